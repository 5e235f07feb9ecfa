//! The globe on real relief, where present.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a failed expectation is a failed test"
)]

mod common;

use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;
use tessclip::clipmap::Rect;
use tessclip::heights::{HeightGrid, Planet};
use tessclip::pyramid::{Globe, GlobeFace, SampleSource};
use tessclip::surface::cube::Face;

fn etopo() -> Option<HeightGrid> {
    common::data("etopo/etopo5_int16.tif").map(|file| common::terrain(&file))
}

fn normal(lon: f64, lat: f64) -> DVec3 {
    let (sin, cos) = lat.to_radians().sin_cos();
    let (east, prime) = lon.to_radians().sin_cos();
    DVec3::new(cos * prime, cos * east, sin)
}

#[test]
fn known_places_have_their_heights() {
    let Some(grid) = etopo() else {
        return;
    };
    let globe = Globe::new(vec![grid.clone()], 8.0).unwrap();
    assert_eq!(globe.size(), 2_048);
    assert!(!globe.has_voids());
    assert_eq!(globe.step_m(), Some(0.5));
    assert_eq!(globe.height_range(), Some([-10_376.0, 7_833.0]));
    // Nodes, in twelfths of a degree.
    for (lon, lat, height) in [
        (1_043.0, 336.0, 6_096.0),
        (1_706.0, 136.0, -9_905.0),
        (-1_867.0, 234.0, 1_524.0),
        (0.0, -1_080.0, 2_810.0),
        (700.0, 1_080.0, -4_290.0),
    ] {
        assert_eq!(globe.height(normal(lon / 12.0, lat / 12.0)), height, "{lon} {lat}");
    }
    // Every node of every 7th row, the date line included, and every pole from every side.
    for j in (0..grid.height).step_by(7) {
        for i in 0..grid.width {
            let place = normal(i as f64 / 12.0 - 180.0, j as f64 / 12.0 - 90.0);
            assert_eq!(globe.height(place), grid.heights_m[j * grid.width + i], "{i} {j}");
        }
    }
    for j in 0..2_161 {
        let lat = f64::from(j) / 12.0 - 90.0;
        assert_eq!(globe.height(normal(180.0, lat)), globe.height(normal(-180.0, lat)));
    }
}

#[test]
fn a_read_takes_its_time_and_no_more() {
    let fine = Planet { size: 513, ..Planet::default() }.to_grid().unwrap();
    let coarse = Planet { size: 65, ..Planet::default() }.to_grid().unwrap();
    let globe = Arc::new(Globe::new(vec![fine, coarse], 8.0).unwrap());
    let source = GlobeFace { globe, face: Face::ALL[1], size: 2_048 };
    let mut out = Vec::new();
    let start = Instant::now();
    for k in 0..40 {
        let lo = [k * 10, 500];
        source.read(0, Rect { lo, hi: [lo[0] + 127, lo[1] + 127] }, &mut out);
    }
    let each = start.elapsed().as_nanos() / out.len() as u128;
    eprintln!("{each} ns a sample");
    // Far above what it takes, so that only a blunder fails it on a busy machine.
    assert!(each < 5_000, "{each} ns");
}
