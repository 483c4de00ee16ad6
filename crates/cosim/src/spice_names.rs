//! Names as SPICE takes them: no letters apart by case, no brackets, none for two things.

use std::collections::BTreeMap;
use std::collections::HashMap;

/// Legal, distinct names of SPICE, with the number that the last of a kind got.
pub(super) struct SpiceNames {
    taken: HashMap<String, usize>,
}

impl SpiceNames {
    pub(super) fn new() -> Self {
        // ngspice takes all of these for ground
        Self { taken: ["0", "gnd"].map(|name| (name.to_owned(), 1)).into() }
    }

    /// An unused name close to `wanted`.
    pub(super) fn take(&mut self, wanted: &str) -> String {
        let plain = wanted.chars().filter(|c| *c != ')');
        let plain: String =
            plain.map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' }).collect();
        let mut count = self.taken.get(&plain).copied().unwrap_or(0);
        let name = loop {
            count += 1;
            let name = if count == 1 { plain.clone() } else { format!("{plain}_{count}") };
            if !self.taken.contains_key(&name) {
                break name;
            }
        };
        self.taken.insert(plain, count);
        self.taken.entry(name.clone()).or_insert(1);
        name
    }
}

/// An analysis with the names that the deck has for the sources that a `.dc` sweeps.
pub(super) fn swept(analysis: &str, called: &BTreeMap<String, String>) -> String {
    let words = analysis.split_whitespace().enumerate();
    let one = |(k, word): (usize, &str)| {
        let name = matches!(k, 1 | 5).then(|| called.get(&word.to_ascii_lowercase())).flatten();
        name.map_or_else(|| word.to_owned(), Clone::clone)
    };
    if analysis.starts_with(".dc") { words.map(one).collect::<Vec<_>>().join(" ") } else { analysis.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// Names are legal and distinct, also where one is spelled as another's number; a hundred thousand of one name cost no more each
    /// than the first.
    #[test]
    fn names_are_distinct() {
        let mut names = SpiceNames::new();
        let taken: Vec<String> = ["a(1)", "A(1)", "a_1_2", "a 1", "gnd", "0"].map(|n| names.take(n)).into();
        assert_eq!(taken, ["a_1", "a_1_2", "a_1_2_2", "a_1_3", "gnd_2", "0_2"]);
        let many: HashSet<String> = (0..100_000).map(|_| names.take("r_anon9")).collect();
        assert_eq!(many.len(), 100_000);
    }
}
