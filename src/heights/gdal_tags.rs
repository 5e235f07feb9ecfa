//! GDAL's two private TIFF tags: the nodata value, and scale, offset and unit in a bit of XML.

use super::raster::ZMap;

/// Metres per international foot.
pub(crate) const FOOT_M: f64 = 0.3048;
/// Metres per US survey foot.
pub(crate) const US_FOOT_M: f64 = 1200.0 / 3937.0;

/// A declared void value, kept in every type it may have to be compared in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Nodata {
    /// The value if it is a whole number.
    pub(crate) integer: Option<i128>,
    /// The value as the nearest `f64`; may be NaN or infinite.
    pub(crate) float: f64,
}

impl Nodata {
    /// Parses the text of tag 42113. `Ok(None)` if it is empty, `Err` with the text if it is no
    /// number.
    pub(crate) fn parse(text: &str) -> Result<Option<Self>, String> {
        let text = text.trim_matches(|c: char| c == '\0' || c.is_whitespace());
        if text.is_empty() {
            return Ok(None);
        }
        let float: f64 = text.parse().map_err(|_| text.to_owned())?;
        // Straight from the text where possible: an `f64` cannot hold every 64-bit integer.
        let integer = text.parse().ok().or_else(|| {
            let whole = float.fract() == 0.0 && float.abs() < 1e30;
            whole.then_some(float as i128)
        });
        Ok(Some(Self { integer, float }))
    }
}

/// Scale, offset and unit of band 1 from the XML of tag 42112, as a map to metres.
///
/// The second value tells whether the unit was one of feet. Items that are missing, of other
/// bands or no numbers change nothing.
pub(crate) fn metadata_zmap(xml: &str) -> (ZMap, bool) {
    let (mut scale, mut offset, mut unit) = (1.0, 0.0, 1.0);
    for item in xml.split("<Item").skip(1) {
        let Some((attributes, rest)) = item.split_once('>') else {
            continue;
        };
        let value = rest.split('<').next().unwrap_or("").trim();
        if attribute(attributes, "sample").is_some_and(|s| s != "0") {
            continue;
        }
        let number = || value.parse().ok().filter(|v: &f64| v.is_finite());
        match attribute(attributes, "role") {
            Some("scale") => scale = number().filter(|&v| v != 0.0).unwrap_or(scale),
            Some("offset") => offset = number().unwrap_or(offset),
            Some("unittype") => {
                unit = match value.to_ascii_lowercase().as_str() {
                    "ft" | "foot" | "feet" => FOOT_M,
                    "us survey foot" | "ft-us" | "us-ft" | "ftus" => US_FOOT_M,
                    _ => 1.0,
                }
            }
            _ => {}
        }
    }
    let map = ZMap::IDENTITY.then(scale, offset).then(unit, 0.0);
    (map, unit != 1.0)
}

/// The value of `name="value"` in the attributes of a tag.
fn attribute<'a>(attributes: &'a str, name: &str) -> Option<&'a str> {
    attributes.split_whitespace().find_map(|part| {
        let (key, value) = part.split_once('=')?;
        (key == name).then(|| value.trim_matches('"'))
    })
}

#[cfg(test)]
mod tests {
    use super::{Nodata, metadata_zmap};

    #[test]
    fn nodata_texts() {
        let of = |t: &str| Nodata::parse(t).unwrap();
        assert_eq!(of("\0"), None);
        assert_eq!(of("-32768\0").unwrap().integer, Some(-32768));
        assert_eq!(of("-3.2768e4").unwrap().integer, Some(-32768));
        assert!(of(" nan").unwrap().float.is_nan());
        assert!(of("-inf").unwrap().integer.is_none());
        assert!(Nodata::parse("none").is_err());
    }

    #[test]
    fn scale_and_offset_of_the_first_band() {
        let xml = r#"<GDALMetadata>
            <Item name="OFFSET" sample="0" role="offset">-100</Item>
            <Item name="SCALE" sample="0" role="scale">0.5</Item>
            <Item name="SCALE" sample="1" role="scale">7</Item></GDALMetadata>"#;
        let (map, feet) = metadata_zmap(xml);
        assert_eq!(map.metres(10.0), Some(-95.0));
        assert!(!feet);
    }
}
