//! Parts of a subcircuit: controlled and constant currents, numbered as they come.

use std::fmt::Write;

/// Text of a subcircuit, with the numbers of its sources.
#[derive(Debug, Default)]
pub(super) struct SubcircuitText {
    /// The lines written so far.
    pub(super) text: String,
    /// Sources named so far: G, F, I.
    counts: [usize; 3],
}

impl SubcircuitText {
    /// Parts that follow `text`.
    pub(super) fn after(text: String) -> Self {
        Self { text, counts: [0; 3] }
    }

    /// A line as it is.
    pub(super) fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    /// A current of `gain` times the voltage of `node` from `from` to `to`; none where the gain is 0.
    pub(super) fn by_voltage(&mut self, places: (&str, &str), node: &str, gain: f64) {
        self.between(places, (node, "0"), gain);
    }

    /// The same with the voltage between two nodes.
    pub(super) fn between(&mut self, (from, to): (&str, &str), (plus, minus): (&str, &str), gain: f64) {
        if gain != 0.0 {
            self.counts[0] += 1;
            let _ = writeln!(self.text, "G{} {from} {to} {plus} {minus} {gain:e}", self.counts[0]);
        }
    }

    /// A current of `gain` times that through the source `through`; none where the gain is 0.
    pub(super) fn by_current(&mut self, (from, to): (&str, &str), through: &str, gain: f64) {
        if gain != 0.0 {
            self.counts[1] += 1;
            let _ = writeln!(self.text, "F{} {from} {to} {through} {gain:e}", self.counts[1]);
        }
    }

    /// Makes a node show the sum of the currents into it, 1 V for 1 A: a conductance of 1 S that makes no noise.
    pub(super) fn sum(&mut self, node: &str) {
        self.by_voltage((node, "0"), node, 1.0);
    }

    /// A constant current (A); none where it is 0.
    pub(super) fn constant(&mut self, (from, to): (&str, &str), current: f64) {
        if current != 0.0 {
            self.counts[2] += 1;
            let _ = writeln!(self.text, "I{} {from} {to} {current:e}", self.counts[2]);
        }
    }
}
