//! Coordinates as a user types them.

/// A place to go to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Longitude and latitude in degrees, or x and y in metres.
    pub place: [f64; 2],
    /// Metres, where it was given.
    pub height_m: Option<f64>,
}

/// What a number is of, as the letter after it says.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mark {
    North,
    South,
    East,
    West,
    Metres,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Axis {
    Longitude,
    Latitude,
}

#[derive(Clone, Copy, Debug)]
struct Part {
    value: f64,
    mark: Option<Mark>,
}

impl Part {
    fn axis(self) -> Option<Axis> {
        match self.mark? {
            Mark::North | Mark::South => Some(Axis::Latitude),
            Mark::East | Mark::West => Some(Axis::Longitude),
            Mark::Metres => None,
        }
    }

    /// Degrees east or north.
    fn degrees(self) -> Result<f64, String> {
        match self.mark {
            Some(Mark::Metres) => Err("longitude and latitude are degrees, not metres".to_owned()),
            Some(_) if self.value < 0.0 => Err("give a letter or a minus sign, not both".to_owned()),
            Some(Mark::South | Mark::West) => Ok(-self.value),
            _ => Ok(self.value),
        }
    }
}

/// What has to be given.
pub fn form(degrees: bool) -> &'static str {
    if degrees { "longitude, latitude[, height]" } else { "x, y[, height]" }
}

/// Reads two numbers and perhaps a height, separated by commas or blanks. Degrees may carry N, S, E or W, and
/// then come in any order.
pub fn parse(text: &str, degrees: bool) -> Result<Goal, String> {
    let parts = parts(text)?;
    let (place, height) = match parts.as_slice() {
        [a, b] => ([*a, *b], None),
        [a, b, height] => ([*a, *b], Some(*height)),
        _ => return Err(format!("give {}", form(degrees))),
    };
    if height.is_some_and(|part| part.axis().is_some()) {
        return Err("the height is in metres".to_owned());
    }
    let place = if degrees { on_a_globe(place)? } else { on_a_plane(place)? };
    Ok(Goal { place, height_m: height.map(|part| part.value) })
}

fn on_a_plane(place: [Part; 2]) -> Result<[f64; 2], String> {
    if place.iter().any(|part| part.axis().is_some()) {
        return Err("x and y are metres, without N, S, E or W".to_owned());
    }
    Ok(place.map(|part| part.value))
}

fn on_a_globe([first, second]: [Part; 2]) -> Result<[f64; 2], String> {
    let axes = [first.axis(), second.axis()];
    if axes[0].is_some() && axes[0] == axes[1] {
        return Err("give one longitude and one latitude".to_owned());
    }
    let latitude_first = axes[0] == Some(Axis::Latitude) || axes[1] == Some(Axis::Longitude);
    let [longitude, latitude] = if latitude_first { [second, first] } else { [first, second] };
    let [longitude, latitude] = [longitude.degrees()?, latitude.degrees()?];
    if latitude.abs() > 90.0 {
        return Err(format!("latitude {latitude} is not between -90 and 90"));
    }
    // Data may run on over the date line: one and a half turns are taken.
    if longitude.abs() > 540.0 {
        return Err(format!("longitude {longitude} is not between -540 and 540"));
    }
    Ok([longitude, latitude])
}

fn parts(text: &str) -> Result<Vec<Part>, String> {
    let mut parts: Vec<Part> = Vec::new();
    let words = text.split(|c: char| matches!(c, ',' | ';') || c.is_whitespace());
    for word in words.filter(|word| !word.is_empty()) {
        let number = word.trim_end_matches(|c: char| c.is_alphabetic() || c == '°');
        let mark = mark(&word[number.len()..]).ok_or_else(|| format!("'{word}' is not understood"))?;
        if number.is_empty() {
            // A letter that stands alone belongs to the number before it.
            match parts.last_mut() {
                Some(last) if last.mark.is_none() => last.mark = mark,
                _ => return Err(format!("'{word}' has no number before it")),
            }
        } else {
            let value = number.parse::<f64>().ok().filter(|v| v.is_finite());
            let value = value.ok_or_else(|| format!("'{word}' is not a number"))?;
            parts.push(Part { value, mark });
        }
    }
    Ok(parts)
}

/// The mark that follows a number; the outer option is none for one that means nothing.
fn mark(text: &str) -> Option<Option<Mark>> {
    match text.trim_start_matches('°') {
        "" => Some(None),
        "N" | "n" => Some(Some(Mark::North)),
        "S" | "s" => Some(Some(Mark::South)),
        "E" | "e" => Some(Some(Mark::East)),
        "W" | "w" => Some(Some(Mark::West)),
        "m" | "M" => Some(Some(Mark::Metres)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn goal(text: &str, degrees: bool) -> ([f64; 2], Option<f64>) {
        let goal = parse(text, degrees).unwrap_or_else(|e| panic!("{text}: {e}"));
        (goal.place, goal.height_m)
    }

    #[test]
    fn degrees_come_in_many_forms() {
        let expected = ([8.25, 47.5], None);
        for text in [
            "8.25, 47.5",
            "8.25 47.5",
            "  8.25,47.5 ",
            "8.25;47.5",
            "47.5N 8.25E",
            "47.5 N, 8.25 E",
            "47.5°n 8.25°e",
            "47.5 ° N 8.25",
            "8.25E 47.5",
            "47.5, 8.25E",
            "+8.25 4.75e1",
        ] {
            assert_eq!(goal(text, true), expected, "{text}");
        }
        assert_eq!(goal("33.9S 18.4W", true), ([-18.4, -33.9], None));
        assert_eq!(goal("-18.4 -33.9", true), ([-18.4, -33.9], None));
        assert_eq!(goal("8.25, 47.5, 1200", true), ([8.25, 47.5], Some(1200.0)));
        assert_eq!(goal("47.5N 8.25E -12m", true), ([8.25, 47.5], Some(-12.0)));
        assert_eq!(goal("47.5N 8.25E 1200 m", true), ([8.25, 47.5], Some(1200.0)));
        assert_eq!(goal("359 0", true), ([359.0, 0.0], None));
    }

    #[test]
    fn metres_are_taken_as_they_are() {
        assert_eq!(goal("15000 -2000.5", false), ([15_000.0, -2_000.5], None));
        assert_eq!(goal("15000m, 200m, 3500 m", false), ([15_000.0, 200.0], Some(3_500.0)));
    }

    #[test]
    fn what_cannot_be_meant_is_refused_with_a_reason() {
        let cases = [
            ("", true, "give longitude, latitude[, height]"),
            ("8.25", false, "give x, y[, height]"),
            ("1 2 3 4", false, "give x, y[, height]"),
            ("8,25 47,5", true, "give longitude"),
            ("abc 3", true, "'abc' is not understood"),
            ("1e999 3", true, "'1e999' is not a number"),
            ("inf 3", false, "'inf' is not understood"),
            ("1.2.3 4", true, "'1.2.3' is not a number"),
            ("N 47", true, "'N' has no number before it"),
            ("47N N 8", true, "'N' has no number before it"),
            ("8 91", true, "latitude 91"),
            ("8 90.5S", true, "latitude -90.5"),
            ("541 3", true, "longitude 541"),
            ("47N 48S", true, "one longitude and one latitude"),
            ("8E 9W", true, "one longitude and one latitude"),
            ("-47S 8E", true, "not both"),
            ("47m 8", true, "degrees, not metres"),
            ("47N 8", false, "without N, S, E or W"),
            ("8 47 100N", true, "the height is in metres"),
            ("47°30'N 8E", true, "is not a number"),
        ];
        for (text, degrees, reason) in cases {
            let problem = parse(text, degrees).unwrap_err();
            assert!(problem.contains(reason), "{text}: {problem}");
            assert!(problem.chars().count() < 60 && !problem.contains('\n'), "{problem}");
        }
    }
}
