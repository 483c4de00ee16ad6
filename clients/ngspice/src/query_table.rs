//! Instance parameters for `show a1` and `@a1[…]`: read-only, made from the netlists of the circuit.
//!
//! ngspice reads the table of a device's instance parameters anew at every lookup, so that the table is made at setup,
//! when the models are known. All instances share one: it holds the names of every netlist of the circuit, and an
//! instance that does not have one says so.

use crate::abi::{SpiceParameter, kind};
use crate::instance::Instance;
use std::collections::HashSet;
use std::ffi::{CString, c_int};

/// The names, in the order of their numbers, as ngspice holds them and as instances do.
#[derive(Default)]
pub(crate) struct LookNames {
    own: Vec<String>,
    written: Vec<String>,
}

/// How a name is written in a deck: ngspice takes capitals for small letters and splits names at parentheses and commas.
pub(crate) fn written(name: &str) -> String {
    let plain = |c: char| match c {
        '(' | ',' => Some('_'),
        ')' => None,
        c => Some(c.to_ascii_lowercase()),
    };
    name.chars().filter_map(plain).collect()
}

/// A table of instance parameters, to be handed to the host for good.
pub(crate) struct ParameterTable {
    pub(crate) count: &'static c_int,
    pub(crate) first: *const SpiceParameter,
}

impl LookNames {
    /// The name with this number.
    pub(crate) fn get(&self, index: usize) -> Option<&str> {
        self.own.get(index).map(String::as_str)
    }

    /// The names of every instance; what they have in common first. None where they are those there were.
    ///
    /// The host keeps no copy, but it may hold an address during a lookup: a published table is never freed. There is a
    /// new one for another set of names alone.
    pub(crate) fn renew<'a>(
        &mut self,
        instances: impl Iterator<Item = &'a Instance> + Clone,
    ) -> Option<ParameterTable> {
        let mut seen = HashSet::new();
        let (mut own, mut spelled, mut shown) = (Vec::new(), Vec::new(), Vec::new());
        let first = instances.clone().flat_map(|i| i.shown()).map(|name| (name, true));
        for (name, show) in first.chain(instances.flat_map(|i| i.quantities()).map(|name| (name, false))) {
            let word = written(&name);
            if seen.insert(word.clone()) {
                own.push(name);
                spelled.push(word);
                shown.push(show);
            }
        }
        if own == self.own && spelled == self.written {
            return None;
        }
        let parameters: Vec<SpiceParameter> = (spelled.iter().zip(&own).zip(&shown).enumerate())
            .filter_map(|(id, ((word, name), show))| {
                let keyword = CString::new(word.as_str()).ok()?;
                let description = CString::new(name.as_str()).ok()?;
                Some(SpiceParameter {
                    keyword: keyword.into_raw(),
                    id: id as c_int,
                    data_type: kind::IF_REAL | kind::IF_ASK | if *show { 0 } else { kind::IF_UNINTERESTING },
                    description: description.into_raw(),
                })
            })
            .collect();
        (self.own, self.written) = (own, spelled);
        let count = Box::leak(Box::new(parameters.len() as c_int));
        Some(ParameterTable { count, first: Box::leak(parameters.into_boxed_slice()).as_ptr() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A name is written as ngspice leaves it: in small letters, an index behind an underscore.
    #[test]
    fn names_are_written_as_ngspice_leaves_them() {
        assert_eq!(written("b1.hot.T"), "b1.hot.t");
        assert_eq!(written("x1(2).y"), "x1_2.y");
        assert_eq!(written("D(1,2).vx"), "d_1_2.vx");
    }
}
