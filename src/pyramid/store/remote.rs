//! Stores behind HTTP(S) and in object stores, read by byte ranges.

use std::io;
use std::sync::Arc;

use object_store::path::Path;
use object_store::{Error, ObjectStore, ObjectStoreExt as _, parse_url_opts};
use tokio::runtime::Runtime;
use url::Url;

use super::{ReadAt, Store, StoreError};

/// Files below one address. Credentials come from the environment, as their services document it. Its calls
/// block and must not be made from inside another asynchronous runtime.
pub struct Remote {
    store: Box<dyn ObjectStore>,
    base: Path,
    /// Requests run here; loader threads wait for them.
    runtime: Runtime,
}

impl Remote {
    /// Opens the store at an address: `http://`, `https://`, `s3://`, `gs://`, `az://`.
    ///
    /// # Errors
    /// An address that is none, and as [`Store::open`].
    pub fn open(address: &str) -> Result<Store, StoreError> {
        Store::open_from(Arc::new(Self::connect(address)?), address)
    }

    fn connect(address: &str) -> Result<Self, StoreError> {
        let wrong = |reason: String| StoreError::NotAStore { at: address.into(), reason };
        let url = Url::parse(address).map_err(|e| wrong(e.to_string()))?;
        let mut options: Vec<(String, String)> = std::env::vars_os()
            .filter_map(|(k, v)| Some((k.into_string().ok()?, v.into_string().ok()?)))
            .filter(|(k, _)| ["AWS_", "GOOGLE_", "AZURE_"].iter().any(|p| k.starts_with(p)))
            .map(|(k, v)| (k.to_ascii_lowercase(), v))
            .collect();
        if url.scheme() == "http" {
            options.push(("allow_http".into(), "true".into()));
        }
        let (store, base) = parse_url_opts(&url, options).map_err(|e| wrong(e.to_string()))?;
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()
            .map_err(|e| StoreError::io(address, "starting its network threads", e))?;
        Ok(Self { store, base, runtime })
    }

    fn path(&self, file: &str) -> Path {
        file.split('/').fold(self.base.clone(), |path, part| path.join(part))
    }
}

fn to_io(e: Error) -> io::Error {
    match e {
        Error::NotFound { .. } => io::ErrorKind::NotFound.into(),
        other => io::Error::other(other.to_string()),
    }
}

impl ReadAt for Remote {
    fn is_near(&self) -> bool {
        false
    }

    fn size(&self, file: &str) -> io::Result<Option<u64>> {
        match self.runtime.block_on(self.store.head(&self.path(file))) {
            Ok(meta) => Ok(Some(meta.size)),
            Err(Error::NotFound { .. }) => Ok(None),
            Err(e) => Err(to_io(e)),
        }
    }

    fn read(&self, file: &str, offset: u64, length: usize) -> io::Result<Vec<u8>> {
        if length == 0 {
            return Ok(Vec::new());
        }
        let range = offset..offset + length as u64;
        let bytes = self.runtime.block_on(self.store.get_range(&self.path(file), range)).map_err(to_io)?;
        if bytes.len() != length {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        Ok(bytes.to_vec())
    }
}
