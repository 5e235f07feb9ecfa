//! A rival in the right half of the picture, ours in the left one: for pictures and for the viewer.

use anyhow::Context as _;
use tessclip::gpu::{Gpu, GpuError, Offscreen};
use tessclip::measure::FrameUpload;
use tessclip::rivals::{Detail, DrawCount, Lab, Method, Rival, Unfit};
use tessclip::{Camera, ColorMode, Factors, RenderError, Scene, Target, Terrain};

/// A method by its name, as `compare --methods` takes it.
pub fn parse_method(text: &str) -> Result<Method, String> {
    Method::ALL.into_iter().find(|m| m.name() == text).ok_or_else(|| {
        let known = Method::ALL.map(Method::name).join(", ");
        format!("`{text}` is no method; take one of {known}")
    })
}

/// Left and right half of a picture as left, top, width and height in pixels. The right one takes an odd column.
pub fn halves([width, height]: [u32; 2]) -> [[u32; 4]; 2] {
    let left = width / 2;
    [[0, 0, left, height], [left, 0, width - left, height]]
}

/// A rival at work.
pub struct Beside {
    rival: Box<dyn Rival>,
    /// Keeps the tables that a method makes of a terrain.
    #[cfg(feature = "viewer")]
    lab: Lab,
    /// Which one.
    pub method: Method,
}

impl Beside {
    /// Makes a method ready to draw a terrain with the look of a scene, at the detail of its n and levels.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        format: wgpu::TextureFormat,
        terrain: &Terrain,
        scene: &Scene,
        method: Method,
    ) -> anyhow::Result<Self> {
        let lab = Lab::new(device, queue, format, terrain, &look_for(method, scene));
        let rival = make(&lab, scene, method).with_context(|| format!("beside {}", method.name()))?;
        Ok(Self {
            rival,
            #[cfg(feature = "viewer")]
            lab,
            method,
        })
    }

    /// Takes another scene, or stands another method in its place, over the same terrain.
    #[cfg(feature = "viewer")]
    pub fn restyle(&mut self, scene: &Scene, method: Method) -> anyhow::Result<()> {
        self.lab.scene = look_for(method, scene);
        self.rival = make(&self.lab, scene, method).with_context(|| format!("beside {}", method.name()))?;
        self.method = method;
        Ok(())
    }

    /// The CPU's part of a frame of a half of `size_px`. A rival follows the camera that is drawn, also while ours
    /// is frozen. Call once before `record`.
    pub fn prepare(&mut self, camera: &Camera, size_px: [u32; 2]) -> Result<FrameUpload, RenderError> {
        self.rival.prepare(camera, size_px)
    }

    /// Records the prepared frame. Where the other half was drawn before, the target must not be cleared: clearing
    /// takes no notice of its area.
    pub fn record(&mut self, encoder: &mut wgpu::CommandEncoder, target: Target<'_>) {
        self.rival.record(encoder, target);
    }

    /// What the last submitted frame drew; may wait for the GPU.
    pub fn count(&self) -> Result<DrawCount, GpuError> {
        self.rival.count()
    }

    /// Draws a frame into the right half of a target, beside what is there; waits for it.
    pub fn draw(&mut self, gpu: &Gpu, target: &Offscreen, camera: &Camera) -> anyhow::Result<DrawCount> {
        let area = halves(target.size)[1];
        self.prepare(camera, [area[2], area[3]])?;
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let (color, depth) = (&target.color, &target.depth);
        self.record(&mut encoder, Target { color, depth, clear: false, area: Some(area) });
        gpu.queue.submit([encoder.finish()]);
        Ok(self.count()?)
    }
}

fn make(lab: &Lab, scene: &Scene, method: Method) -> Result<Box<dyn Rival>, Unfit> {
    // Rivals read samples where they need them: of a store nothing may be there yet.
    if lab.terrain.source.streaming().is_some() {
        return Err(Unfit(
            "draws no streamed store, only terrain in memory: name the DEM it was built from".into(),
        ));
    }
    lab.make(method, &Detail { n: scene.n, levels: scene.levels, ..Detail::default() })
}

/// The look of ours, as far as a method has one. Only ours draws edges and bounds, and knows of errors and refills:
/// the others show their levels instead. Factors by error are a method of their own.
fn look_for(method: Method, scene: &Scene) -> Scene {
    let scene = Scene { factors: Factors::Uniform, ..scene.clone() };
    if matches!(method, Method::Tessellated | Method::ByError | Method::AllPatches) {
        return scene;
    }
    let color = match scene.color {
        ColorMode::Error | ColorMode::Refill => ColorMode::Levels,
        color => color,
    };
    Scene { color, wireframe: false, bounds: false, ..scene }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_cover_a_picture_once() {
        for width in 2..40 {
            let [left, right] = halves([width, 7]);
            assert_eq!((left[0], left[2], right[0] + right[2]), (0, right[0], width));
            assert!(left[2] > 0 && right[2] - left[2] < 2);
            assert_eq!([left[1], left[3], right[1], right[3]], [0, 7, 0, 7]);
        }
    }

    #[test]
    fn methods_have_the_names_of_compare() {
        for method in Method::ALL {
            assert_eq!(parse_method(method.name()), Ok(method));
        }
        for bad in ["", "all", "raom", "ROAM", "roam,classic"] {
            assert!(parse_method(bad).expect_err("no method").contains("brute-force, classic"), "{bad}");
        }
    }

    #[test]
    fn others_keep_only_what_they_can_draw_of_the_look() {
        let by_error = Factors::ByError { pixel_error: None, budget: Some(5_000) };
        let scene = Scene {
            wireframe: true,
            bounds: true,
            color: ColorMode::Error,
            factors: by_error,
            sun_deg: [1.0, 2.0],
            ..Scene::default()
        };
        let ours = look_for(Method::Tessellated, &scene);
        assert_eq!(ours, Scene { factors: Factors::Uniform, ..scene.clone() });
        let roam = look_for(Method::Roam, &scene);
        assert_eq!(roam, Scene { color: ColorMode::Levels, wireframe: false, bounds: false, ..ours });
        let slope = Scene { color: ColorMode::Slope, ..scene };
        assert_eq!(look_for(Method::Classic, &slope).color, ColorMode::Slope);
    }
}
