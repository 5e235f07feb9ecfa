//! From the world back to a terrain's own units: poses of cameras, and places.

use glam::{DMat3, DVec3};

use super::Terrain;
use crate::camera::Camera;

/// Cosine of the pitch under which a camera counts as looking straight up or down.
const UPRIGHT: f64 = 1e-8;

impl Terrain {
    /// The numbers of a pose `x, y, z, yaw, pitch` in the terrain's own units that give this camera: the
    /// inverse of [`Terrain::camera`]. Yaw is from -180 to 180 degrees. Whatever axes the camera's own angles
    /// are measured in, the pose's are those of the place; a roll that they show there is lost.
    #[must_use]
    pub fn pose(&self, camera: &Camera) -> [f64; 5] {
        let axes = self.curved.as_ref().map_or(DMat3::IDENTITY, |c| c.place_of(camera.eye_m).1);
        let [x, y, z] = self.native_at_point(camera.eye_m);
        let [yaw_deg, pitch_deg] = angles_deg(camera, axes);
        [x, y, z, yaw_deg, pitch_deg]
    }

    /// True when the first two numbers of a pose are longitude and latitude, degrees.
    #[must_use]
    pub fn poses_in_degrees(&self) -> bool {
        self.curved.as_ref().map_or(self.degrees.is_some(), |c| c.poses_in_degrees())
    }

    /// A world point (metres) in the units of poses: longitude and latitude in degrees or the DEM's own
    /// coordinates, then metres above the base surface; world metres where positions are the data.
    #[must_use]
    pub fn native_at_point(&self, p: DVec3) -> [f64; 3] {
        if let Some(curved) = &self.curved {
            return curved.place_of(p).0;
        }
        match self.degrees {
            Some(d) => [p.x / d.metres_per_degree[0], p.y / d.metres_per_degree[1], p.z],
            None => p.to_array(),
        }
    }
}

/// Yaw and pitch of a camera in the given axes (unit east, north and up as columns), degrees.
fn angles_deg(camera: &Camera, axes: DMat3) -> [f64; 2] {
    let seen = axes.transpose();
    let forward = seen * camera.forward();
    let level = forward.truncate().length();
    // Straight up or down every heading looks the same way; what is to the right tells them apart.
    let yaw = if level < UPRIGHT {
        let right = seen * camera.right_and_up()[0];
        (-right.y).atan2(right.x)
    } else {
        forward.x.atan2(forward.y)
    };
    [yaw.to_degrees(), forward.z.atan2(level).to_degrees()]
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::Terrain;
    use crate::camera::Camera;
    use crate::heights::{Degrees, HeightGrid, PositionGrid, ReadOptions, open_terrain};
    use crate::pyramid::Prefilter;
    use crate::surface::Ellipsoid;

    fn grid(spec: &str) -> HeightGrid {
        open_terrain(spec, &ReadOptions::default()).unwrap()
    }

    fn on(grid: &HeightGrid, base: &str) -> Terrain {
        Terrain::on(grid, base.parse().unwrap(), Prefilter::Subsample).unwrap()
    }

    fn in_degrees(west: f64, south: f64) -> HeightGrid {
        let mut grid = grid("procedural:dunes?width=120&height=100");
        let metres_per_degree = [78_000.0, 111_200.0];
        grid.georeference.degrees = Some(Degrees { west, south, step: [0.01; 2], metres_per_degree });
        grid.origin_m = [west * metres_per_degree[0], south * metres_per_degree[1]];
        grid.spacing_m = metres_per_degree.map(|m| 0.01 * m);
        grid
    }

    /// The camera that the pose of `camera` gives, held against it; tells the pose.
    fn round_trip(terrain: &Terrain, camera: &Camera) -> [f64; 5] {
        let pose = terrain.pose(camera);
        let back = terrain.camera(pose, camera.fov_deg);
        let told = format!("{camera:?} gave {pose:?} gave {back:?}");
        assert!(back.eye_m.distance(camera.eye_m) <= 1e-9 * camera.eye_m.length().max(1.0), "{told}");
        assert!(back.forward().distance(camera.forward()) <= 1e-9, "{told}");
        pose
    }

    /// As [`round_trip`], for a camera without roll, whose picture must not turn either; the numbers come back
    /// but for whole turns.
    fn comes_back(terrain: &Terrain, pose: [f64; 5]) {
        let camera = terrain.camera(pose, 50.0);
        let back = round_trip(terrain, &camera);
        let right = |c: &Camera| c.right_and_up()[0];
        let again = terrain.camera(back, 50.0);
        assert!(right(&again).distance(right(&camera)) <= 1e-8, "{pose:?} {back:?}");
    }

    fn same_numbers(terrain: &Terrain, pose: [f64; 5]) {
        comes_back(terrain, pose);
        let back = terrain.pose(&terrain.camera(pose, 50.0));
        for (a, b) in back.iter().zip(pose) {
            assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "{back:?} {pose:?}");
        }
    }

    #[test]
    fn on_a_plane_in_metres_and_in_degrees() {
        let metres = Terrain::new(&grid("procedural:dunes?width=120&height=100"), Prefilter::Subsample);
        let degrees = Terrain::new(&in_degrees(7.0, 45.5), Prefilter::Subsample);
        for (terrain, x, y) in [(&metres, 1_234.5, -77.25), (&degrees, 7.123_456, 45.9)] {
            for yaw in [-170.0, 0.0, 33.0, 179.0] {
                for pitch in [-90.0, -89.9, -30.0, 0.0, 45.0, 90.0] {
                    same_numbers(terrain, [x, y, 812.5, yaw, pitch]);
                }
            }
        }
    }

    #[test]
    fn on_the_globe_at_the_poles_and_across_the_date_line() {
        let terrain = Terrain::globe(vec![grid("procedural:planet?size=65")], Ellipsoid::WGS84).unwrap();
        for lon in [-180.0, -179.999_999, -30.0, 0.0, 90.0, 179.5, 180.0, 200.0] {
            for lat in [-90.0, -89.999_999, -45.0, 0.0, 60.0, 89.9, 89.999_999, 90.0] {
                for (h, yaw, pitch) in [(2.0, 10.0, -5.0), (3e5, -120.0, -90.0), (2e7, 75.0, -60.0)] {
                    comes_back(&terrain, [lon, lat, h, yaw, pitch]);
                }
            }
        }
        same_numbers(&terrain, [86.9, 27.9, 9_000.0, 20.0, -10.0]);
        same_numbers(&terrain, [-179.25, -80.0, 120.0, -90.0, -90.0]);
    }

    #[test]
    fn on_patches_rings_and_positions() {
        let dunes = grid("procedural:dunes?width=301&height=200");
        let patch = on(&in_degrees(178.9, -20.0), "wgs84");
        for lon in [178.9, 179.7, 180.0, 180.05] {
            same_numbers(&patch, [lon, -19.3, 850.0, 44.0, -12.0]);
        }
        same_numbers(&on(&dunes, "sphere:50000"), [-3_000.0, 2_000.0, 400.0, 12.0, -30.0]);
        for base in ["cylinder:4000", "cylinder:4000,inside", "torus:4000,1200"] {
            let terrain = on(&dunes, base);
            for (x, y) in [(10.0, 20.0), (8_000.0, 5_500.0), (4_500.0, 3_000.0)] {
                same_numbers(&terrain, [x, y, 150.0, -75.0, -25.0]);
                same_numbers(&terrain, [x, y, 150.0, 75.0, -90.0]);
            }
        }
        let sampled = Terrain::sampled(PositionGrid::parse("overhang?size=33").unwrap());
        same_numbers(&sampled, [120.0, -3_000.0, 2_000.0, 77.0, -40.0]);
        same_numbers(&sampled, [120.0, -3_000.0, 2_000.0, 77.0, 90.0]);
    }

    #[test]
    fn angles_measured_in_other_axes_are_those_of_the_place_afterwards() {
        let globe = Terrain::globe(vec![grid("procedural:planet?size=65")], Ellipsoid::WGS84).unwrap();
        let plane = Terrain::new(&grid("procedural:dunes?width=120&height=100"), Prefilter::Subsample);
        let turned = DMat3::from_rotation_z(0.7) * DMat3::from_rotation_x(0.3);
        for (terrain, eye_m) in [(&globe, DVec3::new(5e6, 2e6, 4e6)), (&plane, DVec3::new(10.0, 20.0, 3e3))] {
            for pitch_deg in [-70.0, 0.0, 20.0] {
                let camera = Camera { eye_m, yaw_deg: 130.0, pitch_deg, axes: turned, ..Camera::default() };
                round_trip(terrain, &camera);
            }
        }
        // Straight down in axes that are turned around the vertical: the heading is in the right vector.
        let axes = DMat3::from_rotation_z(0.7);
        let camera = Camera { yaw_deg: 20.0, pitch_deg: -90.0, axes, ..Camera::default() };
        let pose = round_trip(&plane, &camera);
        assert!((pose[3] - (20.0 - 0.7_f64.to_degrees())).abs() < 1e-6, "{pose:?}");
    }

    #[test]
    fn points_have_native_coordinates_and_heights() {
        let torus = on(&grid("procedural:dunes?width=301&height=200"), "torus:4000,1200");
        // Out on the equator, where both angles begin.
        let [x, y, h] = torus.native_at_point(DVec3::new(5_450.0, 0.0, 0.0));
        // Nearer to the data's end by a turn, or at its beginning: both are the same place.
        let around = [301.0, 200.0].map(|n: f64| 30.0 * n);
        for (v, whole) in [(x, around[0]), (y, around[1])] {
            assert!(((v / whole).round() * whole - v).abs() < 1e-6, "{x} {y}");
        }
        assert!((h - 250.0).abs() < 1e-9, "{h}");
        let degrees = Terrain::new(&in_degrees(7.0, 45.5), Prefilter::Subsample);
        let at = degrees.native_at_point(DVec3::new(7.5 * 78_000.0, 46.0 * 111_200.0, 12.0));
        assert!((at[0] - 7.5).abs() < 1e-12 && (at[1] - 46.0).abs() < 1e-12 && at[2] == 12.0, "{at:?}");
    }
}
