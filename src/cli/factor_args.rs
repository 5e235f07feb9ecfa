//! How finely patches are divided, as the command line and scene files ask for it.

use anyhow::bail;
use clap::ValueEnum;
use tessclip::Factors;

/// Samples per side of a window where patches go by their error and nothing else is said: more than usual,
/// for not all of a window's cells are drawn then.
pub const N_BY_ERROR: u32 = 511;
/// Least samples per side of a window for that.
pub const LEAST_N_BY_ERROR: u32 = 127;
/// Pixels where patches go by their error and no limit is given.
const PIXEL_ERROR: f32 = 1.0;

/// What the factors go by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FactorKind {
    /// All cells of every level
    Uniform,
    /// Each patch by its measured deviation
    Error,
}

/// Kind and limits, where they are given.
#[derive(Clone, Copy, Debug, Default, PartialEq, clap::Args)]
pub struct FactorWishes {
    /// How finely patches are divided; by default uniform, and error where one of the next two is given
    /// (alone it means --pixel-error 1)
    #[arg(long = "factors", value_enum, value_name = "KIND")]
    pub kind: Option<FactorKind>,
    /// Draw every patch only as finely as keeps its measured deviation under P pixels, 0.05 to 100, as far as the
    /// windows' finest levels reach (a larger --n reaches further) and before --morph moves anything
    #[arg(long, value_name = "P", value_parser = parse_pixel_error, allow_negative_numbers = true)]
    pub pixel_error: Option<f32>,
    /// Keep a frame under T triangles, 1000 to 50000000; with --pixel-error the coarser mesh wins. Patches over
    /// voids are never coarse: there it may not be met, and a warning says so
    #[arg(long, value_name = "T", value_parser = parse_budget, allow_negative_numbers = true)]
    pub budget: Option<u32>,
}

impl FactorWishes {
    /// Key of a limit that is given although uniform factors take no notice of it.
    pub fn idle_limit(&self) -> Option<&'static str> {
        let limits = [("pixel_error", self.pixel_error.is_some()), ("budget", self.budget.is_some())];
        let given = limits.into_iter().find(|(_, given)| *given)?;
        (self.kind == Some(FactorKind::Uniform)).then_some(given.0)
    }

    /// These wishes, and where they say nothing those of a scene file.
    pub fn over(&self, file: &Self) -> anyhow::Result<Factors> {
        if let Some(key) = self.idle_limit() {
            let option = key.replace('_', "-");
            bail!("--{option} has no meaning with --factors uniform; leave one of them out");
        }
        // A limit on the command line says `error` as well, whatever the file says.
        let kind = self.asked().or_else(|| file.asked()).unwrap_or(FactorKind::Uniform);
        if kind == FactorKind::Uniform {
            return Ok(Factors::Uniform);
        }
        let budget = self.budget.or(file.budget);
        let usual = budget.is_none().then_some(PIXEL_ERROR);
        let pixel_error = self.pixel_error.or(file.pixel_error).or(usual);
        Ok(Factors::ByError { pixel_error, budget })
    }

    /// The kind, said outright or by a limit.
    fn asked(&self) -> Option<FactorKind> {
        let limited = self.pixel_error.is_some() || self.budget.is_some();
        self.kind.or_else(|| limited.then_some(FactorKind::Error))
    }
}

/// A pixel error within its bounds.
pub fn pixel_error(pixels: f64) -> Result<f32, String> {
    // No NaN is within.
    if (0.05..=100.0).contains(&pixels) { Ok(pixels as f32) } else { Err("give 0.05 to 100 pixels".into()) }
}

/// A triangle budget within its bounds.
pub fn budget(triangles: Option<u32>) -> Result<u32, String> {
    let within = triangles.filter(|t| (1_000..=50_000_000).contains(t));
    within.ok_or_else(|| "give 1000 to 50000000 triangles, a whole number".into())
}

fn parse_pixel_error(text: &str) -> Result<f32, String> {
    pixel_error(text.parse().unwrap_or(f64::NAN))
}

fn parse_budget(text: &str) -> Result<u32, String> {
    budget(text.parse().ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wishes(kind: Option<FactorKind>, pixel_error: Option<f32>, budget: Option<u32>) -> FactorWishes {
        FactorWishes { kind, pixel_error, budget }
    }

    fn by_error(pixel_error: Option<f32>, budget: Option<u32>) -> Factors {
        Factors::ByError { pixel_error, budget }
    }

    #[test]
    fn a_limit_says_error_and_error_alone_says_one_pixel() {
        let none = FactorWishes::default();
        let of = |kind, pixels, triangles| wishes(kind, pixels, triangles).over(&none).expect("suits");
        assert_eq!(of(None, None, None), Factors::Uniform);
        assert_eq!(of(Some(FactorKind::Uniform), None, None), Factors::Uniform);
        assert_eq!(of(Some(FactorKind::Error), None, None), by_error(Some(1.0), None));
        assert_eq!(of(None, Some(2.5), None), by_error(Some(2.5), None));
        assert_eq!(of(None, None, Some(5_000)), by_error(None, Some(5_000)));
        assert_eq!(of(Some(FactorKind::Error), Some(0.5), Some(5_000)), by_error(Some(0.5), Some(5_000)));
    }

    #[test]
    fn the_command_line_goes_before_the_file_key_by_key() {
        let file = wishes(Some(FactorKind::Error), Some(2.0), Some(9_000));
        let over = |said: FactorWishes, file: FactorWishes| said.over(&file).expect("suits");
        assert_eq!(over(FactorWishes::default(), file), by_error(Some(2.0), Some(9_000)));
        assert_eq!(over(wishes(None, Some(4.0), None), file), by_error(Some(4.0), Some(9_000)));
        assert_eq!(over(wishes(Some(FactorKind::Uniform), None, None), file), Factors::Uniform);
        let uniform = wishes(Some(FactorKind::Uniform), None, None);
        assert_eq!(over(wishes(None, None, Some(7_000)), uniform), by_error(None, Some(7_000)));
        let limit_alone = wishes(None, Some(3.0), None);
        assert_eq!(over(FactorWishes::default(), limit_alone), by_error(Some(3.0), None));
    }

    #[test]
    fn uniform_with_a_limit_is_refused() {
        for (said, option) in [
            (wishes(Some(FactorKind::Uniform), Some(1.0), None), "--pixel-error "),
            (wishes(Some(FactorKind::Uniform), None, Some(5_000)), "--budget "),
        ] {
            let error = said.over(&FactorWishes::default()).expect_err("a contradiction").to_string();
            assert!(error.contains(option) && error.contains("--factors uniform"), "{error}");
        }
    }

    #[test]
    fn limits_out_of_range_are_refused() {
        assert_eq!(parse_pixel_error("0.05"), Ok(0.05));
        assert_eq!(parse_pixel_error("100"), Ok(100.0));
        for bad in ["0.049", "100.1", "0", "-1", "NaN", "inf", "fine", ""] {
            assert!(parse_pixel_error(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_budget("1000"), Ok(1_000));
        assert_eq!(parse_budget("50000000"), Ok(50_000_000));
        for bad in ["999", "50000001", "99999999999", "-1000", "1e6", "2000.5", ""] {
            assert!(parse_budget(bad).is_err(), "{bad}");
        }
    }
}
