//! Camera paths: named ones over a terrain, and CSV files `t,x,y,z,yaw,pitch` with header.

use anyhow::{Context as _, bail};
use glam::DVec3;
use serde::Deserialize;
use tessclip::{Camera, Terrain};

/// A timed camera path, sampled linearly.
pub struct CameraPath {
    /// As given.
    pub name: String,
    keys: Vec<Key>,
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

/// Names of the built-in paths.
pub const NAMES: [&str; 3] = ["straight", "double-turn", "circle"];

impl CameraPath {
    /// A named path, or a CSV file.
    pub fn open(spec: &str, terrain: &Terrain) -> anyhow::Result<Self> {
        let keys = if NAMES.contains(&spec) { named(spec, terrain) } else { read_csv(spec, terrain)? };
        Ok(Self { name: spec.into(), keys })
    }

    /// Seconds it lasts.
    pub fn seconds(&self) -> f64 {
        self.keys.last().map_or(0.0, |k| k.t) - self.keys[0].t
    }

    /// Ground distance it covers in metres.
    pub fn length_m(&self) -> f64 {
        self.keys.windows(2).map(|k| (k[1].x - k[0].x).hypot(k[1].y - k[0].y)).sum()
    }

    /// The camera at a share 0..1 of the path, and its path time.
    pub fn at(&self, share: f64, fov_deg: f64) -> (f64, Camera) {
        let t = self.keys[0].t + share * self.seconds();
        let after = self.keys.partition_point(|k| k.t <= t).clamp(1, self.keys.len() - 1);
        let (a, b) = (self.keys[after - 1], self.keys[after]);
        let s = ((t - a.t) / (b.t - a.t)).clamp(0.0, 1.0);
        let mix = |u: f64, v: f64| u + (v - u) * s;
        // The short way round between two headings.
        let turn = (b.yaw - a.yaw + 180.0).rem_euclid(360.0) - 180.0;
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

/// Paths over the middle of the terrain, a fixed height above the ground below.
fn named(name: &str, terrain: &Terrain) -> Vec<Key> {
    let [low, high] = terrain.extent_m();
    let at = |u: f64, v: f64| [low[0] + (high[0] - low[0]) * u, low[1] + (high[1] - low[1]) * v];
    let steps = 120;
    let points: Vec<[f64; 2]> = (0..=steps)
        .map(|k| {
            let s = f64::from(k) / f64::from(steps);
            match name {
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
    let ground = |p: [f64; 2]| terrain.ground_height_m(p[0], p[1]).map_or(0.0, f64::from);
    (0..points.len())
        .map(|k| {
            let p = points[k];
            let next = points[(k + 1).min(points.len() - 1)];
            let from = points[(k + 1).min(points.len() - 1) - 1];
            // Smoothed over the neighbours, so that the flight does not jump with each peak.
            let near = &points[k.saturating_sub(6)..(k + 7).min(points.len())];
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
        .collect()
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
        [key.x, key.y] = terrain.world_from_native([key.x, key.y]);
        keys.push(key);
    }
    if keys.len() < 2 {
        bail!("{file}: a path needs at least two lines after its header");
    }
    Ok(keys)
}
