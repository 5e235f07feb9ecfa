//! Where a store's bytes come from: the seam for local files, memory, networks and tests that misbehave.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

/// Files by name, read by position. Called from loader threads; may block as long as it likes.
pub trait ReadAt: Send + Sync {
    /// Bytes of a file; `None` when there is none of that name.
    ///
    /// # Errors
    /// When that cannot be told.
    fn size(&self, file: &str) -> io::Result<Option<u64>>;

    /// Exactly `length` bytes from `offset` on.
    ///
    /// # Errors
    /// `UnexpectedEof` when the file ends before, `NotFound` when there is none, or what the system says.
    fn read(&self, file: &str, offset: u64, length: usize) -> io::Result<Vec<u8>>;

    /// A whole file of at most `most` bytes.
    ///
    /// # Errors
    /// As [`ReadAt::read`], and when it is larger.
    fn read_all(&self, file: &str, most: u64) -> io::Result<Vec<u8>> {
        let size = self.size(file)?.ok_or(io::ErrorKind::NotFound)?;
        if size > most {
            return Err(io::Error::other(format!("{size} bytes where at most {most} are expected")));
        }
        let length = usize::try_from(size).map_err(io::Error::other)?;
        self.read(file, 0, length)
    }

    /// True when asking for sizes costs next to nothing; false over a network.
    fn is_near(&self) -> bool {
        true
    }

    /// Every file there is, where that can be told.
    fn list(&self) -> Option<Vec<String>> {
        None
    }
}

/// A folder on a local disk. Files are opened for each read: nothing is held that could go stale, and a
/// tile costs far more to decode than an open to make.
#[derive(Clone, Debug)]
pub struct Folder {
    /// The folder.
    pub root: PathBuf,
}

impl ReadAt for Folder {
    fn size(&self, file: &str) -> io::Result<Option<u64>> {
        match std::fs::metadata(self.root.join(file)) {
            Ok(m) if m.is_file() => Ok(Some(m.len())),
            Ok(_) => Ok(None),
            Err(e) if matches!(e.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => Ok(None),
            Err(e) => Err(e),
        }
    }

    fn read(&self, file: &str, offset: u64, length: usize) -> io::Result<Vec<u8>> {
        let file = std::fs::File::open(self.root.join(file))?;
        // A length from a damaged index must not take memory that the file could not fill.
        if offset.saturating_add(length as u64) > file.metadata()?.len() {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let mut out = vec![0; length];
        read_exact_at(&file, &mut out, offset)?;
        Ok(out)
    }

    fn list(&self) -> Option<Vec<String>> {
        let mut out = Vec::new();
        collect(&self.root, "", &mut out).ok()?;
        Some(out)
    }
}

#[cfg(unix)]
fn read_exact_at(file: &std::fs::File, out: &mut [u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, out, offset)
}

#[cfg(not(unix))]
fn read_exact_at(mut file: &std::fs::File, out: &mut [u8], offset: u64) -> io::Result<()> {
    use std::io::{Read as _, Seek as _};
    file.seek(io::SeekFrom::Start(offset))?;
    file.read_exact(out)
}

fn collect(folder: &Path, prefix: &str, out: &mut Vec<String>) -> io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.file_type()?.is_dir() {
            collect(&entry.path(), &format!("{name}/"), out)?;
        } else {
            out.push(name);
        }
    }
    Ok(())
}

/// Files in memory.
#[derive(Clone, Debug, Default)]
pub struct InMemory {
    /// Contents by name.
    pub files: BTreeMap<String, Vec<u8>>,
}

impl InMemory {
    /// Reads a whole folder.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn from_folder(root: &Path) -> io::Result<Self> {
        let folder = Folder { root: root.into() };
        let names = folder.list().ok_or(io::ErrorKind::NotFound)?;
        let read = |name: String| {
            let bytes = std::fs::read(root.join(&name))?;
            Ok((name, bytes))
        };
        Ok(Self { files: names.into_iter().map(read).collect::<io::Result<_>>()? })
    }
}

impl ReadAt for InMemory {
    fn size(&self, file: &str) -> io::Result<Option<u64>> {
        Ok(self.files.get(file).map(|f| f.len() as u64))
    }

    fn read(&self, file: &str, offset: u64, length: usize) -> io::Result<Vec<u8>> {
        let bytes = self.files.get(file).ok_or(io::ErrorKind::NotFound)?;
        let from = usize::try_from(offset).map_err(io::Error::other)?;
        let part = from.checked_add(length).and_then(|to| bytes.get(from..to));
        part.map(<[u8]>::to_vec).ok_or_else(|| io::ErrorKind::UnexpectedEof.into())
    }

    fn list(&self) -> Option<Vec<String>> {
        Some(self.files.keys().cloned().collect())
    }
}
