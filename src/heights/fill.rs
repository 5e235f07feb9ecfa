//! Filling voids by push-pull: average the valid samples into ever coarser levels, then bring
//! the coarse values back down into the holes.
//!
//! Every filled height is a convex combination of valid ones, so the range never grows.

/// Relaxation sweeps after each level; they take away the bilinear creases of the coarse level.
const SWEEPS: usize = 4;

struct Level {
    width: usize,
    height: usize,
    heights: Vec<f32>,
    valid: Vec<bool>,
}

/// Replaces the void samples of a `width` x `height` grid; valid ones stay bit for bit.
///
/// Without any valid sample all become 0. Slices of the wrong length are left alone.
pub(crate) fn fill_voids(heights: &mut [f32], valid: &[bool], width: usize, height: usize) {
    if heights.len() != valid.len() || heights.len() != width.saturating_mul(height) {
        return;
    }
    if !valid.iter().any(|&v| v) {
        heights.fill(0.0);
        return;
    }
    let mut levels = vec![Level { width, height, heights: heights.to_vec(), valid: valid.to_vec() }];
    while let Some(top) = levels.last()
        && top.valid.iter().any(|&v| !v)
        && top.width.max(top.height) > 1
    {
        levels.push(push(top));
    }
    let Some(mut coarse) = levels.pop() else {
        return;
    };
    while let Some(mut fine) = levels.pop() {
        pull(&mut fine, &coarse);
        coarse = fine;
    }
    heights.copy_from_slice(&coarse.heights);
}

/// The next coarser level: the mean of the valid samples of every 2 x 2 block.
fn push(fine: &Level) -> Level {
    let (width, height) = (fine.width.div_ceil(2), fine.height.div_ceil(2));
    let mut coarse =
        Level { width, height, heights: vec![0.0; width * height], valid: vec![false; width * height] };
    for row in 0..height {
        for col in 0..width {
            let (mut sum, mut count) = (0.0_f64, 0_u32);
            for r in 2 * row..(2 * row + 2).min(fine.height) {
                for c in 2 * col..(2 * col + 2).min(fine.width) {
                    let i = r * fine.width + c;
                    if fine.valid[i] {
                        sum += f64::from(fine.heights[i]);
                        count += 1;
                    }
                }
            }
            if count > 0 {
                coarse.heights[row * width + col] = (sum / f64::from(count)) as f32;
                coarse.valid[row * width + col] = true;
            }
        }
    }
    coarse
}

/// Fills the voids of `fine` from the complete level above it, then relaxes them.
fn pull(fine: &mut Level, coarse: &Level) {
    let voids: Vec<usize> = (0..fine.valid.len()).filter(|&i| !fine.valid[i]).collect();
    for &i in &voids {
        let (row, col) = (i / fine.width, i % fine.width);
        fine.heights[i] = bilinear(coarse, row, col);
    }
    for _ in 0..SWEEPS {
        for &i in &voids {
            let (row, col) = (i / fine.width, i % fine.width);
            let (mut sum, mut count) = (0.0_f64, 0_u32);
            let mut add = |j: usize| {
                sum += f64::from(fine.heights[j]);
                count += 1;
            };
            if row > 0 {
                add(i - fine.width);
            }
            if row + 1 < fine.height {
                add(i + fine.width);
            }
            if col > 0 {
                add(i - 1);
            }
            if col + 1 < fine.width {
                add(i + 1);
            }
            if count > 0 {
                fine.heights[i] = (sum / f64::from(count)) as f32;
            }
        }
    }
}

/// The coarse level at a fine sample: fine centres lie a quarter of a coarse cell off centre.
fn bilinear(coarse: &Level, row: usize, col: usize) -> f32 {
    let axis = |i: usize, len: usize| {
        let near = (i / 2).min(len - 1);
        let far = if i.is_multiple_of(2) { near.saturating_sub(1) } else { (near + 1).min(len - 1) };
        (near, far)
    };
    let (rn, rf) = axis(row, coarse.height);
    let (cn, cf) = axis(col, coarse.width);
    let at = |r: usize, c: usize| f64::from(coarse.heights[r * coarse.width + c]);
    let near = 0.75 * at(rn, cn) + 0.25 * at(rn, cf);
    let far = 0.75 * at(rf, cn) + 0.25 * at(rf, cf);
    (0.75 * near + 0.25 * far) as f32
}

#[cfg(test)]
mod tests {
    use super::fill_voids;

    #[test]
    fn a_ramp_is_filled_between_its_ends() {
        let mut heights: Vec<f32> = (0..81).map(|i| (i % 9) as f32).collect();
        let mut valid = vec![true; 81];
        for row in 2..7 {
            for col in 2..7 {
                heights[row * 9 + col] = 0.0;
                valid[row * 9 + col] = false;
            }
        }
        fill_voids(&mut heights, &valid, 9, 9);
        for row in 2..7 {
            for col in 2..7 {
                let h = heights[row * 9 + col];
                assert!((h - col as f32).abs() < 1.2, "{row} {col} {h}");
            }
        }
    }

    #[test]
    fn nothing_valid_gives_zero() {
        let mut heights = vec![5.0; 6];
        fill_voids(&mut heights, &[false; 6], 3, 2);
        assert_eq!(heights, [0.0; 6]);
    }
}
