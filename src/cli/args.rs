//! Arguments that several commands share.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use clap::ValueEnum;
use tessclip::{Camera, ColorMode, Prefilter, Scene, Terrain};

pub use super::factor_args::ShapeArgs;
use super::scene_file::SceneFile;
pub use super::stores::ReadArgs;
pub use super::terrain_args::TerrainArgs;

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
    /// Bound on each patch's error on screen, logarithmic
    Error,
    /// What this frame refilled: of a single picture everything, see --from
    Refill,
}

impl From<Color> for ColorMode {
    fn from(color: Color) -> Self {
        match color {
            Color::Shaded => Self::Shaded,
            Color::Levels => Self::Levels,
            Color::Blocks => Self::Blocks,
            Color::Elevation => Self::Elevation,
            Color::Slope => Self::Slope,
            Color::Error => Self::Error,
            Color::Refill => Self::Refill,
        }
    }
}

/// How it is looked at.
#[derive(Clone, Debug, Default, clap::Args)]
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
    /// Draw the bounds of the visible patches, as culling sees them
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    bounds: Option<bool>,
    /// Background (and fog) colour
    #[arg(long, value_name = "RRGGBB", value_parser = parse_color)]
    background: Option<Rgb>,
    /// No distance fog
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    no_fog: Option<bool>,
    /// Direction of the sun in degrees, azimuth clockwise from north and altitude from -90 to 90; by default 315,35
    #[arg(long, value_name = "AZIMUTH,ALTITUDE", value_parser = parse_sun, allow_hyphen_values = true)]
    sun: Option<[f64; 2]>,
}

/// Linear RGB.
#[derive(Clone, Copy, Debug)]
pub struct Rgb([f32; 3]);

impl LookArgs {
    /// Puts these wishes, then what the file says, into a scene.
    pub fn apply(&self, scene: Scene, file: &SceneFile) -> Scene {
        Scene {
            color: self.color.or(file.color).map_or(scene.color, ColorMode::from),
            wireframe: self.wireframe.or(file.wireframe).unwrap_or(scene.wireframe),
            bounds: self.bounds.or(file.bounds).unwrap_or(scene.bounds),
            fog: self.no_fog.map(|no| !no).or(file.fog).unwrap_or(scene.fog),
            background: self.background.or(file.background).map_or(scene.background, |c| c.0),
            sun_deg: self.sun.or(file.sun).unwrap_or(scene.sun_deg),
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
    let pose = pose.map(Camera::parse_pose).transpose()?;
    camera_at(terrain, pose, fov_deg)
}

/// The same from the numbers of a pose.
pub fn camera_at(terrain: &Terrain, pose: Option<[f64; 5]>, fov_deg: f64) -> anyhow::Result<Camera> {
    let camera = match pose {
        Some(pose) => {
            let place = [pose[0], pose[1]];
            if let Some(wrong) = terrain.curved.as_ref().and_then(|c| c.bad_place(place)) {
                bail!("camera pose '{}': {wrong}", pose_words(pose));
            }
            terrain.camera(pose, fov_deg)
        }
        None => terrain.overview(fov_deg),
    };
    camera.validate()?;
    Ok(camera)
}

/// A pose as the command line takes it; reading it gives the same numbers bit for bit.
pub fn pose_words(pose: [f64; 5]) -> String {
    pose.map(|v| v.to_string()).join(",")
}

/// The name of a choice on the command line and in scene files.
#[cfg(feature = "viewer")]
pub fn name_of<T: ValueEnum>(choice: &T) -> String {
    choice.to_possible_value().map_or_else(String::new, |v| v.get_name().to_string())
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

/// The six digits whose colour is nearest to a linear one: those it came from, where it came from such.
#[cfg(feature = "viewer")]
pub fn nearest_digits(rgb: [f32; 3]) -> String {
    let byte = |wanted: f32| {
        let away = |byte: u32| (linear(byte) - wanted).abs();
        (0..=255).min_by(|a, b| away(*a).total_cmp(&away(*b))).unwrap_or(0)
    };
    rgb.map(|wanted| format!("{:02x}", byte(wanted))).concat()
}

fn parse_sun(text: &str) -> Result<[f64; 2], String> {
    let number = |field: &str| field.trim().parse().unwrap_or(f64::NAN);
    sun(text.split_once(',').map_or([f64::NAN; 2], |(azimuth, altitude)| [number(azimuth), number(altitude)]))
}

/// A direction of the sun, degrees, within its bounds; the azimuth is brought within one turn.
pub fn sun([azimuth, altitude]: [f64; 2]) -> Result<[f64; 2], String> {
    // No NaN is within.
    if !azimuth.is_finite() || !(-90.0..=90.0).contains(&altitude) {
        return Err("give AZIMUTH,ALTITUDE in degrees, the altitude from -90 to 90, as 315,35".into());
    }
    // What lies just below 0 is rounded up to a whole turn.
    let within = azimuth.rem_euclid(360.0);
    Ok([if within < 360.0 { within } else { 0.0 }, altitude])
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
    use super::*;

    #[test]
    fn the_sun_is_brought_within_one_turn_and_kept_within_its_bounds() {
        assert_eq!(parse_sun("315,35"), Ok([315.0, 35.0]));
        assert_eq!(parse_sun("-45, -90"), Ok([315.0, -90.0]));
        assert_eq!(parse_sun("725.5,90"), Ok([5.5, 90.0]));
        assert_eq!(parse_sun("-1e-20,0"), Ok([0.0, 0.0]));
        for bad in ["", "10", "10,", "10,91", "10,-90.5", "nan,3", "3,nan", "inf,3", "1,2,3", "a,b"] {
            assert!(parse_sun(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_pose_reads_back_bit_for_bit() {
        let pose = [-0.1, 1e-300, 1e8 / 3.0, -0.0, f64::MAX];
        let read = Camera::parse_pose(&pose_words(pose)).expect("a pose");
        assert_eq!(read.map(f64::to_bits), pose.map(f64::to_bits));
    }

    #[cfg(feature = "viewer")]
    #[test]
    fn a_background_gives_the_digits_it_came_from() {
        for digits in ["000000", "ffffff", "05070c", "c0d7ec", "0a0b01", "7f80fe"] {
            assert_eq!(nearest_digits(parse_color(digits).expect("a colour").0), digits);
        }
        assert_eq!(nearest_digits([-1.0, 2.0, 0.5]), "00ffbc");
    }
}
