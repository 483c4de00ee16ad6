//! What an instance remembers of an accepted point, kept in memory that ngspice itself rolls back.
//!
//! ngspice hands out state memory per instance and rotates it with the accepted points, so a rejected step needs no
//! undoing. That memory is not trustworthy by itself: before the first operating point it holds anything, and node
//! damping blends the doubles of two states into numbers that never were. Each record therefore carries a check over
//! its own bits; a record that does not check is none.
//!
//! Doubles: check, token, step, skipped time; then p charges at this point, at the base, and at the base before.

use bimorph::device::Token;

/// A record as it was read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct History {
    /// State of the device; none where the memory holds no record.
    pub token: Option<Token>,
    /// What charges are differentiated from.
    pub base: Base,
    /// Charge of each port [C].
    pub charges: Vec<f64>,
}

/// The last two points far enough apart to tell a slope, see [`crate::companion`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Base {
    /// Time between the two [s]; 0 after an operating point.
    pub step: f64,
    /// Time since the later one [s].
    pub skipped: f64,
    /// Charges at the later one [C].
    pub charges: Vec<f64>,
    /// Charges at the earlier one [C].
    pub charges_before: Vec<f64>,
}

/// Doubles before the charges.
pub const HEAD: usize = 4;

/// Doubles needed for `ports` ports.
pub fn len(ports: usize) -> usize {
    HEAD + 3 * ports
}

/// Writes a record into `memory`. `epoch` names the run the record belongs to.
pub fn write(memory: &mut [f64], epoch: u64, token: Token, charges: &[f64], base: &Base) {
    let ports = charges.len();
    memory[1] = token.0 as f64;
    memory[2] = base.step;
    memory[3] = base.skipped;
    let parts = [charges, &base.charges, &base.charges_before];
    for (place, part) in memory[HEAD..].chunks_exact_mut(ports.max(1)).zip(parts) {
        place.copy_from_slice(part);
    }
    memory[0] = check(epoch, &memory[1..]);
}

/// Reads a record into `history`; without a valid one its token is none and its charges are zero.
pub fn read(memory: &[f64], epoch: u64, history: &mut History) {
    let ports = (memory.len() - HEAD) / 3;
    let valid = memory[0].to_bits() == check(epoch, &memory[1..]).to_bits();
    let base = &mut history.base;
    history.token = valid.then_some(Token(memory[1] as u64));
    (base.step, base.skipped) = if valid { (memory[2], memory[3]) } else { (0.0, 0.0) };
    let into = [&mut history.charges, &mut base.charges, &mut base.charges_before];
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
        Base { step: 1e-9 * seed, skipped: 0.0, charges: vec![3e-15, 0.0], charges_before: vec![5e-15, 6e-15] }
    }

    fn record(seed: f64) -> Vec<f64> {
        let mut memory = vec![f64::NAN; len(2)];
        write(&mut memory, 7, Token(1234567), &[1e-15, 2e-15 * seed], &base(seed));
        memory
    }

    /// What was written is read back.
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
        for (memory, epoch) in [(vec![0.0; 10], 7), (vec![f64::NAN; 10], 7), (record(1.0), 8), (blend, 7)] {
            read(&memory, epoch, &mut history);
            assert_eq!(history.token, None);
            assert_eq!(history.charges, [0.0, 0.0]);
        }
    }
}
