//! TERRAIN on the command line: how it is read, what it stands on, and where its levels come from.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context as _, bail};
use tessclip::heights::{HeightGrid, NodataPolicy, PositionGrid, is_position_file};
use tessclip::rivals::Ground;
use tessclip::stream::TileSource;
use tessclip::surface::{Base, Ellipsoid};
use tessclip::{Prefilter, Terrain};

#[cfg(feature = "viewer")]
use super::args::name_of;
use super::args::{Filter, Nodata};
use super::scene_file::SceneFile;
use super::stores::{ReadArgs, StreamArgs, open_store};

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
        check_factor(self.factor())?;
        self.exaggerated(self.open_plain()?, self.factor())
    }

    /// Factor on the heights.
    pub fn factor(&self) -> f64 {
        self.exaggeration.unwrap_or(1.0)
    }

    /// This terrain, opened plain, with its heights times `factor`.
    pub fn exaggerated(&self, terrain: Terrain, factor: f64) -> anyhow::Result<Terrain> {
        check_factor(factor)?;
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

    /// As [`TerrainArgs::open`], its heights as they were read.
    pub fn open_plain(&self) -> anyhow::Result<Terrain> {
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

    /// As [`TerrainArgs::open`], all of it in memory and without voids where it is not too large for that:
    /// what rivals can draw. Says in words what was done about it.
    pub fn open_whole(&self) -> anyhow::Result<(Terrain, Option<String>)> {
        let mut terrain = self.open()?;
        let mut note = Vec::new();
        if terrain.curved.is_some()
            && self.base.is_none()
            && self.over.is_empty()
            && self.positions()?.is_none()
        {
            let plane = Self { base: Some(Base::Plane), ..self.clone() };
            terrain = plane.open()?;
            note.push("data in degrees was laid on a plane, which rivals need (--base says otherwise)");
        }
        let samples: u64 = terrain.source.lattice().domain().count();
        if terrain.source.streaming().is_some() && samples > Ground::MOST_SAMPLES {
            let most = Ground::MOST_SAMPLES;
            bail!(
                "{}: {samples} samples are too many to compare in memory, {most} at most; see fly",
                self.terrain
            );
        }
        if terrain.curved.is_some() {
            return Ok((terrain, None));
        }
        let (streamed, voids) = (terrain.source.streaming().is_some(), terrain.source.has_voids());
        if !streamed && !voids {
            return Ok((terrain, (!note.is_empty()).then(|| note.join("; "))));
        }
        let grid = self.grid()?;
        let grid = if voids { grid.with_nodata(NodataPolicy::Fill) } else { grid };
        let stored = open_store(&self.terrain)?.map(|s| s.manifest().prefilter());
        let prefilter = stored.unwrap_or_else(|| self.prefilter());
        let whole = Terrain::new(&grid, prefilter).exaggerated(self.factor() as f32);
        if streamed {
            note.push("the store was read whole: all methods have all samples from the start");
        }
        if voids {
            note.push("voids were filled, for all methods");
        }
        Ok((whole, Some(note.join("; "))))
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

/// Factors that heights may be drawn with.
fn check_factor(factor: f64) -> anyhow::Result<()> {
    if !factor.is_finite() || factor.abs() > 1e6 {
        bail!("--exaggeration {factor}: give a number of at most 1e6 in magnitude");
    }
    Ok(())
}

/// The same wishes in other words; the factor on the heights is left to who draws.
#[cfg(feature = "viewer")]
impl TerrainArgs {
    /// As options of the command line.
    pub fn options(&self) -> Vec<String> {
        let one = |name: &str, value: Option<String>| value.map(|value| format!("--{name}={value}"));
        let mut all = self.read.said();
        all.extend(one("nodata", self.nodata.as_ref().map(name_of)));
        all.extend(one("base", self.base.map(|base| base.to_string())));
        all.extend(self.over.iter().map(|dem| format!("--over={dem}")));
        all.extend(one("prefilter", self.prefilter.as_ref().map(name_of)));
        all.extend(self.stream.said());
        all
    }

    /// As a scene file says them, which knows nothing of streaming.
    pub fn as_file(&self) -> SceneFile {
        SceneFile {
            source: Some(self.terrain.clone()),
            base: self.base,
            over: self.over.clone(),
            spacing: self.read.spacing,
            z_scale: self.read.z_scale,
            z_offset: self.read.z_offset,
            nodata: self.nodata,
            prefilter: self.prefilter,
            ..SceneFile::default()
        }
    }

    /// Another terrain, streamed as this one; all else was said of this one alone.
    pub fn another(&self, terrain: &str) -> Self {
        Self {
            terrain: terrain.into(),
            read: ReadArgs::default(),
            nodata: None,
            base: None,
            over: Vec::new(),
            exaggeration: None,
            prefilter: None,
            stream: self.stream.clone(),
        }
    }
}
