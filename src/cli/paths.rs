//! Camera paths: named ones over a terrain, and CSV files `t,x,y,z,yaw,pitch` with header.

use std::sync::Arc;

use anyhow::{Context as _, bail};
use glam::{DMat3, DQuat, DVec3};
use serde::Deserialize;
use tessclip::scene::Curved;
use tessclip::{Camera, Terrain};

/// A timed camera path, sampled linearly; on a globe along great circles.
pub struct CameraPath {
    /// As given.
    pub name: String,
    /// In the terrain's own units; on a plane in world metres.
    keys: Vec<Key>,
    curved: Option<Arc<Curved>>,
    /// On a globe: the cameras at the keys, see [`carried`].
    carried: Vec<Camera>,
}

#[derive(Clone, Copy, Deserialize)]
struct Key {
    t: f64,
    x: f64,
    y: f64,
    z: f64,
    yaw: f64,
    pitch: f64,
}

impl Key {
    fn pose(self) -> [f64; 5] {
        [self.x, self.y, self.z, self.yaw, self.pitch]
    }
}

/// Names of the built-in paths.
pub const NAMES: [&str; 3] = ["straight", "double-turn", "circle"];

impl CameraPath {
    /// A named path, or a CSV file.
    pub fn open(spec: &str, terrain: &Terrain) -> anyhow::Result<Self> {
        let keys = if NAMES.contains(&spec) { named(spec, terrain) } else { read_csv(spec, terrain)? };
        let curved = terrain.curved.clone();
        let carried = match &curved {
            Some(c) if c.globe.is_some() => carried(c, &keys),
            _ => Vec::new(),
        };
        Ok(Self { name: spec.into(), keys, curved, carried })
    }

    /// Seconds it lasts.
    pub fn seconds(&self) -> f64 {
        self.keys.last().map_or(0.0, |k| k.t) - self.keys[0].t
    }

    /// Distance it covers in metres: over the ground on a plane, of the eye elsewhere.
    pub fn length_m(&self) -> f64 {
        let Some(curved) = &self.curved else {
            return self.keys.windows(2).map(|k| (k[1].x - k[0].x).hypot(k[1].y - k[0].y)).sum();
        };
        if let [.., _] = &self.carried[..] {
            // Along the great circles, not through the globe.
            let steps = 16 * self.keys.len();
            let eyes: Vec<DVec3> =
                (0..=steps).map(|k| self.at(k as f64 / steps as f64, 60.0).1.eye_m).collect();
            return eyes.windows(2).map(|e| e[0].distance(e[1])).sum();
        }
        let eyes: Vec<DVec3> = self.keys.iter().map(|k| curved.camera(k.pose(), 60.0).eye_m).collect();
        eyes.windows(2).map(|e| e[0].distance(e[1])).sum()
    }

    /// The camera at a share 0..1 of the path, and its path time.
    pub fn at(&self, share: f64, fov_deg: f64) -> (f64, Camera) {
        let t = self.keys[0].t + share * self.seconds();
        let after = self.keys.partition_point(|k| k.t <= t).clamp(1, self.keys.len() - 1);
        let (a, b) = (self.keys[after - 1], self.keys[after]);
        let s = ((t - a.t) / (b.t - a.t)).clamp(0.0, 1.0);
        let mix = |u: f64, v: f64| u + (v - u) * s;
        // The short way round between two headings.
        let short_way = |from: f64, to: f64| (to - from + 180.0).rem_euclid(360.0) - 180.0;
        if let [.., _] = &self.carried[..]
            && let Some(curved) = &self.curved
        {
            let (from, to) = (self.carried[after - 1], self.carried[after]);
            return (t, between(curved, &from, &to, s, fov_deg));
        }
        let turn = short_way(a.yaw, b.yaw);
        let pose = [mix(a.x, b.x), mix(a.y, b.y), mix(a.z, b.z), a.yaw + turn * s, mix(a.pitch, b.pitch)];
        if let Some(curved) = &self.curved {
            return (t, curved.camera(pose, fov_deg));
        }
        let camera = Camera {
            eye_m: DVec3::new(mix(a.x, b.x), mix(a.y, b.y), mix(a.z, b.z)),
            yaw_deg: a.yaw + turn * s,
            pitch_deg: mix(a.pitch, b.pitch),
            fov_deg,
            ..Camera::default()
        };
        (t, camera)
    }
}

/// Cameras at the keys of a path over a globe. Yaw is measured in axes that are carried along the path
/// without turning about the vertical, so that neither the view nor the light jumps where north does: at a
/// pole.
fn carried(curved: &Curved, keys: &[Key]) -> Vec<Camera> {
    let mut out: Vec<Camera> = Vec::with_capacity(keys.len());
    for key in keys {
        let mut camera = curved.camera(key.pose(), 60.0);
        if let Some(before) = out.last() {
            let forward = camera.forward();
            camera.axes = turned(before, camera.axes.z_axis);
            let d = camera.axes.transpose() * forward;
            camera.yaw_deg = d.x.atan2(d.y).to_degrees();
        }
        out.push(camera);
    }
    out
}

/// The axes of `from` after the smallest turn that brings its vertical to `up`.
fn turned(from: &Camera, up: DVec3) -> DMat3 {
    DMat3::from_quat(DQuat::from_rotation_arc(from.axes.z_axis, up)) * from.axes
}

/// The camera a share `s` of the way, on the great circle between both.
fn between(curved: &Curved, from: &Camera, to: &Camera, s: f64, fov_deg: f64) -> Camera {
    let (a, b) = (from.axes.z_axis, to.axes.z_axis);
    let arc = DQuat::from_rotation_arc(a, b);
    let up = (DQuat::IDENTITY.slerp(arc, s) * a).normalize();
    let height = |c: &Camera| curved.surface.foot(c.eye_m).height_m;
    let above = height(from) + (height(to) - height(from)) * s;
    let turn = (to.yaw_deg - from.yaw_deg + 180.0).rem_euclid(360.0) - 180.0;
    Camera {
        eye_m: curved.over(up, above),
        yaw_deg: from.yaw_deg + turn * s,
        pitch_deg: from.pitch_deg + (to.pitch_deg - from.pitch_deg) * s,
        fov_deg,
        axes: turned(from, up),
    }
}

/// Paths over the middle of the terrain, a fixed height above the ground below; over a globe the straight
/// one leads over the north pole.
fn named(name: &str, terrain: &Terrain) -> Vec<Key> {
    let [low, high] = terrain.extent_m();
    let at = |u: f64, v: f64| match &terrain.curved {
        None => [low[0] + (high[0] - low[0]) * u, low[1] + (high[1] - low[1]) * v],
        Some(curved) => curved.native_at([u, v]),
    };
    let globe = terrain.curved.as_ref().is_some_and(|c| c.globe.is_some());
    let steps = 120;
    let points: Vec<[f64; 2]> = (0..=steps)
        .map(|k| {
            let s = f64::from(k) / f64::from(steps);
            match name {
                // From 60 degrees north over the pole to 60 degrees on the other side.
                "straight" if globe && s < 0.5 => [10.0, 60.0 + 60.0 * s],
                "straight" if globe => [-170.0, 120.0 - 60.0 * s],
                "straight" => at(0.5, 0.1 + 0.8 * s),
                "circle" => {
                    let angle = s * std::f64::consts::TAU;
                    at(0.5 + 0.3 * angle.sin(), 0.5 + 0.3 * angle.cos())
                }
                // Three legs with two sharp turns between them (Song et al. 2016, Fig. 7).
                _ if s < 0.4 => at(0.15 + 1.75 * s, 0.2),
                _ if s < 0.6 => at(0.85, 0.2 + 3.0 * (s - 0.4)),
                _ => at(0.85 - 1.75 * (s - 0.6), 0.8),
            }
        })
        .collect();
    let range = terrain.source.height_range().map_or(1.0, |r| f64::from(r[1] - r[0]));
    let spacing = terrain.spacing_m[0].max(terrain.spacing_m[1]);
    let above = (0.25 * range).max(8.0 * spacing);
    let ground = |p: [f64; 2]| match &terrain.curved {
        None => terrain.ground_height_m(p[0], p[1]).map_or(0.0, f64::from),
        Some(curved) => curved.native_ground_m(p),
    };
    let mut keys: Vec<Key> = (0..points.len())
        .map(|k| {
            let p = points[k];
            let next = points[(k + 1).min(points.len() - 1)];
            let from = points[(k + 1).min(points.len() - 1) - 1];
            // Smoothed over the neighbours, so that the flight does not jump with each peak.
            let near = &points[k.saturating_sub(6)..(k + 7).min(points.len())];
            // Headings as the ground runs; on curved surfaces they are set below.
            let z = near.iter().map(|q| ground(*q)).sum::<f64>() / near.len() as f64;
            Key {
                t: k as f64 * 0.5,
                x: p[0],
                y: p[1],
                z: z.max(ground(p)) + above,
                yaw: (next[0] - from[0]).atan2(next[1] - from[1]).to_degrees(),
                pitch: -12.0,
            }
        })
        .collect();
    if let Some(curved) = &terrain.curved {
        for k in 0..keys.len() {
            let to = (k + 1).min(keys.len() - 1);
            let ahead =
                curved.camera(keys[to].pose(), 60.0).eye_m - curved.camera(keys[to - 1].pose(), 60.0).eye_m;
            let here = curved.camera(keys[k].pose(), 60.0);
            let d = here.axes.transpose() * ahead;
            keys[k].yaw = d.x.atan2(d.y).to_degrees();
        }
    }
    keys
}

fn read_csv(file: &str, terrain: &Terrain) -> anyhow::Result<Vec<Key>> {
    let mut builder = csv::ReaderBuilder::new();
    builder.trim(csv::Trim::All).comment(Some(b'#'));
    let mut reader = builder.from_path(file).with_context(|| {
        format!("{file}: neither a path file that can be read nor one of {}", NAMES.join(", "))
    })?;
    let mut keys: Vec<Key> = Vec::new();
    let headers = reader.headers().with_context(|| format!("{file}: line 1"))?.clone();
    for record in reader.records() {
        let record = record.with_context(|| file.to_string())?;
        let line = record.position().map_or(0, csv::Position::line);
        let Ok(mut key) = record.deserialize::<Key>(Some(&headers)) else {
            bail!("{file}: line {line}: expected six numbers under the header t,x,y,z,yaw,pitch");
        };
        let numbers = [key.t, key.x, key.y, key.z, key.yaw, key.pitch];
        if numbers.iter().any(|v| v.is_nan() || v.abs() > Camera::FARTHEST_M) {
            bail!("{file}: line {line}: every number must be finite and at most 1e15");
        }
        if keys.last().is_some_and(|last| key.t <= last.t) {
            bail!("{file}: line {line}: t must grow from line to line");
        }
        if let Some(wrong) = terrain.curved.as_ref().and_then(|c| c.bad_place([key.x, key.y])) {
            bail!("{file}: line {line}: {wrong}");
        }
        if terrain.curved.is_none() {
            [key.x, key.y] = terrain.world_from_native([key.x, key.y]);
        }
        keys.push(key);
    }
    if keys.len() < 2 {
        bail!("{file}: a path needs at least two lines after its header");
    }
    Ok(keys)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a failed expectation is a failed test")]
mod tests {
    use super::CameraPath;
    use tessclip::Terrain;
    use tessclip::heights::{ReadOptions, open_terrain};
    use tessclip::surface::Ellipsoid;

    #[test]
    fn neither_view_nor_axes_jump_over_the_pole() {
        let grid = open_terrain("procedural:planet?size=65", &ReadOptions::default()).unwrap();
        let terrain = Terrain::globe(vec![grid], Ellipsoid::WGS84).unwrap();
        let path = CameraPath::open("straight", &terrain).unwrap();
        let frames: Vec<_> = (0..=1000).map(|k| path.at(f64::from(k) / 1000.0, 60.0).1).collect();
        // The path does lead over it, and poses alone would turn around there.
        assert!(frames.iter().any(|c| c.eye_m.truncate().length() < 1e4));
        let poses = [[10.0, 89.9, 1e5, 0.0, 0.0], [-170.0, 89.9, 1e5, 0.0, 0.0]];
        let [a, b] = poses.map(|p| terrain.camera(p, 60.0).axes.x_axis);
        assert!(a.dot(b) < -0.99);
        let step = path.length_m() / 1000.0;
        for pair in frames.windows(2) {
            assert!(pair[0].forward().dot(pair[1].forward()) > 0.999);
            assert!(pair[0].axes.x_axis.dot(pair[1].axes.x_axis) > 0.999);
            assert!(pair[0].eye_m.distance(pair[1].eye_m) < 2.0 * step);
        }
    }
}
