//! Scene files as the viewer saves them: what is looked at, read back to the same picture.

use std::path::absolute;

use anyhow::{Context as _, anyhow, bail};
use serde::Serialize;
use tessclip::Scene;
use tessclip::surface::Base;

use super::args::{FOV_DEG, TerrainArgs, name_of, nearest_digits};
use super::factor_args::{FactorWishes, usual_n};
use super::line::color_name;
use super::scene_file::{is_path, paths_of};
use crate::viewer::look::Look;

/// The tables of a scene file, in the order of examples/scenes/plane.toml.
#[derive(Serialize)]
struct Document {
    terrain: TerrainTable,
    #[serde(skip_serializing_if = "is_usual")]
    clipmap: ClipmapTable,
    #[serde(skip_serializing_if = "is_usual")]
    look: LookTable,
    camera: CameraTable,
}

#[derive(Serialize)]
struct TerrainTable {
    source: String,
    base: Option<String>,
    over: Option<Vec<String>>,
    exaggeration: Option<f64>,
    spacing: Option<f64>,
    z_scale: Option<f64>,
    z_offset: Option<f64>,
    nodata: Option<String>,
    prefilter: Option<String>,
}

#[derive(Default, PartialEq, Serialize)]
struct ClipmapTable {
    n: Option<u32>,
    levels: Option<u32>,
    morph: Option<bool>,
    factors: Option<String>,
    pixel_error: Option<f32>,
    budget: Option<u32>,
    cull: Option<bool>,
    drop_fine_levels: Option<bool>,
}

#[derive(Default, PartialEq, Serialize)]
struct LookTable {
    color: Option<String>,
    wireframe: Option<bool>,
    bounds: Option<bool>,
    fog: Option<bool>,
    background: Option<String>,
    sun: Option<[f64; 2]>,
    beside: Option<&'static str>,
}

#[derive(Serialize)]
struct CameraTable {
    pose: [f64; 5],
    freeze: Option<[f64; 5]>,
    fov: Option<f64>,
    size: String,
}

/// True for a table that says nothing.
fn is_usual<T: Default + PartialEq>(table: &T) -> bool {
    *table == T::default()
}

/// A value, where it is not the usual one.
fn unless<T: PartialEq>(value: T, usual: &T) -> Option<T> {
    (value != *usual).then_some(value)
}

/// A scene file that [`super::scene_file::SceneFile::of`] reads back to the same picture; see
/// [`super::line::render_line`]. Paths become absolute: those in a scene file are relative to its own folder. What a
/// file cannot say is left out: how a store is streamed.
pub fn scene_toml(
    terrain: &TerrainArgs,
    look: &Look,
    pose: [f64; 5],
    size: [u32; 2],
) -> anyhow::Result<String> {
    let (scene, usual) = (&look.scene, Scene::default());
    let FactorWishes { kind, pixel_error, budget } = FactorWishes::asking_for(scene.factors);
    let document = Document {
        terrain: terrain_table(terrain, look.exaggeration)?,
        clipmap: ClipmapTable {
            n: unless(scene.n, &usual_n(scene.factors)),
            levels: scene.levels,
            morph: unless(scene.morph, &usual.morph),
            factors: kind.as_ref().map(name_of),
            pixel_error,
            budget,
            cull: unless(scene.cull, &usual.cull),
            drop_fine_levels: unless(scene.drop_fine_levels, &usual.drop_fine_levels),
        },
        look: LookTable {
            color: unless(scene.color, &usual.color).map(color_name),
            wireframe: unless(scene.wireframe, &usual.wireframe),
            bounds: unless(scene.bounds, &usual.bounds),
            fog: unless(scene.fog, &usual.fog),
            background: unless(scene.background, &usual.background).map(nearest_digits),
            sun: unless(scene.sun_deg, &usual.sun_deg),
            beside: look.beside.map(tessclip::rivals::Method::name),
        },
        camera: CameraTable {
            pose,
            freeze: look.frozen,
            fov: unless(look.fov_deg, &FOV_DEG),
            size: format!("{}x{}", size[0], size[1]),
        },
    };
    let version = env!("CARGO_PKG_VERSION");
    Ok(format!("# Saved by tessclip view {version}.\n\n{}", toml::to_string(&document)?))
}

fn terrain_table(terrain: &TerrainArgs, exaggeration: f64) -> anyhow::Result<TerrainTable> {
    let said = terrain.as_file();
    let over = said.over.iter().map(|dem| whole_path(dem)).collect::<anyhow::Result<Vec<_>>>()?;
    Ok(TerrainTable {
        source: whole_source(&terrain.terrain, said.base)?,
        base: said.base.map(|base| base.to_string()),
        over: (!over.is_empty()).then_some(over),
        exaggeration: unless(exaggeration, &1.0),
        spacing: said.spacing,
        z_scale: said.z_scale,
        z_offset: said.z_offset,
        nodata: said.nodata.as_ref().map(name_of),
        prefilter: said.prefilter.as_ref().map(name_of),
    })
}

/// A source whose paths are absolute.
fn whole_source(source: &str, base: Option<Base>) -> anyhow::Result<String> {
    let paths = paths_of(source, base).into_iter().map(whole_path).collect::<anyhow::Result<Vec<_>>>()?;
    joined(&paths, base)
}

/// Paths as one source. Only now they may hold a comma: that of a folder's name.
fn joined(paths: &[String], base: Option<Base>) -> anyhow::Result<String> {
    let source = paths.join(",");
    if paths_of(&source, base).len() != paths.len() {
        bail!("{source}: a scene file cannot name positions in a folder with a comma in its name");
    }
    Ok(source)
}

fn whole_path(name: &str) -> anyhow::Result<String> {
    if !is_path(name) {
        return Ok(name.into());
    }
    let path = absolute(name).with_context(|| format!("{name}: its folder cannot be told"))?;
    let text = path.into_os_string().into_string();
    text.map_err(|path| anyhow!("{}: a scene file cannot hold such a path", path.display()))
}

#[cfg(test)]
mod tests {
    use super::super::line::tests::{asked, assert_same, cases};
    use super::*;

    /// Options with their paths made absolute, those of streaming left out.
    fn kept(options: Vec<String>) -> Vec<String> {
        let streaming = ["--cache-mb=", "--loaders=", "--upload-mb="];
        let kept = options.into_iter().filter(|o| !streaming.iter().any(|s| o.starts_with(s)));
        kept.map(|o| match o.strip_prefix("--over=") {
            Some(dem) => format!("--over={}", whole_path(dem).expect("a path")),
            None => o,
        })
        .collect()
    }

    #[test]
    fn a_saved_scene_reads_back_to_the_same_picture() {
        let folder = tempfile::TempDir::new().expect("a folder");
        let at = folder.path().join("saved.toml");
        let at = at.to_str().expect("text");
        for case in cases() {
            let text = scene_toml(&case.terrain, &case.look, case.pose, case.size).expect("a scene");
            assert!(text.starts_with("# Saved by tessclip view "), "{text}");
            std::fs::write(at, &text).expect("written");
            let said = asked(&[at, "-o", "x.png"]);
            assert_same(&case, &said, &text);
            let terrain = &case.terrain;
            let source = whole_source(&terrain.terrain, terrain.as_file().base).expect("a source");
            assert_eq!(said.terrain.terrain, source, "{text}");
            assert_eq!(said.terrain.options(), kept(terrain.options()), "{text}");
        }
    }

    #[test]
    fn only_what_is_not_usual_is_written_in_a_fixed_order() {
        let case = cases().remove(0);
        let text = scene_toml(&case.terrain, &case.look, case.pose, case.size).expect("a scene");
        let wanted = "\n\n[terrain]\nsource = \"procedural:mountains?seed=3&size=1025\"\n\n[camera]\n\
                      pose = [15000.0, 2000.0, 3500.0, 0.0, -15.0]\nsize = \"1280x720\"\n";
        assert!(text.ends_with(wanted), "{text}");
        let case = cases().remove(2);
        let text = scene_toml(&case.terrain, &case.look, case.pose, case.size).expect("a scene");
        let wanted = "[clipmap]\nn = 63\nlevels = 3\nmorph = true\n\n[look]\ncolor = \"levels\"\nwireframe = true\n\
                      bounds = true\n\n[camera]\n";
        assert!(text.contains(wanted), "{text}");
    }

    #[test]
    fn positions_in_a_folder_with_a_comma_are_refused() {
        let source = |paths: &[&str], base| {
            joined(&paths.iter().map(ToString::to_string).collect::<Vec<_>>(), base)
                .map_err(|e| e.to_string())
        };
        let three = ["/a/x.tif", "/a/y.tif", "/a/z.tif"];
        assert_eq!(source(&three, Some(Base::Sampled)), Ok("/a/x.tif,/a/y.tif,/a/z.tif".into()));
        assert_eq!(source(&["/a,b,c/x.tif"], None), Ok("/a,b,c/x.tif".into()));
        for bad in [&["/a,b/x.tif", "/a,b/y.tif", "/a,b/z.tif"][..], &["/a,b,c/x.tif"]] {
            assert!(source(bad, Some(Base::Sampled)).is_err_and(|e| e.contains("comma")), "{bad:?}");
        }
    }
}
