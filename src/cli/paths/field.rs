//! A terrain by shares of its extent, and random numbers with a fixed seed: what named paths are made of.

use std::cell::RefCell;
use std::collections::HashMap;

use glam::DVec3;
use tessclip::Terrain;
use tessclip::clipmap::Rect;
use tessclip::pyramid::VOID;
use tessclip::surface::Base;

use super::Key;

/// A terrain by shares 0..1 of its extent, east and north.
pub(super) struct Field<'a> {
    terrain: &'a Terrain,
    low: [f64; 2],
    high: [f64; 2],
    /// Samples of blocks of [`BLOCK`] x [`BLOCK`] nodes: a path asks often close by.
    blocks: RefCell<HashMap<[i32; 2], Vec<f32>>>,
}

/// Side of the blocks in which samples are read, nodes.
const BLOCK: i32 = 256;
/// Most blocks kept: 16 MiB.
const MOST_BLOCKS: usize = 64;

impl<'a> Field<'a> {
    pub(super) fn new(terrain: &'a Terrain) -> Self {
        let [low, high] = terrain.extent_m();
        Self { terrain, low, high, blocks: RefCell::default() }
    }

    /// The point at these shares in the units of poses.
    pub(super) fn at(&self, share: [f64; 2]) -> [f64; 2] {
        match &self.terrain.curved {
            None => [0, 1].map(|a| self.low[a] + (self.high[a] - self.low[a]) * share[a]),
            Some(curved) => curved.native_at(share),
        }
    }

    /// Height of the ground under a point in the units of poses, metres; the finest sample, read where it
    /// is not there yet.
    pub(super) fn ground(&self, p: [f64; 2]) -> f64 {
        match &self.terrain.curved {
            None => self.plane_ground(p),
            Some(curved) => curved.native_ground_m(p),
        }
    }

    fn plane_ground(&self, p: [f64; 2]) -> f64 {
        let source = &self.terrain.source;
        let last = source.lattice().last;
        let at = self.terrain.samples_from_world(DVec3::new(p[0], p[1], 0.0));
        let node = [0, 1].map(|a| at[a].round().clamp(0.0, f64::from(last[a])) as i32);
        let block = node.map(|v| v / BLOCK);
        let lo = block.map(|v| v * BLOCK);
        let hi = [0, 1].map(|a| lo[a].saturating_add(BLOCK - 1).min(last[a]));
        let mut blocks = self.blocks.borrow_mut();
        if blocks.len() >= MOST_BLOCKS && !blocks.contains_key(&block) {
            blocks.clear();
        }
        let samples = blocks.entry(block).or_insert_with(|| {
            let mut out = Vec::new();
            source.read_now(0, Rect { lo, hi }, &mut out);
            out
        });
        let ix = (node[1] - lo[1]) * (hi[0] - lo[0] + 1) + node[0] - lo[0];
        match samples.get(ix as usize) {
            Some(h) if *h != VOID => f64::from(*h),
            // Nothing is drawn there: any height near the ground around will do.
            _ => self.terrain.ground_height_m(p[0], p[1]).map_or(0.0, f64::from),
        }
    }

    /// Metres that the whole extent would measure if it were everywhere as around these shares.
    pub(super) fn side_m(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let Some(curved) = &self.terrain.curved else {
            return [0, 1].map(|a| (self.high[a] - self.low[a]).max(1e-6));
        };
        let eye = |share: [f64; 2]| {
            let [x, y] = curved.native_at(share);
            curved.camera([x, y, 0.0, 0.0, 0.0], 60.0).eye_m
        };
        let half = 1e-3;
        let east = eye([u + half, v]).distance(eye([u - half, v]));
        let north = eye([u, v + half]).distance(eye([u, v - half]));
        [east, north].map(|d| (d / (2.0 * half)).max(1e-6))
    }

    /// Metres between the finest samples, east and north.
    pub(super) fn spacing_m(&self) -> [f64; 2] {
        self.terrain.spacing_m.map(|s| s.max(1e-6))
    }

    /// Height above the ground that keeps clear of single samples.
    pub(super) fn clear_m(&self) -> f64 {
        let [x, y] = self.spacing_m();
        8.0 * x.max(y)
    }

    /// Height above the ground of the usual views: over what stands out of it.
    pub(super) fn view_m(&self) -> f64 {
        let range = self.terrain.source.height_range().map_or(1.0, |r| f64::from(r[1] - r[0]));
        (0.25 * range).max(self.clear_m())
    }

    /// Greatest height that is still outside of the ground on the other side.
    pub(super) fn ceiling_m(&self) -> f64 {
        match self.terrain.base() {
            Base::Cylinder { radius_m, inside: true } => 0.9 * radius_m,
            _ => f64::INFINITY,
        }
    }

    pub(super) fn is_globe(&self) -> bool {
        self.terrain.curved.as_ref().is_some_and(|c| c.globe.is_some())
    }

    /// Turns every key towards the next one.
    pub(super) fn face_ahead(&self, keys: &mut [Key]) {
        for k in 0..keys.len() {
            let to = (k + 1).min(keys.len() - 1);
            let (a, b) = (keys[to.saturating_sub(1)], keys[to]);
            keys[k].yaw = match &self.terrain.curved {
                None => (b.x - a.x).atan2(b.y - a.y).to_degrees(),
                Some(curved) => {
                    let ahead = curved.camera(b.pose(), 60.0).eye_m - curved.camera(a.pose(), 60.0).eye_m;
                    let d = curved.camera(keys[k].pose(), 60.0).axes.transpose() * ahead;
                    d.x.atan2(d.y).to_degrees()
                }
            };
        }
    }
}

/// xorshift64: the same numbers every time.
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new() -> Self {
        Self(0x9e37_79b9_7f4a_7c15)
    }

    /// The next number, 0 <= x < 1.
    pub(super) fn share(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}
