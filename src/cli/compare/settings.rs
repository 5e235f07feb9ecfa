//! The details that methods fly with: the one asked for, and those of the sweep.

use serde_json::{Value, json};
use tessclip::Scene;
use tessclip::rivals::{Detail, Method};

use super::super::scene_file::SceneFile;

/// Detail of the methods, each by its own parameter.
#[derive(Clone, Debug, clap::Args)]
pub struct DetailArgs {
    /// Clipmaps: samples per side of a window; by default 255
    #[arg(long)]
    n: Option<u32>,
    /// Clipmaps: levels; by default the fewest that cover the data from everywhere
    #[arg(long)]
    levels: Option<u32>,
    /// Geomipmaps, chunks, ROAM and ours by error: screen-space error threshold in pixels
    #[arg(long, default_value_t = 1.0, value_name = "PX", value_parser = parse_pixels)]
    pixel_error: f64,
    /// Geomipmaps (17 x 17 vertices in the paper) and chunks: cells a side of a patch
    #[arg(long, default_value_t = 16, value_name = "CELLS", value_parser = parse_cells)]
    patch_cells: u32,
    /// Ours by error: samples per side of a window, 127, 255, 511 or 1023
    #[arg(long, default_value_t = 511, value_name = "N")]
    error_n: u32,
    /// Ours by error: most triangles, beside the threshold
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u32).range(1_000..=50_000_000))]
    budget: Option<u32>,
    /// Ours: blend levels into each other near their perimeter, as classic and footprint always do
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    morph: Option<bool>,
}

impl DetailArgs {
    /// These wishes, then what the scene file says, then the defaults.
    pub fn detail(&self, file: &SceneFile) -> Detail {
        Detail {
            n: self.n.or(file.n).unwrap_or(Detail::default().n),
            levels: self.levels.or(file.levels),
            pixel_error: self.pixel_error,
            patch_cells: self.patch_cells,
            error_n: self.error_n,
            budget: self.budget,
        }
    }

    /// What of them is the scene's.
    pub fn apply(&self, scene: Scene, file: &SceneFile) -> Scene {
        Scene {
            morph: self.morph.or(file.morph).unwrap_or(scene.morph),
            cull: file.cull.unwrap_or(scene.cull),
            drop_fine_levels: file.drop_fine_levels.unwrap_or(scene.drop_fine_levels),
            ..scene
        }
    }
}

fn parse_cells(text: &str) -> Result<u32, String> {
    match text.parse::<u32>() {
        Ok(v) if (8..=128).contains(&v) && v.is_power_of_two() => Ok(v),
        _ => Err("give 8, 16, 32, 64 or 128 cells".into()),
    }
}

fn parse_pixels(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if (0.01..=1_000.0).contains(&v) => Ok(v),
        _ => Err("give 0.01 to 1000 pixels".into()),
    }
}

/// A method at one detail.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    pub method: Method,
    pub detail: Detail,
    /// The detail asked for; else one of the sweep.
    pub usual: bool,
}

/// Which part of the detail a method has.
fn is_clipmap(method: Method) -> bool {
    matches!(
        method,
        Method::Classic | Method::Footprint | Method::Tessellated | Method::VertexStage | Method::AllPatches
    )
}

impl Setting {
    /// Clipmaps: samples per side of a window.
    pub fn window(&self) -> Option<u32> {
        match self.method {
            Method::ByError => Some(self.detail.error_n),
            method => is_clipmap(method).then_some(self.detail.n),
        }
    }

    /// The method's own parameters.
    pub fn params(&self) -> Value {
        let d = &self.detail;
        match self.method {
            Method::BruteForce => json!({}),
            Method::ByError => json!({
                "pixel_error": d.pixel_error, "n": d.error_n, "levels": d.levels, "budget": d.budget
            }),
            Method::Roam => json!({ "pixel_error": d.pixel_error }),
            Method::Geomipmap | Method::Chunked => {
                json!({ "pixel_error": d.pixel_error, "patch_cells": d.patch_cells })
            }
            _ => json!({ "n": d.n, "levels": d.levels }),
        }
    }

    /// The same in a few words.
    pub fn words(&self) -> String {
        let d = &self.detail;
        match self.method {
            Method::BruteForce => "every sample".into(),
            Method::ByError => match d.budget {
                Some(budget) => format!("{} px, {budget} triangles, n = {}", d.pixel_error, d.error_n),
                None => format!("{} px, n = {}", d.pixel_error, d.error_n),
            },
            Method::Roam => format!("{} px", d.pixel_error),
            Method::Geomipmap | Method::Chunked => format!("{} px, {} cells", d.pixel_error, d.patch_cells),
            _ => match d.levels {
                Some(levels) => format!("n = {}, {levels} levels", d.n),
                None => format!("n = {}", d.n),
            },
        }
    }
}

/// What is flown: each method at the detail asked for, then the rest of its sweep.
pub fn settings(methods: &[Method], detail: Detail, sweep: bool, quick: bool) -> Vec<Setting> {
    let mut all = Vec::new();
    for &method in methods {
        all.push(Setting { method, detail, usual: true });
        if !sweep {
            continue;
        }
        let more: Vec<Detail> = match method {
            Method::BruteForce => Vec::new(),
            _ if is_clipmap(method) => {
                let sizes: &[u32] = if quick { &[63, 127, 511] } else { &[31, 63, 127, 255, 511, 1023] };
                sizes.iter().map(|&n| Detail { n, ..detail }).collect()
            }
            _ => {
                let errors: &[f64] =
                    if quick { &[0.5, 2.0, 8.0] } else { &[0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0] };
                let errors = if quick && method == Method::ByError { &[0.5, 2.0, 4.0, 8.0] } else { errors };
                let patches: &[u32] =
                    if quick || matches!(method, Method::Roam | Method::ByError) { &[] } else { &[32, 64] };
                let by_error = errors.iter().map(|&pixel_error| Detail { pixel_error, ..detail });
                let by_patch = patches.iter().map(|&patch_cells| Detail { patch_cells, ..detail });
                by_error.chain(by_patch).collect()
            }
        };
        let others = more.into_iter().filter(|d| *d != detail);
        all.extend(others.map(|detail| Setting { method, detail, usual: false }));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sweep_holds_each_setting_once_and_the_one_asked_for_first() {
        let detail = Detail::default();
        let all = settings(&Method::ALL, detail, true, false);
        for (k, a) in all.iter().enumerate() {
            assert!(all[..k].iter().all(|b| b.method != a.method || b.detail != a.detail));
            assert_eq!(a.usual, a.detail == detail);
        }
        assert_eq!(settings(&Method::ALL, detail, false, false).len(), Method::ALL.len());
    }
}
