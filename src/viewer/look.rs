//! How the terrain is looked at: all that a key or the panel changes, and all that `render` can be told.

use tessclip::Scene;
use tessclip::rivals::Method;

/// The look of a picture. With the terrain and the pose it is the whole picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Colours, edges, boxes, fog, sun, window size, factors.
    pub scene: Scene,
    /// Factor on the heights.
    pub exaggeration: f64,
    /// Vertical field of view, degrees.
    pub fov_deg: f64,
    /// Pose that windows, factors and culling stay with while the camera flies on.
    pub frozen: Option<[f64; 5]>,
    /// Method drawn in the right half.
    pub beside: Option<Method>,
}

impl Look {
    /// Least and greatest factor on the heights.
    pub const EXAGGERATION: [f64; 2] = [0.1, 20.0];
    /// Least and greatest field of view, degrees.
    pub const FOV_DEG: [f64; 2] = [5.0, 120.0];
}
