//! A store as a source: for building another one, and for export.

use super::Store;
use crate::clipmap::Rect;
use crate::heights::{HeightError, RasterHeader, RasterSource};
use crate::pyramid::VOID;

/// Level 0 of a store, read by rectangles.
pub struct StoreRaster {
    store: Store,
    header: RasterHeader,
}

impl StoreRaster {
    /// Wraps an open store.
    #[must_use]
    pub fn new(store: Store) -> Self {
        let manifest = store.manifest();
        let size = store.levels().first().map_or([2; 2], |l| l.size);
        let header = RasterHeader {
            width: size[0],
            height: size[1],
            spacing_m: manifest.place.spacing_m,
            origin_m: manifest.place.origin_m,
            georeference: manifest.place.georeference(),
            dtype: manifest.dtype.name(),
            format: "tessclip store",
            raw: true,
        };
        Self { store, header }
    }
}

impl RasterSource for StoreRaster {
    fn header(&self) -> &RasterHeader {
        &self.header
    }

    fn read(&self, at: [u64; 2], size: [usize; 2], out: &mut [f32]) -> Result<(), HeightError> {
        if size.contains(&0) {
            return Ok(());
        }
        let fit = |v: u64| i32::try_from(v).unwrap_or(i32::MAX);
        let hi = [0, 1].map(|a| fit(at[a] + size[a] as u64 - 1));
        let mut heights = Vec::with_capacity(out.len());
        self.store.read_rect(0, Rect { lo: at.map(fit), hi }, &mut heights).map_err(|fault| {
            HeightError::Malformed {
                path: self.store.at().into(),
                format: "tessclip store",
                detail: fault.to_string(),
            }
        })?;
        for (to, h) in out.iter_mut().zip(heights) {
            *to = if h == VOID { f32::NAN } else { h };
        }
        Ok(())
    }
}
