//! Axes: round tick values, SI prefixes, and labels for ranges far from zero.

/// A range with its ticks.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Tick values with their labels, ascending.
    pub ticks: Vec<(f64, String)>,
    /// Unit with its SI prefix, and the offset where labels count from one: "µm", "V (+ 3.3)".
    pub unit: String,
}

/// Prefix and factor that bring `size` into 1…1000.
pub fn prefix(size: f64) -> (f64, &'static str) {
    const TABLE: [(f64, &str); 11] = [
        (1e-18, "a"),
        (1e-15, "f"),
        (1e-12, "p"),
        (1e-9, "n"),
        (1e-6, "µ"),
        (1e-3, "m"),
        (1.0, ""),
        (1e3, "k"),
        (1e6, "M"),
        (1e9, "G"),
        (1e12, "T"),
    ];
    if size == 0.0 || !size.is_finite() {
        return (1.0, "");
    }
    // The small excess keeps 999.9999… of a rounding error in the lower decade from showing as 1000.
    let fit = TABLE.iter().rev().find(|(factor, _)| size.abs() * (1.0 + 1e-9) >= *factor);
    fit.copied().unwrap_or(TABLE[0])
}

/// A quantity for people: four significant digits and an SI prefix ("86.31 kHz").
pub fn quantity(value: f64, unit: &str) -> String {
    let prefixed = matches!(
        unit,
        "m" | "s" | "Hz" | "V" | "A" | "W" | "C" | "F" | "N" | "S" | "rad" | "m/s" | "rad/s" | "Ω" | "N·m" | "Pa"
    );
    let (factor, name) = if prefixed { prefix(value) } else { (1.0, "") };
    let scaled = value / factor;
    if prefixed && scaled != 0.0 && scaled.abs() < 0.1 {
        // far below the last prefix: rounding, as a rule, and legible as what it is
        return format!("{value:.1e} {unit}");
    }
    let digits = if scaled == 0.0 { 0 } else { (3 - scaled.abs().log10().floor() as i32).clamp(0, 9) as usize };
    format!("{scaled:.digits$} {name}{unit}").trim_end().to_owned()
}

/// An axis for values between `low` and `high` with about `count` ticks; with `pad` a margin is left at both ends.
pub fn axis(low: f64, high: f64, unit: &str, count: usize, pad: bool) -> Axis {
    let (mut low, mut high) = if low.is_finite() && high.is_finite() { (low, high) } else { (0.0, 1.0) };
    if high - low <= 1e-12 * low.abs().max(high.abs()) {
        let room = if low == 0.0 { 1.0 } else { 0.05 * low.abs() };
        (low, high) = (low - room, high + room);
    } else if pad {
        let room = 0.06 * (high - low);
        (low, high) = (low - room, high + room);
    }
    let span = high - low;
    let size = low.abs().max(high.abs());
    // Far from zero the labels count from a round offset, so that they stay short.
    let offset = if span < 1e-3 * size { round_to_digits(f64::midpoint(low, high), span) } else { 0.0 };
    let (factor, name) = if unit.is_empty() || unit == "K" || unit == "°" {
        (1.0, "")
    } else {
        prefix((low - offset).abs().max((high - offset).abs()))
    };

    let step = nice_step(span / count.max(1) as f64);
    let first = ((low - offset) / step).ceil() as i64;
    let last = ((high - offset) / step).floor() as i64;
    let digits = (-((step / factor).log10() + 1e-9).floor()).clamp(0.0, 6.0) as usize;
    let plain = step / factor >= 1e-6 && size / factor < 1e7;
    let ticks = (first..=last)
        .map(|k| {
            let value = k as f64 * step;
            let shown = value / factor;
            (offset + value, if plain { format!("{shown:.digits$}") } else { format!("{shown:.2e}") })
        })
        .map(|(v, label)| {
            (
                v,
                if label.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
                    "0".to_owned()
                } else {
                    label
                },
            )
        })
        .collect();
    let mut unit = format!("{name}{unit}");
    if offset != 0.0 {
        unit = format!("{unit} (+ {offset})").trim_start().to_owned();
    }
    Axis { low, high, ticks, unit }
}

/// 1, 2 or 5 times a power of ten, not below `raw`.
pub fn nice_step(raw: f64) -> f64 {
    let decade = 10f64.powf(raw.log10().floor());
    let lead = raw / decade;
    let round = if lead <= 1.0 + 1e-9 {
        1.0
    } else if lead <= 2.0 + 1e-9 {
        2.0
    } else if lead <= 5.0 + 1e-9 {
        5.0
    } else {
        10.0
    };
    round * decade
}

fn round_to_digits(value: f64, span: f64) -> f64 {
    let step = nice_step(span);
    let rounded = (value / step).round() * step;
    // Through text, so that the offset prints short.
    format!("{rounded:.12e}").parse().unwrap_or(rounded)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<&str> {
        axis.ticks.iter().map(|(_, label)| label.as_str()).collect()
    }

    /// Ticks are 1, 2 or 5 times a power of ten, in the prefix of the largest value.
    #[test]
    fn round_ticks_with_prefix() {
        let a = axis(0.0, 30e-6, "s", 6, false);
        assert_eq!(labels(&a), ["0", "5", "10", "15", "20", "25", "30"]);
        assert_eq!(a.unit, "µs");
        assert_eq!(labels(&axis(-0.2, 0.25, "V", 4, false)), ["-200", "0", "200"]);
    }

    /// A small ripple on a large value counts from an offset that is printed once.
    #[test]
    fn far_from_zero() {
        let a = axis(3.3, 3.300001, "V", 4, false);
        assert!(a.unit.starts_with("nV (+ 3.3") || a.unit.starts_with("µV (+ 3.3"), "{}", a.unit);
        assert!(labels(&a).iter().all(|l| l.len() < 8), "{:?}", labels(&a));
    }

    /// Constant and broken ranges still give an axis.
    #[test]
    fn degenerate_ranges() {
        assert!(!axis(0.0, 0.0, "m", 4, true).ticks.is_empty());
        assert!(!axis(5.0, 5.0, "m", 4, true).ticks.is_empty());
        assert!(!axis(f64::NAN, 1.0, "m", 4, true).ticks.is_empty());
    }

    /// Engineering form.
    #[test]
    fn quantities() {
        assert_eq!(quantity(86_300.0, "Hz"), "86.30 kHz");
        assert_eq!(quantity(-8.52e-6, "m"), "-8.520 µm");
        assert_eq!(quantity(0.0, "m"), "0 m");
        assert_eq!(quantity(412.34, "K"), "412.3 K");
    }
}
