//! Procedural terrain: every sample is a pure function of seed, spacing and its two indices.

use rayon::prelude::*;

use super::geo::Georeference;
use super::raster::ZMap;
use super::{HeightError, HeightGrid, ReadOptions, alloc, landform, noise};

/// What kind of terrain to make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProceduralKind {
    /// Eroded-looking mountains, about 0..3000 m; `amp` is a factor.
    Mountains,
    /// Sand dunes, about 0..100 m; `amp` is a factor.
    Dunes,
    /// Exactly flat at 0; `amp` has no effect.
    Plain,
    /// 0 in columns before `width / 2`, `amp` metres from there on. The only kind whose samples
    /// depend on the size, as the step stands in the middle.
    Cliff,
    /// Flat at 0 with single samples of `amp` metres, about one in 1024.
    Spikes,
    /// `amp` metres where column plus row is even, `-amp` elsewhere.
    Checkerboard,
}

impl ProceduralKind {
    /// All kinds.
    pub const ALL: [Self; 6] =
        [Self::Mountains, Self::Dunes, Self::Plain, Self::Cliff, Self::Spikes, Self::Checkerboard];

    /// The name used in recipes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mountains => "mountains",
            Self::Dunes => "dunes",
            Self::Plain => "plain",
            Self::Cliff => "cliff",
            Self::Spikes => "spikes",
            Self::Checkerboard => "checkerboard",
        }
    }

    /// Default of `amp`: factor 1 for mountains and dunes, else 1000 m.
    pub fn default_amp(self) -> f64 {
        match self {
            Self::Mountains | Self::Dunes => 1.0,
            _ => 1000.0,
        }
    }
}

/// A recipe for a terrain. Sample (0, 0) is the south-west one, at plane position (0, 0).
#[derive(Clone, Debug, PartialEq)]
pub struct Procedural {
    /// The kind of terrain.
    pub kind: ProceduralKind,
    /// Another seed gives another terrain of the kind.
    pub seed: u64,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Metres between samples in both directions.
    pub spacing_m: f64,
    /// Factor or metres, see [`ProceduralKind`].
    pub amp: f64,
}

const PARAMETERS: &str = "seed, size, width, height, spacing, amp";

impl Procedural {
    /// The default recipe of a kind: seed 1, 1025 x 1025 samples 30 m apart.
    pub fn new(kind: ProceduralKind) -> Self {
        Self { kind, seed: 1, width: 1025, height: 1025, spacing_m: 30.0, amp: kind.default_amp() }
    }

    /// Parses `NAME?seed=1&size=1025&spacing=30&amp=1` (all parameters optional; `width` and
    /// `height` instead of `size` for oblongs). `options.spacing_m` is the default spacing.
    ///
    /// Errors: `UnknownProcedural`, `UnknownParameter`, `BadParameter`, `TooSmall`, `TooLarge`,
    /// `BadOption`.
    pub fn parse(recipe: &str, options: &ReadOptions) -> Result<Self, HeightError> {
        let made = Self::parse_any_size(recipe, options)?;
        made.check(options)?;
        Ok(made)
    }

    /// The same without a limit on the number of samples.
    pub(crate) fn parse_any_size(recipe: &str, options: &ReadOptions) -> Result<Self, HeightError> {
        options.check()?;
        let (name, query) = recipe.split_once('?').unwrap_or((recipe, ""));
        let kinds = ProceduralKind::ALL;
        let Some(kind) = kinds.into_iter().find(|k| k.name() == name) else {
            return Err(HeightError::UnknownProcedural {
                name: super::error::one_line(name),
                known: format!("{}, {}", kinds.map(ProceduralKind::name).join(", "), super::planet::NAME),
            });
        };
        let mut made = Self::new(kind);
        made.spacing_m = options.spacing_m.unwrap_or(made.spacing_m);
        let mut seen = Vec::new();
        for item in query.split('&').filter(|i| !i.is_empty()) {
            let (key, value) = item.split_once('=').unwrap_or((item, ""));
            if seen.contains(&key) {
                return Err(HeightError::BadParameter {
                    kind: kind.name(),
                    name: super::error::one_line(key),
                    value: super::error::one_line(value),
                    expected: "each parameter once",
                });
            }
            seen.push(key);
            made.set(key, value)?;
        }
        made.check_spacing()?;
        Ok(made)
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), HeightError> {
        let kind = self.kind.name();
        let bad = |expected| HeightError::BadParameter {
            kind,
            name: key.to_owned(),
            value: super::error::one_line(value),
            expected,
        };
        let count = || {
            let expected = "a whole number of at least 2";
            let parsed = value.parse::<usize>().ok().filter(|&n| n >= 2);
            parsed.ok_or_else(|| bad(expected))
        };
        let number = |expected, positive: bool| {
            let parsed = value.parse::<f64>().ok();
            parsed.filter(|v| v.is_finite() && (!positive || *v > 0.0)).ok_or_else(|| bad(expected))
        };
        match key {
            "seed" => self.seed = value.parse().map_err(|_| bad("a whole number"))?,
            "size" => (self.width, self.height) = (count()?, count()?),
            "width" => self.width = count()?,
            "height" => self.height = count()?,
            "spacing" => self.spacing_m = number("a positive number of metres", true)?,
            "amp" => {
                let expected = "a number of at most 1e12 in magnitude";
                self.amp = number(expected, false)?;
                if self.amp.abs() > super::grid::MOST_M {
                    return Err(bad(expected));
                }
            }
            _ => {
                return Err(HeightError::UnknownParameter {
                    kind,
                    name: super::error::one_line(key),
                    known: PARAMETERS,
                });
            }
        }
        Ok(())
    }

    fn check_spacing(&self) -> Result<(), HeightError> {
        if super::grid::SPACING_M.contains(&self.spacing_m) {
            return Ok(());
        }
        let expected = "metres from 1e-6 to 1e9";
        Err(HeightError::BadOption { name: "spacing", value: self.spacing_m, expected })
    }

    /// The number of samples, checked.
    fn check(&self, options: &ReadOptions) -> Result<usize, HeightError> {
        self.check_spacing()?;
        let subject = format!("procedural:{}", self.kind.name());
        alloc::sample_count(&subject, self.width as u64, self.height as u64, options.max_samples)
    }

    /// Height in metres of the sample in column `i` (from west) and row `j` (from south), also
    /// outside the grid. Always finite; heights beyond `f32` become 0.
    pub fn height_m(&self, i: i64, j: i64) -> f32 {
        let at = [i as f64 * self.spacing_m, j as f64 * self.spacing_m];
        let metres = match self.kind {
            ProceduralKind::Mountains => self.amp * landform::mountains(self.seed, at, self.spacing_m),
            ProceduralKind::Dunes => self.amp * landform::dunes(self.seed, at, self.spacing_m),
            ProceduralKind::Plain => 0.0,
            ProceduralKind::Cliff if i < (self.width / 2) as i64 => 0.0,
            ProceduralKind::Cliff => self.amp,
            ProceduralKind::Spikes if noise::hash(self.seed, i, j).is_multiple_of(1024) => self.amp,
            ProceduralKind::Spikes => 0.0,
            ProceduralKind::Checkerboard if (i ^ j) & 1 == 0 => self.amp,
            ProceduralKind::Checkerboard => -self.amp,
        };
        ZMap::IDENTITY.metres(metres).unwrap_or(0.0)
    }

    /// The whole grid, made on all cores, under the default size limit.
    ///
    /// Errors: `TooSmall`, `TooLarge`, `OutOfMemory`, `BadOption`.
    pub fn to_grid(&self) -> Result<HeightGrid, HeightError> {
        self.to_grid_with(&ReadOptions::default())
    }

    /// The whole grid under the limit, `z_scale` and `z_offset` of `options`.
    ///
    /// Errors: as [`Self::to_grid`].
    pub fn to_grid_with(&self, options: &ReadOptions) -> Result<HeightGrid, HeightError> {
        options.check()?;
        let count = self.check(options)?;
        let subject = format!("procedural:{}", self.kind.name());
        let z = ZMap::IDENTITY.then_options(options);
        let mut heights_m: Vec<f32> = alloc::zeroed(&subject, count)?;
        let rows = heights_m.par_chunks_mut(self.width).enumerate();
        rows.for_each(|(j, row)| self.fill_row([0, j as u64], z, row));
        Ok(HeightGrid {
            width: self.width,
            height: self.height,
            heights_m,
            valid: None,
            spacing_m: [self.spacing_m; 2],
            origin_m: [0.0; 2],
            georeference: Georeference::none(),
            dtype: "float32",
            format: "procedural",
        })
    }

    /// Heights of part of row `j`, from column `i` on, mapped by `z`.
    pub(crate) fn fill_row(&self, [i, j]: [u64; 2], z: ZMap, row: &mut [f32]) {
        for (i, h) in (i as i64..).zip(row) {
            let raw = self.height_m(i, j as i64);
            *h = z.metres(f64::from(raw)).unwrap_or(0.0);
        }
    }
}
