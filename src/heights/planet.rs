//! A made-up planet: a geographic grid of the whole globe, a pure function of seed and direction.

use rayon::prelude::*;

use super::geo::{Degrees, Georeference, metres_per_degree};
use super::noise::smoothstep;
use super::raster::{Located, ZMap};
use super::space_noise::{fractal, octaves};
use super::{HeightError, HeightGrid, ReadOptions, alloc};

/// The name used in recipes.
pub(crate) const NAME: &str = "planet";

/// Heights are whole metres.
pub(crate) const DTYPE: &str = "int16";

const PARAMETERS: &str = "seed, size, amp";
/// Deepest and highest ground at `amp` 1, metres.
const BOUNDS_M: [f64; 2] = [-6_000.0, 7_000.0];
/// Largest `amp` in magnitude: beyond it, heights would not fit the `int16` they are rounded for.
const MOST_AMP: f64 = 4.0;

/// A recipe for a planet: whole metres, longitudes from -180, both poles included.
#[derive(Clone, Debug, PartialEq)]
pub struct Planet {
    /// Another seed gives another planet.
    pub seed: u64,
    /// Rows from pole to pole, at least 2; there are `2 * (size - 1)` columns.
    pub size: usize,
    /// Factor on the heights, about -6000..7000 m at 1; at most 4 in magnitude.
    pub amp: f64,
}

impl Default for Planet {
    /// Seed 1, 2048 x 1025 samples, amp 1.
    fn default() -> Self {
        Self { seed: 1, size: 1025, amp: 1.0 }
    }
}

impl Planet {
    /// True when a recipe (without `procedural:`) is one for a planet.
    pub(crate) fn is_named(recipe: &str) -> bool {
        recipe.split('?').next() == Some(NAME)
    }

    /// Parses `planet?seed=1&size=1025&amp=1` (all parameters optional).
    ///
    /// Errors: `UnknownProcedural`, `UnknownParameter`, `BadParameter`, `TooSmall`, `TooLarge`, and
    /// `BadOption`, also for a spacing, which a planet brings along.
    pub fn parse(recipe: &str, options: &ReadOptions) -> Result<Self, HeightError> {
        let made = Self::parse_any_size(recipe, options)?;
        made.count(options)?;
        Ok(made)
    }

    /// The same without a limit on the number of samples.
    pub(crate) fn parse_any_size(recipe: &str, options: &ReadOptions) -> Result<Self, HeightError> {
        let (name, query) = recipe.split_once('?').unwrap_or((recipe, ""));
        if name != NAME {
            return Err(HeightError::UnknownProcedural {
                name: super::error::one_line(name),
                known: NAME.to_owned(),
            });
        }
        let mut made = Self::default();
        let mut seen = Vec::new();
        for item in query.split('&').filter(|i| !i.is_empty()) {
            let (key, value) = item.split_once('=').unwrap_or((item, ""));
            let bad = |expected| HeightError::BadParameter {
                kind: NAME,
                name: super::error::one_line(key),
                value: super::error::one_line(value),
                expected,
            };
            if seen.contains(&key) {
                return Err(bad("each parameter once"));
            }
            seen.push(key);
            match key {
                "seed" => made.seed = value.parse().map_err(|_| bad("a whole number"))?,
                "size" => {
                    let size = value.parse().ok().filter(|&n: &usize| n >= 2);
                    made.size = size.ok_or_else(|| bad("a whole number of at least 2"))?;
                }
                "amp" => {
                    let amp = value.parse().ok().filter(|v: &f64| v.abs() <= MOST_AMP);
                    made.amp = amp.ok_or_else(|| bad("a number of at most 4 in magnitude"))?;
                }
                _ => {
                    return Err(HeightError::UnknownParameter {
                        kind: NAME,
                        name: super::error::one_line(key),
                        known: PARAMETERS,
                    });
                }
            }
        }
        made.check(options)?;
        Ok(made)
    }

    /// Refuses numbers that make no planet.
    fn check(&self, options: &ReadOptions) -> Result<(), HeightError> {
        options.check()?;
        if let Some(value) = options.spacing_m {
            return Err(HeightError::BadOption {
                name: "spacing",
                value,
                expected: "none: a planet brings its own",
            });
        }
        let amp = self.amp.abs();
        if amp.is_nan() || amp > MOST_AMP {
            let expected = "a number of at most 4 in magnitude";
            let value = self.amp.to_string();
            return Err(HeightError::BadParameter { kind: NAME, name: "amp".to_owned(), value, expected });
        }
        Ok(())
    }

    /// Columns.
    pub(crate) fn width(&self) -> usize {
        self.size.saturating_sub(1).saturating_mul(2)
    }

    /// The number of samples, checked.
    fn count(&self, options: &ReadOptions) -> Result<usize, HeightError> {
        let subject = format!("procedural:{NAME}");
        alloc::sample_count(&subject, self.width() as u64, self.size as u64, options.max_samples)
    }

    /// The whole grid, made on all cores, under the default size limit.
    ///
    /// Errors: `TooSmall`, `TooLarge`, `OutOfMemory`, `BadParameter`.
    pub fn to_grid(&self) -> Result<HeightGrid, HeightError> {
        self.to_grid_with(&ReadOptions::default())
    }

    /// The whole grid under the limit, `z_scale` and `z_offset` of `options`.
    ///
    /// Errors: as [`Self::to_grid`], and `BadOption`.
    pub fn to_grid_with(&self, options: &ReadOptions) -> Result<HeightGrid, HeightError> {
        self.check(options)?;
        let count = self.count(options)?;
        let z = ZMap::IDENTITY.then_options(options);
        let mut heights_m: Vec<f32> = alloc::zeroed(&format!("procedural:{NAME}"), count)?;
        let rows = heights_m.par_chunks_mut(self.width()).enumerate();
        rows.for_each(|(j, row)| self.fill_row([0, j as u64], z, row));
        let Located { georeference, origin_m, spacing_m } = self.located();
        Ok(HeightGrid {
            width: self.width(),
            height: self.size,
            heights_m,
            valid: None,
            spacing_m,
            origin_m,
            georeference,
            dtype: DTYPE,
            format: "procedural",
        })
    }

    /// Where the samples lie; for sizes of at least 2.
    pub(crate) fn located(&self) -> Located {
        let step = 180.0 / (self.size - 1) as f64;
        let metres_per_degree = metres_per_degree(0.0);
        let [mx, my] = metres_per_degree;
        let degrees = Degrees { west: -180.0, south: -90.0, step: [step; 2], metres_per_degree };
        Located {
            georeference: Georeference {
                crs: Some("EPSG:4326".to_owned()),
                degrees: Some(degrees),
                unit: "degree",
                georeferenced: true,
                pixel_is_point: true,
            },
            origin_m: [-180.0 * mx, -90.0 * my],
            spacing_m: [step * mx, step * my],
        }
    }

    /// Heights of part of row `j`, from column `i` on, mapped by `z`.
    pub(crate) fn fill_row(&self, [i, j]: [u64; 2], z: ZMap, row: &mut [f32]) {
        let step = 180.0 / (self.size - 1) as f64;
        let pole = j == 0 || j == (self.size - 1) as u64;
        let (sin, cos) = (step * j as f64 - 90.0).to_radians().sin_cos();
        // Exactly, so that a row at a pole is one point and has one height.
        let (sin, cos) = if pole { (sin.signum(), 0.0) } else { (sin, cos) };
        for (i, h) in (i..).zip(row) {
            let (east, prime) = (step * i as f64 - 180.0).to_radians().sin_cos();
            let metres = self.height_m([cos * prime, cos * east, sin], step.to_radians());
            *h = z.metres(metres).unwrap_or(0.0);
        }
    }

    /// Height in whole metres in a direction (unit length), with detail down to `spacing` radians.
    fn height_m(&self, d: [f64; 3], spacing: f64) -> f64 {
        let sum = |salt: u64, frequency: f64, gain: f64, least: u32| {
            fractal(self.seed ^ salt, d.map(|v| v * frequency), gain, octaves(frequency, spacing, least))
        };
        // Continents: about a third of the ground is land, with ragged coasts.
        let land = sum(0xc0_11, 1.6, 0.52, 6) - 0.13;
        let plains = 700.0 * smoothstep(0.0, 0.5, land) + 60.0 * smoothstep(-0.02, 0.03, land);
        let shelf = 180.0 * smoothstep(0.0, -0.06, land);
        let floor = 4_100.0 * smoothstep(-0.05, -0.2, land) + 900.0 * smoothstep(-0.15, -0.6, land);
        let hills = sum(0x4177, 11.0, 0.55, 2);
        // Chains follow the zero lines of a slow noise; they rise from land and, as arcs, from the sea.
        let line = 1.0 - 3.2 * sum(0xbe17, 2.1, 0.42, 3).hypot(0.02);
        let belt = smoothstep(0.35, 0.95, line) * (0.45 + 0.55 * smoothstep(-0.15, 0.15, land));
        let crest = 1.0 - 1.5 * sum(0x0c4e, 9.0, 0.5, 2).hypot(0.05);
        let chains = belt * (1_500.0 + 4_600.0 * crest.max(0.0) + 900.0 * hills);
        let rough =
            hills * (120.0 + 330.0 * smoothstep(0.0, 0.4, land) + 260.0 * smoothstep(-0.1, -0.4, land));
        let metres = plains - shelf - floor + chains + rough;
        (self.amp * metres.clamp(BOUNDS_M[0], BOUNDS_M[1])).round() + 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::Planet;
    use crate::heights::{HeightError, HeightGrid, ReadOptions, open_terrain};

    fn open(spec: &str) -> Result<HeightGrid, HeightError> {
        open_terrain(spec, &ReadOptions::default())
    }

    #[test]
    fn a_planet_has_land_sea_and_single_poles() {
        for seed in [1, 2, 77] {
            let grid = open(&format!("procedural:planet?seed={seed}&size=257")).unwrap();
            assert_eq!((grid.width, grid.height, grid.dtype), (512, 257, "int16"));
            assert_eq!(grid.bounds(), [-180.0, -90.0, 180.0 - 180.0 / 256.0, 90.0]);
            assert!(grid.heights_m.iter().all(|h| h.fract() == 0.0 && (-6_000.0..=7_000.0).contains(h)));
            let (low, high, _) = grid.min_max_mean().unwrap();
            assert!(low < -4_500.0 && high > 3_500.0, "{seed}: {low} {high}");
            let land = grid.heights_m.iter().enumerate().filter(|(_, h)| **h > 0.0);
            let weight = |row: usize| (row as f64 * std::f64::consts::PI / 256.0).sin();
            let land: f64 = land.map(|(i, _)| weight(i / 512)).sum();
            let all: f64 = (0..257).map(|row| 512.0 * weight(row)).sum();
            assert!((0.15..0.6).contains(&(land / all)), "{seed}: {}", land / all);
            for row in [0, 256] {
                let row = &grid.heights_m[row * 512..][..512];
                assert!(row.iter().all(|h| h == &row[0]));
            }
        }
    }

    #[test]
    fn samples_do_not_depend_on_the_number_of_threads() {
        let planet = Planet { seed: 9, size: 65, amp: 2.0 };
        let make = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| planet.to_grid().unwrap().heights_m)
        };
        assert_eq!(make(1), make(7));
        assert_ne!(make(1), Planet { seed: 10, ..planet.clone() }.to_grid().unwrap().heights_m);
    }

    #[test]
    fn broken_recipes_are_refused() {
        use HeightError as E;
        let error = open("procedural:planets").unwrap_err();
        assert!(matches!(&error, E::UnknownProcedural { known, .. } if known.ends_with("planet")), "{error}");
        assert!(matches!(open("procedural:planet?spacing=3"), Err(E::UnknownParameter { .. })));
        for query in ["size=1", "size=x", "seed=-1", "amp=5", "amp=NaN", "amp=1&amp=1"] {
            let error = open(&format!("procedural:planet?{query}")).unwrap_err();
            assert!(matches!(error, E::BadParameter { kind: "planet", .. }), "{error}");
        }
        for size in ["20000", "18446744073709551615"] {
            let error = open(&format!("procedural:planet?size={size}")).unwrap_err();
            assert!(matches!(error, E::TooLarge { .. }), "{error}");
        }
        let spaced = ReadOptions { spacing_m: Some(30.0), ..ReadOptions::default() };
        let error = open_terrain("procedural:planet", &spaced).unwrap_err();
        assert!(matches!(error, E::BadOption { name: "spacing", .. }), "{error}");
        assert!(Planet { amp: f64::NAN, ..Planet::default() }.to_grid().is_err());
        assert!(open("procedural:planet?size=2").is_ok());
    }
}
