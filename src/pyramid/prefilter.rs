//! How a coarser level is made from the next finer one.

use rayon::prelude::*;

use super::VOID;

/// Prefilter of coarser levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Prefilter {
    /// Every second sample, as the papers do it.
    #[default]
    Subsample,
    /// Binomial 1-2-1 low-pass on both axes around every second sample, over valid samples only.
    LowPass,
}

impl std::fmt::Display for Prefilter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Subsample => "subsample",
            Self::LowPass => "low-pass",
        })
    }
}

/// Makes the next coarser level; sizes in samples, `coarse = ceil((fine - 1) / 2) + 1`.
///
/// A coarse sample is void exactly where the fine sample under it is, with either prefilter.
pub(super) fn halve(fine: &[f32], size: [usize; 2], how: Prefilter) -> (Vec<f32>, [usize; 2]) {
    let coarse = size.map(|s| (s - 1).div_ceil(2) + 1);
    let mut out = vec![0.0; coarse[0] * coarse[1]];
    out.par_chunks_mut(coarse[0]).enumerate().for_each(|(j, row)| {
        let y = (2 * j).min(size[1] - 1);
        for (i, value) in row.iter_mut().enumerate() {
            let x = (2 * i).min(size[0] - 1);
            let centre = fine[y * size[0] + x];
            *value = match how {
                Prefilter::Subsample => centre,
                Prefilter::LowPass if centre == VOID => VOID,
                Prefilter::LowPass => low_pass(fine, size, [x, y]),
            };
        }
    });
    (out, coarse)
}

pub(super) fn low_pass(fine: &[f32], size: [usize; 2], [x, y]: [usize; 2]) -> f32 {
    let (mut sum, mut weights) = (0.0_f64, 0.0_f64);
    for dy in -1_isize..=1 {
        for dx in -1_isize..=1 {
            let (Some(nx), Some(ny)) = (x.checked_add_signed(dx), y.checked_add_signed(dy)) else {
                continue;
            };
            if nx >= size[0] || ny >= size[1] || fine[ny * size[0] + nx] == VOID {
                continue;
            }
            let weight = f64::from(2 - dx.unsigned_abs() as u32) * f64::from(2 - dy.unsigned_abs() as u32);
            sum += weight * f64::from(fine[ny * size[0] + nx]);
            weights += weight;
        }
    }
    #[expect(clippy::cast_possible_truncation, reason = "an average of f32 values fits f32")]
    let value = (sum / weights) as f32;
    value
}
