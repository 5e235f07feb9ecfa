//! Scene files: TOML with the tables `[terrain]`, `[clipmap]`, `[look]` and `[camera]`.
//!
//! Every key is optional but `terrain.source`; examples/scenes shows all of them. What the command line
//! says goes before what the file says. A key that is not known is refused with the nearest one.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::str::FromStr as _;

use anyhow::{Context as _, anyhow, bail};
use clap::ValueEnum;
use tessclip::rivals::Method;
use tessclip::surface::Base;
use toml::de::{DeTable, DeValue};

use super::args::{Color, Filter, Nodata, Rgb, parse_color, parse_size, pose_words, sun};
use super::beside::parse_method;
use super::factor_args::{self, FactorWishes};

/// Tables and their keys.
const KEYS: [(&str, &[&str]); 4] = [
    (
        "terrain",
        &["source", "base", "over", "exaggeration", "spacing", "z_scale", "z_offset", "nodata", "prefilter"],
    ),
    ("clipmap", &["n", "levels", "morph", "cull", "drop_fine_levels", "factors", "pixel_error", "budget"]),
    ("look", &["color", "wireframe", "bounds", "fog", "background", "sun", "beside"]),
    ("camera", &["pose", "freeze", "fov", "size"]),
];

/// What a scene file says; all of it is `None` where TERRAIN is no scene file.
#[derive(Clone, Debug, Default)]
pub struct SceneFile {
    /// The file itself, for messages.
    pub path: Option<String>,
    /// DEM file, positions or recipe.
    pub source: Option<String>,
    /// Base surface.
    pub base: Option<Base>,
    /// More DEMs.
    pub over: Vec<String>,
    /// Factor on the heights.
    pub exaggeration: Option<f64>,
    /// Metres between samples.
    pub spacing: Option<f64>,
    /// Metres a unit.
    pub z_scale: Option<f64>,
    /// Metres added.
    pub z_offset: Option<f64>,
    /// Void policy.
    pub nodata: Option<Nodata>,
    /// Prefilter.
    pub prefilter: Option<Filter>,
    /// Samples per side of a window.
    pub n: Option<u32>,
    /// Level count.
    pub levels: Option<u32>,
    /// Geomorph.
    pub morph: Option<bool>,
    /// Culling.
    pub cull: Option<bool>,
    /// Drop the finest levels from far above.
    pub drop_fine_levels: Option<bool>,
    /// How finely patches are divided.
    pub factors: FactorWishes,
    /// Colouring.
    pub color: Option<Color>,
    /// Triangle edges.
    pub wireframe: Option<bool>,
    /// Bounds of patches.
    pub bounds: Option<bool>,
    /// Distance fog.
    pub fog: Option<bool>,
    /// Background.
    pub background: Option<Rgb>,
    /// Azimuth and altitude of the sun, degrees.
    pub sun: Option<[f64; 2]>,
    /// Rival in the right half.
    pub beside: Option<Method>,
    /// Camera `x,y,z,yaw,pitch`.
    pub pose: Option<String>,
    /// Pose that windows, factors and culling stay with.
    pub freeze: Option<String>,
    /// Vertical field of view, degrees.
    pub fov: Option<f64>,
    /// Picture size.
    pub size: Option<[u32; 2]>,
}

impl SceneFile {
    /// True when a TERRAIN argument names a scene file.
    pub fn is_one(terrain: &str) -> bool {
        !terrain.starts_with("procedural:")
            && Path::new(terrain).extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
    }

    /// The scene file TERRAIN names, or one that says nothing where it is something else.
    pub fn of(terrain: &str) -> anyhow::Result<Self> {
        if !Self::is_one(terrain) {
            return Ok(Self::default());
        }
        let path = Path::new(terrain);
        // A pipe would be waited for without end.
        if path.exists() && !path.is_file() {
            anyhow::bail!("{terrain}: is not a regular file; name a scene file");
        }
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("{terrain}: the scene file cannot be read"))?;
        Self::parse(path, &text)
    }

    fn parse(path: &Path, text: &str) -> anyhow::Result<Self> {
        let place = Place { path, text };
        let document = DeTable::parse(text)
            .map_err(|e| place.fail(e.span().unwrap_or(0..0), &format!("not TOML: {}", e.message())))?;
        let mut scene = Self { path: Some(path.display().to_string()), ..Self::default() };
        for (name, table) in document.get_ref().iter() {
            let Some((name, keys)) = KEYS.iter().find(|(known, _)| *known == name.get_ref().as_ref()) else {
                return Err(place.unknown(name.span(), "", name.get_ref()));
            };
            let DeValue::Table(table) = table.get_ref() else {
                return Err(place.fail(table.span(), &format!("{name} is a table: write [{name}]")));
            };
            for (key, value) in table.iter() {
                let Some(key) = keys.iter().find(|known| **known == key.get_ref().as_ref()) else {
                    return Err(place.unknown(key.span(), name, key.get_ref()));
                };
                scene
                    .set(&place, key, value.get_ref())
                    .map_err(|e| place.fail(value.span(), &format!("{name}.{key}: {e:#}")))?;
            }
            // Only a whole table shows it, whatever the order of its keys.
            if let Some(limit) = scene.factors.idle_limit()
                && let Some((key, _)) = table.iter().find(|(key, _)| limit == key.get_ref().as_ref())
            {
                let what = "has no meaning with factors = \"uniform\"; leave one of them out";
                return Err(place.fail(key.span(), &format!("{name}.{limit}: {what}")));
            }
        }
        if scene.source.is_none() {
            bail!("{}: names no terrain: give source in [terrain]", path.display());
        }
        scene.resolve_paths(path);
        Ok(scene)
    }

    fn set(&mut self, place: &Place<'_>, key: &str, value: &DeValue<'_>) -> anyhow::Result<()> {
        match key {
            "source" => {
                let source = string(value)?;
                if source.is_empty() || Self::is_one(source) {
                    bail!("give a DEM file or procedural:NAME, not `{source}` ({})", place.path.display());
                }
                self.source = Some(source.into());
            }
            "base" => self.base = Some(Base::from_str(string(value)?)?),
            "over" => self.over = list(value, string)?.into_iter().map(String::from).collect(),
            "exaggeration" => self.exaggeration = Some(number(value)?),
            "spacing" => self.spacing = Some(number(value)?),
            "z_scale" => self.z_scale = Some(number(value)?),
            "z_offset" => self.z_offset = Some(number(value)?),
            "nodata" => self.nodata = Some(choice(value)?),
            "prefilter" => self.prefilter = Some(choice(value)?),
            "n" => self.n = Some(whole(value)?),
            "levels" => self.levels = Some(whole(value)?),
            "morph" => self.morph = Some(switch(value)?),
            "cull" => self.cull = Some(switch(value)?),
            "drop_fine_levels" => self.drop_fine_levels = Some(switch(value)?),
            "factors" => self.factors.kind = Some(choice(value)?),
            "pixel_error" => {
                let pixels = factor_args::pixel_error(number(value)?);
                self.factors.pixel_error = Some(pixels.map_err(|e| anyhow!(e))?);
            }
            "budget" => {
                let triangles = factor_args::budget(Some(whole(value)?));
                self.factors.budget = Some(triangles.map_err(|e| anyhow!(e))?);
            }
            "color" => self.color = Some(choice(value)?),
            "wireframe" => self.wireframe = Some(switch(value)?),
            "bounds" => self.bounds = Some(switch(value)?),
            "fog" => self.fog = Some(switch(value)?),
            "background" => self.background = Some(parse_color(string(value)?).map_err(|e| anyhow!(e))?),
            "sun" => self.sun = Some(sun(numbers(value)?).map_err(|e| anyhow!(e))?),
            "beside" => self.beside = Some(parse_method(string(value)?).map_err(|e| anyhow!(e))?),
            "pose" => self.pose = Some(pose_words(numbers(value)?)),
            "freeze" => self.freeze = Some(pose_words(numbers(value)?)),
            "fov" => self.fov = Some(number(value)?),
            _ => self.size = Some(parse_size(string(value)?).map_err(|e| anyhow!(e))?),
        }
        Ok(())
    }

    /// Paths in a scene file are relative to its own folder.
    fn resolve_paths(&mut self, path: &Path) {
        let folder = path.parent().map_or_else(PathBuf::new, Path::to_path_buf);
        let resolved = |given: &str| {
            if is_path(given) { folder.join(given).to_string_lossy().into_owned() } else { given.to_string() }
        };
        if let Some(source) = &mut self.source {
            let paths: Vec<String> = paths_of(source, self.base).into_iter().map(resolved).collect();
            *source = paths.join(",");
        }
        self.over = self.over.iter().map(|dem| resolved(dem)).collect();
    }
}

/// The paths that a source names: the x, y and z of positions may come as three rasters.
pub fn paths_of(source: &str, base: Option<Base>) -> Vec<&str> {
    let parts: Vec<&str> = source.split(',').collect();
    if base == Some(Base::Sampled) && parts.len() == 3 { parts } else { vec![source] }
}

/// True when a name is that of a file or folder, no recipe and no address of a store.
pub fn is_path(name: &str) -> bool {
    !name.starts_with("procedural:") && !name.contains("://")
}

/// Where an error stands.
struct Place<'a> {
    path: &'a Path,
    text: &'a str,
}

impl Place<'_> {
    fn fail(&self, at: Range<usize>, what: &str) -> anyhow::Error {
        let before = self.text.get(..at.start).unwrap_or_default();
        let line = before.matches('\n').count() + 1;
        anyhow!("{}: line {line}: {what}", self.path.display())
    }

    fn unknown(&self, at: Range<usize>, table: &str, key: &str) -> anyhow::Error {
        let (kind, here) =
            if table.is_empty() { ("table", String::new()) } else { ("key", format!("{table}.")) };
        self.fail(at, &format!("unknown {kind} `{here}{key}`; the nearest is `{}`", nearest(table, key)))
    }
}

/// The known name nearest to one in `table`; its own table's win where several are equally near.
fn nearest(table: &str, key: &str) -> String {
    let all = KEYS.iter().flat_map(|(name, keys)| {
        let own = usize::from(*name != table);
        let itself = table.is_empty().then(|| (strsim::damerau_levenshtein(key, name), 0, name.to_string()));
        let keys = keys
            .iter()
            .map(move |known| (strsim::damerau_levenshtein(key, known), own, format!("{name}.{known}")));
        itself.into_iter().chain(keys)
    });
    all.min().map(|(_, _, name)| name).unwrap_or_default()
}

fn string<'a>(value: &'a DeValue<'_>) -> anyhow::Result<&'a str> {
    match value {
        DeValue::String(text) => Ok(text),
        other => bail!("give a text in quotes, not a {}", other.type_str()),
    }
}

fn switch(value: &DeValue<'_>) -> anyhow::Result<bool> {
    match value {
        DeValue::Boolean(on) => Ok(*on),
        other => bail!("give true or false, not a {}", other.type_str()),
    }
}

fn number(value: &DeValue<'_>) -> anyhow::Result<f64> {
    let parsed: Option<f64> = match value {
        DeValue::Float(v) => v.as_str().parse().ok(),
        DeValue::Integer(v) => i64::from_str_radix(v.as_str(), v.radix()).ok().map(|v| v as f64),
        other => bail!("give a number, not a {}", other.type_str()),
    };
    parsed.filter(|v| v.is_finite()).ok_or_else(|| anyhow!("give a finite number"))
}

fn whole(value: &DeValue<'_>) -> anyhow::Result<u32> {
    match value {
        DeValue::Integer(v) => u32::from_str_radix(v.as_str(), v.radix())
            .map_err(|_| anyhow!("give a whole number that is not negative, not {v}")),
        other => bail!("give a whole number, not a {}", other.type_str()),
    }
}

fn list<'a, 'i, T>(
    value: &'a DeValue<'i>,
    each: impl Fn(&'a DeValue<'i>) -> anyhow::Result<T>,
) -> anyhow::Result<Vec<T>> {
    match value {
        DeValue::Array(items) => items.iter().map(|item| each(item.get_ref())).collect(),
        other => bail!("give a list in brackets, not a {}", other.type_str()),
    }
}

fn numbers<const N: usize>(value: &DeValue<'_>) -> anyhow::Result<[f64; N]> {
    let all = list(value, number)?;
    all.try_into().map_err(|all: Vec<f64>| anyhow!("give {N} numbers, not {}", all.len()))
}

fn choice<T: ValueEnum>(value: &DeValue<'_>) -> anyhow::Result<T> {
    let text = string(value)?;
    T::from_str(text, false).map_err(|_| {
        let known: Vec<String> = T::value_variants()
            .iter()
            .filter_map(|v| Some(v.to_possible_value()?.get_name().to_string()))
            .collect();
        let near = known.iter().min_by_key(|name| strsim::damerau_levenshtein(text, name));
        anyhow!(
            "`{text}` is none of {}; the nearest is `{}`",
            known.join(", "),
            near.map_or("", String::as_str)
        )
    })
}

#[cfg(test)]
mod tests {
    use super::super::factor_args::FactorKind;
    use super::*;

    fn parse(clipmap: &str) -> anyhow::Result<SceneFile> {
        let text = format!("[terrain]\nsource = 'procedural:plain'\n[clipmap]\n{clipmap}\n");
        SceneFile::parse(Path::new("hills.toml"), &text)
    }

    #[test]
    fn factors_and_their_limits_are_read() {
        let scene = parse("factors = 'error'\npixel_error = 2\nbudget = 300_000").expect("suits");
        let wanted =
            FactorWishes { kind: Some(FactorKind::Error), pixel_error: Some(2.0), budget: Some(300_000) };
        assert_eq!(scene.factors, wanted);
        assert_eq!(scene.path.as_deref(), Some("hills.toml"));
        assert_eq!(parse("n = 63").expect("suits").factors, FactorWishes::default());
    }

    #[test]
    fn factors_that_do_not_suit_are_refused_where_they_stand() {
        for (clipmap, words) in [
            ("factors = 'eror'", "line 4: clipmap.factors: `eror` is none of uniform, error"),
            ("pixel_error = 0.01", "line 4: clipmap.pixel_error: give 0.05 to 100 pixels"),
            ("pixel_error = inf", "line 4: clipmap.pixel_error: give a finite number"),
            ("n = 511\nbudget = 10", "line 5: clipmap.budget: give 1000 to 50000000 triangles"),
            ("budget = 2e6", "line 4: clipmap.budget: give a whole number"),
            ("factors = 'uniform'\nbudget = 5000", "line 5: clipmap.budget: has no meaning"),
            ("pixel_error = 1\nfactors = 'uniform'", "line 4: clipmap.pixel_error: has no meaning"),
        ] {
            let error = parse(clipmap).expect_err("does not suit").to_string();
            assert!(error.starts_with("hills.toml: ") && error.contains(words), "{error}");
        }
    }

    #[test]
    fn only_paths_are_relative_to_the_file() {
        let source = |source: &str, more: &str| {
            let text = format!("[terrain]\nsource = '{source}'\n{more}\n");
            SceneFile::parse(Path::new("scenes/a.toml"), &text).expect("suits").source.expect("a source")
        };
        assert_eq!(source("dem.tif", ""), "scenes/dem.tif");
        assert_eq!(source("/data/dem.tif", ""), "/data/dem.tif");
        assert_eq!(source("procedural:plain", ""), "procedural:plain");
        assert_eq!(source("https://host/t.zarr", ""), "https://host/t.zarr");
        assert_eq!(source("x,y,z", "base = 'sampled'"), "scenes/x,scenes/y,scenes/z");
        assert_eq!(source("x,y,z", ""), "scenes/x,y,z");
        assert_eq!(source("x,y", "base = 'sampled'"), "scenes/x,y");
    }
}
