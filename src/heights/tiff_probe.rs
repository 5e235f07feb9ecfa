//! A first look at a TIFF: only the tags that say how large it is and how it is packed.
//!
//! The decoder crate reads its block tables before anyone can ask for the size, and multiplies
//! sizes it has not checked. So they are read and checked here first.

use std::io::{Error, ErrorKind, Read, Result, Seek, SeekFrom};

/// Most directory entries worth looking at; real elevation files have about twenty.
const MAX_ENTRIES: u64 = 4096;

/// The layout tags of the first image, with the defaults of the TIFF specification.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Probe {
    pub(crate) width: u64,
    pub(crate) height: u64,
    pub(crate) bits: u64,
    pub(crate) compression: u64,
    /// 0 = white is zero, 1 = black is zero, 2 = RGB, ...; `None` when missing.
    pub(crate) photometric: Option<u64>,
    pub(crate) samples: u64,
    pub(crate) rows_per_strip: u64,
    /// 1 = chunky, 2 = one plane per band.
    pub(crate) planar: u64,
    pub(crate) predictor: u64,
    /// Columns and rows of a tile; `None` for strips.
    pub(crate) tile: Option<[u64; 2]>,
    /// 1 = unsigned, 2 = signed, 3 = float.
    pub(crate) sample_format: u64,
    /// Where in the file the width is stored: position and bytes.
    pub(crate) width_field: (u64, usize),
    pub(crate) big_endian: bool,
}

struct Source<R> {
    reader: R,
    big_endian: bool,
}

impl<R: Read + Seek> Source<R> {
    /// An unsigned integer of `N` bytes at the current position.
    fn uint<const N: usize>(&mut self) -> Result<u64> {
        let mut bytes = [0; N];
        self.reader.read_exact(&mut bytes)?;
        Ok(self.value(&bytes))
    }

    fn value(&self, bytes: &[u8]) -> u64 {
        let fold = |acc: u64, &b: &u8| acc << 8 | u64::from(b);
        if self.big_endian { bytes.iter().fold(0, fold) } else { bytes.iter().rev().fold(0, fold) }
    }
}

fn broken(what: &str) -> Error {
    Error::new(ErrorKind::InvalidData, what.to_owned())
}

/// Reads the first directory. Errors are of kind `InvalidData`, `UnexpectedEof` or the system's.
pub(crate) fn probe(reader: impl Read + Seek) -> Result<Probe> {
    let mut source = Source { reader, big_endian: false };
    let mut order = [0; 2];
    source.reader.read_exact(&mut order)?;
    source.big_endian = &order == b"MM";
    let (offset, big) = match source.uint::<2>()? {
        42 => (source.uint::<4>()?, false),
        43 => {
            source.uint::<4>()?;
            (source.uint::<8>()?, true)
        }
        _ => return Err(broken("bad signature")),
    };
    source.reader.seek(SeekFrom::Start(offset))?;
    let count = if big { source.uint::<8>()? } else { source.uint::<2>()? };
    if count > MAX_ENTRIES {
        return Err(broken("more than 4096 directory entries"));
    }
    let entry_bytes: usize = if big { 20 } else { 12 };
    let mut directory = vec![0_u8; count as usize * entry_bytes];
    source.reader.read_exact(&mut directory)?;

    let mut tags: [(u64, Option<u64>); 12] =
        [256, 257, 258, 259, 262, 277, 278, 284, 317, 322, 323, 339].map(|t| (t, None));
    let mut width_field = (0, 0);
    let first_entry = offset.saturating_add(if big { 8 } else { 2 });
    for (i, entry) in directory.chunks_exact(entry_bytes).enumerate() {
        let tag = source.value(&entry[..2]);
        if tag == 256 {
            let field = entry_bytes * i + if big { 12 } else { 8 };
            let bytes = match source.value(&entry[2..4]) {
                3 => 2,
                4 => 4,
                _ => 0,
            };
            width_field = (first_entry.saturating_add(field as u64), bytes);
        }
        let Some(slot) = tags.iter_mut().find(|(t, _)| *t == tag) else {
            continue;
        };
        // The decoder would silently take the last one, which nobody has checked.
        if slot.1.is_some() {
            return Err(broken(&format!("tag {tag} occurs twice")));
        }
        slot.1 = Some(first_value(&mut source, entry, big)?);
    }
    let get = |tag: u64| tags.iter().find(|(t, _)| *t == tag).and_then(|(_, v)| *v);
    let need = |tag: u64| get(tag).ok_or_else(|| broken(&format!("tag {tag} is missing")));
    let height = need(257)?;
    Ok(Probe {
        width: need(256)?,
        height,
        bits: get(258).unwrap_or(1),
        compression: get(259).unwrap_or(1),
        photometric: get(262),
        samples: get(277).unwrap_or(1),
        rows_per_strip: get(278).unwrap_or(height),
        planar: get(284).unwrap_or(1),
        predictor: get(317).unwrap_or(1),
        tile: get(322).zip(get(323)).map(|(w, h)| [w, h]),
        sample_format: get(339).unwrap_or(1),
        width_field,
        big_endian: source.big_endian,
    })
}

/// The first value of an entry of an unsigned integer type.
fn first_value<R: Read + Seek>(source: &mut Source<R>, entry: &[u8], big: bool) -> Result<u64> {
    let tag = source.value(&entry[..2]);
    let (count, field) = if big {
        (source.value(&entry[4..12]), &entry[12..20])
    } else {
        (source.value(&entry[4..8]), &entry[8..12])
    };
    let size: u64 = match source.value(&entry[2..4]) {
        1 => 1,
        3 => 2,
        4 => 4,
        16 => 8,
        other => return Err(broken(&format!("tag {tag} has type {other}"))),
    };
    if count == 0 {
        return Err(broken(&format!("tag {tag} has no value")));
    }
    if count.saturating_mul(size) <= field.len() as u64 {
        return Ok(source.value(&field[..size as usize]));
    }
    let offset = source.value(field);
    source.reader.seek(SeekFrom::Start(offset))?;
    match size {
        1 => source.uint::<1>(),
        2 => source.uint::<2>(),
        4 => source.uint::<4>(),
        _ => source.uint::<8>(),
    }
}
