//! A file that several threads read at once, each at places of its own.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
#[cfg(unix)]
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
#[cfg(not(unix))]
use std::sync::{Mutex, PoisonError};

use super::HeightError;

/// An open file of a fixed length.
pub(crate) struct Positioned {
    #[cfg(unix)]
    file: File,
    #[cfg(not(unix))]
    file: Mutex<File>,
    length: u64,
    /// Dropped after the file, which some systems insist on.
    _left: Left,
}

/// The name of a temporary file, if it could not be taken away while the file is open.
struct Left(Option<PathBuf>);

impl Drop for Left {
    fn drop(&mut self) {
        if let Some(path) = &self.0 {
            // Nobody is left to be told of a failure.
            let _ = fs::remove_file(path);
        }
    }
}

impl Positioned {
    /// Opens a file for reading.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        Self::new(File::open(path)?, Left(None))
    }

    fn new(file: File, left: Left) -> io::Result<Self> {
        let length = file.metadata()?.len();
        #[cfg(not(unix))]
        let file = Mutex::new(file);
        Ok(Self { file, length, _left: left })
    }

    /// A file of `length` zero bytes that vanishes with this value. Error: `Temporary`.
    pub(crate) fn temporary(length: u64) -> Result<Self, HeightError> {
        static MADE: AtomicU64 = AtomicU64::new(0);
        let (file, path) = loop {
            let number = MADE.fetch_add(1, Ordering::Relaxed);
            let name = format!("tessclip-{}-{number}.spool", std::process::id());
            let path = std::env::temp_dir().join(name);
            match OpenOptions::new().read(true).write(true).create_new(true).open(&path) {
                Ok(file) => break (file, path),
                Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
                Err(e) => return Err(no_temporary(e)),
            }
        };
        // At once, so that nothing stays behind however the program ends.
        let left = Left(fs::remove_file(&path).is_err().then_some(path));
        file.set_len(length).and_then(|()| Self::new(file, left)).map_err(no_temporary)
    }

    /// Bytes in the file.
    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    /// Fills the buffer from `at` on; `UnexpectedEof` where the file is too short.
    pub(crate) fn read_exact_at(&self, mut buffer: &mut [u8], mut at: u64) -> io::Result<()> {
        if at.checked_add(buffer.len() as u64).is_none_or(|end| end > self.length) {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        while !buffer.is_empty() {
            match self.read_at(buffer, at) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(count) => {
                    buffer = &mut buffer[count..];
                    at += count as u64;
                }
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }

    #[cfg(unix)]
    fn read_at(&self, buffer: &mut [u8], at: u64) -> io::Result<usize> {
        self.file.read_at(buffer, at)
    }

    #[cfg(not(unix))]
    fn read_at(&self, buffer: &mut [u8], at: u64) -> io::Result<usize> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(at))?;
        file.read(buffer)
    }

    /// Writes into a temporary file. Error: `Temporary`.
    #[cfg(unix)]
    pub(crate) fn write_all_at(&self, bytes: &[u8], at: u64) -> Result<(), HeightError> {
        self.file.write_all_at(bytes, at).map_err(no_temporary)
    }

    /// Writes into a temporary file. Error: `Temporary`.
    #[cfg(not(unix))]
    pub(crate) fn write_all_at(&self, bytes: &[u8], at: u64) -> Result<(), HeightError> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let written = file.seek(SeekFrom::Start(at)).and_then(|_| io::Write::write_all(&mut *file, bytes));
        written.map_err(no_temporary)
    }
}

fn no_temporary(source: io::Error) -> HeightError {
    HeightError::Temporary { path: std::env::temp_dir(), source }
}

/// A reader with a place of its own in a shared file.
pub(crate) struct FileCursor {
    file: Arc<Positioned>,
    at: u64,
}

impl FileCursor {
    /// Stands at the start.
    pub(crate) fn new(file: &Arc<Positioned>) -> Self {
        Self { file: Arc::clone(file), at: 0 }
    }
}

impl Read for FileCursor {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read_at(buffer, self.at)?;
        self.at += count as u64;
        Ok(count)
    }
}

impl Seek for FileCursor {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
            SeekFrom::End(by) => self.file.length.checked_add_signed(by),
        };
        // Files refuse places over `i64::MAX`, and so does this.
        self.at = at.filter(|&at| i64::try_from(at).is_ok()).ok_or(ErrorKind::InvalidInput)?;
        Ok(self.at)
    }
}
