//! The files that describe a store to other Zarr readers: groups, attributes, figures of tiles.
//!
//! Conventions: multiscales (the GeoZarr convention GDAL 3.13 writes and reads), `spatial:*` and `proj:code`.

use serde_json::{Map, Value, json};
use zarrs::array::Array;
use zarrs::group::GroupBuilder;

use super::Build;
use crate::pyramid::store::codec::{figures_array, one_thread};
use crate::pyramid::store::error::StoreError;
use crate::pyramid::store::level::{FIGURES, Level, TileStats};
use crate::pyramid::store::manifest::Place;
use crate::pyramid::store::sink::Sink;

/// Identifier of the multiscales convention.
const MULTISCALES: &str = "d35379db-88df-4056-af3a-620245f8e347";

/// What places a level for GIS tools: an affine transform from column and row, counted at nodes.
pub(super) fn array_attributes(place: &Place, level: Level, base: Level) -> Map<String, Value> {
    let factor = (1_u64 << level.number) as f64;
    let (origin, step) = match place.degrees {
        Some([west, south, sx, sy, ..]) => ([west, south], [sx, sy]),
        None => (place.origin_m, place.spacing_m),
    };
    let step = step.map(|s| s * factor);
    // Nodes are evenly spaced from the south-west; the last row and column may lie closer (see Lattice).
    let north = origin[1] + (level.size[1] - 1) as f64 * step[1];
    let east = origin[0] + (level.size[0] - 1) as f64 * step[0];
    // The transform is that of pixel edges: half a step out from the outermost nodes.
    let transform = [step[0], 0.0, origin[0] - 0.5 * step[0], 0.0, -step[1], north + 0.5 * step[1]];
    let mut out = Map::new();
    let mut put = |key: &str, value: Value| {
        out.insert(key.into(), value);
    };
    put("spatial:dimensions", json!(["y", "x"]));
    put("spatial:transform", json!(transform));
    put("spatial:bbox", json!([origin[0], origin[1], east, north]));
    put("spatial:registration", json!("pixel"));
    put("spatial:shape", json!([level.size[1], level.size[0]]));
    if let Some(crs) = &place.crs {
        put("proj:code", json!(crs));
    }
    put("units", json!("m"));
    put("long_name", json!("elevation"));
    put("tessclip:level", json!(level.number));
    put("tessclip:base_shape", json!([base.size[1], base.size[0]]));
    out
}

impl Build<'_> {
    /// Headers of one level and the figures of its tiles.
    pub(super) fn write_level_headers(
        &self,
        level: Level,
        array: &Array<Sink>,
        stats: &[TileStats],
    ) -> Result<(), StoreError> {
        let fail = |e: String| StoreError::Encode { at: self.at.into(), reason: e };
        array.store_metadata().map_err(|e| self.write_error(e.into()))?;
        let group = GroupBuilder::new()
            .build(self.sink.clone(), &format!("/{}", level.number))
            .map_err(|e| fail(e.to_string()))?;
        group.store_metadata().map_err(|e| self.write_error(e.into()))?;
        let tiles = level.tiles().map(u64::from);
        let mut builder = figures_array(tiles, FIGURES as u64);
        builder.attributes_mut().insert(
            "figures".into(),
            json!(["min_m", "max_m", "mean_m", "error_of_finer_level_m", "void_samples"]),
        );
        let figures = builder
            .build(self.sink.clone(), &format!("/{}/tiles", level.number))
            .map_err(|e| fail(e.to_string()))?;
        figures.store_metadata().map_err(|e| self.write_error(e.into()))?;
        let values: Vec<f32> = stats.iter().flat_map(|s| s.to_figures()).collect();
        let options = one_thread().with_store_empty_chunks(true);
        figures.store_chunk_opt(&[0, 0, 0], values, &options).map_err(|e| self.write_error(e))
    }

    /// The root group: which levels there are.
    pub(super) fn write_root(&self, place: &Place) -> Result<(), StoreError> {
        let fail = |e: String| StoreError::Encode { at: self.at.into(), reason: e };
        let layout: Vec<Value> = self
            .levels
            .iter()
            .map(|level| {
                let factor = if level.number == 0 { 1.0 } else { 2.0 };
                let mut entry = json!({
                    "asset": format!("{}/elevation", level.number),
                    "transform": { "scale": [factor, factor], "translation": [0.0, 0.0] },
                });
                if level.number > 0 {
                    entry["derived_from"] = json!(format!("{}/elevation", level.number - 1));
                }
                entry
            })
            .collect();
        let mut attributes = Map::new();
        let method =
            if self.options.prefilter == crate::pyramid::Prefilter::LowPass { "gauss" } else { "nearest" };
        attributes.insert("multiscales".into(), json!({ "layout": layout, "resampling_method": method }));
        attributes.insert("zarr_conventions".into(), json!([{ "name": "multiscales", "uuid": MULTISCALES }]));
        if let Some(crs) = &place.crs {
            attributes.insert("proj:code".into(), json!(crs));
        }
        let group = GroupBuilder::new()
            .attributes(attributes)
            .build(self.sink.clone(), "/")
            .map_err(|e| fail(e.to_string()))?;
        group.store_metadata().map_err(|e| self.write_error(e.into()))
    }
}
