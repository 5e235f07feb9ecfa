//! Heights of the triangles drawn, at every base sample under them.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use glam::DVec3;
use rayon::prelude::*;

use crate::rivals::{DrawnMesh, Ground};
use crate::scene::Terrain;

/// How far from a lattice node, in base samples, a vertex is still taken for standing on it. Products in f32
/// of 2^13 samples and a spacing are off by 0.001 of them.
const NODE_SLACK: f64 = 0.02;
/// Twice the area, in base cells, that a sample may lie outside of an edge whose ends are no nodes: rounding
/// must leave none uncovered between two triangles. Between nodes all is exact and the slack is 0.
const EDGE_SLACK: f64 = 1e-6;

/// Heights of the triangles drawn, at every base sample under them.
///
/// Kept as the difference to the truth, in f32: what that rounds is in proportion to the error, so an exact
/// mesh scores exactly 0.
#[derive(Clone, Debug)]
pub struct DrawnHeights {
    differences_m: Vec<f32>,
}

impl DrawnHeights {
    /// Looks at every base sample in every closed triangle.
    ///
    /// Vertices within 0.02 samples of a lattice node stand on it; over such nodes a triangle has exactly its
    /// vertices' heights. Triangles without area in the ground plan and those with a vertex that is not
    /// finite or does not exist are left out. Where triangles differ, the one farthest from the truth counts,
    /// and the higher of two that are equally far: the result does not depend on the order of triangles.
    #[must_use]
    pub fn of(terrain: &Terrain, ground: &Ground, mesh: &DrawnMesh) -> Self {
        let nothing = f32::NAN.to_bits();
        let slots = ground.heights.iter().map(|_| AtomicU32::new(nothing)).collect();
        let raster = Raster { terrain, ground, mesh, slots };
        mesh.triangles.par_iter().for_each(|t| raster.draw(*t));
        let differences_m = raster.slots.into_iter().map(|s| f32::from_bits(s.into_inner())).collect();
        Self { differences_m }
    }

    /// Drawn minus true height at sample `ix` of [`Ground::heights`], metres; `None` where nothing was drawn.
    #[must_use]
    pub fn at(&self, ix: usize) -> Option<f64> {
        self.differences_m.get(ix).filter(|d| !d.is_nan()).map(|d| f64::from(*d))
    }

    /// Drawn minus true height at all samples in the order of [`Ground::heights`], metres; NaN where nothing
    /// was drawn.
    #[must_use]
    pub fn differences_m(&self) -> &[f32] {
        &self.differences_m
    }
}

struct Raster<'a> {
    terrain: &'a Terrain,
    ground: &'a Ground,
    mesh: &'a DrawnMesh,
    /// Bits of the differences. Threads share them: the larger magnitude wins in whatever order they come.
    slots: Vec<AtomicU32>,
}

impl Raster<'_> {
    fn draw(&self, triangle: [u32; 3]) {
        let [Some(a), Some(mut b), Some(mut c)] = triangle.map(|vertex| self.corner(vertex)) else {
            return;
        };
        let mut area2 = cross(a, b, c);
        if area2 < 0.0 {
            (b, c, area2) = (c, b, -area2);
        }
        let on_nodes = [a, b, c].iter().all(|p| p.x.fract() == 0.0 && p.y.fract() == 0.0);
        let slack = if on_nodes { 0.0 } else { EDGE_SLACK };
        if area2 <= slack {
            return;
        }
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let last = self.ground.last().map(f64::from);
        if on_nodes && high.x - low.x <= 1.0 && high.y - low.y <= 1.0 {
            // Half a base cell, as most triangles are: its corners are all there is.
            for p in [a, b, c] {
                if (0.0..=last[0]).contains(&p.x) && (0.0..=last[1]).contains(&p.y) {
                    self.offer([p.x as usize, p.y as usize], p.z);
                }
            }
            return;
        }
        // Empty when it lies outside the data: casts of what is out of range end at the type's ends.
        let span =
            |low: f64, high: f64, last: f64| low.ceil().max(0.0) as i32..=high.floor().min(last) as i32;
        for y in span(low.y, high.y, last[1]) {
            for x in span(low.x, high.x, last[0]) {
                let p = DVec3::new(x.into(), y.into(), 0.0);
                let [at_a, at_b, at_c] = [cross(p, b, c), cross(p, c, a), cross(p, a, b)];
                if at_a < -slack || at_b < -slack || at_c < -slack {
                    continue;
                }
                // At a corner quotients would round; what is drawn there is the vertex itself.
                let height_m = if at_a == area2 {
                    a.z
                } else if at_b == area2 {
                    b.z
                } else if at_c == area2 {
                    c.z
                } else {
                    a.z + (at_b * (b.z - a.z) + at_c * (c.z - a.z)) / area2
                };
                self.offer([x as usize, y as usize], height_m);
            }
        }
    }

    /// A vertex on the lattice of base samples, with its height in metres; `None` when it is none.
    fn corner(&self, vertex: u32) -> Option<DVec3> {
        let position = self.mesh.positions.get(vertex as usize)?;
        let world_m = DVec3::from_array(self.mesh.anchor_m) + DVec3::from_array(position.map(f64::from));
        let [x, y] = self.terrain.samples_from_world(world_m).map(|v| {
            let node = v.round();
            if (v - node).abs() <= NODE_SLACK { node } else { v }
        });
        let corner = DVec3::new(x, y, world_m.z);
        corner.is_finite().then_some(corner)
    }

    fn offer(&self, sample: [usize; 2], height_m: f64) {
        let ix = sample[1] * self.ground.size[0] as usize + sample[0];
        let new = (height_m - f64::from(self.ground.heights[ix])) as f32;
        let slot = &self.slots[ix];
        let mut old = slot.load(Relaxed);
        while wins(new, f32::from_bits(old)) {
            match slot.compare_exchange_weak(old, new.to_bits(), Relaxed, Relaxed) {
                Ok(_) => break,
                Err(now) => old = now,
            }
        }
    }
}

/// A total order, so that the winner is the same in whatever order the candidates come.
fn wins(new: f32, old: f32) -> bool {
    let (far_new, far_old) = (new.abs(), old.abs());
    // Of equal magnitudes the positive one has the smaller bits.
    old.is_nan() || far_new > far_old || (far_new == far_old && new.to_bits() < old.to_bits())
}

/// Twice the area of a triangle in the ground plan, positive when it turns counter-clockwise; exact between
/// nodes.
fn cross(p: DVec3, q: DVec3, r: DVec3) -> f64 {
    (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x)
}
