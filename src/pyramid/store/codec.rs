//! Sample types and codecs of the store. All coding is done by zarrs; this file only names the choices.

use std::num::NonZeroU64;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use zarrs::array::codec::{
    BloscCodec, BloscCodecConfiguration, BytesCodec, Crc32cCodec, PcodecCodec, PcodecCodecConfiguration,
};
use zarrs::array::{
    ArrayBuilder, ArrayBytes, ArrayToBytesCodecTraits as _, CodecChain, CodecOptions, DataType, FillValue,
    data_type,
};

use super::{SHARD, TILE};
use crate::pyramid::VOID;

/// How tiles are compressed; a checksum of the compressed bytes always follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Codec {
    /// Bytes shuffled, then Zstandard at level 5: what every Zarr reader and GDAL from 3.13 on can read.
    #[default]
    Blosc,
    /// pcodec, a fifth to a quarter smaller; zarr-python reads it with the package pcodec, GDAL does not.
    Pcodec,
}

impl std::fmt::Display for Codec {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Blosc => "blosc",
            Self::Pcodec => "pcodec",
        })
    }
}

/// Sample type of the arrays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Dtype {
    /// Whole metres, -32768 is void.
    Int16,
    /// Whole metres, 65535 is void.
    Uint16,
    /// Metres, NaN is void.
    Float32,
}

impl Dtype {
    /// Name, as numpy has it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Int16 => "int16",
            Self::Uint16 => "uint16",
            Self::Float32 => "float32",
        }
    }

    /// Bytes of a sample.
    #[must_use]
    pub fn bytes(self) -> usize {
        if self == Self::Float32 { 4 } else { 2 }
    }

    /// Bytes of a decoded tile.
    #[must_use]
    pub fn tile_bytes(self) -> u64 {
        (TILE * TILE * self.bytes()) as u64
    }

    fn zarr(self) -> (DataType, FillValue) {
        match self {
            Self::Int16 => (data_type::int16(), FillValue::from(i16::MIN)),
            Self::Uint16 => (data_type::uint16(), FillValue::from(u16::MAX)),
            Self::Float32 => (data_type::float32(), FillValue::from(f32::NAN)),
        }
    }

    /// True when a height (not a void) can be stored as this type without loss.
    #[must_use]
    pub(crate) fn holds(self, height_m: f32) -> bool {
        match self {
            Self::Int16 => height_m.fract() == 0.0 && height_m > -32_768.0 && height_m <= 32_767.0,
            Self::Uint16 => height_m.fract() == 0.0 && (0.0..65_535.0).contains(&height_m),
            // A void is marked by NaN here and by VOID in memory: neither is a height.
            Self::Float32 => height_m.is_finite() && height_m != VOID,
        }
    }
}

/// Decoded samples of one tile, row-major from its north-west corner.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Whole metres.
    Int16(Vec<i16>),
    /// Whole metres.
    Uint16(Vec<u16>),
    /// Metres.
    Float32(Vec<f32>),
}

impl Samples {
    /// From heights in metres, voids as NaN or [`VOID`]; the type must hold all of them.
    #[must_use]
    pub(crate) fn from_heights(dtype: Dtype, heights_m: &[f32]) -> Self {
        let void = |h: f32| h.is_nan() || h == VOID;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked by `holds`")]
        match dtype {
            Dtype::Int16 => {
                Self::Int16(heights_m.iter().map(|&h| if void(h) { i16::MIN } else { h as i16 }).collect())
            }
            Dtype::Uint16 => {
                Self::Uint16(heights_m.iter().map(|&h| if void(h) { u16::MAX } else { h as u16 }).collect())
            }
            Dtype::Float32 => {
                Self::Float32(heights_m.iter().map(|&h| if void(h) { f32::NAN } else { h }).collect())
            }
        }
    }

    /// Appends `count` heights from sample `from` on, in metres, [`VOID`] where there is none.
    pub(crate) fn append(&self, from: usize, count: usize, out: &mut Vec<f32>) {
        let to = from + count;
        match self {
            Self::Int16(v) => {
                out.extend(v[from..to].iter().map(|&h| if h == i16::MIN { VOID } else { f32::from(h) }));
            }
            Self::Uint16(v) => {
                out.extend(v[from..to].iter().map(|&h| if h == u16::MAX { VOID } else { f32::from(h) }));
            }
            Self::Float32(v) => out.extend(v[from..to].iter().map(|&h| if h.is_nan() { VOID } else { h })),
        }
    }

    fn into_bytes(self) -> ArrayBytes<'static> {
        match self {
            Self::Int16(v) => bytemuck::cast_slice::<i16, u8>(&v).to_vec().into(),
            Self::Uint16(v) => bytemuck::cast_slice::<u16, u8>(&v).to_vec().into(),
            Self::Float32(v) => bytemuck::cast_slice::<f32, u8>(&v).to_vec().into(),
        }
    }
}

/// The codec of one tile, ready to decode; also builds arrays that encode with it.
pub(crate) struct Coder {
    codec: Codec,
    dtype: Dtype,
    chain: CodecChain,
    data_type: DataType,
    fill: FillValue,
}

impl Coder {
    /// # Errors
    /// When the library does not know the codec, in its words.
    pub fn new(codec: Codec, dtype: Dtype) -> Result<Self, String> {
        let (data_type, fill) = dtype.zarr();
        let crc = Arc::new(Crc32cCodec::new());
        let chain = match codec {
            Codec::Blosc => {
                CodecChain::new(vec![], Arc::new(BytesCodec::little()), vec![blosc(dtype.bytes())?, crc])
            }
            Codec::Pcodec => CodecChain::new(vec![], pcodec()?, vec![crc]),
        };
        Ok(Self { codec, dtype, chain, data_type, fill })
    }

    /// Decodes one tile.
    ///
    /// # Errors
    /// A checksum that does not match, or bytes that do not decode, in the library's words.
    pub fn decode(&self, encoded: &[u8]) -> Result<Samples, String> {
        if self.codec == Codec::Pcodec {
            return self.decode_pcodec(encoded);
        }
        check_frame(encoded, self.dtype.tile_bytes())?;
        let side = NonZeroU64::new(TILE as u64).ok_or("no tile")?;
        let bytes = self
            .chain
            .decode(encoded.into(), &[side, side], &self.data_type, &self.fill, &one_thread())
            .and_then(|b| b.into_fixed().map_err(Into::into))
            .map_err(|e| e.to_string())?;
        if bytes.len() as u64 != self.dtype.tile_bytes() {
            return Err(format!("{} bytes decoded, {} expected", bytes.len(), self.dtype.tile_bytes()));
        }
        Ok(match self.dtype {
            Dtype::Int16 => Samples::Int16(bytemuck::pod_collect_to_vec(&bytes)),
            Dtype::Uint16 => Samples::Uint16(bytemuck::pod_collect_to_vec(&bytes)),
            Dtype::Float32 => Samples::Float32(bytemuck::pod_collect_to_vec(&bytes)),
        })
    }

    /// The chain for pcodec by hand, into memory of a tile's size: the library's own decoder takes as much as
    /// the bytes ask for.
    fn decode_pcodec(&self, encoded: &[u8]) -> Result<Samples, String> {
        fn into<T: pco::data_types::Number>(frame: &[u8], mut out: Vec<T>) -> Result<Vec<T>, String> {
            let done = pco::standalone::simple_decompress_into(frame, &mut out).map_err(|e| e.to_string())?;
            if done.n_processed != out.len() || !done.finished {
                return Err(format!("{} samples decoded, {} expected", done.n_processed, out.len()));
            }
            Ok(out)
        }
        let Some((frame, sum)) = encoded.split_last_chunk::<4>() else {
            return Err("shorter than its checksum".into());
        };
        if crc32c::crc32c(frame) != u32::from_le_bytes(*sum) {
            return Err("the checksum is invalid".into());
        }
        let count = TILE * TILE;
        Ok(match self.dtype {
            Dtype::Int16 => Samples::Int16(into(frame, vec![0; count])?),
            Dtype::Uint16 => Samples::Uint16(into(frame, vec![0; count])?),
            Dtype::Float32 => Samples::Float32(into(frame, vec![0.0; count])?),
        })
    }

    /// A tile of voids.
    pub fn void_tile(&self) -> Samples {
        Samples::from_heights(self.dtype, &vec![VOID; TILE * TILE])
    }
}

/// A sharded array of elevation of the given size, rows first.
///
/// # Errors
/// In the library's words.
pub(crate) fn elevation_array(codec: Codec, dtype: Dtype, size: [u64; 2]) -> Result<ArrayBuilder, String> {
    let (data_type, fill) = dtype.zarr();
    let mut builder =
        ArrayBuilder::new(vec![size[1], size[0]], vec![SHARD as u64, SHARD as u64], data_type, fill);
    builder.subchunk_shape(vec![TILE as u64, TILE as u64]).dimension_names(["y", "x"].into());
    let crc = Arc::new(Crc32cCodec::new());
    match codec {
        Codec::Blosc => builder
            .array_to_bytes_codec(Arc::new(BytesCodec::little()))
            .bytes_to_bytes_codecs(vec![blosc(dtype.bytes())?, crc]),
        Codec::Pcodec => builder.array_to_bytes_codec(pcodec()?).bytes_to_bytes_codecs(vec![crc]),
    };
    Ok(builder)
}

/// The array of figures a tile.
pub(crate) fn figures_array(tiles: [u64; 2], fields: u64) -> ArrayBuilder {
    let shape = vec![tiles[1], tiles[0], fields];
    let mut builder = ArrayBuilder::new(shape.clone(), shape, data_type::float32(), f32::NAN);
    // Not compressed: their size is then known before memory is taken.
    builder
        .dimension_names(["tile_row", "tile_column", "figure"].into())
        .bytes_to_bytes_codecs(vec![Arc::new(Crc32cCodec::new())]);
    builder
}

/// Loaders and builders are threads already: none of them should start more.
pub(crate) fn one_thread() -> CodecOptions {
    CodecOptions::default().with_concurrent_target(1)
}

/// Bytes of samples for an encoder.
pub(crate) fn array_bytes(samples: Samples) -> ArrayBytes<'static> {
    samples.into_bytes()
}

/// Blosc takes memory for the size a frame says it has: bytes that lie may have a fitting checksum.
pub(crate) fn check_frame(encoded: &[u8], bytes: u64) -> Result<(), String> {
    // Bytes 4 to 7 of the frame, little-endian.
    let size = encoded.get(4..8).and_then(|b| Some(u32::from_le_bytes(b.try_into().ok()?)));
    if size.map(u64::from) != Some(bytes) {
        return Err("its frame has another size than what it should hold".into());
    }
    Ok(())
}

/// Shuffled by elements of so many bytes.
pub(crate) fn blosc(element_bytes: usize) -> Result<Arc<BloscCodec>, String> {
    let configuration: BloscCodecConfiguration = serde_json::from_value(serde_json::json!({
        "cname": "zstd", "clevel": 5, "shuffle": "shuffle", "typesize": element_bytes, "blocksize": 0,
    }))
    .map_err(|e| e.to_string())?;
    BloscCodec::new_with_configuration(&configuration).map(Arc::new).map_err(|e| e.to_string())
}

fn pcodec() -> Result<Arc<PcodecCodec>, String> {
    let configuration: PcodecCodecConfiguration = serde_json::from_value(serde_json::json!({
        "level": 8, "mode_spec": "auto", "delta_spec": "auto", "delta_encoding_order": null,
        "paging_spec": "equal_pages_up_to", "equal_pages_up_to": 262_144,
    }))
    .map_err(|e| e.to_string())?;
    PcodecCodec::new_with_configuration(&configuration).map(Arc::new).map_err(|e| e.to_string())
}
