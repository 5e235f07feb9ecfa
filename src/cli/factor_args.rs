//! The clipmap's shape and how finely its patches are divided, as the command line and scene files ask for it.

use anyhow::bail;
use clap::ValueEnum;
use tessclip::{Factors, Scene};

use super::scene_file::SceneFile;

/// Samples per side of a window where patches go by their error and nothing else is said: more than usual,
/// for not all of a window's cells are drawn then.
pub const N_BY_ERROR: u32 = 511;
/// Least samples per side of a window for that.
pub const LEAST_N_BY_ERROR: u32 = 127;
/// Pixels where patches go by their error and no limit is given.
const PIXEL_ERROR: f32 = 1.0;

/// Samples per side of a window where none are given.
pub fn usual_n(factors: Factors) -> u32 {
    if factors.by_error() { N_BY_ERROR } else { Scene::default().n }
}

/// The clipmap's shape.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct ShapeArgs {
    /// Samples per side of a window: 15, 31, 63, 127, 255, 511 or 1023; by default 255, and 511 with factors by
    /// error, which need at least 127, as --color error does
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
    /// Draw the finest levels also from far above them
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    keep_fine_levels: Option<bool>,
    #[command(flatten)]
    factors: FactorWishes,
}

impl ShapeArgs {
    /// The scene with this shape, then what the file says, then the defaults.
    pub fn scene(&self, file: &SceneFile) -> anyhow::Result<Scene> {
        let usual = Scene::default();
        let factors = self.factors.over(&file.factors)?;
        let n = self.n.or(file.n).unwrap_or(usual_n(factors));
        // Only here: what one place says of n and what another says of the factors come together.
        if factors.by_error() && n < LEAST_N_BY_ERROR {
            let given = match (self.n, &file.path) {
                (None, Some(path)) => format!("{path}: clipmap.n = {n}"),
                _ => format!("--n {n}"),
            };
            bail!(
                "{given}: factors by error need windows of at least {LEAST_N_BY_ERROR} samples; raise it or \
                 take --factors uniform"
            );
        }
        let drops = self.keep_fine_levels.map(|keep| !keep).or(file.drop_fine_levels);
        Ok(Scene {
            n,
            factors,
            levels: self.levels.or(file.levels),
            morph: self.morph.or(file.morph).unwrap_or(usual.morph),
            cull: self.no_cull.map(|no| !no).or(file.cull).unwrap_or(usual.cull),
            drop_fine_levels: drops.unwrap_or(usual.drop_fine_levels),
            ..usual
        })
    }
}

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
    /// Keep a frame under T triangles, 1000 to 50000000; with --pixel-error the coarser mesh wins. No mesh has
    /// fewer than some two a patch in view (a smaller --n has fewer patches), and beside voids nothing is left
    /// out: a warning says where T is not met
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

    /// The fewest wishes that ask for these factors.
    #[cfg(feature = "viewer")]
    pub fn asking_for(factors: Factors) -> Self {
        let Factors::ByError { pixel_error, budget } = factors else { return Self::default() };
        // What the kind alone stands for.
        let usual = budget.is_none() && pixel_error.is_none_or(|p| p == PIXEL_ERROR);
        let kind = usual.then_some(FactorKind::Error);
        Self { kind, pixel_error: pixel_error.filter(|_| !usual), budget }
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
    use clap::Parser as _;

    use super::*;

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        shape: ShapeArgs,
    }

    fn shape(args: &[&str]) -> ShapeArgs {
        Line::try_parse_from([&["tessclip"], args].concat()).expect("understood").shape
    }

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

    #[test]
    fn windows_are_larger_by_default_where_factors_go_by_error() {
        let none = SceneFile::default();
        let scene = |args: &[&str], file| shape(args).scene(file).expect("suits");
        assert_eq!((scene(&[], &none).n, scene(&[], &none).factors), (255, Factors::Uniform));
        let by_error = scene(&["--factors", "error"], &none);
        let one_pixel = Factors::ByError { pixel_error: Some(1.0), budget: None };
        assert_eq!((by_error.n, by_error.factors), (511, one_pixel));
        let both = scene(&["--pixel-error", "0.5", "--budget", "200000", "--n", "127"], &none);
        let limits = Factors::ByError { pixel_error: Some(0.5), budget: Some(200_000) };
        assert_eq!((both.n, both.factors), (127, limits));
        let file = SceneFile { n: Some(255), ..SceneFile::default() };
        assert_eq!(scene(&["--budget", "5000"], &file).n, 255);
    }

    #[test]
    fn factors_by_error_need_large_windows() {
        let file = SceneFile { path: Some("hills.toml".into()), n: Some(63), ..SceneFile::default() };
        let said = |args: &[&str]| shape(args).scene(&file).expect_err("too small").to_string();
        for (error, place) in [
            (said(&["--pixel-error", "1"]), "hills.toml: clipmap.n = 63: "),
            (said(&["--pixel-error", "1", "--n", "31"]), "--n 31: "),
        ] {
            assert!(error.starts_with(place) && error.contains("at least 127 samples"), "{error}");
        }
        assert!(shape(&["--pixel-error", "1", "--n", "127"]).scene(&file).is_ok());
        assert!(shape(&[]).scene(&file).is_ok());
    }

    #[test]
    fn contradictions_and_limits_out_of_range_are_refused() {
        assert!(shape(&["--factors", "uniform", "--budget", "5000"]).scene(&SceneFile::default()).is_err());
        for bad in
            [["--pixel-error", "-1"], ["--pixel-error", "nan"], ["--budget", "10"], ["--factors", "all"]]
        {
            assert!(Line::try_parse_from([&["tessclip"], &bad[..]].concat()).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn fine_levels_are_kept_where_that_is_said() {
        let dropped =
            |args: &[&str], file: &SceneFile| shape(args).scene(file).expect("suits").drop_fine_levels;
        let none = SceneFile::default();
        assert!(dropped(&[], &none) && dropped(&["--keep-fine-levels=false"], &none));
        assert!(!dropped(&["--keep-fine-levels"], &none));
        let file = SceneFile { drop_fine_levels: Some(false), ..SceneFile::default() };
        assert!(!dropped(&[], &file) && dropped(&["--keep-fine-levels=false"], &file));
    }
}
