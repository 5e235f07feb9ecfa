//! Measures: what is uploaded, how long frames take, whether the mesh is whole.

mod cracks;
mod environment;
pub mod error;
mod frames;
pub mod fronts;
pub mod invariants;
mod mesh;
mod open_loop;
pub mod oracle;
pub mod pairs;
pub mod stability;
mod upload;
mod watertight;

pub use cracks::{enclosed_pixels, sees_below};
pub use environment::Environment;
pub use frames::{FrameStatistics, percentile};
pub use mesh::Mesh;
pub use open_loop::{FrameTimes, Lateness, OpenLoop, OpenLoopReport};
pub use upload::{FrameUpload, UploadLedger};
pub use watertight::{ClosedFaults, Faults, check_closed, check_mesh};
