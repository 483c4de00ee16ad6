//! Oscillators: two runs of one are never in phase for long, so their frequencies and amplitudes are compared in place of their points.
//!
//! The second half of a waveform is taken for settled. Crossings of its middle, upwards, straight between points, give the period from the
//! first to the last; the parabola through each highest and lowest point gives the amplitude.

use serde::Serialize;
use std::f64::consts::PI;

/// Whole cycles that an oscillation has at least.
const MIN_CYCLES: usize = 8;
/// By how much a cycle may be longer or shorter than the mean one (1).
const REGULAR: f64 = 0.05;
/// By how much the difference of points is larger than that of amplitudes and of frequencies where it is one of phase.
const PHASE: f64 = 3.0;

/// Part of the difference of points that the frequencies make up over the run, at least (1). A driven circuit has the
/// frequency of its source: its phase is a result.
const DRIFTS: f64 = 0.3;
/// By how much the swing of a cycle may be larger or smaller than the mean one (1): of what dies away the phase is a result, too.
const STEADY: f64 = 0.2;

/// The oscillation of a vector in two runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Oscillation {
    /// Frequency of both (Hz).
    pub frequency: [f64; 2],
    /// Half of the mean swing of both, in the unit of the vector.
    pub amplitude: [f64; 2],
    /// Differences of the two frequencies and of the two amplitudes, relative to the second run's (1).
    pub difference: [f64; 2],
}

/// The oscillation that two runs have in common, where the difference of their points, as a fraction of the range, is one of phase.
pub(super) fn common(a: (&[f64], &[f64]), b: (&[f64], &[f64]), largest: f64) -> Option<Oscillation> {
    let [[f, p], [g, q]] = [settled(a)?, settled(b)?];
    let difference = [(f / g - 1.0).abs(), (p / q - 1.0).abs()];
    let same = difference.iter().all(|d| *d < REGULAR);
    let drift = PI * (f - g).abs() * a.0.last().copied().unwrap_or(0.0);
    let of_phase = difference.iter().all(|d| largest > PHASE * d) && drift > DRIFTS * largest;
    (same && of_phase).then_some(Oscillation { frequency: [f, g], amplitude: [p, q], difference })
}

/// Frequency (Hz) and amplitude of the second half of a waveform, where it is a regular oscillation.
fn settled((t, y): (&[f64], &[f64])) -> Option<[f64; 2]> {
    let (first, last) = (*t.first()?, *t.last()?);
    let from = t.partition_point(|&x| x < 0.5 * (first + last));
    let (t, y) = (&t[from..], &y[from..]);
    let (low, high) = y.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &y| (low.min(y), high.max(y)));
    let middle = 0.5 * (low + high);
    let crossed = |k: usize| (y[k - 1] < middle && y[k] >= middle).then_some(k);
    let crossings: Vec<usize> = (1..y.len()).filter_map(crossed).collect();
    let time = |k: usize| t[k - 1] + (t[k] - t[k - 1]) * (middle - y[k - 1]) / (y[k] - y[k - 1]);
    let cycles = crossings.len().checked_sub(1).filter(|cycles| *cycles >= MIN_CYCLES)?;
    let period = (time(crossings[cycles]) - time(crossings[0])) / cycles as f64;
    let regular = crossings.windows(2).all(|k| ((time(k[1]) - time(k[0])) / period - 1.0).abs() < REGULAR);
    if !regular || period.is_nan() || period <= 0.0 {
        return None;
    }
    let swing = |k: &[usize]| extreme(t, y, k[0]..k[1], 1.0) - extreme(t, y, k[0]..k[1], -1.0);
    let swings: Vec<f64> = crossings.windows(2).map(swing).collect();
    let mean = swings.iter().sum::<f64>() / cycles as f64;
    let steady = swings.iter().all(|swing| (swing / mean - 1.0).abs() < STEADY);
    steady.then_some([1.0 / period, 0.5 * mean])
}

/// The highest value among these points (`sign` 1) or the lowest (−1), by the parabola through it and its neighbours.
fn extreme(t: &[f64], y: &[f64], points: std::ops::Range<usize>, sign: f64) -> f64 {
    let at = points.max_by(|&i, &j| (sign * y[i]).total_cmp(&(sign * y[j]))).unwrap_or(0);
    let (Some(before), Some(after)) = (at.checked_sub(1), (at + 1 < y.len()).then_some(at + 1)) else { return y[at] };
    let (h, k) = (t[at] - t[before], t[after] - t[at]);
    let (left, right) = ((y[at] - y[before]) / h, (y[after] - y[at]) / k);
    let (slope, bend) = ((left * k + right * h) / (h + k), (right - left) / (h + k));
    let top = y[at] - slope * slope / (4.0 * bend);
    if bend * sign < 0.0 && top.is_finite() { top } else { y[at] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn wave(points: usize, f: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
        let t: Vec<f64> = (0..=points).map(|k| k as f64 / points as f64).collect();
        let y = t.iter().map(|t| f(*t)).collect();
        (t, y)
    }

    fn of(a: &(Vec<f64>, Vec<f64>), b: &(Vec<f64>, Vec<f64>), largest: f64) -> Option<Oscillation> {
        common((&a.0, &a.1), (&b.0, &b.1), largest)
    }

    /// Two sines of 100 cycles, 0.1 % apart in frequency and 0.2 % in amplitude, which makes them 60 % of their amplitude apart at the end, at 30 points a cycle.
    #[test]
    fn frequencies_and_amplitudes_are_measured() {
        let a = wave(3000, |t| 3.0 + 1.002 * (TAU * 100.1 * t).sin());
        let b = wave(3517, |t| 3.0 + (TAU * 100.0 * t).sin());
        let found = of(&a, &b, 0.3).unwrap();
        assert!(
            (found.frequency[0] / 100.1 - 1.0).abs() < 1e-5 && (found.frequency[1] / 100.0 - 1.0).abs() < 1e-5,
            "{found:?}"
        );
        assert!(
            (found.difference[0] / 1e-3 - 1.0).abs() < 0.02 && (found.difference[1] / 2e-3 - 1.0).abs() < 0.1,
            "{found:?}"
        );
    }

    /// Signals that decay, chirp, have few cycles, are driven or differ in amplitude are compared point by point.
    #[test]
    fn nothing_else_is_an_oscillator() {
        let sine = |f: f64, phase: f64| wave(3000, move |t| (TAU * f * t + phase).sin());
        let dying = |f: f64| wave(3000, move |t| (-4.0 * t).exp() * (TAU * f * t).sin());
        let chirp = |f: f64| wave(3000, move |t| (TAU * f * t * (1.0 + t)).sin());
        assert!(of(&sine(100.1, 0.0), &sine(100.0, 0.0), 0.3).is_some());
        for (a, b) in [
            (dying(100.1), dying(100.0)),
            (chirp(60.06), chirp(60.0)),
            (sine(5.005, 0.0), sine(5.0, 0.0)),
            (sine(100.0, 0.6), sine(100.0, 0.0)),
        ] {
            assert!(of(&a, &b, 0.3).is_none());
        }
        assert!(of(&sine(100.1, 0.0), &sine(100.0, 0.0), 0.001).is_none());
    }
}
