//! Values on the command line: numbers with netlist suffixes, `NAME=VALUE`, lists of names.

use bimorph::jobs::sweep::parse;
use bimorph::netlist::Setting;

/// A number with an optional suffix: `30u`, `1.2e6`, `-5`.
pub(crate) fn number(text: &str) -> Result<f64, String> {
    parse::number(text.trim())
        .ok_or_else(|| format!("expected a number such as 2.1u, 30n or 1.2e6 (m milli, M mega), got \"{text}\""))
}

/// `NAME=VALUE`; a value that is no number is text.
pub(crate) fn setting(text: &str) -> Result<(String, Setting), String> {
    let (name, value) = pair(text)?;
    let value = parse::number(&value).map_or(Setting::Text(value), Setting::Number);
    Ok((name, value))
}

/// `NAME=VOLTS`.
pub(crate) fn volts(text: &str) -> Result<(String, f64), String> {
    let (name, value) = pair(text)?;
    Ok((name, number(&value)?))
}

fn pair(text: &str) -> Result<(String, String), String> {
    match text.split_once('=').map(|(name, value)| (name.trim(), value.trim())) {
        Some((name, value)) if !name.is_empty() && !value.is_empty() => {
            Ok((name.to_owned(), value.trim_matches('"').to_owned()))
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Suffixes as in netlists; text stays text; an index list is one name.
    #[test]
    fn values_and_names() {
        assert_eq!(setting("w=2.1u"), Ok(("w".into(), Setting::Number(2.1e-6))));
        assert_eq!(setting("layer=\"p2\""), Ok(("layer".into(), Setting::Text("p2".into()))));
        assert_eq!(volts("heat=-500m"), Ok(("heat".into(), -0.5)));
        assert!(volts("heat=ten").is_err() && setting("w").is_err() && setting("=1").is_err());
        assert_eq!(names(&["a.x, D(1,2).y".into(), "b.x".into()]), ["a.x", "D(1,2).y", "b.x"]);
    }
}
