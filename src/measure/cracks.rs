//! Pixels of clear colour inside the terrain's silhouette.

use glam::DVec3;

use super::Mesh;

/// Pixels `[x, y]` of colour `clear` (RGB) that are not connected with the picture's border through other
/// such pixels. A crack shows so; but so may the sky in a slit between two ridges that is thinner than a
/// pixel: [`sees_below`] tells one from the other.
#[must_use]
pub fn enclosed_pixels(rgba: &[u8], size: [u32; 2], clear: [u8; 3]) -> Vec<[u32; 2]> {
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
    (0..size[1])
        .flat_map(|y| (0..size[0]).map(move |x| [x, y]))
        .filter(|p| {
            let ix = p[1] as usize * w + p[0] as usize;
            is_clear(ix) && !outside[ix]
        })
        .collect()
}

/// True when the ray from `eye_m` along `direction` passes below the surface of a mesh: a pixel there that
/// shows the background is a crack. A gap between triangles does not hide it, because the ray is under the
/// triangles behind the gap.
#[must_use]
pub fn sees_below(mesh: &Mesh, eye_m: DVec3, direction: DVec3) -> bool {
    mesh.triangles.iter().any(|t| {
        let [a, b, c] = t.map(|ix| DVec3::from_array(mesh.vertices[ix as usize]));
        // The part of the ray above the triangle's ground plan, clipped edge by edge.
        let (mut from, mut to) = (0.0_f64, f64::INFINITY);
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let inward = DVec3::new(p.y - q.y, q.x - p.x, 0.0);
            let (at, slope) = (inward.dot(eye_m - p), inward.dot(direction));
            if slope == 0.0 {
                if at < 0.0 {
                    return false;
                }
            } else if slope > 0.0 {
                from = from.max(-at / slope);
            } else {
                to = to.min(-at / slope);
            }
        }
        if from >= to || !to.is_finite() {
            return false;
        }
        let normal = (b - a).cross(c - a);
        // Height over the plane is linear along the ray; far rounding must not count.
        let above = |s: f64| normal.dot(eye_m + direction * s - a) / normal.z;
        let slack = 1e-5 * to;
        above(from) < -slack || above(to) < -slack
    })
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
        assert_eq!(enclosed_pixels(&rgba, [4, 4], [255, 0, 255]), [[1, 2]]);
    }

    #[test]
    fn a_ray_below_the_surface_is_told_from_one_that_passes_above() {
        let mesh = Mesh {
            vertices: vec![[0.0, 0.0, 10.0], [10.0, 0.0, 10.0], [0.0, 10.0, 10.0]],
            levels: vec![0; 3],
            triangles: vec![[0, 1, 2]],
        };
        let eye = DVec3::new(-5.0, 2.0, 12.0);
        assert!(!sees_below(&mesh, eye, DVec3::new(1.0, 0.0, -0.1)), "over it");
        assert!(sees_below(&mesh, eye, DVec3::new(1.0, 0.0, -0.6)), "under its near edge");
        assert!(!sees_below(&mesh, eye, DVec3::new(0.0, 1.0, -0.6)), "beside it");
    }
}
