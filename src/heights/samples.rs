//! Samples of any type, decoded or as they lie in a file, to heights in metres.

use tiff::decoder::DecodingResult;

use super::gdal_tags::Nodata;
use super::raster::ZMap;

/// A sample type: its value, and a void value in that very type.
trait Sample: Copy + PartialEq {
    fn value(self) -> f64;
    /// `None` where no sample of the type can be void.
    fn void(nodata: Nodata) -> Option<Self>;
}

macro_rules! integer_samples {
    ($($t:ty),*) => {$(
        impl Sample for $t {
            fn value(self) -> f64 {
                self as f64
            }
            fn void(nodata: Nodata) -> Option<Self> {
                nodata.integer.and_then(|n| <$t>::try_from(n).ok())
            }
        }
    )*};
}
integer_samples!(u8, i8, u16, i16, u32, i32, u64, i64);

impl Sample for f32 {
    fn value(self) -> f64 {
        f64::from(self)
    }
    fn void(nodata: Nodata) -> Option<Self> {
        Some(nodata.float as f32)
    }
}

impl Sample for f64 {
    fn value(self) -> f64 {
        self
    }
    fn void(nodata: Nodata) -> Option<Self> {
        Some(nodata.float)
    }
}

/// What raw samples mean.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rule {
    /// The declared void value.
    pub(crate) nodata: Option<Nodata>,
    /// From raw values to metres.
    pub(crate) z: ZMap,
}

impl Rule {
    /// Height of a sample that a file leaves out: 0 by convention, or void if it declares voids.
    pub(crate) fn sparse(self) -> f32 {
        if self.nodata.is_some() { f32::NAN } else { self.z.metres(0.0).unwrap_or(f32::NAN) }
    }

    /// Heights in metres, NaN for `nodata` and for what is not finite.
    fn fill<S: Sample>(self, samples: impl Iterator<Item = S>, out: &mut [f32]) {
        let void = self.nodata.and_then(S::void);
        // Told apart here and not for each sample.
        if self.z == ZMap::IDENTITY {
            convert(samples, void, out, |raw| raw as f32);
        } else {
            convert(samples, void, out, |raw| self.z.apply(raw));
        }
    }
}

fn convert<S: Sample>(
    samples: impl Iterator<Item = S>,
    void: Option<S>,
    out: &mut [f32],
    metres: impl Fn(f64) -> f32,
) {
    for (height, sample) in out.iter_mut().zip(samples) {
        let h = metres(sample.value());
        *height = if Some(sample) == void || !h.is_finite() { f32::NAN } else { h };
    }
}

/// Heights of the pixels from `start` on of a decoded block with `stride` samples a pixel, of which
/// the first counts. All void where the block ends early.
pub(crate) fn from_block(data: &DecodingResult, start: usize, stride: usize, rule: Rule, out: &mut [f32]) {
    match data {
        DecodingResult::U8(v) => pick(v, start, stride, rule, out, |s| s),
        DecodingResult::U16(v) => pick(v, start, stride, rule, out, |s| s),
        DecodingResult::U32(v) => pick(v, start, stride, rule, out, |s| s),
        DecodingResult::U64(v) => pick(v, start, stride, rule, out, |s| s),
        DecodingResult::I8(v) => pick(v, start, stride, rule, out, |s| s),
        DecodingResult::I16(v) => pick(v, start, stride, rule, out, |s| s),
        DecodingResult::I32(v) => pick(v, start, stride, rule, out, |s| s),
        DecodingResult::I64(v) => pick(v, start, stride, rule, out, |s| s),
        DecodingResult::F16(v) => pick(v, start, stride, rule, out, |s| s.to_f32()),
        DecodingResult::F32(v) => pick(v, start, stride, rule, out, |s| s),
        DecodingResult::F64(v) => pick(v, start, stride, rule, out, |s| s),
    }
}

fn pick<T: Copy, S: Sample>(
    data: &[T],
    start: usize,
    stride: usize,
    rule: Rule,
    out: &mut [f32],
    sample: impl Fn(T) -> S,
) {
    let Some(last) = out.len().checked_sub(1) else {
        return;
    };
    match data.get(start * stride..(start + last) * stride + 1) {
        Some(part) if stride == 1 => rule.fill(part.iter().map(|&s| sample(s)), out),
        Some(part) => rule.fill(part.iter().step_by(stride).map(|&s| sample(s)), out),
        None => out.fill(f32::NAN),
    }
}

/// A sample type as it lies in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stored {
    U8,
    U16,
    U32,
    U64,
    I8,
    I16,
    I32,
    I64,
    F32,
    F64,
}

impl Stored {
    /// The type of a TIFF sample format and a number of bits; `None` for any other.
    pub(crate) fn new(format: u64, bits: u64) -> Option<Self> {
        Some(match (format, bits) {
            (1, 8) => Self::U8,
            (1, 16) => Self::U16,
            (1, 32) => Self::U32,
            (1, 64) => Self::U64,
            (2, 8) => Self::I8,
            (2, 16) => Self::I16,
            (2, 32) => Self::I32,
            (2, 64) => Self::I64,
            (3, 32) => Self::F32,
            (3, 64) => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of a sample.
    pub(crate) fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    /// Heights of samples as the file holds them.
    pub(crate) fn heights(self, bytes: &[u8], big_endian: bool, rule: Rule, out: &mut [f32]) {
        macro_rules! fill {
            ($t:ty) => {{
                let samples = bytes.as_chunks::<{ size_of::<$t>() }>().0.iter();
                if big_endian {
                    rule.fill(samples.map(|b| <$t>::from_be_bytes(*b)), out);
                } else {
                    rule.fill(samples.map(|b| <$t>::from_le_bytes(*b)), out);
                }
            }};
        }
        match self {
            Self::U8 => fill!(u8),
            Self::U16 => fill!(u16),
            Self::U32 => fill!(u32),
            Self::U64 => fill!(u64),
            Self::I8 => fill!(i8),
            Self::I16 => fill!(i16),
            Self::I32 => fill!(i32),
            Self::I64 => fill!(i64),
            Self::F32 => fill!(f32),
            Self::F64 => fill!(f64),
        }
    }
}
