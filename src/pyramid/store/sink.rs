//! Where a build writes: a folder whose files are counted and hashed on their way to the disk.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use xxhash_rust::xxh3::xxh3_64;
use zarrs::storage::byte_range::ByteRangeIterator;
use zarrs::storage::{
    Bytes, MaybeBytesIterator, OffsetBytesIterator, ReadableStorageTraits, StorageError, StoreKey,
    StorePrefix, WritableStorageTraits,
};

use super::bytes::{Folder, ReadAt as _};
use super::manifest::Written;

/// A storage of zarrs that writes each key once and remembers what it wrote.
pub(crate) struct Sink {
    root: PathBuf,
    written: Mutex<BTreeMap<String, Written>>,
}

impl Sink {
    pub fn new(root: PathBuf) -> Self {
        Self { root, written: Mutex::default() }
    }

    /// What was written so far.
    pub fn written(&self) -> BTreeMap<String, Written> {
        self.written.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub fn write(&self, file: &str, bytes: &[u8]) -> std::io::Result<()> {
        let path = self.root.join(file);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        std::fs::File::create(&path)?.write_all(bytes)?;
        let record = Written { bytes: bytes.len() as u64, xxh3: xxh3_64(bytes) };
        self.written.lock().unwrap_or_else(PoisonError::into_inner).insert(file.into(), record);
        Ok(())
    }
}

fn io(e: std::io::Error) -> StorageError {
    StorageError::IOError(Arc::new(e))
}

impl WritableStorageTraits for Sink {
    fn set(&self, key: &StoreKey, value: Bytes) -> Result<(), StorageError> {
        self.write(key.as_str(), &value).map_err(io)
    }

    fn set_partial_many(&self, _: &StoreKey, _: OffsetBytesIterator) -> Result<(), StorageError> {
        Err(StorageError::Unsupported("parts of files are never rewritten".into()))
    }

    /// A shard without any height is not written; there is nothing to erase.
    fn erase(&self, _: &StoreKey) -> Result<(), StorageError> {
        Ok(())
    }

    fn erase_prefix(&self, _: &StorePrefix) -> Result<(), StorageError> {
        Err(StorageError::Unsupported("a build never erases".into()))
    }

    fn supports_set_partial(&self) -> bool {
        false
    }
}

impl ReadableStorageTraits for Sink {
    fn get_partial_many<'a>(
        &'a self,
        key: &StoreKey,
        ranges: ByteRangeIterator<'a>,
    ) -> Result<MaybeBytesIterator<'a>, StorageError> {
        let folder = Folder { root: self.root.clone() };
        let Some(size) = folder.size(key.as_str()).map_err(io)? else { return Ok(None) };
        let name = key.as_str().to_string();
        let parts = ranges.map(move |range| {
            let (from, to) = (range.start(size), range.end(size));
            let length = usize::try_from(to.saturating_sub(from)).unwrap_or(usize::MAX);
            folder.read(&name, from, length).map(Bytes::from).map_err(io)
        });
        Ok(Some(Box::new(parts)))
    }

    fn size_key(&self, key: &StoreKey) -> Result<Option<u64>, StorageError> {
        Folder { root: self.root.clone() }.size(key.as_str()).map_err(io)
    }

    fn supports_get_partial(&self) -> bool {
        true
    }
}
