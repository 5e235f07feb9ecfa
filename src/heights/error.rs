//! The one error type of the layer.

use std::path::{Path, PathBuf};

/// Why a terrain could not be read or made.
///
/// Every message is one line that says what is wrong, where, and what to do about it.
#[derive(Debug, thiserror::Error)]
pub enum HeightError {
    /// Nothing exists at the path.
    #[error("{}: no such file; check the path", path.display())]
    NotFound {
        /// The path as given.
        path: PathBuf,
    },
    /// The path is a directory or another thing that is not a regular file.
    #[error("{}: not a regular file; name one elevation file", path.display())]
    NotAFile {
        /// The path as given.
        path: PathBuf,
    },
    /// The file has no bytes.
    #[error("{}: the file is empty; fetch or export it again", path.display())]
    Empty {
        /// The path as given.
        path: PathBuf,
    },
    /// The operating system refused to open or read the file.
    #[error("{}: cannot read the file ({source}); check its permissions", path.display())]
    Io {
        /// The path as given.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Neither the first bytes nor the extension name a known format.
    #[error(
        "{}: not a GeoTIFF, PNG or .hgt file (first bytes {found}); convert it to GeoTIFF",
        path.display()
    )]
    UnknownFormat {
        /// The path as given.
        path: PathBuf,
        /// The first bytes in hexadecimal.
        found: String,
    },
    /// A raster needs two samples along each axis to span an area.
    #[error("{subject}: {width} x {height} samples; at least 2 x 2 are needed")]
    TooSmall {
        /// File or recipe.
        subject: String,
        /// Columns.
        width: u64,
        /// Rows.
        height: u64,
    },
    /// More samples than the caller allows; nothing was allocated.
    #[error(
        "{subject}: {width} x {height} samples exceed the limit of {limit}; \
         cut the data or raise the limit"
    )]
    TooLarge {
        /// File or recipe.
        subject: String,
        /// Columns.
        width: u64,
        /// Rows.
        height: u64,
        /// `ReadOptions::max_samples`.
        limit: u64,
    },
    /// Rasters that cannot be joined.
    #[error("{name}: cannot be joined with the others: {reason}")]
    Mosaic {
        /// The raster that does not fit.
        name: String,
        /// Why, and what to do.
        reason: String,
    },
    /// A side of the raster reaches beyond 32-bit indices.
    #[error("{subject}: {width} x {height} samples; a side may have at most 2147483647; cut the data")]
    SideTooLong {
        /// File or recipe.
        subject: String,
        /// Columns.
        width: u64,
        /// Rows.
        height: u64,
    },
    /// A rectangle reaches out of its raster, or its buffer has another length.
    #[error("{size:?} samples from {at:?} into {got} heights do not fit a raster of {raster:?} samples")]
    Rectangle {
        /// First column and row.
        at: [u64; 2],
        /// Columns and rows.
        size: [usize; 2],
        /// Length of the buffer.
        got: usize,
        /// Columns and rows of the raster.
        raster: [u64; 2],
    },
    /// Samples could not be laid down in the folder of temporary files.
    #[error("{}: cannot hold a temporary file ({source}); free space there or set TMPDIR", path.display())]
    Temporary {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The system has not enough memory for the samples.
    #[error("{subject}: no memory for {bytes} bytes; cut the data or free memory")]
    OutOfMemory {
        /// File or recipe.
        subject: String,
        /// Size of the refused allocation.
        bytes: u64,
    },
    /// The file breaks the rules of its format.
    #[error("{}: broken {format}: {detail}; fetch or export it again", path.display())]
    Malformed {
        /// The path as given.
        path: PathBuf,
        /// Format name.
        format: &'static str,
        /// What is wrong, one line.
        detail: String,
    },
    /// The file is fine but uses something that is not implemented.
    #[error("{}: unsupported {format}: {detail}; {advice}", path.display())]
    Unsupported {
        /// The path as given.
        path: PathBuf,
        /// Format name.
        format: &'static str,
        /// The unsupported thing, by name.
        detail: String,
        /// What to do.
        advice: &'static str,
    },
    /// The file holds a picture.
    #[error(
        "{}: {detail} is an image, not elevation; give a single-band elevation raster",
        path.display()
    )]
    NotElevation {
        /// The path as given.
        path: PathBuf,
        /// What was found, for example "8-bit RGB".
        detail: String,
    },
    /// The rows of the raster do not run along the axes of its coordinate system.
    #[error("{}: the raster is rotated or sheared; warp it north-up (gdalwarp)", path.display())]
    Rotated {
        /// The path as given.
        path: PathBuf,
    },
    /// A sample spacing was given for a file that brings its own.
    #[error(
        "{}: already georeferenced with a spacing of {east_m} x {north_m} m; \
         do not give a spacing for it",
        path.display()
    )]
    AlreadyGeoreferenced {
        /// The path as given.
        path: PathBuf,
        /// Spacing in the file, metres, along the rows.
        east_m: f64,
        /// Spacing in the file, metres, along the columns.
        north_m: f64,
    },
    /// A number in [`crate::heights::ReadOptions`] makes no sense.
    #[error("option {name}: {value} is not usable; give {expected}")]
    BadOption {
        /// Field name.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What would be accepted.
        expected: &'static str,
    },
    /// The name of an `.hgt` file is its only georeference, and this one says nothing.
    #[error(
        "{}: the name must begin with the south-west corner like N44W072; rename the file",
        path.display()
    )]
    HgtName {
        /// The path as given.
        path: PathBuf,
    },
    /// The size of an `.hgt` file is its only header, and this one is no square.
    #[error(
        "{}: {bytes} bytes are no square of 16-bit samples (1201 x 1201 is 2884802, \
         3601 x 3601 is 25934402); unpack or fetch it again",
        path.display()
    )]
    HgtSize {
        /// The path as given.
        path: PathBuf,
        /// File length.
        bytes: u64,
    },
    /// The buffer given to [`crate::heights::HeightGrid::new`] has the wrong length.
    #[error("{width} x {height} samples need {expected} heights, but {got} were given")]
    Length {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Width times height (saturated).
        expected: usize,
        /// Length of the buffer.
        got: usize,
    },
    /// The file has other bands than positions need.
    #[error(
        "{}: {detail} are no positions; give 3 bands of 32- or 64-bit floats: x, y, z in metres",
        path.display()
    )]
    NotPositions {
        /// The path as given.
        path: PathBuf,
        /// What was found, for example "1 bands of 16-bit samples, format 2".
        detail: String,
    },
    /// The buffer given to [`crate::heights::PositionGrid`] has the wrong length.
    #[error("{width} x {height} nodes need {expected} positions, but {got} were given")]
    PositionCount {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Width times height.
        expected: usize,
        /// Length of the buffer.
        got: usize,
    },
    /// A position is so far away that its squares are not safe; often an undeclared void value.
    #[error(
        "{subject}: the node in column {column}, row {row} has a coordinate of {value_m:e} m; \
         keep within 1e12 m, or declare the value as nodata"
    )]
    FarPosition {
        /// File or recipe.
        subject: String,
        /// Column of the first such node, from the first.
        column: usize,
        /// Its row, from the first (in the grid's order: south).
        row: usize,
        /// The coordinate, metres.
        value_m: f64,
    },
    /// The rasters of x, y and z differ in size.
    #[error("the rasters of x, y and z have {x:?}, {y:?} and {z:?} samples; give three of equal size")]
    UnequalGrids {
        /// Columns and rows of the raster of x.
        x: [usize; 2],
        /// Columns and rows of the raster of y.
        y: [usize; 2],
        /// Columns and rows of the raster of z.
        z: [usize; 2],
    },
    /// No procedural terrain has this name.
    #[error("procedural:{name}: unknown terrain; known: {known}")]
    UnknownProcedural {
        /// The name as given.
        name: String,
        /// All names.
        known: String,
    },
    /// The procedural terrain has no such parameter.
    #[error("procedural:{kind}: unknown parameter `{name}`; known: {known}")]
    UnknownParameter {
        /// Terrain name.
        kind: &'static str,
        /// The parameter as given.
        name: String,
        /// All parameters of the terrain.
        known: &'static str,
    },
    /// A parameter of a procedural terrain has a value that cannot be used.
    #[error("procedural:{kind}: {name}={value} is not usable; give {expected}")]
    BadParameter {
        /// Terrain name.
        kind: &'static str,
        /// The parameter.
        name: String,
        /// The value as given.
        value: String,
        /// What would be accepted.
        expected: &'static str,
    },
}

impl HeightError {
    /// A broken file; `detail` may come from elsewhere and is made one short line.
    pub(crate) fn malformed(path: &Path, format: &'static str, detail: impl ToString) -> Self {
        Self::Malformed { path: path.to_owned(), format, detail: one_line(&detail.to_string()) }
    }

    /// A valid file that is not supported, with the advice that fits nearly all of them.
    pub(crate) fn unsupported(path: &Path, format: &'static str, detail: impl ToString) -> Self {
        Self::Unsupported {
            path: path.to_owned(),
            format,
            detail: one_line(&detail.to_string()),
            advice: "rewrite it with gdal_translate -co COMPRESS=DEFLATE",
        }
    }

    /// A read error of the operating system.
    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io { path: path.to_owned(), source }
    }
}

/// Text from a file or a library as at most 160 printable characters on one line.
pub(crate) fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(160).collect()
}
