//! Terrains that the viewer's tests fly over.

use tessclip::heights::{Degrees, HeightGrid, PositionGrid, ReadOptions, open_terrain};
use tessclip::surface::Ellipsoid;
use tessclip::{Prefilter, Terrain};

pub fn read(spec: &str) -> HeightGrid {
    open_terrain(spec, &ReadOptions::default()).unwrap()
}

pub fn plane(spec: &str) -> Terrain {
    Terrain::new(&read(spec), Prefilter::Subsample)
}

pub fn mountains() -> Terrain {
    plane("procedural:mountains?size=257")
}

pub fn in_degrees() -> Terrain {
    let mut grid = read("procedural:mountains?size=65");
    let (step, metres_per_degree) = ([1e-3; 2], [77_000.0, 111_000.0]);
    grid.georeference.degrees = Some(Degrees { west: 8.0, south: 46.0, step, metres_per_degree });
    grid.origin_m = [8.0 * metres_per_degree[0], 46.0 * metres_per_degree[1]];
    grid.spacing_m = metres_per_degree.map(|m| 1e-3 * m);
    Terrain::new(&grid, Prefilter::Subsample)
}

pub fn globe() -> Terrain {
    Terrain::globe(vec![read("procedural:planet?size=65")], Ellipsoid::WGS84).unwrap()
}

pub fn sampled() -> Terrain {
    Terrain::sampled(PositionGrid::parse("overhang?size=65").unwrap())
}
