//! Which patches are drawn, and how fine (Brodersen 2005, section 5, figure 5).

use glam::Vec3;

use super::grid::beside;
use super::tables::{BLOCK_PATCHES, Bounds, Tables};
use crate::rivals::stage::Stand;

/// A level not asked for yet this frame.
const UNKNOWN: u8 = u8::MAX;

/// A patch to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Chosen {
    /// Patches from the south-west.
    pub at: [u32; 2],
    /// Its level.
    pub level: u32,
    /// How many levels each neighbour is finer: south, north, west, east.
    pub extra: [u32; 4],
}

/// This frame's choice.
pub(super) struct Selection {
    /// Of patches in view and of their neighbours.
    levels: Vec<u8>,
    seen: Vec<[u32; 2]>,
    /// What is drawn.
    pub chosen: Vec<Chosen>,
}

impl Selection {
    /// Nothing chosen yet.
    pub fn new(tables: &Tables) -> Self {
        let count = tables.patches[0] as usize * tables.patches[1] as usize;
        Self { levels: vec![UNKNOWN; count], seen: Vec::new(), chosen: Vec::new() }
    }

    /// Chooses for a camera; with `cull` off all patches are in view.
    pub fn choose(&mut self, tables: &Tables, stand: &Stand, pixel_error: f64, cull: bool) {
        self.see(tables, stand, cull);
        self.levels.fill(UNKNOWN);
        self.chosen.clear();
        let levels = &mut self.levels;
        // A neighbour out of view has its level as well: what is drawn does not depend on what is culled.
        let mut level_of = |at: [u32; 2]| {
            let known = &mut levels[tables.number(at)];
            if *known == UNKNOWN {
                *known = tables.level(at, stand, pixel_error) as u8;
            }
            u32::from(*known)
        };
        for at in &self.seen {
            let level = level_of(*at);
            let extra = [0, 1, 2, 3].map(|side| {
                beside(*at, side, tables.patches).map_or(0, |next| level.saturating_sub(level_of(next)))
            });
            self.chosen.push(Chosen { at: *at, level, extra });
        }
    }

    /// Finds the patches in view: map blocks first, and patches only of those that are partly in view.
    fn see(&mut self, tables: &Tables, stand: &Stand, cull: bool) {
        self.seen.clear();
        for y in 0..tables.blocks[1] {
            for x in 0..tables.blocks[0] {
                let bounds = tables.block_bounds([x, y]);
                if cull && !stand.sees(bounds.0, bounds.1, bounds.2) {
                    continue;
                }
                let all = !cull || is_within(stand, bounds);
                let range = |a: usize, block: u32| {
                    let first = block * BLOCK_PATCHES;
                    first..(first + BLOCK_PATCHES).min(tables.patches[a])
                };
                for at in range(1, y).flat_map(|y| range(0, x).map(move |x| [x, y])) {
                    let (lo, hi, heights) = tables.bounds(at);
                    if all || stand.sees(lo, hi, heights) {
                        self.seen.push(at);
                    }
                }
            }
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        let lists = size_of_val(&self.seen[..]) + size_of_val(&self.chosen[..]);
        (self.levels.len() + lists) as u64
    }
}

/// True when a box is wholly in view: then nothing in it need be tested (Assarsson and Moller 2000).
fn is_within(stand: &Stand, (lo, hi, range_m): Bounds) -> bool {
    let at = |p: [i32; 2], h: f32| {
        let place = |a: usize| (f64::from(p[a] - stand.plane.anchor[a]) * stand.spacing_m[a]) as f32;
        Vec3::new(place(0), place(1), h - stand.plane.anchor_height_m)
    };
    let (low, high) = (at(lo, range_m[0]), at(hi, range_m[1]));
    stand.frustum.planes.iter().all(|p| {
        let n = Vec3::new(p[0], p[1], p[2]);
        let near = Vec3::select(n.cmpge(Vec3::ZERO), low, high);
        n.dot(near) + p[3] >= 0.0
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::patterns::pattern;
    use super::*;
    use crate::rivals::geomipmap::check;

    #[test]
    fn patches_chosen_conform_and_tile_the_data() {
        for (w, h) in [(331, 262), (2, 2), (2, 500), (65, 65), (40, 33)] {
            // Rough in the north-east: neighbours differ by several levels there.
            let rough = check::rough(w, h);
            let ground = check::ground(w, h, |x, y| {
                let share = if 3 * x > w && 3 * y > h { 1.0 } else { 1e-3 };
                share * rough.height([x as i32, y as i32])
            });
            let tables = Tables::of(&ground, 8);
            let mut selection = Selection::new(&tables);
            let mut most = 0;
            for (x, pixel_error) in [(0.0, 1.0), (150.0, 30.0), (100.0, 2.0), (1e4, 0.3)] {
                selection.choose(&tables, &check::stand(DVec3::new(x, 90.0, 60.0)), pixel_error, false);
                let mut triangles = Vec::new();
                for c in &selection.chosen {
                    let numbers = pattern(8, c.level, c.extra);
                    triangles.extend(check::triangles(&numbers, 8, tables.low(c.at), 1, ground.last()));
                    most = c.extra.into_iter().fold(most, u32::max);
                }
                check::assert_conforming(&triangles, ground.last());
            }
            assert!(w < 300 || most == 2, "no neighbours differed by two levels");
        }
    }

    #[test]
    fn the_levels_of_what_is_in_view_do_not_depend_on_the_rest() {
        let ground = check::rough(331, 262);
        let tables = Tables::of(&ground, 8);
        let eye = DVec3::new(100.0, 100.0, 120.0);
        let choose = |stand: &Stand, cull: bool| {
            let mut selection = Selection::new(&tables);
            selection.choose(&tables, stand, 40.0, cull);
            selection.chosen
        };
        let all = choose(&check::stand(eye), false);
        let east = choose(&check::stand_seeing_east_of(eye, 150.0), true);
        assert!(east.len() > 100 && east.len() < all.len());
        assert!(east.iter().all(|c| all.contains(c)));
        assert!(all.iter().all(|c| east.contains(c) || tables.low(c.at)[0] + 8 < 150));
    }
}
