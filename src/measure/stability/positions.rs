//! Positions and normals of drawn vertices, and what absolute f32 positions would have cost.

use glam::DVec3;

use super::worlds::{World, cameras, in_degrees, worlds};
use super::{MOST_DEG, MOST_M, MOST_PX, SIZE_PX, Shot, StabilityError, renderer_for, shoot};
use crate::gpu::Gpu;
use crate::heights::HeightGrid;
use crate::measure::invariants::{CheckRow, Effort};
use crate::measure::oracle::{degrees_between, named_vertices, packed_normal, true_normal, true_position};
use crate::measure::percentile;
use crate::pyramid::Prefilter;
use crate::scene::{Scene, Terrain};
use crate::surface::{Base, Ellipsoid};

/// Figures of the vertices of one world.
#[derive(Clone, Debug)]
pub struct PositionRows {
    world: String,
    /// Metres off within a kilometre of the camera.
    pub near: CheckRow,
    /// Pixels off on screen.
    pub screen: CheckRow,
    /// Degrees the normals are off.
    pub degrees: Vec<f64>,
    /// Worst pixels off had positions been absolute f32.
    pub absolute_px: f64,
}

impl PositionRows {
    /// Rows of a world of this name, without figures yet.
    #[must_use]
    pub fn new(world: impl Into<String>) -> Self {
        let world = world.into();
        Self {
            near: CheckRow::new(format!("position within 1 km: {world}"), "m", MOST_M),
            screen: CheckRow::new(format!("position on screen: {world}"), "px", MOST_PX),
            degrees: Vec::new(),
            absolute_px: 0.0,
            world,
        }
    }

    /// The rows, with the normals' percentile and the comparison.
    #[must_use]
    pub fn finish(mut self) -> Vec<CheckRow> {
        self.degrees.sort_by(f64::total_cmp);
        let mut normals = CheckRow::new(format!("normals, p99: {}", self.world), "degrees", MOST_DEG);
        normals.add(percentile(&self.degrees, 0.99).unwrap_or(0.0));
        normals.tried = self.degrees.len() as u64;
        // The price is the same: 16 bytes a vertex and one matrix in both.
        let mut versus = CheckRow::new(
            format!("no worse than absolute f32 (bound): {}", self.world),
            "px",
            self.absolute_px,
        );
        versus.add(self.screen.worst);
        versus.tried = self.screen.tried;
        let mut rows = vec![self.near, self.screen, normals, versus];
        // Nothing tried is nothing shown; close by there may be no node of coarse data.
        for row in rows.iter_mut().skip(1).filter(|r| r.tried == 0) {
            row.failed = 1;
            row.pass = false;
        }
        rows
    }
}

/// Holds every vertex of a frame against what it should be.
pub fn judge_vertices(rows: &mut PositionRows, shot: &Shot, terrain: &Terrain) {
    let anchor = DVec3::from_array(shot.mesh.anchor_m);
    for named in named_vertices(&shot.mesh, &shot.windows) {
        let vertex = shot.mesh.vertices[named.vertex];
        let (void, truth) = (vertex.packed == u32::MAX, true_position(terrain, named.node, named.level));
        let Some(truth) = truth.filter(|_| !void) else {
            // Both or neither must take it for void.
            if void != truth.is_none() {
                rows.near.add(f64::NAN);
            }
            continue;
        };
        let drawn = anchor + DVec3::from_array(vertex.position.map(f64::from));
        // A vertex that strays from afar into the camera's surroundings counts as well.
        let distance = shot.lens.distance(truth).min(shot.lens.distance(drawn));
        if distance.is_nan() || distance <= 1e3 {
            rows.near.add(drawn.distance(truth));
        }
        if let Some(px) = shot.lens.exact(truth).filter(|px| shot.lens.shows(*px)) {
            rows.screen.add(shot.lens.drawn(vertex.position).distance(px));
            // Where nothing is left of it at all, it may be anywhere in the picture.
            let absolute = shot.lens.drawn_absolute(truth).distance(px);
            let most = f64::from(SIZE_PX[0]).hypot(f64::from(SIZE_PX[1]));
            rows.absolute_px = rows.absolute_px.max(if absolute < most { absolute } else { most });
        }
        if let Some(normal) = true_normal(terrain, &shot.windows, named.node, named.level) {
            let packed = packed_normal(vertex.packed, terrain.curved.is_some());
            rows.degrees.push(degrees_between(packed, normal));
        }
    }
}

fn check_world(gpu: &Gpu, world: &World, brief: bool) -> Result<Vec<CheckRow>, StabilityError> {
    let mut rows = PositionRows::new(world.name.as_str());
    let mut renderer = renderer_for(gpu, &world.terrain, &Scene { n: world.n, ..Scene::default() })?;
    for camera in cameras(&world.terrain, world.least_m, if brief { 2 } else { 6 }) {
        let shot = shoot(gpu, &mut renderer, &camera)?;
        judge_vertices(&mut rows, &shot, &world.terrain);
    }
    Ok(rows.finish())
}

/// All worlds, then the terrain asked for, on a plane and on a globe.
pub(super) fn check_positions(
    gpu: &Gpu,
    grid: &HeightGrid,
    effort: Effort,
) -> Result<Vec<CheckRow>, StabilityError> {
    let brief = effort == Effort::Brief;
    let mut all = worlds(brief)?;
    let least_m = 1.0;
    let terrain = Terrain::new(grid, Prefilter::Subsample);
    all.push(World { name: "this terrain on a plane".into(), terrain, least_m, n: 63 });
    if !brief {
        // In degrees where it lies; else a second of arc apart in the Alps, whatever its size in metres.
        let placed = if grid.georeference.degrees.is_some() { grid.clone() } else { in_degrees(grid) };
        let wgs84 = Base::Ellipsoid { a_m: Ellipsoid::WGS84.a, b_m: Ellipsoid::WGS84.b };
        let terrain = Terrain::on(&placed, wgs84, Prefilter::Subsample)?;
        all.push(World { name: "this terrain on WGS84".into(), terrain, least_m, n: 63 });
    }
    let mut rows = Vec::new();
    for world in &all {
        rows.extend(check_world(gpu, world, brief)?);
    }
    Ok(rows)
}
