//! The name of a base surface as given by a user, read and written.

use std::fmt;
use std::str::FromStr;

use super::{Cylinder, Ellipsoid, Plane, Surface, Torus};

/// Which base surface, by its measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Base {
    /// The plane z = 0.
    Plane,
    /// An ellipsoid of revolution around z; a sphere when both are equal.
    Ellipsoid {
        /// Radius of the equator, metres.
        a_m: f64,
        /// Half the length of the axis, metres.
        b_m: f64,
    },
    /// A cylinder around z.
    Cylinder {
        /// Radius, metres.
        radius_m: f64,
        /// True when heights grow towards the axis.
        inside: bool,
    },
    /// A ring torus around z.
    Torus {
        /// From the axis to the middle of the tube, metres.
        major_m: f64,
        /// Radius of the tube, metres.
        minor_m: f64,
    },
    /// A grid of positions, given elsewhere.
    Sampled,
}

/// Why a text names no base surface. Every message is one line: what is wrong, what to give.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BaseError {
    /// No surface has this name.
    #[error(
        "base `{name}`: unknown; give plane, wgs84, moon, mars, sphere:R, ellipsoid:A,B, \
         cylinder:R, cylinder:R,inside, torus:R,r or sampled"
    )]
    Unknown {
        /// The text before the colon.
        name: String,
    },
    /// Too many or too few measures, or a word that does not belong.
    #[error("base `{given}`: wrong measures; give {expected}")]
    Form {
        /// The text as given.
        given: String,
        /// The right form.
        expected: &'static str,
    },
    /// A measure is no number.
    #[error("base {name}: `{value}` is not a number; give metres, like 6371000")]
    NotANumber {
        /// Name of the surface.
        name: &'static str,
        /// The measure as given.
        value: String,
    },
    /// A measure is too small, too large or not finite.
    #[error("base {name}: {value} m is out of range; give 1e-3 to 1e12 m")]
    Range {
        /// Name of the surface.
        name: &'static str,
        /// The measure, metres.
        value: f64,
    },
    /// The tube of a torus closes its hole.
    #[error(
        "base torus: the tube of {minor_m} m reaches the axis {major_m} m away; give torus:R,r with r < R"
    )]
    Tube {
        /// From the axis to the middle of the tube, metres.
        major_m: f64,
        /// Radius of the tube, metres.
        minor_m: f64,
    },
    /// An ellipsoid is too flat or too long.
    #[error("base ellipsoid: axes of {a_m} m and {b_m} m; give a ratio B / A from 0.5 to 2")]
    Ratio {
        /// Radius of the equator, metres.
        a_m: f64,
        /// Half the length of the axis, metres.
        b_m: f64,
    },
}

impl Base {
    /// The surface itself; `None` for [`Base::Sampled`], which needs its grid.
    #[must_use]
    pub fn surface(self) -> Option<Box<dyn Surface>> {
        Some(match self {
            Self::Plane => Box::new(Plane),
            Self::Ellipsoid { a_m, b_m } => Box::new(Ellipsoid { a: a_m, b: b_m }),
            Self::Cylinder { radius_m, inside } => Box::new(Cylinder { radius_m, inside }),
            Self::Torus { major_m, minor_m } => Box::new(Torus { major_m, minor_m }),
            Self::Sampled => return None,
        })
    }

    /// The measures of the ellipsoids that have a name of their own.
    const fn of(e: Ellipsoid) -> Self {
        Self::Ellipsoid { a_m: e.a, b_m: e.b }
    }
}

const NAMED: [(&str, Base); 3] = [
    ("wgs84", Base::of(Ellipsoid::WGS84)),
    ("moon", Base::of(Ellipsoid::MOON)),
    ("mars", Base::of(Ellipsoid::MARS)),
];

/// At most 80 printable characters, so that a message stays one line.
fn shown(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(80).collect()
}

fn metres(name: &'static str, text: &str) -> Result<f64, BaseError> {
    let value: f64 = text.parse().map_err(|_| BaseError::NotANumber { name, value: shown(text) })?;
    if (1e-3..=1e12).contains(&value) { Ok(value) } else { Err(BaseError::Range { name, value }) }
}

impl FromStr for Base {
    type Err = BaseError;

    fn from_str(text: &str) -> Result<Self, BaseError> {
        if let Some((_, base)) = NAMED.iter().find(|(name, _)| *name == text) {
            return Ok(*base);
        }
        let (name, rest) = text.split_once(':').map_or((text, None), |(name, rest)| (name, Some(rest)));
        let measures: Vec<&str> = rest.map_or_else(Vec::new, |r| r.split(',').collect());
        let form = |expected| Err(BaseError::Form { given: shown(text), expected });
        match (name, measures.as_slice()) {
            ("plane", _) if rest.is_none() => Ok(Self::Plane),
            ("sampled", _) if rest.is_none() => Ok(Self::Sampled),
            ("sphere", [r]) => {
                let r = metres("sphere", r)?;
                Ok(Self::Ellipsoid { a_m: r, b_m: r })
            }
            ("ellipsoid", [a, b]) => {
                let (a_m, b_m) = (metres("ellipsoid", a)?, metres("ellipsoid", b)?);
                // Multiplied rather than divided, so that the limits themselves are accepted.
                let fits = b_m >= 0.5 * a_m && b_m <= 2.0 * a_m;
                if fits { Ok(Self::Ellipsoid { a_m, b_m }) } else { Err(BaseError::Ratio { a_m, b_m }) }
            }
            ("cylinder", [r]) => Ok(Self::Cylinder { radius_m: metres("cylinder", r)?, inside: false }),
            ("cylinder", [r, "inside"]) => {
                Ok(Self::Cylinder { radius_m: metres("cylinder", r)?, inside: true })
            }
            ("torus", [major, minor]) => {
                let (major_m, minor_m) = (metres("torus", major)?, metres("torus", minor)?);
                let fits = minor_m < major_m;
                if fits {
                    Ok(Self::Torus { major_m, minor_m })
                } else {
                    Err(BaseError::Tube { major_m, minor_m })
                }
            }
            ("plane" | "sampled" | "wgs84" | "moon" | "mars", _) => form("the name alone"),
            ("sphere", _) => form("sphere:R"),
            ("ellipsoid", _) => form("ellipsoid:A,B"),
            ("cylinder", _) => form("cylinder:R or cylinder:R,inside"),
            ("torus", _) => form("torus:R,r"),
            _ => Err(BaseError::Unknown { name: shown(name) }),
        }
    }
}

impl fmt::Display for Base {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some((name, _)) = NAMED.iter().find(|(_, base)| base == self) {
            return f.write_str(name);
        }
        match *self {
            Self::Plane => f.write_str("plane"),
            Self::Ellipsoid { a_m, b_m } if a_m == b_m => write!(f, "sphere:{a_m}"),
            Self::Ellipsoid { a_m, b_m } => write!(f, "ellipsoid:{a_m},{b_m}"),
            Self::Cylinder { radius_m, inside: false } => write!(f, "cylinder:{radius_m}"),
            Self::Cylinder { radius_m, inside: true } => write!(f, "cylinder:{radius_m},inside"),
            Self::Torus { major_m, minor_m } => write!(f, "torus:{major_m},{minor_m}"),
            Self::Sampled => f.write_str("sampled"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Base, BaseError};
    use proptest::prelude::*;

    #[test]
    fn names_round_trip() {
        let texts = "plane wgs84 moon mars sphere:1 sphere:6371000.5 ellipsoid:2,1 ellipsoid:1,2 \
                     cylinder:0.001 cylinder:250,inside torus:1000000000000,3 sampled";
        for text in texts.split_whitespace() {
            let base: Base = text.parse().unwrap();
            assert_eq!(base.to_string(), text);
            assert_eq!(base.surface().is_none(), text == "sampled");
        }
        assert_eq!("sphere:1737400".parse::<Base>().unwrap().to_string(), "moon");
        assert_eq!("ellipsoid:5,5".parse::<Base>().unwrap().to_string(), "sphere:5");
    }

    #[test]
    fn each_kind_of_bad_text_is_refused_with_one_line() {
        let error = |text: &str| {
            let e = text.parse::<Base>().unwrap_err();
            let line = e.to_string();
            assert!(line.contains("give") && !line.contains('\n') && line.len() < 250, "{line}");
            e
        };
        for text in ["", "Plane", "pluto", "pluto:3", "a\nb", ":", " plane"] {
            assert!(matches!(error(text), BaseError::Unknown { .. }), "{text}");
        }
        for text in [
            "plane:",
            "plane:3",
            "wgs84:1",
            "sphere",
            "sphere:1,2",
            "ellipsoid:1",
            "cylinder",
            "cylinder:1,outside",
            "cylinder:1,inside,2",
            "torus:1",
            "torus:3,2,1",
            "sampled:x",
        ] {
            assert!(matches!(error(text), BaseError::Form { .. }), "{text}");
        }
        for text in ["sphere:", "sphere:x", "sphere: 1", "ellipsoid:1,", "torus:1,1m", "cylinder:1_0"] {
            assert!(matches!(error(text), BaseError::NotANumber { .. }), "{text}");
        }
        for text in
            ["sphere:0", "sphere:-1", "sphere:9e-4", "cylinder:nan", "torus:inf,1", "ellipsoid:1,1.1e12"]
        {
            assert!(matches!(error(text), BaseError::Range { .. }), "{text}");
        }
        for text in ["torus:1,1", "torus:1,2"] {
            assert!(matches!(error(text), BaseError::Tube { .. }), "{text}");
        }
        for text in ["ellipsoid:1,0.49", "ellipsoid:1,2.1"] {
            assert!(matches!(error(text), BaseError::Ratio { .. }), "{text}");
        }
    }

    proptest! {
        #[test]
        fn any_measures_round_trip(r in 1e-3..1e12_f64, ratio in 0.5..2.0_f64, tube in 0.01..0.99_f64) {
            let other = (r * ratio).clamp(1e-3, 1e12);
            let minor_m = (r * tube).max(1e-3);
            let mut bases = vec![
                Base::Ellipsoid { a_m: r, b_m: other },
                Base::Ellipsoid { a_m: r, b_m: r },
                Base::Cylinder { radius_m: r, inside: true },
            ];
            if minor_m < r {
                bases.push(Base::Torus { major_m: r, minor_m });
            }
            for base in bases {
                prop_assert_eq!(base.to_string().parse::<Base>(), Ok(base));
            }
        }

        #[test]
        fn no_text_panics(text in ".{0,40}") {
            let _ = text.parse::<Base>();
        }
    }
}
