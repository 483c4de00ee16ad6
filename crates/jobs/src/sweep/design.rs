//! Points of the unit cube, one for each sample, a coordinate for each parameter that varies.
//!
//! A point depends on the design, the seed, its number and their count, and on nothing else: shards, threads and
//! resumed runs draw the same ones.

use super::error::{SweepError, bad};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::str::FromStr;

/// How samples fill the cube.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Design {
    /// Independent points: errors of means fall as 1/√N.
    Random,
    /// One point in each of N slices of every coordinate (McKay, Beckman, Conover, Technometrics 21, 1979): better means for the same
    /// N where coordinates act by sums.
    #[default]
    LatinHypercube,
    /// Sobol's sequence with Owen's scrambling (Burley, "Practical hash-based Owen scrambling", JCGT 9, 2020); powers of two fill best.
    Sobol,
}

/// Names, as they are written.
pub const DESIGNS: [(&str, Design); 3] =
    [("random", Design::Random), ("lhs", Design::LatinHypercube), ("sobol", Design::Sobol)];

/// Samples of any design.
const SAMPLES_MOST: usize = 100_000_000;
/// Samples of Sobol's sequence, and its coordinates, as far as the generator has them.
const SOBOL_MOST: (usize, usize) = (1 << 16, 256);

impl FromStr for Design {
    type Err = SweepError;

    fn from_str(text: &str) -> Result<Self, SweepError> {
        let found = DESIGNS.iter().find(|(name, _)| *name == text);
        found.map(|(_, design)| *design).ok_or_else(|| bad("design".into(), "random, lhs or sobol", text))
    }
}

/// The points of a design.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cube {
    design: Design,
    seed: u64,
    count: usize,
}

impl Cube {
    /// `count` points of `coordinates` each.
    ///
    /// # Errors
    /// [`SweepError::BadSpec`] for more than a design has.
    pub(super) fn new(design: Design, seed: u64, count: usize, coordinates: usize) -> Result<Self, SweepError> {
        if design == Design::Sobol && (count > SOBOL_MOST.0 || coordinates > SOBOL_MOST.1) {
            let expected = format!("at most {} samples of {} parameters for sobol", SOBOL_MOST.0, SOBOL_MOST.1);
            return Err(bad("samples".into(), &expected, &format!("{count} of {coordinates}")));
        }
        if count > SAMPLES_MOST {
            return Err(bad("samples".into(), &format!("at most {SAMPLES_MOST} samples"), &count.to_string()));
        }
        Ok(Self { design, seed, count })
    }

    /// Coordinate `c` of point `k`: 0 < u < 1.
    pub(super) fn at(&self, k: usize, c: usize) -> f64 {
        match self.design {
            Design::Random => share(self.seed, c, k),
            Design::LatinHypercube => {
                (slice(self.seed, c, k, self.count) as f64 + share(self.seed, c, k)) / self.count as f64
            }
            Design::Sobol => {
                // the generator has 24 bits; the middle of each of its cells
                let seed = (self.seed ^ (self.seed >> 32)) as u32;
                f64::from(sobol_burley::sample(k as u32, c as u32, seed)) + 2f64.powi(-25)
            }
        }
    }
}

/// A number between 0 and 1 for each seed, coordinate and sample.
fn share(seed: u64, coordinate: usize, sample: usize) -> f64 {
    let mut numbers = ChaCha8Rng::seed_from_u64(seed);
    numbers.set_stream(2 * coordinate as u64);
    numbers.set_word_pos(2 * sample as u128);
    ((numbers.next_u64() >> 11) as f64 + 0.5) * 2f64.powi(-53)
}

/// The slice of sample `k` of `count` in a coordinate: a permutation without a table. Four rounds of Feistel's network
/// over the next power of four are repeated until they reach a slice below `count` (Black & Rogaway, "Ciphers with
/// arbitrary finite domains", 2002).
fn slice(seed: u64, coordinate: usize, k: usize, count: usize) -> u64 {
    let half = (u64::BITS - (count as u64 - 1).leading_zeros()).div_ceil(2).max(1);
    let mask = (1u64 << half) - 1;
    let key = mixed(seed ^ mixed(coordinate as u64 + 1));
    let mut slice = k as u64;
    loop {
        let (mut left, mut right) = (slice >> half, slice & mask);
        for round in 1..=4u64 {
            (left, right) = (right, left ^ (mixed(key ^ mixed(right ^ (round << 56))) & mask));
        }
        slice = (left << half) | right;
        if slice < count as u64 {
            return slice;
        }
    }
}

/// The output function of SplitMix64 (Steele, Lea, Flood, OOPSLA 2014).
fn mixed(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    //! Every design fills the cube, and the same point is always the same.
    use super::*;

    #[test]
    fn points_lie_inside_and_fill() {
        for (_, design) in DESIGNS {
            let cube = Cube::new(design, 7, 1024, 3).unwrap();
            for c in 0..3 {
                let u: Vec<f64> = (0..1024).map(|k| cube.at(k, c)).collect();
                assert!(u.iter().all(|u| *u > 0.0 && *u < 1.0));
                let mean = u.iter().sum::<f64>() / 1024.0;
                // 1/√(12·N) is 0.009; stratified designs are far better
                let bound = if design == Design::Random { 0.03 } else { 1e-3 };
                assert!((mean - 0.5).abs() < bound, "{design:?} {mean}");
                if design != Design::Random {
                    let mut slices = vec![false; 1024];
                    u.iter().for_each(|u| slices[(u * 1024.0) as usize] = true);
                    assert!(slices.iter().all(|hit| *hit), "{design:?}");
                }
            }
            assert_eq!(cube.at(17, 1).to_bits(), Cube::new(design, 7, 1024, 3).unwrap().at(17, 1).to_bits());
            assert_ne!(cube.at(17, 1), Cube::new(design, 8, 1024, 3).unwrap().at(17, 1));
            assert_ne!(cube.at(17, 1), cube.at(17, 2));
        }
    }

    #[test]
    fn too_many_are_refused() {
        assert!(Cube::new(Design::Sobol, 0, 65_537, 1).is_err());
        assert!(Cube::new(Design::LatinHypercube, 0, 1_000_000_000, 1).is_err());
    }

    /// Slices are a permutation, whatever their number, and no two coordinates have the same.
    #[test]
    fn slices_are_permutations() {
        for count in [1, 2, 3, 16, 17, 1000] {
            let order = |c| -> Vec<u64> { (0..count).map(|k| slice(5, c, k, count)).collect() };
            let mut sorted = order(0);
            sorted.sort_unstable();
            assert!(sorted.into_iter().eq(0..count as u64), "{count}");
            assert!(count < 16 || order(0) != order(1));
        }
    }
}
