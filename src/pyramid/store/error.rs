//! Why a store cannot be built or opened.

use crate::heights::HeightError;

/// One line that says what, where and what to do.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// Nothing there, or not a store.
    #[error("{at}: not a tessclip store: {reason}; make one with `tessclip build DEM -o T.zarr`")]
    NotAStore {
        /// Path or address.
        at: String,
        /// What is missing.
        reason: String,
    },
    /// Made by another version.
    #[error("{at}: a store of schema {found}, this program reads {known}; build it again")]
    Schema {
        /// Path or address.
        at: String,
        /// Schema in the file.
        found: String,
        /// Schema understood here.
        known: &'static str,
    },
    /// A file that describes the store is damaged.
    #[error("{at}/{file}: damaged ({reason}); restore the file or build the store again")]
    Header {
        /// Path or address.
        at: String,
        /// File inside the store.
        file: String,
        /// What does not fit.
        reason: String,
    },
    /// The top of the pyramid is damaged: nothing could stand in for it.
    #[error("{at}: {fault}; nothing coarser can stand in for it: restore the file or build the store again")]
    Top {
        /// Path or address.
        at: String,
        /// What was found.
        fault: String,
    },
    /// The system refused.
    #[error("{at}: {action} failed: {reason}; check that it may be read and written")]
    Io {
        /// Path or address.
        at: String,
        /// What was tried.
        action: &'static str,
        /// What the system said.
        reason: std::io::Error,
    },
    /// No room left on the device.
    #[error(
        "{at}: the disk is full; what was begun is removed, what was there before is untouched: make room and build again"
    )]
    DiskFull {
        /// Path of the store.
        at: String,
    },
    /// Something already stands there.
    #[error("{at}: exists already; give another name or --overwrite")]
    Exists {
        /// Path of the store.
        at: String,
    },
    /// Something that is no store stands there and would be replaced.
    #[error("{at}: exists and is not a tessclip store: it is not replaced; give another name")]
    NotOurs {
        /// Path.
        at: String,
    },
    /// Its folder is not there.
    #[error("{at}: there is no folder {folder} to make it in; make that first")]
    NoFolder {
        /// Path of the store.
        at: String,
        /// The folder.
        folder: String,
    },
    /// Another build of the same store runs.
    #[error("{at}: another build of it is running; wait for it or give another name")]
    Busy {
        /// Path of the store.
        at: String,
    },
    /// A source could not be read.
    #[error(transparent)]
    Source(#[from] HeightError),
    /// The bound on the loss cannot be used.
    #[error("a loss of {value} m cannot be allowed: give metres from 0 to 1e6")]
    MaxError {
        /// What was asked for.
        value: f64,
    },
    /// An encoder failed.
    #[error("{at}: encoding failed: {reason}; try another --codec, and report it")]
    Encode {
        /// Path of the store.
        at: String,
        /// What the codec said.
        reason: String,
    },
    /// More than a store may have.
    #[error(
        "{at}: {width} x {height} samples are more than a store may have (2^38 in all); cut the data into several"
    )]
    TooManyTiles {
        /// Path of the store.
        at: String,
        /// Columns.
        width: u64,
        /// Rows.
        height: u64,
    },
    /// More than may be held in memory.
    #[error("{at}: {width} x {height} samples are too many to be held in memory (at most {most}); {advice}")]
    TooLarge {
        /// Path of the store.
        at: String,
        /// Columns.
        width: u64,
        /// Rows.
        height: u64,
        /// Limit, samples.
        most: u64,
        /// What to do instead.
        advice: &'static str,
    },
    /// The build was told to stop.
    #[error("{at}: stopped; what was begun is removed, what was there before is untouched")]
    Stopped {
        /// Path of the store.
        at: String,
    },
}

impl StoreError {
    /// An error of the system, with a full disk told apart.
    pub(crate) fn io(at: &str, action: &'static str, reason: std::io::Error) -> Self {
        use std::io::ErrorKind as Kind;
        if matches!(reason.kind(), Kind::StorageFull | Kind::QuotaExceeded) {
            return Self::DiskFull { at: at.into() };
        }
        Self::Io { at: at.into(), action, reason }
    }
}
