//! Ranges of ports as an option: the box that a reduced model is trained for.

/// Ranges of ports by name, as written: `NAME:LOW:HIGH`, separated by commas, bars or blanks. Decks have
/// bars: ngspice takes commas and blanks for ends of texts.
#[derive(Debug, Clone, PartialEq)]
pub struct PortRanges {
    text: String,
    ranges: Vec<(String, [f64; 2])>,
}

impl PortRanges {
    /// Reads them.
    ///
    /// # Errors
    /// The first part that is not `NAME:LOW:HIGH` with finite numbers and LOW below HIGH, or that names a port again.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut ranges: Vec<(String, [f64; 2])> = Vec::new();
        for word in text.split(|c: char| matches!(c, ',' | '|') || c.is_whitespace()).filter(|word| !word.is_empty()) {
            let (name, range) = one(word).ok_or_else(|| format!("\"{word}\""))?;
            if ranges.iter().any(|(known, _)| *known == name) {
                return Err(format!("\"{name}\" twice"));
            }
            ranges.push((name, range));
        }
        if ranges.is_empty() {
            return Err(format!("\"{text}\""));
        }
        Ok(Self { text: text.to_owned(), ranges })
    }

    /// Names and ranges, in their order.
    pub fn all(&self) -> &[(String, [f64; 2])] {
        &self.ranges
    }

    /// The range of a port; ngspice passes names on in small letters.
    pub fn of(&self, port: &str) -> Option<[f64; 2]> {
        let exact = self.ranges.iter().find(|(name, _)| name == port);
        let found = exact.or_else(|| self.ranges.iter().find(|(name, _)| name.eq_ignore_ascii_case(port)));
        found.map(|(_, range)| *range)
    }

    /// The text that they were read from.
    pub fn text(&self) -> &str {
        &self.text
    }
}

/// A port with its range.
fn one(word: &str) -> Option<(String, [f64; 2])> {
    let (rest, high) = word.rsplit_once(':')?;
    let (name, low) = rest.rsplit_once([':', '='])?;
    let range @ [low, high]: [f64; 2] = [low.parse().ok()?, high.parse().ok()?];
    let fits = !name.is_empty() && low.is_finite() && high.is_finite() && low < high;
    fits.then(|| (name.to_owned(), range))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names keep their colons and dots, and either separator parts the name from its range. An error has the wrong part.
    #[test]
    fn ranges_are_read_as_written() {
        let read = PortRanges::parse("heat:0:2|plate.x=-1e-4:1e-4, a:b:-1:0").expect("ranges");
        let names: Vec<&str> = read.all().iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["heat", "plate.x", "a:b"]);
        assert_eq!((read.of("Heat"), read.of("plate.x"), read.of("y")), (Some([0.0, 2.0]), Some([-1e-4, 1e-4]), None));
        assert_eq!(PortRanges::parse(read.text()), Ok(read));
        for wrong in ["", "heat", "heat:1", "heat:2:1", "heat:1:1", "heat:0:x", "heat:0:inf", "heat:nan:1", ":0:1"] {
            assert_eq!(PortRanges::parse(wrong), Err(format!("\"{wrong}\"")));
        }
        assert_eq!(PortRanges::parse("a:0:1, b:1:0, c:0:1"), Err("\"b:1:0\"".to_owned()));
        assert_eq!(PortRanges::parse("a:0:1 a:0:2"), Err("\"a\" twice".to_owned()));
    }
}
