//! Pixels of clear colour inside the terrain's silhouette.

/// Counts pixels of colour `clear` (RGB) that are not connected with the picture's border through
/// other such pixels. A height field has no holes in its outline, so each of them is a crack.
#[must_use]
pub fn crack_pixels(rgba: &[u8], size: [u32; 2], clear: [u8; 3]) -> u64 {
    let [w, h] = size.map(|v| v as usize);
    let is_clear = |ix: usize| rgba[ix * 4..ix * 4 + 3] == clear;
    let mut outside = vec![false; w * h];
    let mut queue = Vec::new();
    let mut enter = |ix: usize, queue: &mut Vec<usize>| {
        if is_clear(ix) && !outside[ix] {
            outside[ix] = true;
            queue.push(ix);
        }
    };
    for x in 0..w {
        enter(x, &mut queue);
        enter((h - 1) * w + x, &mut queue);
    }
    for y in 0..h {
        enter(y * w, &mut queue);
        enter(y * w + w - 1, &mut queue);
    }
    while let Some(ix) = queue.pop() {
        let (x, y) = (ix % w, ix / w);
        if x > 0 {
            enter(ix - 1, &mut queue);
        }
        if x + 1 < w {
            enter(ix + 1, &mut queue);
        }
        if y > 0 {
            enter(ix - w, &mut queue);
        }
        if y + 1 < h {
            enter(ix + w, &mut queue);
        }
    }
    (0..w * h).filter(|&ix| is_clear(ix) && !outside[ix]).count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_inside_counts_and_the_sky_does_not() {
        // 4 x 4: sky in the first row, one hole at (1, 2).
        let mut rgba = vec![0_u8; 64];
        for ix in [0, 1, 2, 3, 9] {
            rgba[ix * 4..ix * 4 + 3].copy_from_slice(&[255, 0, 255]);
        }
        assert_eq!(crack_pixels(&rgba, [4, 4], [255, 0, 255]), 1);
    }
}
