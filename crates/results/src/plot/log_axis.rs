//! Logarithmic axes: decades as powers of ten, with what fits between them.

/// A logarithmic axis between two exponents of ten.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogAxis {
    /// Exponent of the lower end.
    pub low: f64,
    /// Exponent of the upper end.
    pub high: f64,
}

impl LogAxis {
    /// An axis over values, with a margin; at least one decade, and one for nothing at all.
    pub fn new(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v.log10()), high.max(v.log10())));
        if low > high {
            return Self { low: -1.0, high: 1.0 };
        }
        let room = (0.06 * (high - low)).max(0.12);
        let (low, high) = (low - room, high + room);
        let short = (1.0 - (high - low)).max(0.0) / 2.0;
        Self { low: low - short, high: high + short }
    }

    /// Fraction of the axis at which a value lies.
    pub fn share(&self, value: f64) -> f64 {
        (value.log10() - self.low) / (self.high - self.low)
    }

    /// Decades with their labels, every other one where there are many; with 2 and 5 between them where there are few.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        let span = self.high - self.low;
        let every = ((span / 7.0).ceil() as i32).max(1);
        let leads: &[f64] = if span < 1.6 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let ticks = self.places(leads, |decade| decade.rem_euclid(every) == 0);
        // plain digits where all of them are short, else powers of ten throughout
        let plain = ticks.iter().all(|(lead, decade)| (0..=4).contains(decade) && lead * 10f64.powi(*decade) <= 1e4);
        ticks.into_iter().map(|(lead, decade)| (lead * 10f64.powi(decade), label(lead, decade, plain))).collect()
    }

    /// Places of fine lines within decades, where there is room for them.
    pub fn between(&self) -> Vec<f64> {
        if self.high - self.low > 5.0 {
            return Vec::new();
        }
        let places = self.places(&[2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0], |_| true);
        places.into_iter().map(|(lead, decade)| lead * 10f64.powi(decade)).collect()
    }

    /// Lead and decade of all values on the axis with these leads, ascending.
    fn places(&self, leads: &[f64], wanted: impl Fn(i32) -> bool) -> Vec<(f64, i32)> {
        let decades = (self.low.floor() as i32..=self.high.ceil() as i32).filter(|d| wanted(*d));
        let all = decades.flat_map(|decade| leads.iter().map(move |&lead| (lead, decade)));
        all.filter(|(lead, decade)| (self.low..=self.high).contains(&(f64::from(*decade) + lead.log10()))).collect()
    }
}

/// A tick's label: 200, or 2·10⁻³.
fn label(lead: f64, decade: i32, plain: bool) -> String {
    if plain {
        return format!("{}", lead * 10f64.powi(decade));
    }
    let digits: String = decade.to_string().chars().map(superscript).collect();
    if lead == 1.0 { format!("10{digits}") } else { format!("{lead}·10{digits}") }
}

fn superscript(c: char) -> char {
    match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        c => c.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(c),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64) -> Vec<String> {
        LogAxis::new([low, high].into_iter()).ticks().into_iter().map(|t| t.1).collect()
    }

    /// Decades carry powers of ten; a short range has 2 and 5 as well; a long one leaves decades out.
    #[test]
    fn ticks_are_powers_of_ten() {
        assert_eq!(labels(1e-6, 1e-2), ["10⁻⁶", "10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²"]);
        assert_eq!(labels(30.0, 300.0), ["50", "100", "200"]);
        assert!(labels(1e-14, 1e2).len() <= 9);
        assert_eq!(label(1.0, -12, false), "10⁻¹²");
        assert_eq!(labels(0.02, 3.0), ["10⁻¹", "10⁰"]);
    }
}
