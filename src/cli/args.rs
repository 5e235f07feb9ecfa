//! Arguments that several commands share.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use clap::ValueEnum;
use glam::DVec3;
use tessclip::heights::{HeightGrid, NodataPolicy, ReadOptions, open_terrain};
use tessclip::{Camera, ColorMode, Prefilter, Scene, Terrain};

/// How voids are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Nodata {
    /// Left open
    Hole,
    /// Filled smoothly from around
    Fill,
}

/// Base surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Base {
    /// A plane; degrees become metres at the data's centre latitude
    Plane,
}

/// Prefilters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Filter {
    /// Every second sample, as the papers do it
    Subsample,
    /// Binomial 1-2-1
    LowPass,
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

/// How elevation is read.
#[derive(Clone, Debug, clap::Args)]
pub struct ReadArgs {
    /// Metres between samples, for files without georeference
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    spacing: Option<f64>,
    /// Metres a unit, for raw values
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    z_scale: Option<f64>,
    /// Metres added after scaling
    #[arg(long, value_name = "O", allow_negative_numbers = true)]
    z_offset: Option<f64>,
}

impl ReadArgs {
    /// True when --spacing was given.
    pub fn has_spacing(&self) -> bool {
        self.spacing.is_some()
    }

    /// Reads the terrain as it is, voids and all.
    pub fn read(&self, terrain: &str) -> anyhow::Result<HeightGrid> {
        let options = ReadOptions {
            spacing_m: self.spacing,
            z_scale: self.z_scale,
            z_offset: self.z_offset,
            ..ReadOptions::default()
        };
        Ok(open_terrain(terrain, &options)?)
    }
}

/// A terrain to draw.
#[derive(Clone, Debug, clap::Args)]
pub struct TerrainArgs {
    /// A DEM file or procedural:NAME?seed=1&size=1025 (mountains, dunes, plain, cliff, spikes, checkerboard)
    pub terrain: String,
    #[command(flatten)]
    read: ReadArgs,
    /// How voids are drawn
    #[arg(long, value_enum, default_value = "hole")]
    nodata: Nodata,
    /// Base surface
    #[arg(long, value_enum, default_value = "plane")]
    base: Base,
    /// How coarser levels are made
    #[arg(long, value_enum, default_value = "subsample")]
    prefilter: Filter,
}

impl TerrainArgs {
    /// Reads the terrain; a void policy is applied.
    pub fn grid(&self) -> anyhow::Result<HeightGrid> {
        let Base::Plane = self.base;
        let grid = self.read.read(&self.terrain)?;
        Ok(match self.nodata {
            Nodata::Hole => grid,
            Nodata::Fill => grid.with_nodata(NodataPolicy::Fill),
        })
    }

    /// Reads the terrain and makes its pyramid.
    pub fn open(&self) -> anyhow::Result<Terrain> {
        let grid = self.grid()?;
        if grid.min_max_mean().is_none() {
            bail!("{}: every sample is void: there is nothing to draw", self.terrain);
        }
        Ok(Terrain::new(&grid, self.prefilter()))
    }

    fn prefilter(&self) -> Prefilter {
        match self.prefilter {
            Filter::Subsample => Prefilter::Subsample,
            Filter::LowPass => Prefilter::LowPass,
        }
    }
}

/// The clipmap's shape.
#[derive(Clone, Debug, clap::Args)]
pub struct ShapeArgs {
    /// Samples per side of a window: 15, 31, 63, 127, 255, 511 or 1023
    #[arg(long, default_value_t = 255)]
    pub n: u32,
    /// Levels; by default the fewest that cover the data from everywhere
    #[arg(long)]
    pub levels: Option<u32>,
    /// Blend levels into each other near their perimeter
    #[arg(long)]
    pub morph: bool,
    /// Draw every patch, also those out of view
    #[arg(long)]
    pub no_cull: bool,
}

impl ShapeArgs {
    /// The scene with this shape and the defaults for everything else.
    pub fn scene(&self) -> Scene {
        Scene { n: self.n, levels: self.levels, morph: self.morph, cull: !self.no_cull, ..Scene::default() }
    }
}

/// How it is looked at.
#[derive(Clone, Debug, clap::Args)]
pub struct LookArgs {
    /// Picture size
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = parse_size)]
    pub size: [u32; 2],
    /// Vertical field of view in degrees
    #[arg(long, default_value_t = 60.0, allow_negative_numbers = true)]
    pub fov: f64,
    /// Colouring
    #[arg(long, value_enum, default_value = "shaded")]
    color: Color,
    /// Draw triangle edges
    #[arg(long)]
    wireframe: bool,
    /// Background (and fog) colour
    #[arg(long, value_name = "RRGGBB", value_parser = parse_color)]
    background: Option<Rgb>,
    /// No distance fog
    #[arg(long)]
    no_fog: bool,
}

/// Linear RGB.
#[derive(Clone, Copy, Debug)]
pub struct Rgb([f32; 3]);

impl LookArgs {
    /// Puts these wishes into a scene.
    pub fn apply(&self, scene: Scene) -> Scene {
        Scene {
            color: match self.color {
                Color::Shaded => ColorMode::Shaded,
                Color::Levels => ColorMode::Levels,
                Color::Blocks => ColorMode::Blocks,
                Color::Elevation => ColorMode::Elevation,
                Color::Slope => ColorMode::Slope,
            },
            wireframe: self.wireframe,
            fog: !self.no_fog,
            background: self.background.map_or(scene.background, |c| c.0),
            ..scene
        }
    }
}

/// A camera from a pose in the terrain's own units, or one that sees the whole terrain.
pub fn camera(terrain: &Terrain, pose: Option<&str>, fov_deg: f64) -> anyhow::Result<Camera> {
    let camera = match pose {
        Some(text) => {
            let [x, y, z, yaw_deg, pitch_deg] = Camera::parse_pose(text)?;
            let [x, y] = terrain.world_from_native([x, y]);
            Camera { eye_m: DVec3::new(x, y, z), yaw_deg, pitch_deg, fov_deg }
        }
        None => overview(terrain, fov_deg),
    };
    camera.validate()?;
    Ok(camera)
}

/// From the south, high enough to see all of it.
pub fn overview(terrain: &Terrain, fov_deg: f64) -> Camera {
    let [low, high] = terrain.extent_m();
    let range = terrain.source.height_range().unwrap_or([0.0, 0.0]).map(f64::from);
    let middle = DVec3::new(
        f64::midpoint(low[0], high[0]),
        f64::midpoint(low[1], high[1]),
        f64::midpoint(range[0], range[1]),
    );
    let reach = (high[0] - low[0]).max(high[1] - low[1]);
    let eye = middle + DVec3::new(0.0, -0.72 * reach, 0.5 * reach);
    Camera::looking_at(eye, middle, fov_deg)
}

pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match sides {
        Some([w, h]) if (1..=16384).contains(&w) && (1..=16384).contains(&h) => Ok([w, h]),
        _ => Err("give WIDTHxHEIGHT in pixels, as 1280x720".into()),
    }
}

fn parse_color(text: &str) -> Result<Rgb, String> {
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
