//! A way around a defect of the decoder crate: its LZW reader fails on tiles that reach over the
//! right edge of the image, because it decodes them in pieces. Shown a width that is a multiple
//! of the tile width, it decodes whole tiles, which are then cut here.

use std::io::{Read, Result, Seek, SeekFrom};

use super::tiff_probe::Probe;

/// A reader in which a few bytes read differently.
pub(crate) struct Patched<R> {
    inner: R,
    position: u64,
    at: u64,
    bytes: Vec<u8>,
}

impl<R> Patched<R> {
    /// Wraps a reader that stands at its start. Nothing is changed unless the file is LZW in
    /// tiles with a partial last column, and the padded width fits its field.
    pub(crate) fn new(inner: R, probe: &Probe) -> Self {
        let (at, size) = probe.width_field;
        let bytes = match probe.tile {
            Some([tile, _]) if probe.compression == 5 && !probe.width.is_multiple_of(tile) => {
                encode(probe.width.next_multiple_of(tile), size, probe.big_endian)
            }
            _ => Vec::new(),
        };
        Self { inner, position: 0, at, bytes }
    }
}

/// `value` in `size` bytes; empty if it does not fit.
fn encode(value: u64, size: usize, big_endian: bool) -> Vec<u8> {
    let all = value.to_le_bytes();
    if size == 0 || size > 8 || all[size..].iter().any(|&b| b != 0) {
        return Vec::new();
    }
    let mut bytes = all[..size].to_vec();
    if big_endian {
        bytes.reverse();
    }
    bytes
}

impl<R: Read> Read for Patched<R> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let count = self.inner.read(buffer)?;
        for (i, &byte) in self.bytes.iter().enumerate() {
            let place = (self.at + i as u64).checked_sub(self.position);
            let place = place.and_then(|p| usize::try_from(p).ok());
            if let Some(target) = place.and_then(|p| buffer[..count].get_mut(p)) {
                *target = byte;
            }
        }
        self.position += count as u64;
        Ok(count)
    }
}

impl<R: Seek> Seek for Patched<R> {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        self.position = self.inner.seek(to)?;
        Ok(self.position)
    }
}
