//! Arguments that several commands share.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use clap::ValueEnum;
use tessclip::{Camera, ColorMode, Prefilter, Scene, Terrain};

use super::factor_args::{FactorWishes, LEAST_N_BY_ERROR, N_BY_ERROR};
use super::scene_file::SceneFile;
pub use super::terrain_args::{ReadArgs, TerrainArgs};

/// How voids are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Nodata {
    /// Left open
    Hole,
    /// Filled smoothly from around
    Fill,
}

/// Prefilters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Filter {
    /// Every second sample, as the papers do it
    Subsample,
    /// Binomial 1-2-1
    LowPass,
}

impl From<Filter> for Prefilter {
    fn from(filter: Filter) -> Self {
        match filter {
            Filter::Subsample => Self::Subsample,
            Filter::LowPass => Self::LowPass,
        }
    }
}

/// Colourings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Color {
    /// Sun, sky, tint and fog
    Shaded,
    /// A colour a level
    Levels,
    /// A colour a block kind
    Blocks,
    /// Height ramp
    Elevation,
    /// Slope ramp
    Slope,
}

/// The clipmap's shape.
#[derive(Clone, Debug, clap::Args)]
pub struct ShapeArgs {
    /// Samples per side of a window: 15, 31, 63, 127, 255, 511 or 1023; by default 255, and 511 with factors by
    /// error, which need at least 127
    #[arg(long)]
    n: Option<u32>,
    /// Levels; by default the fewest that cover the data from everywhere
    #[arg(long)]
    levels: Option<u32>,
    /// Blend levels into each other near their perimeter
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    morph: Option<bool>,
    /// Draw every patch, also those out of view
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    no_cull: Option<bool>,
    #[command(flatten)]
    factors: FactorWishes,
}

impl ShapeArgs {
    /// The scene with this shape, then what the file says, then the defaults.
    pub fn scene(&self, file: &SceneFile) -> anyhow::Result<Scene> {
        let usual = Scene::default();
        let factors = self.factors.over(&file.factors)?;
        let n = self.n.or(file.n).unwrap_or(if factors.by_error() { N_BY_ERROR } else { usual.n });
        // Only here: what one place says of n and what another says of the factors come together.
        if factors.by_error() && n < LEAST_N_BY_ERROR {
            let given = match (self.n, &file.path) {
                (None, Some(path)) => format!("{path}: clipmap.n = {n}"),
                _ => format!("--n {n}"),
            };
            bail!(
                "{given}: factors by error need windows of at least {LEAST_N_BY_ERROR} samples; raise it or \
                 take --factors uniform"
            );
        }
        Ok(Scene {
            n,
            factors,
            levels: self.levels.or(file.levels),
            morph: self.morph.or(file.morph).unwrap_or(usual.morph),
            cull: self.no_cull.map(|no| !no).or(file.cull).unwrap_or(usual.cull),
            drop_fine_levels: file.drop_fine_levels.unwrap_or(usual.drop_fine_levels),
            ..usual
        })
    }
}

/// How it is looked at.
#[derive(Clone, Debug, clap::Args)]
pub struct LookArgs {
    /// Picture size; by default 1280x720
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Vertical field of view in degrees; by default 60
    #[arg(long, allow_negative_numbers = true)]
    fov: Option<f64>,
    /// Colouring; by default shaded
    #[arg(long, value_enum)]
    color: Option<Color>,
    /// Draw triangle edges
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    wireframe: Option<bool>,
    /// Background (and fog) colour
    #[arg(long, value_name = "RRGGBB", value_parser = parse_color)]
    background: Option<Rgb>,
    /// No distance fog
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    no_fog: Option<bool>,
}

/// Linear RGB.
#[derive(Clone, Copy, Debug)]
pub struct Rgb([f32; 3]);

impl LookArgs {
    /// Puts these wishes, then what the file says, into a scene.
    pub fn apply(&self, scene: Scene, file: &SceneFile) -> Scene {
        Scene {
            color: match self.color.or(file.color) {
                None => scene.color,
                Some(Color::Shaded) => ColorMode::Shaded,
                Some(Color::Levels) => ColorMode::Levels,
                Some(Color::Blocks) => ColorMode::Blocks,
                Some(Color::Elevation) => ColorMode::Elevation,
                Some(Color::Slope) => ColorMode::Slope,
            },
            wireframe: self.wireframe.or(file.wireframe).unwrap_or(scene.wireframe),
            fog: self.no_fog.map(|no| !no).or(file.fog).unwrap_or(scene.fog),
            background: self.background.or(file.background).map_or(scene.background, |c| c.0),
            sun_deg: file.sun.unwrap_or(scene.sun_deg),
            ..scene
        }
    }

    /// Picture size in pixels.
    pub fn size(&self, file: &SceneFile) -> [u32; 2] {
        self.size_given(file).unwrap_or(SIZE)
    }

    /// Picture size in pixels, where one is given.
    pub fn size_given(&self, file: &SceneFile) -> Option<[u32; 2]> {
        self.size.or(file.size)
    }

    /// Vertical field of view, degrees.
    pub fn fov(&self, file: &SceneFile) -> f64 {
        self.fov.or(file.fov).unwrap_or(FOV_DEG)
    }
}

/// Picture size where none is given.
pub const SIZE: [u32; 2] = [1280, 720];
/// Vertical field of view where none is given, degrees.
pub const FOV_DEG: f64 = 60.0;

/// Whether a picture waits for what is on its way.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct WaitArgs {
    /// Of a streamed store: wait until all the view needs is there; by default true
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true", default_value = "true")]
    pub wait: bool,
}

/// A camera from a pose in the terrain's own units, or one that sees the whole terrain.
pub fn camera(terrain: &Terrain, pose: Option<&str>, fov_deg: f64) -> anyhow::Result<Camera> {
    let camera = match pose {
        Some(text) => {
            let pose = Camera::parse_pose(text)?;
            let place = [pose[0], pose[1]];
            if let Some(wrong) = terrain.curved.as_ref().and_then(|c| c.bad_place(place)) {
                bail!("camera pose '{text}': {wrong}");
            }
            terrain.camera(pose, fov_deg)
        }
        None => terrain.overview(fov_deg),
    };
    camera.validate()?;
    Ok(camera)
}

pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match sides {
        Some([w, h]) if (1..=16384).contains(&w) && (1..=16384).contains(&h) => Ok([w, h]),
        _ => Err("give WIDTHxHEIGHT in pixels, as 1280x720".into()),
    }
}

pub fn parse_color(text: &str) -> Result<Rgb, String> {
    let bad = || "give six hexadecimal digits, as ff00ff".to_string();
    if text.len() != 6 || !text.is_ascii() {
        return Err(bad());
    }
    let value = u32::from_str_radix(text, 16).map_err(|_| bad())?;
    Ok(Rgb([16, 8, 0].map(|shift| linear((value >> shift) & 0xff))))
}

/// sRGB byte to linear (IEC 61966-2-1).
fn linear(byte: u32) -> f32 {
    let v = byte as f32 / 255.0;
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// Fails early, before any work, where an output cannot be written.
pub fn check_writable(path: &Path) -> anyhow::Result<()> {
    let directory = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => PathBuf::from(p),
        _ => PathBuf::from("."),
    };
    if !directory.is_dir() {
        bail!("{}: no such directory; make it first", directory.display());
    }
    if path.is_dir() {
        bail!("{}: is a directory; name a file", path.display());
    }
    Ok(())
}

/// Writes a file whole or not at all: into a neighbour first, then renamed. A link is followed; what is no
/// regular file (a pipe, a device) is written into.
pub fn write_whole(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let failed = || format!("{}: cannot be written", path.display());
    let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    if std::fs::metadata(&target).is_ok_and(|m| !m.is_file()) {
        return std::fs::write(&target, bytes).with_context(failed);
    }
    let mut name = target.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{}.part", std::process::id()));
    let part = target.with_file_name(name);
    let done = std::fs::write(&part, bytes).and_then(|()| std::fs::rename(&part, &target));
    if done.is_err() {
        // What was begun is of no use; that it cannot be removed either adds nothing.
        let _ = std::fs::remove_file(&part);
    }
    done.with_context(failed)
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;
    use tessclip::Factors;

    use super::*;

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        shape: ShapeArgs,
    }

    fn shape(args: &[&str]) -> ShapeArgs {
        Line::try_parse_from([&["tessclip"], args].concat()).expect("understood").shape
    }

    #[test]
    fn windows_are_larger_by_default_where_factors_go_by_error() {
        let none = SceneFile::default();
        let scene = |args: &[&str], file| shape(args).scene(file).expect("suits");
        assert_eq!((scene(&[], &none).n, scene(&[], &none).factors), (255, Factors::Uniform));
        let by_error = scene(&["--factors", "error"], &none);
        let one_pixel = Factors::ByError { pixel_error: Some(1.0), budget: None };
        assert_eq!((by_error.n, by_error.factors), (511, one_pixel));
        let both = scene(&["--pixel-error", "0.5", "--budget", "200000", "--n", "127"], &none);
        let limits = Factors::ByError { pixel_error: Some(0.5), budget: Some(200_000) };
        assert_eq!((both.n, both.factors), (127, limits));
        let file = SceneFile { n: Some(255), ..SceneFile::default() };
        assert_eq!(scene(&["--budget", "5000"], &file).n, 255);
    }

    #[test]
    fn factors_by_error_need_large_windows() {
        let file = SceneFile { path: Some("hills.toml".into()), n: Some(63), ..SceneFile::default() };
        let said = |args: &[&str]| shape(args).scene(&file).expect_err("too small").to_string();
        for (error, place) in [
            (said(&["--pixel-error", "1"]), "hills.toml: clipmap.n = 63: "),
            (said(&["--pixel-error", "1", "--n", "31"]), "--n 31: "),
        ] {
            assert!(error.starts_with(place) && error.contains("at least 127 samples"), "{error}");
        }
        assert!(shape(&["--pixel-error", "1", "--n", "127"]).scene(&file).is_ok());
        assert!(shape(&[]).scene(&file).is_ok());
    }

    #[test]
    fn contradictions_and_limits_out_of_range_are_refused() {
        assert!(shape(&["--factors", "uniform", "--budget", "5000"]).scene(&SceneFile::default()).is_err());
        for bad in
            [["--pixel-error", "-1"], ["--pixel-error", "nan"], ["--budget", "10"], ["--factors", "all"]]
        {
            assert!(Line::try_parse_from([&["tessclip"], &bad[..]].concat()).is_err(), "{bad:?}");
        }
    }
}
