//! Worlds to be precise in: planes and curved surfaces, near the world's origin and far from it.

use glam::DVec3;

use super::StabilityError;
use crate::camera::Camera;
use crate::clipmap::{Node, Rect};
use crate::heights::{Degrees, HeightGrid, Planet, Procedural, ProceduralKind};
use crate::measure::oracle::true_position;
use crate::pyramid::{Prefilter, VOID};
use crate::scene::{Curved, Terrain};
use crate::surface::{Base, Ellipsoid};

/// A terrain, and what to call it in a row.
pub(super) struct World {
    pub(super) name: String,
    pub(super) terrain: Terrain,
    /// Metres over a node from which it must be precise to a hundredth of a pixel: where cells are
    /// kilometres, the integers of a node step by more than the eye at its foot could tell.
    pub(super) least_m: f64,
    /// Window size to try it with.
    pub(super) n: u32,
}

/// Distances from the world's origin that planes are tried at, metres.
pub(super) const OFFSETS_M: [f64; 4] = [0.0, 1e5, 6.4e6, 1e9];

/// Mountains of `size` x `size` samples, 30 m apart.
pub(super) fn mountains(size: usize) -> Result<HeightGrid, StabilityError> {
    let recipe = Procedural { width: size, height: size, ..Procedural::new(ProceduralKind::Mountains) };
    Ok(recipe.to_grid()?)
}

/// The grid as it is on a plane whose first sample lies `offset_m` east and north of the origin.
pub(super) fn plane_at(grid: &HeightGrid, offset_m: f64) -> Terrain {
    let mut terrain = Terrain::new(grid, Prefilter::Subsample);
    terrain.origin_m = [offset_m; 2];
    terrain
}

/// The same plane by way of the curved shaders.
pub(super) fn flat_at(grid: &HeightGrid, offset_m: f64) -> Terrain {
    let mut grid = grid.clone();
    grid.origin_m = [0.0; 2];
    Terrain::from_curved(Curved::flat(&grid, DVec3::new(offset_m, offset_m, 0.0)), grid.spacing_m)
}

/// The grid in degrees, one second of arc apart, in the Alps.
pub(super) fn in_degrees(grid: &HeightGrid) -> HeightGrid {
    let mut grid = grid.clone();
    let step = 1.0 / 3600.0;
    let [west, south] = [7.613, 45.897];
    let metres_per_degree = [77_500.0, 111_150.0];
    grid.georeference.degrees = Some(Degrees { west, south, step: [step; 2], metres_per_degree });
    grid.spacing_m = metres_per_degree.map(|m| m * step);
    grid.origin_m = [west * metres_per_degree[0], south * metres_per_degree[1]];
    grid
}

/// All worlds; `brief` leaves one of each kind.
pub(super) fn worlds(brief: bool) -> Result<Vec<World>, StabilityError> {
    let mut grid = mountains(if brief { 129 } else { 257 })?;
    // Metres that no f32 holds exactly, as data in degrees have them.
    grid.spacing_m = [21.527_777_8, 30.875_123_4];
    let least_m = 1.0;
    let mut out = Vec::new();
    for (k, offset) in OFFSETS_M.into_iter().enumerate() {
        if brief && k != 3 {
            continue;
        }
        let terrain = plane_at(&grid, offset);
        out.push(World { name: format!("plane {offset:e} m off"), terrain, least_m, n: 63 });
        if !brief {
            let terrain = flat_at(&grid, offset);
            out.push(World { name: format!("curved plane {offset:e} m off"), terrain, least_m, n: 63 });
        }
    }
    let sphere = Base::Ellipsoid { a_m: 6.4e6, b_m: 6.4e6 };
    let wgs84 = Base::Ellipsoid { a_m: Ellipsoid::WGS84.a, b_m: Ellipsoid::WGS84.b };
    if !brief {
        let terrain = Terrain::on(&grid, sphere, Prefilter::Subsample)?;
        out.push(World { name: "sphere of 6.4e6 m".into(), terrain, least_m, n: 63 });
    }
    let terrain = Terrain::on(&in_degrees(&grid), wgs84, Prefilter::Subsample)?;
    out.push(World { name: "WGS84, regional".into(), terrain, least_m, n: 63 });
    if !brief {
        let planet = Planet { size: 513, ..Planet::default() }.to_grid()?;
        let terrain = Terrain::globe(vec![planet], Ellipsoid::WGS84)?;
        out.push(World { name: "WGS84, whole planet".into(), terrain, least_m: 20.0, n: 63 });
        // Blocks of base surface grow with n and with the cells: these bend as far as any.
        let coarse = Planet { size: 65, ..Planet::default() }.to_grid()?;
        let terrain = Terrain::globe(vec![coarse], Ellipsoid::WGS84)?;
        out.push(World { name: "WGS84, coarse planet, n = 255".into(), terrain, least_m: 100.0, n: 255 });
        let terrain = Terrain::on(
            &mountains(129)?,
            Base::Cylinder { radius_m: 9e3, inside: false },
            Prefilter::Subsample,
        )?;
        out.push(World { name: "cylinder of 9 km, n = 255".into(), terrain, least_m, n: 255 });
        // Kilometres between samples, as global relief has them.
        grid.spacing_m = [8_276.311_7, 9_276.733_3];
        let terrain = plane_at(&grid, 1e5);
        out.push(World { name: "plane, samples 9 km apart".into(), terrain, least_m, n: 63 });
        let terrain = Terrain::on(&grid, sphere, Prefilter::Subsample)?;
        out.push(World { name: "sphere, samples 9 km apart".into(), terrain, least_m: 10.0, n: 63 });
    }
    Ok(out)
}

/// Cameras in a terrain: one metre (or `least_m`) over and beside the highest node and over one in the middle, further
/// up beside nodes, near a corner of the data and high above. `count` of them at most.
pub(super) fn cameras(terrain: &Terrain, least_m: f64, count: usize) -> Vec<Camera> {
    let spacing = terrain.spacing_m[0].max(terrain.spacing_m[1]);
    // Share of the data, metres up, cells beside the node, pitch.
    let places = [
        (0.52, least_m, 0.0, -80.0),
        (0.31, 1.7, 0.37, -12.0),
        (0.07, 250.0, 0.2, -20.0),
        (0.61, spacing * 10.0, 0.45, -35.0),
        (0.44, spacing * 200.0, 0.0, -70.0),
    ];
    let stand = |(k, (share, up, beside, pitch)): (usize, (f64, f64, f64, f64))| {
        let yaw = 40.0 + 70.0 * k as f64;
        camera_over(terrain, share, up, beside, [yaw, pitch])
    };
    // From the side, so that heights show as well as places.
    let beside = least_m / spacing;
    let top = highest(terrain).and_then(|base| camera_at(terrain, base, least_m, beside, [270.0, -45.0]));
    top.into_iter().chain(places.into_iter().enumerate().filter_map(stand)).take(count).collect()
}

/// The highest base node of the first chart.
fn highest(terrain: &Terrain) -> Option<[i32; 2]> {
    let source = &terrain.source;
    let last = source.lattice().last;
    let mut best: Option<(f32, [i32; 2])> = None;
    let mut row = Vec::new();
    for y in 0..=last[1] {
        row.clear();
        source.read(0, Rect { lo: [0, y], hi: [last[0], y] }, &mut row);
        for (x, h) in (0..).zip(&row).filter(|(_, h)| **h != VOID) {
            if best.is_none_or(|(most, _)| *h > most) {
                best = Some((*h, [x, y]));
            }
        }
    }
    best.map(|(_, base)| base)
}

/// A camera `up` metres over the node at a share of the first chart, moved by `beside` cells.
pub(super) fn camera_over(
    terrain: &Terrain,
    share: f64,
    up: f64,
    beside: f64,
    turn: [f64; 2],
) -> Option<Camera> {
    #[expect(clippy::cast_possible_truncation, reason = "a share of an i32")]
    let base = terrain.graph().charts.first()?.lattice.last.map(|v| (f64::from(v) * share) as i32);
    camera_at(terrain, base, up, beside, turn)
}

/// As [`camera_over`], by the node.
fn camera_at(
    terrain: &Terrain,
    base: [i32; 2],
    up: f64,
    beside: f64,
    [yaw_deg, pitch_deg]: [f64; 2],
) -> Option<Camera> {
    let lattice = terrain.graph().charts.first()?.lattice;
    let position = |base: [i32; 2]| {
        (0..64).find_map(|k| {
            // The next one that is not void.
            let base = [(base[0] + k).min(lattice.last[0]), base[1]];
            true_position(terrain, Node { chart: 0, base }, 0)
        })
    };
    let at = position(base)?;
    let next = position([base[0] + 1, base[1]]).unwrap_or(at);
    let axes = match &terrain.curved {
        None => glam::DMat3::IDENTITY,
        Some(curved) => {
            let (_, normal) = curved.surface.base(0, base.map(f64::from));
            let north = (DVec3::Z - normal * normal.z).try_normalize().unwrap_or(DVec3::Y);
            glam::DMat3::from_cols(north.cross(normal), north, normal)
        }
    };
    // Along the level, whatever the next node's height.
    let along = next - at;
    let along = along - axes.z_axis * along.dot(axes.z_axis);
    let eye_m = at + along * beside + axes.z_axis * up;
    Some(Camera { eye_m, yaw_deg, pitch_deg, axes, ..Camera::default() })
}
