//! The manifest: everything that belongs to a store, with sizes and hashes, and a hash of itself.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use super::bytes::ReadAt;
use super::deviations::Layout;
use super::error::StoreError;
use super::level::{Level, levels_of};
use super::{Codec, Dtype, TILE};
use crate::heights::{Degrees, Georeference};
use crate::pyramid::Prefilter;

pub(crate) const SCHEMA: &str = "tessclip-store/3";
/// The same without deviations of blocks, or with those of other meshes; still read, without them.
const OLDER_SCHEMAS: [&str; 2] = ["tessclip-store/1", "tessclip-store/2"];
pub(crate) const FILE: &str = "manifest.json";
pub(crate) const HASH_FILE: &str = "manifest.json.xxh3";
/// No manifest is larger: one of 10^12 samples has about 60 MB.
const MOST_BYTES: u64 = 1 << 28;

/// Where a store's samples lie, as [`HeightGrid`](crate::heights::HeightGrid) says it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Metres between samples, east and north.
    pub spacing_m: [f64; 2],
    /// Plane coordinates of the south-west sample, metres.
    pub origin_m: [f64; 2],
    /// Coordinate system.
    pub crs: Option<String>,
    /// `[west, south, step east, step north, metres a degree east, north]` for data in degrees.
    pub degrees: Option<[f64; 6]>,
    /// Whether the source placed its samples at all.
    pub georeferenced: bool,
    /// Whether its samples stand for points.
    pub pixel_is_point: bool,
}

impl Place {
    /// From a source's own words.
    #[must_use]
    pub fn new(spacing_m: [f64; 2], origin_m: [f64; 2], georeference: &Georeference) -> Self {
        let degrees = georeference.degrees.map(|d| {
            let [mx, my] = d.metres_per_degree;
            [d.west, d.south, d.step[0], d.step[1], mx, my]
        });
        Self {
            spacing_m,
            origin_m,
            crs: georeference.crs.clone(),
            degrees,
            georeferenced: georeference.georeferenced,
            pixel_is_point: georeference.pixel_is_point,
        }
    }

    /// Back to a georeference.
    #[must_use]
    pub fn georeference(&self) -> Georeference {
        Georeference {
            crs: self.crs.clone(),
            degrees: self.degrees.map(|[west, south, sx, sy, mx, my]| Degrees {
                west,
                south,
                step: [sx, sy],
                metres_per_degree: [mx, my],
            }),
            unit: if self.degrees.is_some() { "degree" } else { "metre" },
            georeferenced: self.georeferenced,
            pixel_is_point: self.pixel_is_point,
        }
    }

    fn is_usable(&self) -> bool {
        let positive = |v: &f64| v.is_finite() && *v > 0.0;
        self.spacing_m.iter().all(positive)
            && self.origin_m.iter().all(|v| v.is_finite())
            && self.degrees.is_none_or(|d| d.iter().all(|v| v.is_finite()) && d[2..].iter().all(positive))
    }
}

/// A file as it was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Written {
    /// Its length.
    pub bytes: u64,
    /// xxh3-64 of its contents.
    pub xxh3: u64,
}

/// Facts of one level.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LevelFacts {
    /// Columns and rows.
    pub size: [u64; 2],
    /// Void samples.
    pub voids: u64,
    /// Worst of the tiles' errors of the next finer level, metres.
    pub error_m: f32,
}

/// Everything that belongs to a store.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of the layout.
    pub schema: String,
    /// Program that made it.
    pub made_by: String,
    /// What it was made from.
    pub sources: Vec<String>,
    /// Sample type of the arrays.
    pub dtype: Dtype,
    /// Sample type of the source.
    pub source_dtype: String,
    /// Compression.
    pub codec: Codec,
    /// Samples along a side of a tile.
    pub tile: usize,
    /// How coarser levels were made: "subsample" or "low-pass".
    pub prefilter: String,
    /// Most that a sample may differ from the source, metres.
    pub max_error_m: f64,
    /// Place of the samples.
    pub place: Place,
    /// Lowest and highest height of level 0, metres; `None` when all is void.
    pub range_m: Option<[f32; 2]>,
    /// Mean height of level 0, metres.
    pub mean_m: Option<f64>,
    /// Levels, finest first.
    pub levels: Vec<LevelFacts>,
    /// Every file but the manifest and its hash.
    pub files: BTreeMap<String, Written>,
}

impl Manifest {
    /// Sizes of the levels.
    pub(crate) fn geometry(&self) -> Vec<Level> {
        self.levels.first().map_or_else(Vec::new, |l| levels_of(l.size))
    }

    /// Whether it lists deviations of blocks that are those measured now.
    pub(crate) fn has_deviations(&self) -> bool {
        self.schema == SCHEMA && self.files.keys().any(|f| f.contains("/deviations/"))
    }

    /// The prefilter by its name.
    #[must_use]
    pub fn prefilter(&self) -> Prefilter {
        if self.prefilter == "low-pass" { Prefilter::LowPass } else { Prefilter::Subsample }
    }

    /// Its two files.
    pub(crate) fn to_files(&self) -> Result<[(&'static str, Vec<u8>); 2], String> {
        let text = serde_json::to_vec(self).map_err(|e| e.to_string())?;
        let hash = format!("{:016x}\n", xxh3_64(&text)).into_bytes();
        Ok([(FILE, text), (HASH_FILE, hash)])
    }

    /// Reads and checks both files.
    pub(crate) fn read(bytes: &dyn ReadAt, at: &str) -> Result<Self, StoreError> {
        let broken =
            |file: &str, reason: String| StoreError::Header { at: at.into(), file: file.into(), reason };
        let load = |file: &'static str, most: u64| match bytes.read_all(file, most) {
            Ok(content) => Ok(content),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                Err(StoreError::NotAStore { at: at.into(), reason: format!("it has no {file}") })
            }
            Err(e) => Err(StoreError::io(&format!("{at}/{file}"), "reading", e)),
        };
        let text = load(FILE, MOST_BYTES)?;
        let hash = load(HASH_FILE, 64)?;
        if hash != format!("{:016x}\n", xxh3_64(&text)).as_bytes() {
            return Err(broken(FILE, "its checksum does not match".into()));
        }
        // Only the schema first: other versions may have other members.
        #[derive(Deserialize)]
        struct Head {
            schema: String,
        }
        let head: Head = serde_json::from_slice(&text).map_err(|e| broken(FILE, e.to_string()))?;
        if head.schema != SCHEMA && !OLDER_SCHEMAS.contains(&head.schema.as_str()) {
            return Err(StoreError::Schema { at: at.into(), found: head.schema, known: SCHEMA });
        }
        let manifest: Self = serde_json::from_slice(&text).map_err(|e| broken(FILE, e.to_string()))?;
        manifest.check().map_err(|reason| broken(FILE, reason))?;
        Ok(manifest)
    }

    /// Whatever a hand-made manifest may contradict.
    fn check(&self) -> Result<(), String> {
        let Some(first) = self.levels.first() else { return Err("no levels".into()) };
        if first.size.iter().any(|s| !(2..=i32::MAX as u64).contains(s)) {
            return Err(format!("{} x {} samples", first.size[0], first.size[1]));
        }
        if self.tile != TILE {
            return Err(format!("tiles of {} samples where {TILE} are read", self.tile));
        }
        let sizes: Vec<[u64; 2]> = levels_of(first.size).iter().map(|l| l.size).collect();
        if sizes != self.levels.iter().map(|l| l.size).collect::<Vec<_>>() {
            return Err("sizes of levels do not follow from each other".into());
        }
        let levels = levels_of(first.size);
        if levels.iter().any(|l| u64::from(l.tiles()[0]) * u64::from(l.tiles()[1]) > super::MOST_TILES) {
            return Err(format!(
                "{} x {} samples are more than a store may have",
                first.size[0], first.size[1]
            ));
        }
        if let Some(stranger) = self.files.keys().find(|f| !is_expected(f, &levels)) {
            return Err(format!("{stranger:?} is no file of such a store"));
        }
        if !self.place.is_usable() {
            return Err("spacing or origin is no number to draw with".into());
        }
        if self.range_m.is_some_and(|[low, high]| !(low <= high && low.is_finite() && high.is_finite())) {
            return Err("the height range is none".into());
        }
        Ok(())
    }
}

/// Only names that follow from the levels: nothing outside the store is ever looked at.
fn is_expected(file: &str, levels: &[Level]) -> bool {
    let parts: Vec<&str> = file.split('/').collect();
    let number = |text: &str| text.parse::<u64>().ok().filter(|n| n.to_string() == text);
    let level = || parts.first().and_then(|p| number(p)).and_then(|l| levels.get(usize::try_from(l).ok()?));
    match parts[..] {
        ["zarr.json"] => true,
        [_, "zarr.json"]
        | [_, "elevation" | "tiles" | "deviations", "zarr.json"]
        | [_, "tiles", "c", "0", "0", "0"] => level().is_some(),
        [_, "deviations", "c", y, x, "0"] => level().is_some_and(|l| {
            let [across, down] = Layout::of(*l).chunks().map(|n| n as u64);
            number(x).is_some_and(|x| x < across) && number(y).is_some_and(|y| y < down)
        }),
        [_, "elevation", "c", y, x] => level().is_some_and(|l| {
            let [across, down] = l.shards();
            number(x).is_some_and(|x| x < across) && number(y).is_some_and(|y| y < down)
        }),
        _ => false,
    }
}
