//! All colours of the panels, and those of the shaders that the legends repeat.

use egui::Color32;
use egui::ecolor::{gamma_u8_from_linear_f32, linear_f32_from_gamma_u8};

/// Lies under all text.
pub const FILL: Color32 = Color32::from_rgb(12, 14, 18);
/// Text.
pub const TEXT: Color32 = Color32::from_gray(242);
/// Text of less weight.
pub const WEAK: Color32 = Color32::from_gray(214);
/// Messages and what could not be understood.
pub const NOTE: Color32 = Color32::from_rgb(240, 228, 66);
/// Frames within the first mark, within the second, and longer: told apart with any kind of colour vision.
pub const FRAMES: [Color32; 3] =
    [Color32::from_rgb(86, 180, 233), Color32::from_rgb(230, 159, 0), Color32::from_rgb(213, 94, 0)];
/// The marks themselves.
pub const MARK: Color32 = Color32::from_rgba_premultiplied(150, 150, 150, 150);

/// `palette` of shaders/shared/shading.wgsl, linear.
const PALETTE: [[f32; 3]; 8] = [
    [0.791, 0.347, 0.000],
    [0.093, 0.456, 0.815],
    [0.000, 0.342, 0.171],
    [0.871, 0.776, 0.054],
    [0.000, 0.168, 0.445],
    [0.665, 0.112, 0.000],
    [0.604, 0.191, 0.386],
    [0.40, 0.40, 0.40],
];
/// Knots of `ramp` there, linear.
const RAMP: [[f32; 3]; 5] = [
    [0.058, 0.000, 0.089],
    [0.035, 0.095, 0.255],
    [0.014, 0.278, 0.263],
    [0.110, 0.578, 0.130],
    [0.982, 0.799, 0.018],
];
/// What `surface_color` of draw_terrain.wgsl shows where nothing was refilled, linear.
const KEPT: [f32; 3] = [0.12, 0.12, 0.12];
/// Brightness of blocks of even levels beside those of odd ones (draw_terrain.wgsl: 0.35 and 0.7).
const EVEN_LEVELS: f32 = 0.5;

/// Colour of a level. Sun and sky together bring the shader's factor of 0.6 back to about 1.
pub fn level(level: u32) -> Color32 {
    shown(PALETTE[level as usize % PALETTE.len()], 1.0)
}

/// Colour of a block kind (0 M, 1 R, 2 L, 3 fill) on even and on odd levels.
pub fn block(kind: usize) -> [Color32; 2] {
    [EVEN_LEVELS, 1.0].map(|factor| shown(PALETTE[kind % PALETTE.len()], factor))
}

/// Colour of what the frame refilled, and of the rest.
pub fn refilled() -> [Color32; 2] {
    [PALETTE[0], KEPT].map(|color| shown(color, 1.0))
}

/// The dark to light ramp, `t` from 0 to 1.
pub fn ramp(t: f32) -> Color32 {
    let x = t.clamp(0.0, 1.0) * (RAMP.len() - 1) as f32;
    let knot = (x as usize).min(RAMP.len() - 2);
    let part = x - knot as f32;
    shown([0, 1, 2].map(|c| RAMP[knot][c] + (RAMP[knot + 1][c] - RAMP[knot][c]) * part), 1.0)
}

/// Black or white, whichever stands out more on an opaque colour.
pub fn ink_on(back: Color32) -> Color32 {
    let back = luminance([back.r(), back.g(), back.b()].map(linear_f32_from_gamma_u8));
    if contrast(back, 0.0) > contrast(1.0, back) { Color32::BLACK } else { Color32::WHITE }
}

fn shown(linear: [f32; 3], factor: f32) -> Color32 {
    let [r, g, b] = linear.map(|v| gamma_u8_from_linear_f32(v * factor));
    Color32::from_rgb(r, g, b)
}

/// Relative luminance of a linear colour (WCAG 2).
fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Contrast ratio of two luminances (WCAG 2), from 1 to 21.
fn contrast(a: f32, b: f32) -> f32 {
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

#[cfg(test)]
mod tests {
    use egui::ecolor::linear_from_gamma;

    use super::*;

    fn channels(color: Color32) -> [u8; 3] {
        [color.r(), color.g(), color.b()]
    }

    /// The fill over a grey backdrop, linear: blended as targets with an sRGB format do, and as others do.
    fn behind(backdrop: f32) -> [[f32; 3]; 2] {
        let through = (1.0 - f32::from(FILL.a()) / 255.0) * backdrop;
        let linear = channels(FILL).map(|c| linear_f32_from_gamma_u8(c) + through);
        let gamma = channels(FILL).map(|c| linear_from_gamma(f32::from(c) / 255.0 + through));
        [linear, gamma]
    }

    #[test]
    fn text_is_legible_over_snow_and_over_night() {
        for text in [TEXT, WEAK, NOTE] {
            let text = luminance(channels(text).map(linear_f32_from_gamma_u8));
            for backdrop in [0.0, 1.0] {
                for back in behind(backdrop) {
                    let ratio = contrast(text, luminance(back));
                    assert!(ratio >= 4.5, "contrast {ratio} over {back:?}");
                }
            }
        }
    }

    #[test]
    fn numbers_in_squares_are_legible() {
        for ix in 0..8 {
            let back = luminance(channels(level(ix)).map(linear_f32_from_gamma_u8));
            let ink = luminance(channels(ink_on(level(ix))).map(linear_f32_from_gamma_u8));
            assert!(contrast(ink, back) >= 4.5, "level {ix}");
        }
    }

    /// Triples of a function of the shader.
    fn triples(function: &str) -> Vec<[f32; 3]> {
        let shader = include_str!("../../../shaders/shared/shading.wgsl");
        let body = shader.split(function).nth(1).unwrap().split("\n}").next().unwrap();
        let triple = |text: &str| -> Vec<f32> {
            text.split(')').next().unwrap().split(',').map(|v| v.trim().parse().unwrap()).collect()
        };
        body.split("vec3<f32>(").skip(1).map(|text| triple(text).try_into().unwrap()).collect()
    }

    #[test]
    fn legends_have_the_colours_of_the_shader() {
        assert_eq!(triples("fn palette("), PALETTE);
        assert_eq!(triples("fn ramp("), RAMP);
    }

    #[test]
    fn the_ramp_passes_through_its_knots() {
        for (ix, knot) in RAMP.iter().enumerate() {
            assert_eq!(ramp(ix as f32 / 4.0), shown(*knot, 1.0));
        }
        assert_eq!(ramp(7.0), ramp(1.0));
    }
}
