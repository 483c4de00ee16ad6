//! What an instance remembers of an accepted point, kept in memory that ngspice itself rolls back.
//!
//! ngspice hands out state memory per instance and rotates it with the accepted points, so a rejected step needs no
//! undoing. That memory is not trustworthy by itself: before the first operating point it holds anything, and node
//! damping blends the doubles of two states into numbers that never were. Each record therefore carries a check over
//! its own bits; a record that does not check is none.
//!
//! Doubles: check, token, step, then p charges, then p charges of the point before.

use bimorph::device::Token;

/// A record as it was read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct History {
    /// State of the device; none where the memory holds no record.
    pub token: Option<Token>,
    /// Step that led to this point [s]; 0 after an operating point.
    pub step: f64,
    /// Charge of each port [C].
    pub charges: Vec<f64>,
    /// Charge of each port at the accepted point before [C].
    pub charges_before: Vec<f64>,
}

const HEAD: usize = 3;

/// Doubles needed for `ports` ports.
pub fn len(ports: usize) -> usize {
    HEAD + 2 * ports
}

/// Writes a record into `memory`. `epoch` names the run the record belongs to.
pub fn write(memory: &mut [f64], epoch: u64, token: Token, step: f64, charges: &[f64], charges_before: &[f64]) {
    let ports = charges.len();
    memory[1] = token.0 as f64;
    memory[2] = step;
    memory[HEAD..HEAD + ports].copy_from_slice(charges);
    memory[HEAD + ports..].copy_from_slice(charges_before);
    memory[0] = check(epoch, &memory[1..]);
}

/// Reads a record into `history`; without a valid one its token is none and its charges are zero.
pub fn read(memory: &[f64], epoch: u64, history: &mut History) {
    let ports = (memory.len() - HEAD) / 2;
    history.charges.clear();
    history.charges_before.clear();
    if memory[0].to_bits() == check(epoch, &memory[1..]).to_bits() {
        history.token = Some(Token(memory[1] as u64));
        history.step = memory[2];
        history.charges.extend_from_slice(&memory[HEAD..HEAD + ports]);
        history.charges_before.extend_from_slice(&memory[HEAD + ports..]);
    } else {
        history.token = None;
        history.step = 0.0;
        history.charges.resize(ports, 0.0);
        history.charges_before.resize(ports, 0.0);
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

    fn record(seed: f64) -> Vec<f64> {
        let mut memory = vec![f64::NAN; len(2)];
        write(&mut memory, 7, Token(1234567), 1e-9 * seed, &[1e-15, 2e-15 * seed], &[3e-15, 0.0]);
        memory
    }

    /// What was written is read back.
    #[test]
    fn round_trip() {
        let mut history = History::default();
        read(&record(1.0), 7, &mut history);
        assert_eq!(history.token, Some(Token(1234567)));
        assert_eq!((history.step, &history.charges[..]), (1e-9, &[1e-15, 2e-15][..]));
        assert_eq!(history.charges_before, [3e-15, 0.0]);
    }

    /// Zeros, noise, another run's record and a blend of two records are no records.
    #[test]
    fn refuses_what_was_never_written() {
        let blend: Vec<f64> = record(1.0).iter().zip(record(2.0)).map(|(a, b)| a + 0.3 * (b - a)).collect();
        let mut history = History::default();
        for (memory, epoch) in [(vec![0.0; 7], 7), (vec![f64::NAN; 7], 7), (record(1.0), 8), (blend, 7)] {
            read(&memory, epoch, &mut history);
            assert_eq!(history.token, None);
            assert_eq!(history.charges, [0.0, 0.0]);
        }
    }
}
