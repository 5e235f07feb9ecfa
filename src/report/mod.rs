//! Reports: `report.json` (schema "tessclip-report/1"), `frames.csv` and a self-contained `report.html`.

mod comparison;
mod comparison_files;
mod comparison_plots;
mod comparison_uploads;
mod comparison_words;
mod files;
mod html;
mod json;
mod plots;
mod run;

pub use comparison::{
    Cannot, Comparison, ComparisonReport, Front, FrontPoint, MethodRow, OuterPoint, PathComparison,
    SampleRow, UploadPerFrame, mark_fronts, runs,
};
pub use comparison_files::{comparison_section, write_comparison};
pub use comparison_uploads::UploadRow;
pub use comparison_words::words;
pub use html::write_html;
pub use json::{Report, ReportError, SceneFacts, write_report};
pub use run::{CrackReport, FrameRow, Geometry, Memory, Quantiles, Run, StreamReport, TeleportWaits, Waits};
