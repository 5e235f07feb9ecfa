//! The command line that draws what is looked at.

use tessclip::{ColorMode, Scene};

use super::args::{Color, FOV_DEG, TerrainArgs, name_of, nearest_digits, pose_words};
use super::factor_args::{FactorWishes, usual_n};
use super::png_pose::shell_line;
use crate::viewer::look::Look;

/// A line for a POSIX shell that draws the picture of a look and a pose. `terrain` is the terrain itself, not the
/// scene file that named it. Only what differs from the defaults is written, beside size, pose and output.
///
/// A background that never was six digits gets the nearest ones. Of the refill colouring the line draws a first
/// frame, which refills everything: what another frame refills depends on the one before.
pub fn render_line(
    terrain: &TerrainArgs,
    look: &Look,
    pose: [f64; 5],
    size: [u32; 2],
    output: &str,
) -> String {
    let mut words = vec!["tessclip".to_string(), "render".to_string(), no_option(&terrain.terrain)];
    words.extend(terrain.options());
    words.extend(look_options(look));
    words.push(format!("--size={}x{}", size[0], size[1]));
    words.push(format!("--camera={}", pose_words(pose)));
    words.extend(["-o".to_string(), no_option(output)]);
    shell_line(words.into_iter())
}

/// The name of a colouring on the command line and in scene files.
pub fn color_name(mode: ColorMode) -> String {
    let all = <Color as clap::ValueEnum>::value_variants();
    all.iter().find(|color| ColorMode::from(**color) == mode).map_or_else(String::new, name_of)
}

/// A path that nothing takes for an option.
fn no_option(path: &str) -> String {
    if path.starts_with('-') { format!("./{path}") } else { path.to_string() }
}

fn look_options(look: &Look) -> Vec<String> {
    let (scene, usual) = (&look.scene, Scene::default());
    let FactorWishes { kind, pixel_error, budget } = FactorWishes::asking_for(scene.factors);
    let set = |name: &str, value: Option<String>| value.map(|value| format!("--{name}={value}"));
    let on = |name: &str, is_on: bool| is_on.then(|| format!("--{name}"));
    let [azimuth, altitude] = scene.sun_deg;
    let all = [
        set("exaggeration", (look.exaggeration != 1.0).then(|| look.exaggeration.to_string())),
        set("n", (scene.n != usual_n(scene.factors)).then(|| scene.n.to_string())),
        set("levels", scene.levels.map(|levels| levels.to_string())),
        on("morph", scene.morph),
        on("no-cull", !scene.cull),
        on("keep-fine-levels", !scene.drop_fine_levels),
        set("factors", kind.as_ref().map(name_of)),
        set("pixel-error", pixel_error.map(|pixels| pixels.to_string())),
        set("budget", budget.map(|triangles| triangles.to_string())),
        set("color", (scene.color != usual.color).then(|| color_name(scene.color))),
        on("wireframe", scene.wireframe),
        on("bounds", scene.bounds),
        on("no-fog", !scene.fog),
        set("sun", (scene.sun_deg != usual.sun_deg).then(|| format!("{azimuth},{altitude}"))),
        set("background", (scene.background != usual.background).then(|| nearest_digits(scene.background))),
        set("fov", (look.fov_deg != FOV_DEG).then(|| look.fov_deg.to_string())),
        set("freeze", look.frozen.map(pose_words)),
        set("beside", look.beside.map(|method| method.name().to_string())),
    ];
    all.into_iter().flatten().collect()
}

#[cfg(test)]
pub(super) mod tests {
    use clap::Parser as _;
    use tessclip::Factors;
    use tessclip::rivals::Method;

    use super::super::render;
    use super::*;

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        args: render::Args,
    }

    /// What `render` makes of these arguments.
    pub fn asked(args: &[&str]) -> render::Asked {
        let line =
            Line::try_parse_from([&["render"], args].concat()).unwrap_or_else(|e| panic!("{args:?}: {e}"));
        line.args.asked().unwrap_or_else(|e| panic!("{args:?}: {e:#}"))
    }

    /// A picture to be said again.
    pub struct Case {
        pub terrain: TerrainArgs,
        pub look: Look,
        pub pose: [f64; 5],
        pub size: [u32; 2],
    }

    fn case(args: &[&str], scene: Scene, pose: [f64; 5]) -> Case {
        let said = asked(&[args, &["-o", "x.png"]].concat());
        let look = Look {
            scene,
            exaggeration: said.terrain.factor(),
            fov_deg: said.fov_deg,
            frozen: said.frozen,
            beside: said.beside,
        };
        Case { terrain: said.terrain, look, pose, size: said.size }
    }

    /// Pictures of all kinds.
    pub fn cases() -> Vec<Case> {
        let usual = Scene::default;
        let by_error = |pixel_error, budget| Factors::ByError { pixel_error, budget };
        let background =
            asked(&["procedural:plain", "--background", "05070c", "-o", "x.png"]).scene.background;
        let home = [15_000.0, 2_000.0, 3_500.0, 0.0, -15.0];
        let plain = ["procedural:mountains?seed=3&size=1025"];
        let names = ["it's \"my\" $HOME `dem`.tif", "--spacing=30", "--z-scale=0.1", "--z-offset=-3.5"];
        let names = [&names[..], &["--nodata", "fill", "--prefilter", "low-pass"]].concat();
        let degrees = ["N46E008.hgt", "--over", "a b.tif", "--over=-c.tif", "--base", "wgs84"];
        let store = ["odd t.zarr", "--cache-mb=64", "--loaders=2", "--upload-mb=16", "--base=plane"];
        let off = Scene { cull: false, fog: false, drop_fine_levels: false, ..usual() };
        let marks = Scene { n: 63, levels: Some(3), wireframe: true, bounds: true, morph: true, ..usual() };
        let frozen =
            ["procedural:dunes", "--freeze=-1.5,-2e-7,3,350,-10", "--exaggeration", "2.5", "--fov=45.25"];
        vec![
            case(&plain, usual(), home),
            case(&["procedural:plain", "--size", "1x16384"], off, [0.1, 1.0 / 3.0, -1e15, 1e-7, -89.999_999]),
            case(&plain, Scene { color: ColorMode::Levels, ..marks }, home),
            case(&plain, Scene { n: 511, factors: by_error(Some(1.0), None), ..usual() }, home),
            case(&plain, Scene { n: 255, factors: by_error(Some(0.1), Some(123_456)), ..usual() }, home),
            case(&plain, Scene { n: 127, factors: by_error(None, Some(50_000_000)), ..usual() }, home),
            case(&plain, Scene { sun_deg: [0.1 + 0.2, -12.5], background, ..usual() }, home),
            case(&frozen, Scene { color: ColorMode::Error, ..usual() }, [-1.0, -2.0, -3.0, -4.0, -5.0]),
            case(&["procedural:plain", "--beside", "geomipmap"], Scene { n: 31, ..usual() }, home),
            case(&degrees, usual(), [8.123_456_789_012, 46.2, 4500.0, 359.0, -12.0]),
            case(&["x y.tif,y's.tif,z.tif", "--base=sampled"], Scene { n: 127, ..usual() }, home),
            case(&names, Scene { color: ColorMode::Refill, ..usual() }, home),
            case(&store, Scene { color: ColorMode::Slope, ..usual() }, home),
            case(&["procedural:planet", "--base=sphere:1737400.5", "--exaggeration=-20"], usual(), home),
        ]
    }

    /// The same picture to the last bit; Debug writes every bit of a number.
    pub fn assert_same(case: &Case, said: &render::Asked, words: &str) {
        let look = &case.look;
        assert_eq!(format!("{:?}", said.scene), format!("{:?}", look.scene), "{words}");
        assert_eq!(said.pose.map(|p| p.map(f64::to_bits)), Some(case.pose.map(f64::to_bits)), "{words}");
        assert_eq!(format!("{:?}", said.frozen), format!("{:?}", look.frozen), "{words}");
        assert_eq!((said.size, said.beside), (case.size, look.beside), "{words}");
        let numbers = [said.fov_deg, said.terrain.factor()].map(f64::to_bits);
        assert_eq!(numbers, [look.fov_deg, look.exaggeration].map(f64::to_bits), "{words}");
    }

    /// Splits as a POSIX shell does, as far as quotes go.
    fn split(line: &str) -> Vec<String> {
        let (mut words, mut word, mut rest) = (Vec::new(), None::<String>, line.chars());
        while let Some(c) = rest.next() {
            match c {
                ' ' => words.extend(word.take()),
                '\'' => word.get_or_insert_default().extend(rest.by_ref().take_while(|c| *c != '\'')),
                '\\' => word.get_or_insert_default().extend(rest.next()),
                c => word.get_or_insert_default().push(c),
            }
        }
        words.extend(word);
        words
    }

    #[test]
    fn a_line_draws_the_same_picture() {
        for case in cases() {
            let line = render_line(&case.terrain, &case.look, case.pose, case.size, "my picture.png");
            let words = split(&line);
            assert_eq!(words[..2], ["tessclip", "render"], "{line}");
            assert_eq!(words[words.len() - 2..], ["-o", "my picture.png"], "{line}");
            let args: Vec<&str> = words[2..].iter().map(String::as_str).collect();
            let said = asked(&args);
            assert_same(&case, &said, &line);
            assert_eq!(said.terrain.terrain, case.terrain.terrain, "{line}");
            assert_eq!(said.terrain.options(), case.terrain.options(), "{line}");
        }
    }

    #[test]
    fn defaults_are_left_out_and_what_is_set_is_said() {
        let cases = cases();
        let line = |k: usize| {
            let case: &Case = &cases[k];
            render_line(&case.terrain, &case.look, case.pose, case.size, "-a.png")
        };
        assert_eq!(
            line(0),
            "tessclip render 'procedural:mountains?seed=3&size=1025' --size=1280x720 \
             --camera=15000,2000,3500,0,-15 -o ./-a.png"
        );
        let said = "--n=63 --levels=3 --morph --color=levels --wireframe --bounds";
        assert!(line(2).contains(&format!("size=1025' {said} --size")), "{}", line(2));
        assert!(line(3).contains("' --factors=error --size"), "{}", line(3));
        assert!(line(4).contains("' --n=255 --pixel-error=0.1 --budget=123456 --size"), "{}", line(4));
        assert!(line(6).contains("--sun=0.30000000000000004,-12.5 --background=05070c"), "{}", line(6));
        assert!(line(9).contains("--base=wgs84 --over='a b.tif' --over=-c.tif"), "{}", line(9));
        let mut terrain = cases[0].terrain.clone();
        terrain.terrain = "-odd.tif".into();
        let odd = render_line(&terrain, &cases[0].look, cases[0].pose, cases[0].size, "a.png");
        assert!(odd.starts_with("tessclip render ./-odd.tif --size"), "{odd}");
    }

    #[test]
    fn every_method_and_colouring_has_its_word() {
        for method in Method::ALL {
            let look = Look { beside: Some(method), ..cases().remove(0).look };
            assert!(look_options(&look).contains(&format!("--beside={}", method.name())));
        }
        let names =
            [ColorMode::Shaded, ColorMode::Blocks, ColorMode::Elevation, ColorMode::Error].map(color_name);
        assert_eq!(names, ["shaded", "blocks", "elevation", "error"]);
    }
}
