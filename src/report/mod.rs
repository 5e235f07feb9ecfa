//! Reports: `report.json` (schema "tessclip-report/1"), `frames.csv` and a self-contained `report.html`.

mod html;
mod json;

pub use html::write_html;
pub use json::{FrameRow, Geometry, Memory, Quantiles, Report, ReportError, Run, SceneFacts, write_report};
