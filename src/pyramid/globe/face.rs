//! One face of the globe as a source of samples, computed when they are asked for.

use std::sync::Arc;

use rayon::prelude::*;

use super::Globe;
use crate::clipmap::{Lattice, Rect};
use crate::pyramid::SampleSource;
use crate::surface::cube::Face;

/// Reads of more samples than this are shared out to all cores; smaller ones take under two
/// milliseconds, which waking the others would only add to.
const PARALLEL: u64 = 16 * 1024;

/// A globe seen through one chart of the cube sphere.
///
/// Node `i, j` of level `l` lies at chart coordinates `2 i 2^l / size - 1` and the same of `j`, each from
/// -1 to 1 on the face. The same function of place is sampled at every level and by every face.
#[derive(Clone, Debug)]
pub struct GlobeFace {
    /// The heights, shared by all faces.
    pub globe: Arc<Globe>,
    /// The chart.
    pub face: Face,
    /// Cells along a side at level 0, a power of two up to 2^21.
    pub size: u32,
}

impl GlobeFace {
    /// Height at a node, metres or [`super::super::VOID`].
    fn node(&self, level: u32, i: i32, j: i32) -> f32 {
        let size = f64::from(self.size);
        // Exact: powers of two, and far fewer bits than an f64 has.
        let s = [i, j].map(|k| 2.0 * ((i64::from(k) << level) as f64) / size - 1.0);
        self.globe.height(self.face.direction(s))
    }
}

impl SampleSource for GlobeFace {
    fn lattice(&self) -> Lattice {
        Lattice { last: [i32::try_from(self.size).unwrap_or(i32::MAX); 2] }
    }

    /// Those of the whole globe: a face may well be free of them when this is true.
    fn has_voids(&self) -> bool {
        self.globe.has_voids()
    }

    /// Indices may go from -1 to one past the last: nodes beyond the border continue the face's lattice,
    /// as far as its chart goes (levels with at least four cells a side).
    fn read(&self, level: u32, rect: Rect, out: &mut Vec<f32>) {
        if rect.is_empty() {
            return;
        }
        let columns = rect.lo[0]..=rect.hi[0];
        if rect.count() <= PARALLEL {
            for j in rect.lo[1]..=rect.hi[1] {
                out.extend(columns.clone().map(|i| self.node(level, i, j)));
            }
            return;
        }
        let width = rect.hi[0].abs_diff(rect.lo[0]) as usize + 1;
        let start = out.len();
        out.resize(start + width * (rect.hi[1].abs_diff(rect.lo[1]) as usize + 1), 0.0);
        out[start..].par_chunks_mut(width).enumerate().for_each(|(row_index, row)| {
            // Fewer rows than an i32 counts.
            let j = rect.lo[1] + row_index as i32;
            for (h, i) in row.iter_mut().zip(columns.clone()) {
                *h = self.node(level, i, j);
            }
        });
    }

    /// That of the whole globe's grids, which bounds the face's.
    fn height_range(&self) -> Option<[f32; 2]> {
        self.globe.height_range()
    }

    fn step_m(&self) -> Option<f32> {
        self.globe.step_m()
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{grid, smooth};
    use super::{Arc, Face, Globe, GlobeFace, Rect, SampleSource};
    use crate::heights::Planet;

    /// Nodes of the face's border by direction, exact bits, with their heights at `level`.
    fn border(source: &GlobeFace, level: u32) -> Vec<([u64; 3], u32)> {
        let last = (source.size >> level) as i32;
        let mut out = Vec::new();
        for k in 0..=last {
            for index in [[k, 0], [k, last], [0, k], [last, k]] {
                let s = index.map(|i| 2.0 * f64::from(i << level) / f64::from(source.size) - 1.0);
                let bits = source.face.direction(s).to_array().map(f64::to_bits);
                out.push((bits, source.sample(level, index).to_bits()));
            }
        }
        out.sort_unstable();
        out.dedup();
        out
    }

    #[test]
    fn faces_agree_on_their_borders_to_the_bit() {
        let planet = Planet { size: 65, ..Planet::default() }.to_grid().unwrap();
        let tile = grid([30.0, 20.0], 0.7, [40, 40], smooth);
        let globe = Arc::new(Globe::new(vec![planet, tile], 8.0).unwrap());
        assert_eq!(globe.step_m(), None);
        for level in 0..=6 {
            let mut all = Vec::new();
            for face in Face::ALL {
                all.extend(border(&GlobeFace { globe: Arc::clone(&globe), face, size: 64 }, level));
            }
            all.sort_unstable();
            // Each node of an edge comes from two faces, each corner from three, and always as one.
            let (mut twice, mut thrice) = (0, 0);
            for same in all.chunk_by(|a, b| a.0 == b.0) {
                assert!(same.iter().all(|n| n == &same[0]));
                match same.len() {
                    2 => twice += 1,
                    3 => thrice += 1,
                    n => panic!("{n} faces at a node of level {level}"),
                }
            }
            assert_eq!((twice, thrice), (12 * ((64 >> level) - 1), 8));
        }
    }

    #[test]
    fn reads_are_the_same_in_parallel_and_across_levels() {
        let planet = Planet { size: 33, ..Planet::default() }.to_grid().unwrap();
        let globe = Arc::new(Globe::new(vec![planet], 8.0).unwrap());
        assert_eq!(globe.step_m(), Some(0.5));
        let source = GlobeFace { globe, face: Face::ALL[4], size: 128 };
        let whole = Rect { lo: [-1, -1], hi: [129, 129] };
        let mut all = vec![7.0];
        source.read(0, whole, &mut all);
        assert_eq!(all.len(), 1 + 131 * 131);
        for j in -1..=129 {
            for i in -1..=129 {
                let h = all[1 + (j + 1) as usize * 131 + (i + 1) as usize];
                assert_eq!(h, source.sample(0, [i, j]));
                if i % 4 == 0 && j % 4 == 0 {
                    assert_eq!(h, source.sample(2, [i / 4, j / 4]));
                }
            }
        }
        source.read(0, Rect { lo: [0, 0], hi: [-1, 5] }, &mut all);
        assert_eq!(all.len(), 1 + 131 * 131);
    }
}
