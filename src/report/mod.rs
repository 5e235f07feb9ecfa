//! Reports: `report.json` (schema "tessclip-report/1"), `frames.csv` and a self-contained `report.html`.

mod html;
mod json;
mod plots;
mod run;

pub use html::write_html;
pub use json::{Report, ReportError, SceneFacts, write_report};
pub use run::{CrackReport, FrameRow, Geometry, Memory, Quantiles, Run, StreamReport, TeleportWaits, Waits};
