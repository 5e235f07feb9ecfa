//! Numbers as the panels write them: each with its unit, and a dash where nothing is known.

/// Stands for what is not known.
pub const DASH: &str = "–";
/// Stands between groups of three digits.
const THIN_SPACE: char = '\u{2009}';
/// Points of the compass, 45 degrees apart, clockwise from north.
const COMPASS: [&str; 8] = ["N", "NE", "E", "SE", "S", "SW", "W", "NW"];
/// Multiples of a byte, each a thousand of the one before.
const BYTES: [&str; 5] = ["B", "kB", "MB", "GB", "TB"];

/// A known value as `write` puts it, or a dash.
pub fn known<T>(value: Option<T>, write: impl FnOnce(T) -> String) -> String {
    value.map_or_else(|| DASH.to_owned(), write)
}

/// Bytes with three digits and a decimal unit.
pub fn bytes(n: f64) -> String {
    if !n.is_finite() {
        return DASH.to_owned();
    }
    let mut value = n.max(0.0);
    let mut ix = 0;
    while value >= 999.5 && ix + 1 < BYTES.len() {
        value /= 1000.0;
        ix += 1;
    }
    let decimals = match value {
        _ if ix == 0 => 0,
        v if v < 9.995 => 2,
        v if v < 99.95 => 1,
        _ => 0,
    };
    format!("{value:.decimals$} {}", BYTES[ix])
}

/// A count, its digits in groups of three.
pub fn count(n: u64) -> String {
    groups(&n.to_string())
}

/// A height or a coordinate in metres, to a decimetre.
pub fn metres(m: f64) -> String {
    if !m.is_finite() {
        DASH.to_owned()
    } else if m.abs() < 999_999.95 {
        format!("{} m", grouped(m, 1))
    } else {
        format!("{} km", grouped(m / 1000.0, 1))
    }
}

/// A length of any size in metres, with about three digits.
pub fn length(m: f64) -> String {
    let km = m / 1000.0;
    match m.abs() {
        a if !a.is_finite() => DASH.to_owned(),
        a if a < 9.995 => format!("{} m", grouped(m, 2)),
        a if a < 999.5 => format!("{} m", grouped(m, 0)),
        a if a < 9_995.0 => format!("{} km", grouped(km, 2)),
        a if a < 99_950.0 => format!("{} km", grouped(km, 1)),
        _ => format!("{} km", grouped(km, 0)),
    }
}

/// A duration in milliseconds.
pub fn milliseconds(ms: f64) -> String {
    if ms < 9.995 { format!("{ms:.2} ms") } else { format!("{ms:.1} ms") }
}

/// An angle in degrees.
pub fn angle(deg: f64) -> String {
    format!("{}°", grouped(deg, 1))
}

/// Degrees of longitude, from 180 west to 180 east.
pub fn longitude(deg: f64) -> String {
    let turned = (deg + 180.0).rem_euclid(360.0) - 180.0;
    format!("{:.5}° {}", turned.abs(), if turned < 0.0 { "W" } else { "E" })
}

/// Degrees of latitude.
pub fn latitude(deg: f64) -> String {
    format!("{:.5}° {}", deg.abs(), if deg < 0.0 { "S" } else { "N" })
}

/// A heading, degrees clockwise from north: 0 to 359 and the nearest point of the compass.
pub fn heading(deg: f64) -> String {
    if !deg.is_finite() {
        return DASH.to_owned();
    }
    // Zero may come out with a sign.
    let whole = deg.round().rem_euclid(360.0).abs();
    let point = (whole / 45.0).round() as usize % COMPASS.len();
    format!("{whole:.0}° {}", COMPASS[point])
}

/// The text, or its beginning where it has more characters than `columns`.
pub fn cut(text: &str, columns: usize) -> String {
    if text.chars().count() <= columns {
        return text.to_owned();
    }
    text.chars().take(columns.saturating_sub(1)).chain(['…']).collect()
}

/// As many of the items as fit a line of `columns` characters, two spaces apart; those at the end go first.
pub fn fitted(items: &[String], columns: usize) -> String {
    let mut line = String::new();
    for item in items {
        if line.is_empty() {
            line = cut(item, columns);
        } else if line.chars().count() + 2 + item.chars().count() <= columns {
            line.push_str("  ");
            line.push_str(item);
        } else {
            break;
        }
    }
    line
}

/// A number with its whole part in groups; never a negative zero.
fn grouped(value: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value.abs());
    let (whole, rest) = text.split_at(text.find('.').unwrap_or(text.len()));
    let zero = text.bytes().all(|b| matches!(b, b'0' | b'.'));
    let sign = if value < 0.0 && !zero { "-" } else { "" };
    format!("{sign}{}{rest}", groups(whole))
}

fn groups(digits: &str) -> String {
    let mut out = String::with_capacity(2 * digits.len());
    for (ix, digit) in digits.chars().enumerate() {
        if ix > 0 && (digits.len() - ix).is_multiple_of(3) {
            out.push(THIN_SPACE);
        }
        out.push(digit);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_keep_three_digits_over_every_step() {
        let cases = [
            (0.0, "0 B"),
            (999.4, "999 B"),
            (999.6, "1.00 kB"),
            (12_340.0, "12.3 kB"),
            (99_960.0, "100 kB"),
            (999_600.0, "1.00 MB"),
            (5.0e15, "5000 TB"),
            (f64::NAN, DASH),
        ];
        for (n, text) in cases {
            assert_eq!(bytes(n), text);
        }
    }

    #[test]
    fn counts_are_grouped_by_thousands() {
        assert_eq!(count(0), "0");
        assert_eq!(count(999), "999");
        assert_eq!(count(1_000), "1\u{2009}000");
        assert_eq!(count(1_234_567), "1\u{2009}234\u{2009}567");
    }

    #[test]
    fn metres_have_a_sign_only_where_they_are_not_zero() {
        assert_eq!(metres(8_848.86), "8\u{2009}848.9 m");
        assert_eq!(metres(-0.04), "0.0 m");
        assert_eq!(metres(-12.34), "-12.3 m");
        assert_eq!(metres(6_378_137.0), "6\u{2009}378.1 km");
        assert_eq!(metres(f64::NAN), DASH);
    }

    #[test]
    fn lengths_pass_from_metres_to_kilometres() {
        assert_eq!(length(1.234), "1.23 m");
        assert_eq!(length(999.4), "999 m");
        assert_eq!(length(999.6), "1.00 km");
        assert_eq!(length(45_678.0), "45.7 km");
        assert_eq!(length(12_345_678.0), "12\u{2009}346 km");
    }

    #[test]
    fn headings_turn_over_at_north() {
        assert_eq!(heading(-0.2), "0° N");
        assert_eq!(heading(359.7), "0° N");
        assert_eq!(heading(315.0), "315° NW");
        assert_eq!(heading(-135.0), "225° SW");
        assert_eq!(heading(22.0), "22° N");
        assert_eq!(heading(23.0), "23° NE");
    }

    #[test]
    fn degrees_name_their_half() {
        assert_eq!(longitude(8.25), "8.25000° E");
        assert_eq!(longitude(359.0), "1.00000° W");
        assert_eq!(latitude(-47.5), "47.50000° S");
        assert_eq!(angle(-0.01), "0.0°");
    }

    #[test]
    fn lines_end_where_their_columns_do() {
        assert_eq!(cut("mountains", 9), "mountains");
        assert_eq!(cut("mountains", 5), "moun…");
        let items = ["one", "three", "five"].map(str::to_owned);
        assert_eq!(fitted(&items, 16), "one  three  five");
        assert_eq!(fitted(&items, 15), "one  three");
        assert_eq!(fitted(&items, 2), "o…");
    }

    #[test]
    fn what_is_unknown_is_a_dash() {
        assert_eq!(known(None, count), "–");
        assert_eq!(known(Some(0), count), "0");
    }
}
