//! Any bytes are read as a layout to their end, and extracted: no panic, no hang, and the same netlist each time.
//!
//! Drawings are masks of the examples in both formats, without the labels that carry their netlist in half of the cases, changed at random:
//! bytes exchanged, stretches lost, doubled and mixed, numbers made extreme. A few run with every test; `make fuzz` runs them for minutes.

use bimorph::input::from_bytes;
use bimorph::layout::mask::mask;
use bimorph::layout::{LayoutFormat, Process};
use bimorph::netlist::{load, read_bundle};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// No drawing may take more wall time than this, with a release build on a busy machine.
const LONGEST: Duration = Duration::from_secs(60);
/// Drawings with every test, of each format.
const QUICK: usize = 60;
/// Words and numbers of CIF at the ends of their range.
const WORDS: [&str; 14] = [
    "DS 1 1 1;",
    "DF;",
    "C 1;",
    "C 1 T 2147483647 0 R -1 1;",
    "L POLY1;",
    "B 0 0 0 0;",
    "P 0 0 1;",
    "W 2000 0 0 5000 5000;",
    "R 100 0 0;",
    "9;",
    "94 x 0 0;",
    "(",
    "E",
    "-2147483648",
];

/// A cantilever with a beam at an angle, by hand: GDS files that others wrote carry no netlist.
const FOREIGN: &str = "DS 1 1 1;\n9 T;\nL POLY1;\nB 10000 200 5000 0;\nB 20000 200 19848 1736 984808 173648;\nB 5000 5000 31500 3500;\n\
    W 150 31500 3500 31500 9000 36000 9000;\nL ANCHOR1;\nB 600 600 0 0;\nDF;\nC 1;\nE\n";

fn corpus(format: LayoutFormat) -> Vec<Vec<u8>> {
    let process = Process::builtin("polymumps").unwrap();
    let mut all = Vec::new();
    for name in ["bank/bank", "comb_resonator/comb_resonator", "switch/switch", "pivots/pivots", "arch/arch"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/{name}.net"));
        let structure = load(&read_bundle(&path, &[]).unwrap(), &[]).unwrap().structure;
        let drawn = mask(&structure, &process, format, "x").unwrap().bytes;
        if format == LayoutFormat::Cif {
            let bare: Vec<u8> = drawn
                .split_inclusive(|b| *b == b'\n')
                .filter(|line| !line.starts_with(b"94"))
                .flatten()
                .copied()
                .collect();
            all.push(bare);
        }
        all.push(drawn);
    }
    if format == LayoutFormat::Cif {
        all.push(FOREIGN.into());
    }
    all
}

struct Maker {
    random: ChaCha8Rng,
    corpus: Vec<Vec<u8>>,
}

impl Maker {
    fn below(&mut self, most: usize) -> usize {
        (self.random.next_u64() % most.max(1) as u64) as usize
    }

    fn drawing(&mut self) -> Vec<u8> {
        let at = self.below(self.corpus.len());
        let mut bytes = self.corpus[at].clone();
        for _ in 0..self.below(6) {
            let (at, length) = (self.below(bytes.len()), 1 + self.below(60));
            let end = (at + length).min(bytes.len());
            match self.below(6) {
                0 if !bytes.is_empty() => bytes[at] = self.random.next_u32() as u8,
                1 => drop(bytes.drain(at..end)),
                2 => {
                    let again = bytes[at..end].repeat(1 + self.below(8));
                    bytes.splice(at..at, again);
                }
                3 => {
                    let word = WORDS[self.below(WORDS.len())];
                    bytes.splice(at..at, word.bytes());
                }
                4 => {
                    let other = self.below(self.corpus.len());
                    let other = self.corpus[other].clone();
                    let from = self.below(other.len());
                    bytes.splice(at..at, other[from..(from + 200).min(other.len())].iter().copied());
                }
                _ => {
                    let digits: Vec<usize> = (0..bytes.len()).filter(|&k| bytes[k].is_ascii_digit()).collect();
                    if let Some(&k) = digits.get(self.below(digits.len())) {
                        bytes[k] = b'0' + self.below(10) as u8;
                    }
                }
            }
        }
        bytes
    }
}

fn read(bytes: &[u8], name: &str) -> bool {
    match from_bytes(bytes, name, Some("polymumps"), None) {
        Ok(source) => {
            if let Err(diagnostics) = load(&source.bundle, &[]) {
                assert!(diagnostics.has_errors());
            }
            true
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
    }
}

/// Where a drawing lies that is being read, or was not read well.
fn kept(name: &str) -> PathBuf {
    std::env::temp_dir().join(name)
}

/// Runs a format until `done`; with `keep` each drawing is written down before it is read, so that one that ends the process is known.
fn run(format: LayoutFormat, name: &str, (seed, keep): (u64, bool), mut done: impl FnMut(usize) -> bool) {
    let mut maker = Maker { random: ChaCha8Rng::seed_from_u64(seed), corpus: corpus(format) };
    let (mut count, mut converted) = (0, 0);
    while !done(count) {
        let bytes = maker.drawing();
        if keep {
            std::fs::write(kept(name), &bytes).expect("a place for drawings");
        }
        let begun = Instant::now();
        match catch_unwind(AssertUnwindSafe(|| read(&bytes, name))) {
            Ok(good) => converted += usize::from(good),
            Err(fault) => {
                let _ = std::fs::write(kept(name), &bytes);
                eprintln!("seed {seed}, drawing {count} of {} bytes: {}", bytes.len(), kept(name).display());
                resume_unwind(fault);
            }
        }
        let took = begun.elapsed();
        if took >= LONGEST {
            let _ = std::fs::write(kept(name), &bytes);
            panic!("seed {seed}, drawing {count} took {took:?}: {}", kept(name).display());
        }
        count += 1;
    }
    println!("{count} drawings, {converted} of them converted");
    assert!(converted > 0, "no drawing converts: nothing is tried");
}

#[test]
fn a_few_cif() {
    run(LayoutFormat::Cif, "fuzz.cif", (1, false), |count| count >= QUICK);
}

#[test]
fn a_few_gds() {
    run(LayoutFormat::Gds, "fuzz.gds", (1, false), |count| count >= QUICK);
}

/// For `FUZZ_MINUTES` (min), each time with other drawings: the seed is the time, and is printed on failure.
fn for_minutes(format: LayoutFormat, name: &str) {
    let minutes: f64 = std::env::var("FUZZ_MINUTES").ok().and_then(|text| text.parse().ok()).unwrap_or(10.0);
    let end = Instant::now() + Duration::from_secs_f64(60.0 * minutes);
    let seed = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0, |d| d.as_secs());
    run(format, name, (seed, true), |_| Instant::now() > end);
}

#[test]
#[ignore = "minutes: make fuzz"]
fn fuzz_cif() {
    for_minutes(LayoutFormat::Cif, "fuzz.cif");
}

#[test]
#[ignore = "minutes: make fuzz"]
fn fuzz_gds() {
    for_minutes(LayoutFormat::Gds, "fuzz.gds");
}
