//! Ranges of ports as an option: the box that a reduced model is trained for.

/// Ranges of ports by name, as written: `NAME:LOW:HIGH`, separated by commas, bars or blanks. Decks have
/// bars: ngspice takes commas and blanks for ends of texts.
#[derive(Debug, Clone, PartialEq)]
pub struct PortRanges {
    text: String,
    ranges: Vec<(String, [f64; 2])>,
}

impl PortRanges {
    /// Reads them; `None` where one is not `NAME:LOW:HIGH` with finite numbers and LOW below HIGH, or a name stands twice.
    pub fn parse(text: &str) -> Option<Self> {
        let mut ranges: Vec<(String, [f64; 2])> = Vec::new();
        for word in text.split(|c: char| matches!(c, ',' | '|') || c.is_whitespace()).filter(|word| !word.is_empty()) {
            let (rest, high) = word.rsplit_once(':')?;
            let (name, low) = rest.rsplit_once([':', '='])?;
            let (low, high): (f64, f64) = (low.parse().ok()?, high.parse().ok()?);
            let fits = !name.is_empty() && low.is_finite() && high.is_finite() && low < high;
            if !fits || ranges.iter().any(|(known, _)| known == name) {
                return None;
            }
            ranges.push((name.to_owned(), [low, high]));
        }
        (!ranges.is_empty()).then(|| Self { text: text.to_owned(), ranges })
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Names keep their colons and dots, either separator parts the name from its range, and wrong words are no ranges.
    #[test]
    fn ranges_are_read_as_written() {
        let read = PortRanges::parse("heat:0:2|plate.x=-1e-4:1e-4, a:b:-1:0").expect("ranges");
        let names: Vec<&str> = read.all().iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["heat", "plate.x", "a:b"]);
        assert_eq!((read.of("Heat"), read.of("plate.x"), read.of("y")), (Some([0.0, 2.0]), Some([-1e-4, 1e-4]), None));
        assert_eq!(PortRanges::parse(read.text()), Some(read));
        for wrong in ["", "heat", "heat:1", "heat:2:1", "heat:0:x", "heat:0:inf", ":0:1", "a:0:1 a:0:2"] {
            assert_eq!(PortRanges::parse(wrong), None, "{wrong}");
        }
    }
}
