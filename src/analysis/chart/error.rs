//! The error of a run: how far its signals are from those of a reference.
//!
//! Signals of one unit are taken together: the root mean square of their differences over all output times, over the largest
//! amplitude (half of the range) among them in the reference. Of several units the largest error counts.

use crate::analysis::transient::TransientResult;

/// The error of `found` relative to the amplitude of `reference`; infinite where a motion stands against none, or is not
/// finite. Both have the same signals at the same times.
pub fn relative_error(reference: &TransientResult, found: &TransientResult) -> f64 {
    relative_error_above(reference, found, &|_| 0.0)
}

/// [`relative_error`] with amplitudes of at least `least` of their unit: what swings less than that is measured by it.
pub fn relative_error_above(reference: &TransientResult, found: &TransientResult, least: &dyn Fn(&str) -> f64) -> f64 {
    let mut units: Vec<&str> = reference.signals.iter().map(|s| s.1.as_str()).collect();
    units.sort_unstable();
    units.dedup();
    let mut worst: f64 = 0.0;
    for unit in units {
        let (mut sum, mut count, mut amplitude) = (0.0, 0usize, least(unit));
        for (want, got) in reference.signals.iter().zip(&found.signals).filter(|(want, _)| want.1 == unit) {
            let low = want.2.iter().copied().fold(f64::INFINITY, f64::min);
            let high = want.2.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            amplitude = amplitude.max(0.5 * (high - low));
            sum += want.2.iter().zip(&got.2).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
            count += want.2.len();
        }
        let apart = (sum / count.max(1) as f64).sqrt();
        let error = if apart == 0.0 { 0.0 } else { apart / amplitude };
        // a comparison with NaN must not hide it
        worst = if error.is_nan() { f64::INFINITY } else { worst.max(error) };
    }
    worst
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

    /// What stands still but for rounding is measured by what counts as motion.
    #[test]
    fn rounding_is_no_motion() {
        let reference = run(&[("m", &[1e-23, -1e-23]), ("K", &[0.0, 1.0])]);
        let found = run(&[("m", &[-1e-23, 1e-23]), ("K", &[0.0, 1.0])]);
        let least = |unit: &str| if unit == "m" { 1e-15 } else { 0.0 };
        assert!(relative_error_above(&reference, &found, &least) < 1e-7);
        assert!(relative_error(&reference, &found) > 1.0);
    }

    /// Nothing that is not a number passes for a small error.
    #[test]
    fn not_a_number_is_no_small_error() {
        let reference = run(&[("m", &[0.0, 1.0]), ("K", &[0.0, 1.0])]);
        let broken = run(&[("m", &[f64::NAN, 1.0]), ("K", &[0.0, 1.0])]);
        assert_eq!(relative_error(&reference, &broken), f64::INFINITY);
        assert_eq!(relative_error(&run(&[("m", &[2.0, 2.0])]), &run(&[("m", &[2.0, 2.1])])), f64::INFINITY);
    }
}
