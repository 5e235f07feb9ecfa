//! Writing one file of a report.

use std::path::Path;

use serde::Serialize;

use super::ReportError;

/// Writes a file whole into a directory that is there.
pub(super) fn write(dir: &Path, file: &'static str, bytes: &[u8]) -> Result<(), ReportError> {
    let path = dir.join(file);
    std::fs::write(&path, bytes).map_err(|reason| ReportError::Write { path, reason })
}

/// Rows as CSV with a head; nothing where there are none.
pub(super) fn table<T: Serialize>(file: &'static str, rows: &[T]) -> Result<Vec<u8>, ReportError> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    let made = rows.iter().try_for_each(|row| csv.serialize(row));
    made.map_err(|e| e.to_string())
        .and_then(|()| csv.into_inner().map_err(|e| e.to_string()))
        .map_err(|reason| ReportError::Make { file, reason })
}
