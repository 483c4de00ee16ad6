//! Values on the `.model` line: netlist parameters with SUGAR's suffixes, ports and monitors with a scale.
//!
//! ngspice 39 drops the quotes inside a `.model` line and splits what is left at blanks, commas, equals signs and
//! parentheses. So `set=["w=2.1u" "F=0"]` arrives as w, 2.1u, F, 0, and a node `x1(2)` arrives as two words. Later
//! versions keep more of it together. Both forms are read here.

use bimorph::netlist::{Setting, parse_setting};

/// A signal shown as a voltage.
#[derive(Debug, Clone, PartialEq)]
pub struct Monitor {
    /// Signal name ("yoke.y").
    pub signal: String,
    /// Volts per unit of the signal [V/m, V/rad, V/K, …].
    pub scale: f64,
}

impl Monitor {
    /// Reads `NAME` or `NAME:SCALE`.
    pub fn parse(text: &str) -> Self {
        let scaled = text.rsplit_once(':').and_then(|(name, scale)| Some((name, number(scale)?)));
        let (signal, scale) = scaled.unwrap_or((text, 1.0));
        Self { signal: signal.to_owned(), scale }
    }
}

/// A port as the line names it.
#[derive(Debug, Clone, PartialEq)]
pub struct PortName {
    /// Name of the port.
    pub name: String,
    /// Volts per unit of what lies across it, where the line says so.
    pub scale: Option<f64>,
}

impl PortName {
    /// Reads `NAME` or `NAME:SCALE`.
    pub fn parse(text: &str) -> Self {
        match text.rsplit_once(':').and_then(|(name, scale)| Some((name, number(scale)?))) {
            Some((name, scale)) => Self { name: name.to_owned(), scale: Some(scale) },
            None => Self { name: text.to_owned(), scale: None },
        }
    }
}

/// A number as decks or as netlists write it.
fn number(text: &str) -> Option<f64> {
    if let Ok(value) = text.parse::<f64>() {
        return Some(value).filter(|v| v.is_finite());
    }
    match parse_setting(text) {
        Ok(Setting::Number(value)) if value.is_finite() => Some(value),
        _ => None,
    }
}

/// Reads netlist parameters from words: `NAME=VALUE` or `NAME:VALUE` in one word, or NAME and VALUE in two.
///
/// # Errors
/// The word that has no partner.
pub fn settings(words: &[String]) -> Result<Vec<(String, Setting)>, String> {
    let mut set = Vec::new();
    let mut parts = words.iter().map(String::as_str);
    while let Some(part) = parts.next() {
        let (name, value) = match part.split_once(['=', ':']) {
            Some(pair) => pair,
            None => (part, parts.next().ok_or_else(|| part.to_owned())?),
        };
        let (name, value) = (name.trim(), value.trim());
        if name.is_empty() || value.is_empty() {
            return Err(part.to_owned());
        }
        // SPICE's word for mega, since a host that lower-cases the line turns SUGAR's M into m.
        let mega = value.len().checked_sub(3).and_then(|at| value.get(at..)).filter(|s| s.eq_ignore_ascii_case("meg"));
        let written = mega.map_or_else(|| value.to_owned(), |_| format!("{}M", &value[..value.len() - 3]));
        let setting = number(&written).map_or_else(|| Setting::Text(value.to_owned()), Setting::Number);
        set.push((name.to_owned(), setting));
    }
    Ok(set)
}

/// Puts names together again that were split at parentheses: "x1", "2", ".y" is `x1(2).y`.
pub fn rejoin(words: &[String]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let mut open = false;
    for word in words {
        let index = !word.is_empty() && word.bytes().all(|b| b.is_ascii_digit());
        match names.last_mut() {
            Some(name) if index => {
                if open {
                    name.pop();
                    name.push(',');
                } else {
                    name.push('(');
                }
                name.push_str(word);
                name.push(')');
            }
            Some(name) if word.starts_with('.') => name.push_str(word),
            _ => names.push(word.clone()),
        }
        open = index;
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_owned).collect()
    }

    /// A monitor is a signal, with a scale after the last colon where that is a number.
    #[test]
    fn monitors() {
        assert_eq!(Monitor::parse("yoke.y:1e6"), Monitor { signal: "yoke.y".into(), scale: 1e6 });
        assert_eq!(Monitor::parse("yoke.y:1M").scale, 1e6);
        assert_eq!(Monitor::parse("yoke.y:1E6").scale, 1e6);
        assert_eq!(Monitor::parse("b1.hot.T"), Monitor { signal: "b1.hot.T".into(), scale: 1.0 });
        assert_eq!(Monitor::parse("odd:name").signal, "odd:name");
    }

    /// Parameters read the same from whole words and from what ngspice 39 leaves of them.
    #[test]
    fn settings_in_both_forms() {
        let want = vec![("w".to_owned(), Setting::Number(2.1e-6)), ("mode".to_owned(), Setting::Text("fast".into()))];
        assert_eq!(settings(&words("w=2.1u mode=fast")), Ok(want.clone()));
        assert_eq!(settings(&words("w:2.1u mode:fast")), Ok(want.clone()));
        assert_eq!(settings(&words("w 2.1u mode fast")), Ok(want));
        assert_eq!(settings(&words("w 2.1u mode")), Err("mode".to_owned()));
        assert_eq!(settings(&words("f=2meg")), Ok(vec![("f".to_owned(), Setting::Number(2e6))]));
    }

    /// Names with indices survive the splitting at parentheses.
    #[test]
    fn rejoins_indices() {
        assert_eq!(rejoin(&words("x1 2 .y:1e6 b.x")), words("x1(2).y:1e6 b.x"));
        assert_eq!(rejoin(&words("x 1 2 .y")), words("x(1,2).y"));
        assert_eq!(rejoin(&words("heat sense")), words("heat sense"));
    }
}
