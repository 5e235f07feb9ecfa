//! Exports for tools that read no sharded Zarr: a Cloud Optimized GeoTIFF, written by GDAL.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, bail};
use tessclip::heights::RasterSource;

use super::Outcome;
use super::args::{ReadArgs, check_writable};

/// Bytes read at once.
const BAND_BYTES: u64 = 64 << 20;

/// Writes raw samples and a description of them beside the output, and lets `gdal_translate` make the COG.
pub fn to_cog(dems: &[String], output: &Path, read: &ReadArgs, overwrite: bool) -> anyhow::Result<Outcome> {
    check_writable(output)?;
    if output.exists() && !overwrite {
        bail!("{}: exists already; give another name or --overwrite", output.display());
    }
    let missing = || "gdal_translate, which writes COGs, is not installed: apt-get install gdal-bin";
    Command::new("gdal_translate").arg("--version").output().with_context(missing)?;
    let source = super::build::open_sources(dems, &read.options())?;
    let draft = Draft::new(output)?;
    write_raw(source.as_ref(), &draft.raw)
        .with_context(|| format!("{}: cannot be written", draft.raw.display()))?;
    let description = describe(source.as_ref(), &draft.raw);
    std::fs::write(&draft.vrt, description)
        .with_context(|| format!("{}: cannot be written", draft.vrt.display()))?;
    let options = ["-q", "-of", "COG", "-co", "COMPRESS=DEFLATE", "-co", "BIGTIFF=IF_SAFER", "-co"];
    let predictor = if is_short(source.as_ref()) { "PREDICTOR=2" } else { "PREDICTOR=3" };
    let done = Command::new("gdal_translate")
        .args(options)
        .arg(predictor)
        .args(["-co", "RESAMPLING=NEAREST", "-co", "OVERVIEW_RESAMPLING=NEAREST"])
        .arg(&draft.vrt)
        .arg(&draft.part)
        .output()
        .with_context(missing)?;
    if !done.status.success() {
        bail!("{}: gdal_translate failed: {}", output.display(), String::from_utf8_lossy(&done.stderr));
    }
    std::fs::rename(&draft.part, output)
        .with_context(|| format!("{}: cannot be written", output.display()))?;
    Ok(Outcome::Done)
}

/// Files beside the output that go away whatever happens.
struct Draft {
    raw: PathBuf,
    vrt: PathBuf,
    part: PathBuf,
}

impl Draft {
    fn new(output: &Path) -> anyhow::Result<Self> {
        let name = output.file_name().context("name a file")?.to_string_lossy().into_owned();
        let beside = |end: &str| output.with_file_name(format!(".{name}.{}.{end}", std::process::id()));
        Ok(Self { raw: beside("raw"), vrt: beside("vrt"), part: beside("tif") })
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        for file in [&self.raw, &self.vrt, &self.part] {
            let _ = std::fs::remove_file(file);
        }
    }
}

fn is_short(source: &dyn RasterSource) -> bool {
    source.header().raw && matches!(source.header().dtype, "byte" | "int8" | "int16")
}

/// Rows from the north, little-endian; -32768 or NaN where void.
fn write_raw(source: &dyn RasterSource, path: &Path) -> anyhow::Result<()> {
    let header = source.header();
    let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let width = usize::try_from(header.width)?;
    let short = is_short(source);
    let mut top = header.height;
    let mut band = Vec::new();
    while top > 0 {
        let rows = top.min((BAND_BYTES / (4 * header.width)).max(1));
        top -= rows;
        let count = usize::try_from(rows)?;
        band.clear();
        band.resize(width * count, f32::NAN);
        source.read([0, top], [width, count], &mut band)?;
        for row in band.chunks_exact(width).rev() {
            for &h in row {
                if short {
                    #[expect(clippy::cast_possible_truncation, reason = "the source's own type")]
                    let whole = if h.is_nan() { i16::MIN } else { h as i16 };
                    file.write_all(&whole.to_le_bytes())?;
                } else {
                    file.write_all(&h.to_le_bytes())?;
                }
            }
        }
    }
    Ok(file.flush()?)
}

fn xml(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// A GDAL virtual raster over the raw file.
fn describe(source: &dyn RasterSource, raw: &Path) -> String {
    let h = source.header();
    let (origin, step) = match h.georeference.degrees {
        Some(d) => ([d.west, d.south], d.step),
        None => (h.origin_m, h.spacing_m),
    };
    let north = origin[1] + ((h.height - 1) as f64 + 0.5) * step[1];
    let transform = format!("{}, {}, 0, {}, 0, {}", origin[0] - 0.5 * step[0], step[0], north, -step[1]);
    let (kind, bytes, void) = if is_short(source) { ("Int16", 2, "-32768") } else { ("Float32", 4, "nan") };
    let srs = h.georeference.crs.as_ref().map_or(String::new(), |c| format!("  <SRS>{}</SRS>\n", xml(c)));
    let meaning = if h.georeference.pixel_is_point { "Point" } else { "Area" };
    let name = xml(&raw.file_name().unwrap_or_default().to_string_lossy());
    format!(
        "<VRTDataset rasterXSize=\"{w}\" rasterYSize=\"{hh}\">\n{srs}  <GeoTransform>{transform}</GeoTransform>\n  \
         <Metadata><MDI key=\"AREA_OR_POINT\">{meaning}</MDI></Metadata>\n  \
         <VRTRasterBand dataType=\"{kind}\" band=\"1\" subClass=\"VRTRawRasterBand\">\n    \
         <NoDataValue>{void}</NoDataValue>\n    <UnitType>m</UnitType>\n    \
         <SourceFilename relativetoVRT=\"1\">{name}</SourceFilename>\n    <ImageOffset>0</ImageOffset>\n    \
         <PixelOffset>{bytes}</PixelOffset>\n    <LineOffset>{line}</LineOffset>\n    <ByteOrder>LSB</ByteOrder>\n  \
         </VRTRasterBand>\n</VRTDataset>\n",
        w = h.width,
        hh = h.height,
        line = h.width * bytes,
    )
}
