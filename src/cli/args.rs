//! Arguments that several commands share.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context as _, bail};
use clap::ValueEnum;
use tessclip::heights::{
    HeightGrid, NodataPolicy, PositionGrid, ReadOptions, is_position_file, open_terrain,
};
use tessclip::stream::TileSource;
use tessclip::surface::{Base, Ellipsoid};
use tessclip::{Camera, ColorMode, Prefilter, Scene, Terrain};

use super::scene_file::SceneFile;
use super::stores::{StreamArgs, open_store};

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

    /// Reads the terrain, or the one a scene file names, as it is, voids and all.
    pub fn read(&self, terrain: &str) -> anyhow::Result<HeightGrid> {
        let file = SceneFile::of(terrain)?;
        let read = self.over(&file);
        let source = file.source.as_deref().unwrap_or(terrain);
        let recipe = source.strip_prefix("procedural:");
        if recipe.is_some_and(PositionGrid::is_named)
            || (recipe.is_none() && is_position_file(Path::new(source)))
        {
            bail!("{source}: holds positions, not heights; render, mesh, fly and plan take them");
        }
        if let Some(store) = open_store(source)? {
            read.refuse_for_store(source)?;
            return Ok(store.to_grid(ReadOptions::default().max_samples)?);
        }
        Ok(open_terrain(source, &read.options())?)
    }

    /// These wishes, for the readers.
    pub fn options(&self) -> ReadOptions {
        ReadOptions {
            spacing_m: self.spacing,
            z_scale: self.z_scale,
            z_offset: self.z_offset,
            ..ReadOptions::default()
        }
    }

    /// What is settled when a store is built.
    fn refuse_for_store(&self, store: &str) -> anyhow::Result<()> {
        let given = [
            ("--spacing", self.spacing.is_some()),
            ("--z-scale", self.z_scale.is_some()),
            ("--z-offset", self.z_offset.is_some()),
        ];
        match given.into_iter().find(|(_, given)| *given) {
            Some((option, _)) => {
                bail!("{store}: is a store, for which {option} was settled when it was built")
            }
            None => Ok(()),
        }
    }

    /// These wishes, and where they say nothing those of a scene file.
    fn over(&self, file: &SceneFile) -> Self {
        Self {
            spacing: self.spacing.or(file.spacing),
            z_scale: self.z_scale.or(file.z_scale),
            z_offset: self.z_offset.or(file.z_offset),
        }
    }
}

/// A terrain to draw.
#[derive(Clone, Debug, clap::Args)]
pub struct TerrainArgs {
    /// A DEM file, a store T.zarr, three rasters X,Y,Z or a three-band raster of positions, a scene file NAME.toml, or
    /// procedural:NAME?seed=1&size=1025 (mountains, dunes, plain, cliff, spikes, checkerboard, planet,
    /// overhang, fold)
    pub terrain: String,
    #[command(flatten)]
    read: ReadArgs,
    /// How voids are drawn; by default hole
    #[arg(long, value_enum)]
    nodata: Option<Nodata>,
    /// Base surface: plane, wgs84, moon, mars, sphere:R, ellipsoid:A,B, cylinder:R[,inside], torus:R,r or
    /// sampled; by default wgs84 for data in degrees, sampled for positions, else plane
    #[arg(long, value_name = "BASE")]
    base: Option<Base>,
    /// More DEMs in degrees on the same ellipsoid; the finest wins where they overlap
    #[arg(long, value_name = "DEM")]
    over: Vec<String>,
    /// Factor on the heights; by default 1
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    exaggeration: Option<f64>,
    /// How coarser levels are made; by default subsample
    #[arg(long, value_enum)]
    prefilter: Option<Filter>,
    #[command(flatten)]
    stream: StreamArgs,
}

impl TerrainArgs {
    /// These wishes, and where they say nothing those of the scene file TERRAIN may name.
    pub fn over(&self, file: &SceneFile) -> Self {
        Self {
            terrain: file.source.clone().unwrap_or_else(|| self.terrain.clone()),
            read: self.read.over(file),
            nodata: self.nodata.or(file.nodata),
            base: self.base.or(file.base),
            over: if self.over.is_empty() { file.over.clone() } else { self.over.clone() },
            exaggeration: self.exaggeration.or(file.exaggeration),
            prefilter: self.prefilter.or(file.prefilter),
            stream: self.stream.clone(),
        }
    }

    /// Reads the terrain's heights; a void policy is applied.
    pub fn grid(&self) -> anyhow::Result<HeightGrid> {
        self.read_grid(&self.terrain)
    }

    fn read_grid(&self, terrain: &str) -> anyhow::Result<HeightGrid> {
        let grid = self.read.read(terrain)?;
        if grid.min_max_mean().is_none() {
            bail!("{terrain}: every sample is void: there is nothing to draw");
        }
        Ok(match self.nodata {
            None | Some(Nodata::Hole) => grid,
            Some(Nodata::Fill) => grid.with_nodata(NodataPolicy::Fill),
        })
    }

    /// Reads the terrain and puts it on its base surface.
    pub fn open(&self) -> anyhow::Result<Terrain> {
        let factor = self.exaggeration.unwrap_or(1.0);
        if !factor.is_finite() || factor.abs() > 1e6 {
            bail!("--exaggeration {factor}: give a number of at most 1e6 in magnitude");
        }
        let terrain = self.open_plain()?;
        let range = terrain.source.height_range().unwrap_or([0.0, 0.0]);
        if range.iter().any(|h| f64::from(h.abs()) * factor.abs() > 1e12) {
            bail!("--exaggeration {factor} lifts {}: heights may reach 1e12 m; lower it", self.terrain);
        }
        let terrain = terrain.exaggerated(factor as f32);
        if let Some(curved) = &terrain.curved {
            curved.check_relief().with_context(|| self.terrain.clone())?;
        }
        Ok(terrain)
    }

    fn open_plain(&self) -> anyhow::Result<Terrain> {
        if let Some(terrain) = self.streamed()? {
            return Ok(terrain);
        }
        if let Some(positions) = self.positions()? {
            match self.base {
                None | Some(Base::Sampled) if self.over.is_empty() => {}
                None | Some(Base::Sampled) => bail!("--over needs data in degrees, not positions"),
                Some(base) => bail!("{}: holds positions, which make base sampled, not {base}", self.terrain),
            }
            if positions.valid.as_ref().is_some_and(|v| !v.contains(&true)) {
                bail!("{}: every position is void: there is nothing to draw", self.terrain);
            }
            let heights_only = [
                ("--exaggeration", self.exaggeration.is_some_and(|f| f != 1.0)),
                ("--nodata fill", self.nodata == Some(Nodata::Fill)),
                ("--prefilter low-pass", self.prefilter == Some(Filter::LowPass)),
                ("--spacing", self.read.spacing.is_some()),
                ("--z-scale", self.read.z_scale.is_some()),
                ("--z-offset", self.read.z_offset.is_some()),
            ];
            if let Some((option, _)) = heights_only.into_iter().find(|(_, given)| *given) {
                bail!("{}: holds positions, for which {option} has no meaning; leave it out", self.terrain);
            }
            return Ok(Terrain::sampled(positions));
        }
        let grid = self.grid()?;
        let geographic = grid.georeference.degrees.is_some();
        let wgs84 = Base::Ellipsoid { a_m: Ellipsoid::WGS84.a, b_m: Ellipsoid::WGS84.b };
        let base = self.base.unwrap_or(if geographic { wgs84 } else { Base::Plane });
        if self.over.is_empty() {
            return Terrain::on(&grid, base, self.prefilter()).with_context(|| self.terrain.clone());
        }
        let Base::Ellipsoid { a_m, b_m } = base else {
            bail!("--over needs data in degrees on an ellipsoid, not base {base}");
        };
        if self.prefilter() != Prefilter::Subsample {
            bail!("--over takes every second sample for coarser levels: leave --prefilter out");
        }
        let mut grids = vec![grid];
        for dem in &self.over {
            grids.push(self.read_grid(dem)?);
        }
        for (grid, name) in grids.iter().zip(std::iter::once(&self.terrain).chain(&self.over)) {
            if grid.georeference.degrees.is_none() {
                bail!("{name}: is not in degrees: only such data can share a globe");
            }
        }
        Ok(Terrain::globe(grids, Ellipsoid { a: a_m, b: b_m })?)
    }

    /// A store on a plane is streamed; on other bases it is read whole, as any other DEM.
    fn streamed(&self) -> anyhow::Result<Option<Terrain>> {
        let Some(store) = open_store(&self.terrain)? else { return Ok(None) };
        let geographic = store.manifest().place.degrees.is_some();
        let plane = self.base.map_or(!geographic, |base| base == Base::Plane);
        if !plane || !self.over.is_empty() {
            return Ok(None);
        }
        self.read.refuse_for_store(&self.terrain)?;
        if self.nodata == Some(Nodata::Fill) {
            bail!(
                "{}: voids of a streamed store cannot be filled; fill them before building it",
                self.terrain
            );
        }
        let stored = store.manifest().prefilter();
        if self.prefilter.is_some() && self.prefilter() != stored {
            bail!("{}: was built with --prefilter {stored}; build it again for another one", self.terrain);
        }
        if store.manifest().range_m.is_none() {
            bail!("{}: every sample is void: there is nothing to draw", self.terrain);
        }
        let source = TileSource::new(Arc::new(store), self.stream.options())?;
        Ok(Some(Terrain::streamed(source)))
    }

    /// The terrain as positions, when it holds such or base sampled asks for them.
    fn positions(&self) -> anyhow::Result<Option<PositionGrid>> {
        let recipe = self.terrain.strip_prefix("procedural:").filter(|r| PositionGrid::is_named(r));
        if let Some(recipe) = recipe {
            return Ok(Some(PositionGrid::parse(recipe)?));
        }
        if self.terrain.starts_with("procedural:") {
            return Ok(None);
        }
        // x, y and z may come as three rasters.
        let parts: Vec<&str> = self.terrain.split(',').collect();
        if self.base == Some(Base::Sampled)
            && let [x, y, z] = parts[..]
        {
            let grids = [self.read.read(x)?, self.read.read(y)?, self.read.read(z)?];
            return Ok(Some(PositionGrid::from_grids(&grids[0], &grids[1], &grids[2])?));
        }
        let path = Path::new(&self.terrain);
        if !is_position_file(path) {
            return Ok(None);
        }
        Ok(Some(PositionGrid::read(path)?))
    }

    fn prefilter(&self) -> Prefilter {
        self.prefilter.map_or(Prefilter::Subsample, Prefilter::from)
    }
}

/// The clipmap's shape.
#[derive(Clone, Debug, clap::Args)]
pub struct ShapeArgs {
    /// Samples per side of a window: 15, 31, 63, 127, 255, 511 or 1023; by default 255
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
}

impl ShapeArgs {
    /// The scene with this shape, then what the file says, then the defaults.
    pub fn scene(&self, file: &SceneFile) -> Scene {
        let usual = Scene::default();
        Scene {
            n: self.n.or(file.n).unwrap_or(usual.n),
            levels: self.levels.or(file.levels),
            morph: self.morph.or(file.morph).unwrap_or(usual.morph),
            cull: self.no_cull.map(|no| !no).or(file.cull).unwrap_or(usual.cull),
            drop_fine_levels: file.drop_fine_levels.unwrap_or(usual.drop_fine_levels),
            ..usual
        }
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
        self.size.or(file.size).unwrap_or(SIZE)
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
