//! The error of a run: how far its signals are from those of a reference.
//!
//! In charts signals of one unit are taken together: the root mean square of their differences over all output times,
//! over the largest amplitude (half of the range) among them in the reference. Of several units the largest error
//! counts. The error estimate of a run ([`largest_error`]) is that of each signal alone.

use crate::transient::TransientResult;

/// Fraction of the largest displacement, or swing of a unit, by which what moves less is measured.
pub(crate) const SMALL: f64 = 1.0 / 30.0;

/// A signal: name, unit, samples.
type NamedSignal = (String, String, Vec<f64>);

/// The error of `found` relative to the amplitude of `reference`; infinite where a motion stands against none, or is not
/// finite. Both have the same signals at the same times.
pub fn relative_error(reference: &TransientResult, found: &TransientResult) -> f64 {
    let mut units: Vec<&str> = reference.signals.iter().map(|s| s.1.as_str()).collect();
    units.sort_unstable();
    units.dedup();
    let mut worst: f64 = 0.0;
    for unit in units {
        let (mut sum, mut count, mut amplitude) = (0.0, 0usize, 0.0f64);
        for (want, got) in reference.signals.iter().zip(&found.signals).filter(|(want, _)| want.1 == unit) {
            amplitude = amplitude.max(half_range(&want.2));
            sum += squares(&want.2, &got.2);
            count += want.2.len();
        }
        worst = larger(worst, quotient((sum / count.max(1) as f64).sqrt(), amplitude));
    }
    worst
}

/// The largest error of a signal of `found`. Its scale is the largest of three: its own amplitude in `reference`, a
/// thirtieth of the largest amplitude of its unit, and the minimum that `least` gives for the unit.
pub fn largest_error(reference: &TransientResult, found: &TransientResult, least: &dyn Fn(&str) -> f64) -> f64 {
    let largest = |unit: &str| {
        let swings = reference.signals.iter().filter(|s| s.1 == unit).map(|s| half_range(&s.2));
        swings.fold(0.0, f64::max)
    };
    let error = |(want, got): (&NamedSignal, &NamedSignal)| {
        let amplitude = half_range(&want.2).max(SMALL * largest(&want.1)).max(least(&want.1));
        quotient((squares(&want.2, &got.2) / want.2.len().max(1) as f64).sqrt(), amplitude)
    };
    reference.signals.iter().zip(&found.signals).map(error).fold(0.0, larger)
}

/// Amplitude of samples: half of their range.
pub fn half_range(samples: &[f64]) -> f64 {
    let low = samples.iter().copied().fold(f64::INFINITY, f64::min);
    let high = samples.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (0.5 * (high - low)).max(0.0)
}

fn squares(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

fn quotient(apart: f64, amplitude: f64) -> f64 {
    if apart == 0.0 { 0.0 } else { apart / amplitude }
}

/// The larger of two errors; a comparison with what is not a number must not hide it.
fn larger(a: f64, b: f64) -> f64 {
    if b.is_nan() { f64::INFINITY } else { a.max(b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(signals: &[(&str, &[f64])]) -> TransientResult {
        TransientResult {
            t: vec![],
            signals: signals.iter().map(|(unit, v)| (String::new(), (*unit).to_owned(), v.to_vec())).collect(),
            ..TransientResult::default()
        }
    }

    /// Root mean square over half the range; a signal that hardly moves is measured by the one that does; each unit by its own.
    #[test]
    fn errors_by_hand() {
        let reference = run(&[("m", &[1.0, 3.0]), ("m", &[0.0, 0.0]), ("rad", &[0.0, 0.2])]);
        let found = run(&[("m", &[1.1, 3.0]), ("m", &[0.1, 0.0]), ("rad", &[0.0, 0.2])]);
        assert!((relative_error(&reference, &found) - (0.02f64 / 4.0).sqrt()).abs() < 1e-15);
        assert_eq!(relative_error(&reference, &reference), 0.0);
    }

    /// Each signal by its own swing, but by a thirtieth of the largest of its unit at least.
    #[test]
    fn each_signal_by_its_own() {
        let reference = run(&[("m", &[1.0, -1.0]), ("m", &[0.1, -0.1]), ("m", &[0.0, 0.0])]);
        let found = run(&[("m", &[1.0, -1.0]), ("m", &[0.11, -0.11]), ("m", &[0.001, 0.001])]);
        assert!((largest_error(&reference, &found, &|_| 0.0) - 0.1).abs() < 1e-12);
        assert!((relative_error(&reference, &found) - 0.0058).abs() < 1e-4);
    }

    /// The error of a signal that moves by rounding only has the smallest relevant motion as its scale.
    #[test]
    fn rounding_is_no_motion() {
        let reference = run(&[("m", &[1e-23, -1e-23]), ("K", &[0.0, 1.0])]);
        let found = run(&[("m", &[-1e-23, 1e-23]), ("K", &[0.0, 1.0])]);
        let least = |unit: &str| if unit == "m" { 1e-15 } else { 0.0 };
        assert!(largest_error(&reference, &found, &least) < 1e-7);
        assert!(relative_error(&reference, &found) > 1.0);
    }

    /// Nothing that is not a number passes for a small error.
    #[test]
    fn not_a_number_is_no_small_error() {
        let reference = run(&[("m", &[0.0, 1.0]), ("K", &[0.0, 1.0])]);
        let broken = run(&[("m", &[f64::NAN, 1.0]), ("K", &[0.0, 1.0])]);
        assert_eq!(relative_error(&reference, &broken), f64::INFINITY);
        assert_eq!(largest_error(&reference, &broken, &|_| 0.0), f64::INFINITY);
        assert_eq!(relative_error(&run(&[("m", &[2.0, 2.0])]), &run(&[("m", &[2.0, 2.1])])), f64::INFINITY);
    }
}
