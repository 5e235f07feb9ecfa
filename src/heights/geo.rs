//! Where a grid lies: its coordinate system and the plane frame in metres.

/// What the source says about its place on Earth.
#[derive(Clone, Debug)]
pub struct Georeference {
    /// Coordinate system, for example "EPSG:4326"; `None` when the source names none by code.
    pub crs: Option<String>,
    /// The geographic frame; `Some` exactly when the source is placed in degrees.
    pub degrees: Option<Degrees>,
    /// Native unit of [`super::HeightGrid::bounds`]: "metre" or "degree".
    pub unit: &'static str,
    /// Whether the source places its samples at all.
    pub georeferenced: bool,
    /// Whether a source sample stands for a point (true) or for the area of a pixel (false).
    /// The grid is the same either way: its nodes are the points or the pixel centres.
    pub pixel_is_point: bool,
}

impl Georeference {
    /// The frame of a source without one: metres from its own south-west sample.
    pub(crate) fn none() -> Self {
        Self { crs: None, degrees: None, unit: "metre", georeferenced: false, pixel_is_point: true }
    }
}

/// The geographic frame of a grid: nodes in degrees, and the constant scale to plane metres.
///
/// Plane coordinates are `x = longitude * metres_per_degree[0]` and
/// `y = latitude * metres_per_degree[1]`, with one scale for the whole grid.
#[derive(Clone, Copy, Debug)]
pub struct Degrees {
    /// Longitude of the south-west sample, degrees east.
    pub west: f64,
    /// Latitude of the south-west sample, degrees north.
    pub south: f64,
    /// Degrees between samples, east and north, both positive.
    pub step: [f64; 2],
    /// Metres per degree, east and north, at the centre latitude of the data.
    pub metres_per_degree: [f64; 2],
}

/// WGS84 semi-major axis in metres.
const SEMI_MAJOR_M: f64 = 6_378_137.0;
/// WGS84 first eccentricity squared.
const ECCENTRICITY_2: f64 = 6.694_379_990_141_316e-3;

/// Metres per degree of longitude and of latitude on the WGS84 ellipsoid at `latitude` (degrees):
/// the radius of the parallel and the meridian radius of curvature, each times pi / 180.
pub(crate) fn metres_per_degree(latitude: f64) -> [f64; 2] {
    let (sin, cos) = latitude.to_radians().sin_cos();
    let w2 = 1.0 - ECCENTRICITY_2 * sin * sin;
    let w = w2.sqrt();
    let parallel = SEMI_MAJOR_M * cos / w;
    let meridian = SEMI_MAJOR_M * (1.0 - ECCENTRICITY_2) / (w2 * w);
    [parallel.to_radians(), meridian.to_radians()]
}

#[cfg(test)]
mod tests {
    use super::metres_per_degree;

    #[test]
    fn degree_lengths_match_the_published_ones() {
        let [x, y] = metres_per_degree(0.0);
        assert!((x - 111_319.491).abs() < 0.01, "{x}");
        assert!((y - 110_574.276).abs() < 0.01, "{y}");
        let [x, y] = metres_per_degree(45.0);
        assert!((x - 78_846.8).abs() < 0.5, "{x}");
        assert!((y - 111_131.8).abs() < 0.5, "{y}");
    }
}
