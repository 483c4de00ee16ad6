//! Values on the command line: numbers with netlist suffixes, `NAME=VALUE`, lists of names.

use bimorph::analysis::transient::Until;
use bimorph::domains::Shock;
use bimorph::jobs::sweep;
use bimorph::netlist::{Setting, parse_setting};

/// A number as netlists write it, with an optional suffix: `30u`, `1.2e6`, `-5`, `2*pi`.
pub(crate) fn number(text: &str) -> Result<f64, String> {
    match sweep::number(text.trim()).map_or_else(|| parse_setting(text).ok(), |x| Some(Setting::Number(x))) {
        Some(Setting::Number(value)) if value.is_finite() => Ok(value),
        _ => Err(format!("expected a number such as 2.1u, 30n or 1.2e6 (m milli, M mega), got \"{text}\"")),
    }
}

/// `NAME=VALUE`; the value is a number, an expression of numbers, or text.
pub(crate) fn setting(text: &str) -> Result<(String, Setting), String> {
    let (name, value) = pair(text)?;
    let value = number(&value).map_or_else(|_| parse_setting(&value), |x| Ok(Setting::Number(x)));
    Ok((name, value.map_err(|_| format!("expected a number or a text as value, got \"{text}\""))?))
}

/// `NAME=VOLTS`.
pub(crate) fn volts(text: &str) -> Result<(String, f64), String> {
    let (name, value) = pair(text)?;
    Ok((name, number(&value)?))
}

/// `NAME=LOW:HIGH`.
pub(crate) fn range(text: &str) -> Result<(String, [f64; 2]), String> {
    let (name, value) = pair(text)?;
    let expected = || format!("expected NAME=LOW:HIGH with LOW below HIGH, such as drive=0:20, got \"{text}\"");
    let (low, high) = value.split_once(':').ok_or_else(expected)?;
    let (low, high) = (number(low)?, number(high)?);
    if low < high { Ok((name, [low, high])) } else { Err(expected()) }
}

/// End condition of a run: `contact`, `release` or `SIGNAL=VALUE`.
pub(crate) fn until(text: &str) -> Result<Until, String> {
    match text {
        "contact" => Ok(Until::Contact),
        "release" => Ok(Until::Release),
        _ => match volts(text) {
            Ok((name, level)) => Ok(Until::Level(name, level)),
            Err(_) => Err(format!("expected contact, release or SIGNAL=VALUE, got \"{text}\"")),
        },
    }
}

/// Standard gravity (m/s²).
const GRAVITY: f64 = 9.806_65;

/// A half-sine shock: `PEAK,DURATION` or `PEAK,DURATION,DEGREES`, the peak in m/s² or, with a `g` behind it, in standard gravity.
pub(crate) fn shock(text: &str) -> Result<Shock, String> {
    let expected = || format!("expected PEAK,DURATION or PEAK,DURATION,DEGREES, such as 500g,0.5m,90, got \"{text}\"");
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    let (peak, duration, degrees) = match parts[..] {
        [peak, duration] => (peak, duration, "0"),
        [peak, duration, degrees] => (peak, duration, degrees),
        _ => return Err(expected()),
    };
    let peak = match peak.strip_suffix('g') {
        Some(count) => number(count).map(|count| GRAVITY * count),
        None => number(peak),
    };
    let (Ok(peak), Ok(duration), Ok(degrees)) = (peak, number(duration), number(degrees)) else {
        return Err(expected());
    };
    if duration <= 0.0 {
        return Err(format!("expected a positive duration [s], got \"{text}\""));
    }
    // a quarter turn has no part along the other axis
    let quarter = degrees / 90.0;
    let axis = if quarter.fract() == 0.0 {
        [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]][quarter.rem_euclid(4.0) as usize]
    } else {
        let (sin, cos) = degrees.to_radians().sin_cos();
        [cos, sin]
    };
    Ok(Shock { peak: axis.map(|part| peak * part), duration })
}

fn pair(text: &str) -> Result<(String, String), String> {
    match text.split_once('=').map(|(name, value)| (name.trim(), value.trim())) {
        Some((name, value)) if !name.is_empty() && !value.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err(format!("expected NAME=VALUE, got \"{text}\"")),
    }
}

/// Names in one or more lists; a comma inside brackets belongs to its name: `a.x,D(1,2).y`.
pub(crate) fn names(lists: &[String]) -> Vec<String> {
    let mut names = Vec::new();
    for list in lists {
        let (mut name, mut depth) = (String::new(), 0i32);
        for c in list.chars().chain([',']) {
            match c {
                ',' if depth <= 0 => {
                    if !name.trim().is_empty() {
                        names.push(name.trim().to_owned());
                    }
                    name.clear();
                    continue;
                }
                '(' => depth += 1,
                ')' => depth -= 1,
                _ => {}
            }
            name.push(c);
        }
    }
    names
}

/// `NAME` or `NAME:SCALE`: a scale stands after the last colon where that is a number.
pub(crate) fn scaled(text: &str) -> (String, Option<f64>) {
    let scaled = text.rsplit_once(':').and_then(|(name, scale)| Some((name, number(scale).ok()?)));
    scaled.map_or_else(|| (text.to_owned(), None), |(name, scale)| (name.to_owned(), Some(scale)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Suffixes as in netlists; text stays text; an index list is one name.
    #[test]
    fn values_and_names() {
        assert_eq!(setting("w=2.1u"), Ok(("w".into(), Setting::Number(2.1e-6))));
        assert_eq!(setting("layer=\"p2\""), Ok(("layer".into(), Setting::Text("p2".into()))));
        assert_eq!(volts("heat=-500m"), Ok(("heat".into(), -0.5)));
        assert_eq!(setting("oz=pi/4"), Ok(("oz".into(), Setting::Number(std::f64::consts::FRAC_PI_4))));
        // in a netlist a comment would begin there
        assert!(number("0.1%").is_err() && volts("heat=200%").is_err() && setting("w=50%").is_err());
        assert_eq!(setting("w='50%'"), Ok(("w".into(), Setting::Text("50%".into()))));
        assert_eq!(until("contact"), Ok(Until::Contact));
        assert_eq!(until("a(8).y=-0.5u"), Ok(Until::Level("a(8).y".into(), -0.5e-6)));
        assert!(until("closing").is_err() && until("a.y=").is_err());
        assert!(volts("heat=ten").is_err() && setting("w").is_err() && setting("=1").is_err());
        assert_eq!(scaled("yoke.y:1M"), ("yoke.y".into(), Some(1e6)));
        assert_eq!(scaled("odd:name"), ("odd:name".into(), None));
        assert_eq!(names(&["a.x, D(1,2).y".into(), "b.x".into()]), ["a.x", "D(1,2).y", "b.x"]);
    }
}
