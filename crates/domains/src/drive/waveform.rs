//! Waveforms of an input over time, with the meaning of the sources of SPICE.

use std::f64::consts::TAU;

/// A value over time (of its own unit), from the time 0 on.
#[derive(Debug, Clone, PartialEq)]
pub enum InputWaveform {
    /// offset until `delay`, then offset + amplitude·sin(2π·frequency·(t − delay)).
    Sine {
        /// Value in the middle.
        offset: f64,
        /// Amplitude.
        amplitude: f64,
        /// Frequency (Hz).
        frequency: f64,
        /// When it begins (s).
        delay: f64,
    },
    /// Goes from `low` to `high` and back along straight lines.
    Pulse {
        /// Value at the start.
        low: f64,
        /// Value of the pulse.
        high: f64,
        /// When it begins to rise (s).
        delay: f64,
        /// How long it rises, stays and falls (s).
        lengths: [f64; 3],
        /// When the next pulse begins after this one did (s); none: one pulse.
        period: Option<f64>,
    },
    /// Straight lines between points (s, value), constant before the first and after the last.
    Lines(Vec<[f64; 2]>),
}

/// Times nearer than this part of themselves are one (1).
const SAME_TIME: f64 = 1e-12;

impl InputWaveform {
    /// Checks that a source can have it.
    ///
    /// # Errors
    /// The expected property that it does not have.
    pub fn check(&self) -> Result<(), &'static str> {
        let (numbers, positive): (Vec<f64>, Vec<f64>) = match self {
            Self::Sine { offset, amplitude, frequency, delay } => (vec![*offset, *amplitude, *delay], vec![*frequency]),
            Self::Pulse { low, high, delay, lengths: [rise, stay, fall], period } => {
                (vec![*low, *high, *delay, *stay], [*rise, *fall].into_iter().chain(*period).collect())
            }
            Self::Lines(points) => (points.iter().flatten().copied().collect(), Vec::new()),
        };
        if !numbers.iter().chain(&positive).all(|x| x.is_finite()) {
            return Err("finite numbers");
        }
        if !positive.iter().all(|x| *x > 0.0) {
            return Err("a positive frequency, positive times of rise and fall, and a positive period");
        }
        match self {
            Self::Sine { delay, .. } if *delay < 0.0 => Err("a delay of at least 0"),
            Self::Sine { .. } => Ok(()),
            Self::Pulse { delay, lengths: [rise, stay, fall], period, .. } => match period {
                _ if *delay < 0.0 || *stay < 0.0 => Err("a delay and a length of at least 0"),
                Some(period) if rise + stay + fall > *period => Err("a period of at least rise, length and fall"),
                _ => Ok(()),
            },
            Self::Lines(points) if points.is_empty() => Err("a point at least"),
            Self::Lines(points) if points.windows(2).any(|ends| ends[0][0] >= ends[1][0]) => Err("ascending times"),
            Self::Lines(_) => Ok(()),
        }
    }

    /// Value and rate of change at the time `t` (s).
    pub fn at(&self, t: f64) -> [f64; 2] {
        match self {
            Self::Sine { offset, delay, .. } if t < *delay => [*offset, 0.0],
            Self::Sine { offset, amplitude, frequency, delay } => {
                let (sin, cos) = (TAU * frequency * (t - delay)).sin_cos();
                [offset + amplitude * sin, TAU * frequency * amplitude * cos]
            }
            Self::Pulse { .. } => {
                let [places, values] = self.pulse_at(t);
                on_lines(&places.into_iter().zip(values).map(|(t, x)| [t, x]).collect::<Vec<_>>(), t)
            }
            Self::Lines(points) => on_lines(points, t),
        }
    }

    /// The value farthest from that at t = 0.
    pub fn farthest(&self) -> f64 {
        let start = self.at(0.0)[0];
        let values = match self {
            Self::Sine { offset, amplitude, .. } => vec![offset + amplitude, offset - amplitude],
            Self::Pulse { low, high, .. } => vec![*low, *high],
            Self::Lines(points) => points.iter().map(|[_, x]| *x).collect(),
        };
        let farther = |a: f64, b: f64| if (b - start).abs() > (a - start).abs() { b } else { a };
        values.into_iter().fold(start, farther)
    }

    /// The largest jump of its rate; both ends of a ramp together.
    pub fn jump_of_rate(&self) -> f64 {
        match self {
            Self::Sine { amplitude, frequency, .. } => (TAU * frequency * amplitude).abs(),
            Self::Pulse { low, high, lengths: [rise, _, fall], .. } => 2.0 * (high - low).abs() / rise.min(*fall),
            Self::Lines(points) => {
                let inner = points.windows(2).map(|ends| (ends[1][1] - ends[0][1]) / (ends[1][0] - ends[0][0]));
                let slopes: Vec<f64> = std::iter::once(0.0).chain(inner).chain(std::iter::once(0.0)).collect();
                2.0 * slopes.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max)
            }
        }
    }

    /// The first time after `t` at which its slope jumps (s); infinite without one.
    pub fn corner_after(&self, t: f64) -> f64 {
        let later = |corner: &f64| *corner > t + SAME_TIME * (t.abs() + corner.abs());
        match self {
            Self::Sine { delay, .. } => Some(*delay).filter(later).unwrap_or(f64::INFINITY),
            Self::Pulse { period, .. } => {
                let [places, _] = self.pulse_at(t);
                let next = period.map_or(f64::INFINITY, |period| places[0] + period);
                places.into_iter().chain([next]).filter(later).fold(f64::INFINITY, f64::min)
            }
            Self::Lines(points) => points.iter().map(|[corner, _]| *corner).find(later).unwrap_or(f64::INFINITY),
        }
    }

    /// The corners of the pulse that `t` lies in, and its values there.
    fn pulse_at(&self, t: f64) -> [[f64; 4]; 2] {
        let Self::Pulse { low, high, delay, lengths: [rise, stay, fall], period } = self else { return [[0.0; 4]; 2] };
        let begun = period.map_or(0.0, |period| {
            let count = ((t - delay) / period).floor().max(0.0);
            // rounding must not leave the end of a period in the pulse before
            let next = (count + 1.0) * period;
            if t - delay >= next * (1.0 - SAME_TIME) { next } else { count * period }
        });
        let from = delay + begun;
        [[from, from + rise, from + rise + stay, from + rise + stay + fall], [*low, *high, *high, *low]]
    }
}

/// Value and rate at `t` of lines between points.
fn on_lines(points: &[[f64; 2]], t: f64) -> [f64; 2] {
    let after = points.partition_point(|[at, _]| *at <= t);
    match (after.checked_sub(1).map(|before| points[before]), points.get(after)) {
        (None, Some([_, first])) => [*first, 0.0],
        (Some([from, a]), Some([to, b])) => {
            let slope = (b - a) / (to - from);
            [a + slope * (t - from), slope]
        }
        (Some([_, last]), None) => [last, 0.0],
        (None, None) => [0.0; 2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values, rates and corners are those of SPICE's SIN, PULSE and PWL sources (ngspice manual, 4.1).
    #[test]
    fn waveforms_of_spice() {
        let sine = InputWaveform::Sine { offset: 1.0, amplitude: 2.0, frequency: 0.25, delay: 1.0 };
        assert_eq!([sine.at(0.5), sine.at(1.0)], [[1.0, 0.0], [1.0, TAU * 0.5]]);
        assert!((sine.at(2.0)[0] - 3.0).abs() < 1e-15 && sine.at(2.0)[1].abs() < 1e-15);
        assert_eq!([sine.corner_after(0.0), sine.corner_after(1.0)], [1.0, f64::INFINITY]);
        let pulse = |period| InputWaveform::Pulse { low: 1.0, high: 3.0, delay: 1.0, lengths: [1.0, 2.0, 0.5], period };
        let once = [0.5, 1.5, 2.5, 4.25, 9.0].map(|t| pulse(None).at(t));
        assert_eq!(once, [[1.0, 0.0], [2.0, 2.0], [3.0, 0.0], [2.0, -4.0], [1.0, 0.0]]);
        let again = pulse(Some(5.0));
        assert_eq!([again.at(6.5), again.at(5.75)], [[2.0, 2.0], [1.0, 0.0]]);
        let corners = [0.0, 1.0, 2.0, 4.0, 4.5, 6.0].map(|t| again.corner_after(t));
        assert_eq!(corners, [1.0, 2.0, 4.0, 4.5, 6.0, 7.0]);
        assert_eq!(pulse(None).corner_after(4.5), f64::INFINITY);
        let lines = InputWaveform::Lines(vec![[1.0, 2.0], [3.0, -2.0]]);
        assert_eq!([lines.at(0.0), lines.at(2.0), lines.at(4.0)], [[2.0, 0.0], [0.0, -2.0], [-2.0, 0.0]]);
        assert_eq!(
            [lines.corner_after(0.0), lines.corner_after(1.0), lines.corner_after(3.0)],
            [1.0, 3.0, f64::INFINITY]
        );
        assert_eq!([sine.farthest(), again.farthest(), lines.farthest()], [3.0, 3.0, -2.0]);
        let jumps = [sine.jump_of_rate(), again.jump_of_rate(), lines.jump_of_rate()];
        assert_eq!(jumps, [TAU * 0.5, 8.0, 4.0]);
    }

    /// Impossible waveforms are refused: times that do not ascend, pulses longer than their period, steps without a rise.
    #[test]
    fn impossible_waveforms_are_refused() {
        let pulse =
            |rise, period| InputWaveform::Pulse { low: 0.0, high: 1.0, delay: 0.0, lengths: [rise, 1.0, 1.0], period };
        let refused = [
            InputWaveform::Lines(Vec::new()),
            InputWaveform::Lines(vec![[0.0, 0.0], [0.0, 1.0]]),
            InputWaveform::Lines(vec![[0.0, f64::NAN]]),
            InputWaveform::Sine { offset: 0.0, amplitude: 1.0, frequency: 0.0, delay: 0.0 },
            pulse(0.0, None),
            pulse(1.0, Some(2.5)),
        ];
        assert!(refused.iter().all(|wave| wave.check().is_err()));
        assert!(pulse(1.0, Some(3.0)).check().is_ok());
    }
}
