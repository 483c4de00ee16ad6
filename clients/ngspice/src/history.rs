//! History of an instance at an accepted point, in memory that ngspice itself rolls back.
//!
//! ngspice hands out state memory per instance and rotates it with the accepted points, so a rejected step needs no
//! undoing. That memory is not trustworthy by itself: before the first operating point it holds anything, and node
//! damping blends the doubles of two states into numbers that never were. Each record therefore has a checksum over its
//! own bits; a record with a wrong one is ignored.
//!
//! Doubles: check, token, step; then p charges at this point, at the last two bases, p currents at the last, and p largest currents.

use crate::companion::{Companion, DifferentiationRule, hidden, shortest};
use bimorph::device::Token;

/// A record as it was read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct History {
    /// State of the device; none where the memory holds no record.
    pub token: Option<Token>,
    /// Base for differentiating charges.
    pub base: Base,
    /// Charge of each port (C).
    pub charges: Vec<f64>,
}

/// The last two points far enough apart to give a slope, the last one first, see [`crate::companion`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Base {
    /// Time between them (s); 0 without a step since an operating point, or since the slope changed.
    pub step: f64,
    /// Charges at each (C).
    pub charges: [Vec<f64>; 2],
    /// Currents from the change of charges at the last one (A).
    pub currents: Vec<f64>,
    /// The largest of those so far (A).
    pub peaks: Vec<f64>,
}

impl Base {
    /// At an operating point with these charges (C).
    pub fn start(&mut self, charges: &[f64]) {
        self.step = 0.0;
        for place in &mut self.charges {
            place.clear();
            place.extend_from_slice(charges);
        }
        for place in [&mut self.currents, &mut self.peaks] {
            place.clear();
            place.resize(charges.len(), 0.0);
        }
    }

    /// At the end of a step that ends at `t` and is `dt` long (s), with these charges there (C): adds the currents that they
    /// make (A), and answers by how much each changes with its charge (1/s).
    pub fn advance(
        &mut self,
        rule: DifferentiationRule,
        (t, dt): (f64, f64),
        charges: &[f64],
        currents: &mut [f64],
    ) -> f64 {
        if self.charges[0].iter().zip(&self.peaks).any(|(q, peak)| hidden((t, dt), *q, *peak)) {
            let slope = 1.0 / shortest(t);
            for (n, current) in currents.iter_mut().enumerate() {
                let (q, last) = (charges[n], self.currents[n]);
                self.currents[n] += slope * (q - self.charges[0][n] - last * dt);
                *current += self.currents[n];
                self.charges[0][n] = q;
            }
            // one with the step before, unless the slope changed between them
            self.step = if rule == DifferentiationRule::First || self.step == 0.0 { 0.0 } else { self.step + dt };
            return slope;
        }
        let companion = Companion::new(rule, dt, self.step);
        for (n, current) in currents.iter_mut().enumerate() {
            let before = [self.charges[0][n], self.charges[1][n]];
            self.currents[n] = companion.current(charges[n], before, self.currents[n]);
            *current += self.currents[n];
            self.peaks[n] = self.peaks[n].max(self.currents[n].abs());
        }
        self.step = dt;
        self.charges.swap(0, 1);
        self.charges[0].clear();
        self.charges[0].extend_from_slice(charges);
        companion.slope
    }

    /// The charges at the last point become these (C), and its currents what follows with `slope` (1/s), that of the step to it.
    pub fn settle(&mut self, charges: &[f64], slope: f64) {
        for ((kept, current), charge) in self.charges[0].iter_mut().zip(&mut self.currents).zip(charges) {
            *current += slope * (charge - *kept);
            *kept = *charge;
        }
    }
}

/// Doubles before the charges.
pub const HEAD: usize = 3;

/// Doubles needed for `ports` ports.
pub fn len(ports: usize) -> usize {
    HEAD + 5 * ports
}

/// Writes a record into `memory`. `epoch` names the run the record belongs to.
pub fn write(memory: &mut [f64], epoch: u64, token: Token, charges: &[f64], base: &Base) {
    let ports = charges.len();
    memory[1] = token.0 as f64;
    memory[2] = base.step;
    let [last, second] = &base.charges;
    let parts = [charges, last, second, &base.currents, &base.peaks];
    for (place, part) in memory[HEAD..].chunks_exact_mut(ports.max(1)).zip(parts) {
        place.copy_from_slice(part);
    }
    memory[0] = check(epoch, &memory[1..]);
}

/// Reads a record into `history`; without a valid one, its token is `None` and its charges are zero.
pub fn read(memory: &[f64], epoch: u64, history: &mut History) {
    let ports = (memory.len() - HEAD) / 5;
    let valid = memory[0].to_bits() == check(epoch, &memory[1..]).to_bits();
    let base = &mut history.base;
    history.token = valid.then_some(Token(memory[1] as u64));
    base.step = if valid { memory[2] } else { 0.0 };
    let [last, second] = &mut base.charges;
    let into = [&mut history.charges, last, second, &mut base.currents, &mut base.peaks];
    for (part, place) in into.into_iter().zip(memory[HEAD..].chunks_exact(ports.max(1))) {
        part.clear();
        part.extend(place.iter().map(|q| if valid { *q } else { 0.0 }));
    }
}

/// A check over bits, as an integer that a double holds exactly (multiply-and-xorshift, after FNV-1a).
fn check(epoch: u64, values: &[f64]) -> f64 {
    let mix = values.iter().fold(epoch ^ 0xcbf2_9ce4_8422_2325, |hash, v| {
        let x = (hash ^ v.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        x ^ (x >> 29)
    });
    ((mix >> 12) | 1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn base(seed: f64) -> Base {
        let charges = [vec![3e-15, 0.0], vec![5e-15, 6e-15]];
        Base { step: 1e-9 * seed, charges, currents: vec![7e-6, -1e-6], peaks: vec![8e-6, 1e-6] }
    }

    /// Over points a rounding of the time apart the current stays unchanged, by every rule, and continues so after
    /// them.
    #[test]
    fn steps_of_rounding_are_crossed() {
        let q = |t: f64| vec![1e-13 + 2e-15 * t / 1e-6];
        for rule in [DifferentiationRule::Trapezoidal(0.5), DifferentiationRule::Gear] {
            let (mut base, mut before) = (Base::default(), 0.0);
            base.start(&q(0.0));
            for t in [1e-6, 2e-6, 2e-6 + 1e-18, 2e-6 + 3e-18, 3e-6, 4e-6] {
                let mut current = [0.0];
                base.advance(
                    if before == 0.0 { DifferentiationRule::First } else { rule },
                    (t, t - before),
                    &q(t),
                    &mut current,
                );
                assert!((current[0] / 2e-9 - 1.0).abs() < 1e-3, "{rule:?}: {current:?} at {t:e}");
                before = t;
            }
        }
    }

    /// A corner after which the first step is one of rounding is one for the step after it, too: by Gear's method, which would reach back over it.
    #[test]
    fn a_corner_is_kept_over_a_step_of_rounding() {
        let mut base = Base { step: 1e-6, charges: [vec![1e-15], vec![0.0]], currents: vec![0.0], peaks: vec![0.0] };
        base.advance(DifferentiationRule::First, (1e-6 + 1e-20, 1e-20), &[1e-15], &mut [0.0]);
        let mut current = [0.0];
        base.advance(DifferentiationRule::Gear, (2e-6, 1e-6), &[1e-15], &mut current);
        assert_eq!(current, [0.0]);
    }

    /// Charges that have settled elsewhere leave the currents that they would have made.
    #[test]
    fn settled_charges_take_their_currents_along() {
        let run = |asked: f64, settled: f64| {
            let mut base = base(1.0);
            let slope = base.advance(DifferentiationRule::Trapezoidal(0.5), (5e-9, 1e-9), &[asked, 0.0], &mut [0.0; 2]);
            base.settle(&[settled, 0.0], slope);
            base.currents[0]
        };
        assert!((run(4e-15, 6e-15) / run(6e-15, 6e-15) - 1.0).abs() < 1e-12);
    }

    fn record(seed: f64) -> Vec<f64> {
        let mut memory = vec![f64::NAN; len(2)];
        write(&mut memory, 7, Token(1234567), &[1e-15, 2e-15 * seed], &base(seed));
        memory
    }

    /// A written record is read back unchanged.
    #[test]
    fn round_trip() {
        let mut history = History::default();
        read(&record(1.0), 7, &mut history);
        assert_eq!(history, History { token: Some(Token(1234567)), base: base(1.0), charges: vec![1e-15, 2e-15] });
    }

    /// Zeros, noise, another run's record and a blend of two records are no records.
    #[test]
    fn refuses_what_was_never_written() {
        let blend: Vec<f64> = record(1.0).iter().zip(record(2.0)).map(|(a, b)| a + 0.3 * (b - a)).collect();
        let mut history = History::default();
        for (memory, epoch) in [(vec![0.0; 13], 7), (vec![f64::NAN; 13], 7), (record(1.0), 8), (blend, 7)] {
            read(&memory, epoch, &mut history);
            assert_eq!(history.token, None);
            assert_eq!(history.charges, [0.0, 0.0]);
        }
    }
}
