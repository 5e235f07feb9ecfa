//! Procedural positions: terrain that hangs over, and terrain that is broken on purpose.

use rayon::prelude::*;

use super::noise::{gradient, smoothstep};
use super::positions::{MAX_NODES, PositionGrid};
use super::{HeightError, alloc};

/// Half the extent of both kinds in metres.
const HALF_M: f64 = 5_000.0;
/// Largest number of nodes along a side.
const MAX_SIZE: usize = 8193;
/// What `size` may be.
const SIZES: &str = "a whole number from 2 to 8193";

/// What kind of position grid to make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PositionKind {
    /// A ridge like a breaking wave, whose crest leans over its eastern foot, and west of it an
    /// exactly vertical cliff. About 10 x 10 km, -0.1 to 1.6 km high.
    Overhang,
    /// A sheet with a pleat that is folded over twice, rows of cells without area, and a patch whose
    /// nodes all lie in one point. About 10 x 10 km.
    Fold,
}

impl PositionKind {
    /// All kinds.
    pub const ALL: [Self; 2] = [Self::Overhang, Self::Fold];

    /// The name used in recipes.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Overhang => "overhang",
            Self::Fold => "fold",
        }
    }

    /// Position in metres at sheet coordinates from 0 to 1; detail ends at twice `spacing_m`.
    fn position(self, st: [f64; 2], spacing_m: f64) -> [f64; 3] {
        match self {
            Self::Overhang => overhang(st, spacing_m),
            Self::Fold => fold(st),
        }
    }
}

impl PositionGrid {
    /// The grid of a kind with `size` x `size` nodes, made on all cores.
    ///
    /// Errors: `TooSmall`, `TooLarge`, `OutOfMemory`.
    pub fn procedural(kind: PositionKind, size: usize) -> Result<Self, HeightError> {
        let subject = format!("procedural:{}", kind.name());
        let count = alloc::sample_count(&subject, size as u64, size as u64, MAX_NODES)?;
        let mut xyz_m: Vec<[f64; 3]> = alloc::zeroed(&subject, count)?;
        let last = (size - 1) as f64;
        let rows = xyz_m.par_chunks_mut(size).enumerate();
        rows.for_each(|(row, nodes)| {
            for (col, node) in nodes.iter_mut().enumerate() {
                *node = kind.position([col as f64 / last, row as f64 / last], 2.0 * HALF_M / last);
            }
        });
        Self::checked(&subject, size, size, xyz_m)
    }

    /// True when a recipe names positions, not heights.
    #[must_use]
    pub fn is_named(recipe: &str) -> bool {
        let name = recipe.split_once('?').map_or(recipe, |(name, _)| name);
        PositionKind::ALL.iter().any(|k| k.name() == name)
    }

    /// Parses and makes `overhang?size=513` or `fold?size=513`; the default size is 513.
    ///
    /// Errors: `UnknownProcedural`, `UnknownParameter`, `BadParameter`, and those of
    /// [`Self::procedural`].
    pub fn parse(recipe: &str) -> Result<Self, HeightError> {
        let (name, query) = recipe.split_once('?').unwrap_or((recipe, ""));
        let kinds = PositionKind::ALL;
        let Some(kind) = kinds.into_iter().find(|k| k.name() == name) else {
            return Err(HeightError::UnknownProcedural {
                name: super::error::one_line(name),
                known: kinds.map(PositionKind::name).join(", "),
            });
        };
        let mut size = None;
        for item in query.split('&').filter(|i| !i.is_empty()) {
            let (key, value) = item.split_once('=').unwrap_or((item, ""));
            if key != "size" {
                let name = super::error::one_line(key);
                return Err(HeightError::UnknownParameter { kind: kind.name(), name, known: "size" });
            }
            let bad = |expected| HeightError::BadParameter {
                kind: kind.name(),
                name: key.to_owned(),
                value: super::error::one_line(value),
                expected,
            };
            if size.is_some() {
                return Err(bad("each parameter once"));
            }
            let number = value.parse().ok().filter(|n| (2..=MAX_SIZE).contains(n));
            size = Some(number.ok_or_else(|| bad(SIZES))?);
        }
        Self::procedural(kind, size.unwrap_or(513))
    }
}

/// Octaves of noise at a plane position in metres: about -1 to 1, wavelengths from 2 km down.
fn roughness(seed: u64, at: [f64; 2], spacing_m: f64) -> f64 {
    let (mut sum, mut amplitude, mut length) = (0.0, 0.5, 1_000.0);
    for octave in 0..8 {
        // Gradient noise has a wavelength of about two lattice cells.
        if 2.0 * length < 2.0 * spacing_m {
            break;
        }
        sum += amplitude * gradient(seed + octave, at.map(|c| c / length))[0];
        amplitude *= 0.5;
        length *= 0.5;
    }
    sum
}

/// The wave and the cliff.
///
/// The wave is a bump exp(-t^2) in height that also pushes its nodes east. Where the push falls faster
/// than the sheet advances, the front runs back under the crest. Height falls all the way down the
/// front, so the profile never meets itself.
fn overhang([s, t]: [f64; 2], spacing_m: f64) -> [f64; 3] {
    /// Part of the columns that stand in the cliff, and where they begin.
    const CLIFF: [f64; 2] = [0.15, 0.06];
    const CLIFF_M: f64 = 600.0;
    /// Middle and half width of the ridge in metres.
    const RIDGE_M: [f64; 2] = [500.0, 900.0];
    const CREST_M: f64 = 1_400.0;

    let y = HALF_M * (2.0 * t - 1.0);
    let climb = ((s - CLIFF[0]) / CLIFF[1]).clamp(0.0, 1.0);
    // All columns in the cliff share one x; the others share out the rest of the width.
    let sheet = (s - CLIFF[1] * climb) / (1.0 - CLIFF[1]);
    let x = HALF_M * (2.0 * sheet - 1.0);
    let foot = HALF_M * (2.0 * CLIFF[0] / (1.0 - CLIFF[1]) - 1.0);
    let mesa = CLIFF_M * climb * (1.0 - smoothstep(foot + 300.0, foot + 1_700.0, x));

    let middle = RIDGE_M[0] + 300.0 * (y / 1_900.0).sin();
    let across = (x - middle) / RIDGE_M[1];
    let bump = (-across * across).exp();
    // Over 1.17 half widths the front hangs; it does so everywhere, more or less.
    let push = RIDGE_M[1] * (1.55 + 0.2 * (y / 1_300.0 + 1.0).sin());
    // Taken along the sheet, so that the detail of the front is its own; flat on the cliff's foot.
    let rough = roughness(11, [x + CLIFF_M * climb, y], spacing_m);
    [x + push * bump, y, mesa + CREST_M * bump + 60.0 * rough]
}

/// The pleat and the collapsed parts.
fn fold([s, t]: [f64; 2]) -> [f64; 3] {
    let (mut x, mut y) = (2.0 * s - 1.0, 2.0 * t - 1.0);
    // From west to east: forth, back, forth again. The sheet lies on itself three times.
    let pleat = if s < 0.4 {
        s
    } else if s < 0.5 {
        0.8 - s
    } else {
        s - 0.2
    };
    x = if t < 0.5 { 2.0 * pleat / 0.8 - 1.0 } else { x };
    // Rows without advance: cells of no area.
    y = if t > 0.6 && t < 0.7 { 2.0 * 0.6 - 1.0 } else { y };
    // Everything in one point.
    if (0.7..0.9).contains(&s) && (0.75..0.95).contains(&t) {
        (x, y) = (0.6, 0.7);
    }
    [HALF_M * x, HALF_M * y, 300.0 * (2.0 * x).sin() * (3.0 * y).cos()]
}

#[cfg(test)]
mod tests {
    use super::{HALF_M, HeightError, PositionGrid, PositionKind};

    /// Twice the area vector of each cell, by its diagonals, square metres.
    fn areas(grid: &PositionGrid) -> Vec<glam::DVec3> {
        let p = |c: usize, r: usize| glam::DVec3::from_array(grid.xyz_m[r * grid.width + c]);
        let cells = (0..grid.height - 1).flat_map(|r| (0..grid.width - 1).map(move |c| (c, r)));
        cells.map(|(c, r)| (p(c + 1, r + 1) - p(c, r)).cross(p(c, r + 1) - p(c + 1, r))).collect()
    }

    #[test]
    fn the_wave_hangs_over_and_the_cliff_is_vertical() {
        for size in [65, 257, 513] {
            let grid = PositionGrid::procedural(PositionKind::Overhang, size).unwrap();
            let areas = areas(&grid);
            let share = |test: &dyn Fn(&glam::DVec3) -> bool| {
                areas.iter().filter(|a| test(a)).count() as f64 / areas.len() as f64
            };
            assert!(share(&|a| a.z < -0.1 * a.length()) > 0.02, "no overhang at {size}");
            assert!(share(&|a| a.z.abs() < 1e-6 * a.length()) > 0.02, "no vertical cells at {size}");
            assert!(areas.iter().all(|a| a.length() > 0.0));
            let [low, high] = grid.bounds_m().unwrap();
            assert!((2.0 * HALF_M - (high[0] - low[0])).abs() < 200.0, "{low:?} {high:?}");
            assert!(low[2] > -120.0 && high[2] > 1_300.0 && high[2] < 1_650.0, "{low:?} {high:?}");
        }
    }

    #[test]
    fn the_wave_does_not_meet_itself() {
        // Profiles of constant y are plane curves; no two segments of one may cross.
        let grid = PositionGrid::procedural(PositionKind::Overhang, 129).unwrap();
        let side = |a: [f64; 3], b: [f64; 3], p: [f64; 3]| {
            (b[0] - a[0]) * (p[2] - a[2]) - (b[2] - a[2]) * (p[0] - a[0])
        };
        for row in grid.xyz_m.chunks(129) {
            for i in 0..128 {
                for j in i + 2..128 {
                    let (a, b, c, d) = (row[i], row[i + 1], row[j], row[j + 1]);
                    let crosses = side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0;
                    assert!(!crosses, "segments {i} and {j} cross");
                }
            }
        }
    }

    #[test]
    fn the_fold_has_folded_and_empty_cells() {
        let areas = areas(&PositionGrid::procedural(PositionKind::Fold, 257).unwrap());
        assert!(areas.iter().filter(|a| a.length() == 0.0).count() > 1_000);
        assert!(areas.iter().filter(|a| a.z < 0.0).count() > 1_000);
    }

    #[test]
    fn recipes_are_parsed_and_refused() {
        let made = PositionGrid::parse("fold?size=7").unwrap();
        assert_eq!((made.width, made.height, made.valid), (7, 7, None));
        assert_eq!(PositionGrid::parse("overhang").unwrap().width, 513);
        assert_eq!(PositionGrid::parse("overhang?size=2").unwrap().xyz_m.len(), 4);
        let error = |recipe: &str| PositionGrid::parse(recipe).unwrap_err();
        assert!(matches!(error("wave"), HeightError::UnknownProcedural { .. }));
        assert!(matches!(error("fold?amp=2"), HeightError::UnknownParameter { .. }));
        for recipe in ["fold?size", "fold?size=1", "fold?size=8194", "fold?size=-3", "fold?size=2&size=2"] {
            assert!(matches!(error(recipe), HeightError::BadParameter { .. }), "{recipe}");
        }
        let made = |size| PositionGrid::procedural(PositionKind::Fold, size).unwrap_err();
        assert!(matches!(made(1), HeightError::TooSmall { .. }));
        assert!(matches!(made(8194), HeightError::TooLarge { .. }));
    }
}
