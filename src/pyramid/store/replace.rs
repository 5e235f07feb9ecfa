//! Putting a finished folder in the place of an old one, whole or not at all.
//!
//! A build writes into a folder of its own beside the target, under a lock that goes away with the process.
//! At the end the two names are exchanged in one step of the file system, so that the target is the old store
//! or the new one at every moment; where the file system cannot do that, see `by_two_renames`.

use std::fs::{self, File};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::Store;
use super::error::StoreError;

/// A folder under construction; removed when dropped before it was put in place.
pub(crate) struct Draft {
    target: PathBuf,
    folder: PathBuf,
    lock_path: PathBuf,
    /// Held until the process ends or the draft is dropped.
    lock: Option<File>,
    placed: bool,
}

impl Draft {
    /// Begins a draft for `target`; what an interrupted build left behind is cleared away.
    pub fn begin(target: &Path, overwrite: bool) -> Result<Self, StoreError> {
        let at = target.display().to_string();
        // Through links: what is exchanged must lie in one place.
        let target = &target.canonicalize().unwrap_or_else(|_| target.to_path_buf());
        let name = target.file_name().ok_or_else(|| StoreError::NotOurs { at: at.clone() })?;
        let name = name.to_string_lossy().into_owned();
        let parent = match target.parent() {
            Some(p) if !p.as_os_str().is_empty() => p.to_path_buf(),
            _ => PathBuf::from("."),
        };
        if !parent.is_dir() {
            return Err(StoreError::NoFolder { at, folder: parent.display().to_string() });
        }
        let folder = parent.join(format!(".{name}.building"));
        let lock_path = parent.join(format!(".{name}.lock"));
        let io = |action: &'static str| {
            let at = at.clone();
            move |e| StoreError::io(&at, action, e)
        };
        let lock = loop {
            let lock = File::create(&lock_path).map_err(io("making its lock beside it"))?;
            match lock.try_lock() {
                Ok(()) => {}
                Err(fs::TryLockError::WouldBlock) => return Err(StoreError::Busy { at }),
                Err(fs::TryLockError::Error(e)) => return Err(StoreError::io(&at, "locking", e)),
            }
            // A build that just ended may have removed the name of the file that we locked.
            if is_same_file(&lock, &lock_path) {
                break lock;
            }
        };
        let draft = Self { target: target.into(), folder, lock_path, lock: Some(lock), placed: false };
        let aside = draft.folder.with_extension("old");
        if aside.exists() {
            // Only where names cannot be exchanged: a build was killed between its two renames.
            let back = if target.exists() { fs::remove_dir_all(&aside) } else { fs::rename(&aside, target) };
            back.map_err(io("bringing the old store back"))?;
        }
        draft.check_target(overwrite)?;
        match fs::remove_dir_all(&draft.folder) {
            Err(e) if e.kind() != ErrorKind::NotFound => return Err(io("clearing an old draft")(e)),
            _ => {}
        }
        fs::create_dir(&draft.folder).map_err(io("making a folder beside it"))?;
        Ok(draft)
    }

    /// Nothing but a store is ever replaced, and that only when asked for.
    fn check_target(&self, overwrite: bool) -> Result<(), StoreError> {
        let at = self.target.display().to_string();
        match fs::symlink_metadata(&self.target) {
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(()),
            Err(e) => Err(StoreError::io(&at, "looking at it", e)),
            Ok(_) if !Store::is_ours(&self.target) => Err(StoreError::NotOurs { at }),
            Ok(_) if !overwrite => Err(StoreError::Exists { at }),
            Ok(_) => Ok(()),
        }
    }

    /// Where to write.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Puts the folder in place of the target.
    pub fn place(mut self, overwrite: bool) -> Result<(), StoreError> {
        let at = self.target.display().to_string();
        let io = |action: &'static str| {
            let at = at.clone();
            move |e| StoreError::io(&at, action, e)
        };
        flush(&self.folder).map_err(io("writing it out to the disk"))?;
        // It may have appeared in the meantime.
        self.check_target(overwrite)?;
        if self.target.exists() {
            exchange(&self.folder, &self.target).map_err(io("putting it in place"))?;
            // What now stands under the draft's name is the old store.
            if let Err(e) = fs::remove_dir_all(&self.folder) {
                log::warn!("{}: the old store is left here: {e}", self.folder.display());
            }
        } else {
            fs::rename(&self.folder, &self.target).map_err(io("putting it in place"))?;
        }
        self.placed = true;
        if let Some(parent) = self.lock_path.parent() {
            // The names themselves; a file system that cannot flush a folder has nothing better to offer.
            let _ = File::open(parent).and_then(|f| f.sync_all());
        }
        Ok(())
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if !self.placed {
            let _ = fs::remove_dir_all(&self.folder);
        }
        // The name goes before the lock does: who waits for it finds a new file.
        let _ = fs::remove_file(&self.lock_path);
        self.lock = None;
    }
}

#[cfg(unix)]
fn is_same_file(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    match (file.metadata(), fs::metadata(path)) {
        (Ok(a), Ok(b)) => (a.dev(), a.ino()) == (b.dev(), b.ino()),
        _ => false,
    }
}

#[cfg(not(unix))]
fn is_same_file(_: &File, _: &Path) -> bool {
    true // a file that is open keeps its name there
}

#[cfg(target_os = "linux")]
fn flush(folder: &Path) -> std::io::Result<()> {
    rustix::fs::syncfs(File::open(folder)?)?;
    Ok(())
}

#[cfg(not(target_os = "linux"))]
fn flush(folder: &Path) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() { flush(&path)? } else { File::open(&path)?.sync_all()? }
    }
    Ok(())
}

#[cfg(target_os = "linux")]
fn exchange(a: &Path, b: &Path) -> std::io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    match renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE) {
        Ok(()) => Ok(()),
        // File systems without it (some network ones).
        Err(rustix::io::Errno::INVAL | rustix::io::Errno::NOSYS) => by_two_renames(a, b),
        Err(e) => Err(e.into()),
    }
}

#[cfg(not(target_os = "linux"))]
fn exchange(a: &Path, b: &Path) -> std::io::Result<()> {
    by_two_renames(a, b)
}

/// Where names cannot be exchanged (network file systems, other systems than Linux): for a moment only the old
/// store's other name exists, `.NAME.old`; the next build would bring it back.
fn by_two_renames(a: &Path, b: &Path) -> std::io::Result<()> {
    let aside = a.with_extension("old");
    fs::rename(b, &aside)?;
    if let Err(e) = fs::rename(a, b) {
        fs::rename(&aside, b)?;
        return Err(e);
    }
    fs::rename(&aside, a)
}
