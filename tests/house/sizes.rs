//! One idea, one file: functions of src/, crates/ and tests/ have at most 100 lines, and files at most 600, where an idea needs them. Longer functions stand
//! in a list, and leaves it with the change that makes it shorter.

use crate::files;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Most lines of a file.
const FILE: usize = 600;
/// Most lines of a function, from its name to its closing brace.
const FUNCTION: usize = 100;

/// Files that are longer.
const LONG_FILES: &[&str] = &[];

/// Functions that are longer, by file and name.
const LONG_FUNCTIONS: &[&str] = &[
    "crates/layout/src/extract/layer.rs extract",
    "crates/multibody/src/joint_coordinates/constrained_loops/fast/kernels.rs one_inward",
    "crates/netlist/src/check.rs facts",
    "crates/netlist/src/instance.rs element",
];

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    files(folder).into_iter().filter(|path| path.extension().is_some_and(|end| end == "rs")).collect()
}

/// Name of the function that a line begins, if it begins one.
fn begun(line: &str) -> Option<&str> {
    let before = ["pub", "const", "async", "unsafe", "extern"];
    let mut words = line.split_whitespace();
    let name = loop {
        let word = words.next()?;
        match word {
            "fn" => break words.next()?,
            _ if before.iter().any(|b| word.split('(').next() == Some(b)) || word.ends_with(')') || word == "\"C\"" => {
            }
            _ => return None,
        }
    };
    name.split(['(', '<']).next()
}

/// Functions with their lengths in lines, as rustfmt lays them out: the closing brace stands under the first word.
fn functions(text: &str) -> Vec<(&str, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut found = Vec::new();
    for (first, line) in lines.iter().enumerate() {
        let Some(name) = begun(line) else { continue };
        let indent = line.len() - line.trim_start().len();
        let ends = |l: &&str| l.len() - l.trim_start().len() == indent && (l.trim() == "}" || l.ends_with(';'));
        let length = lines[first + 1..].iter().position(ends).map_or(1, |after| after + 2);
        let short = line.ends_with(';') || line.ends_with('}');
        found.push((name, if short { 1 } else { length }));
    }
    found
}

#[test]
fn files_and_functions_are_short() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut files, mut long_functions) = (BTreeMap::new(), BTreeMap::new());
    for path in ["src", "crates", "tests"].iter().flat_map(|folder| rust_files(&root.join(folder))) {
        let place = path.strip_prefix(root).unwrap().iter().map(|p| p.to_str().unwrap()).collect::<Vec<_>>().join("/");
        let text = fs::read_to_string(&path).unwrap();
        for (name, length) in functions(&text).into_iter().filter(|(_, length)| *length > FUNCTION) {
            long_functions.insert(format!("{place} {name}"), length);
        }
        files.insert(place, text.lines().count());
    }
    files.retain(|_, lines| *lines > FILE);
    for (found, listed, most) in [(&files, LONG_FILES, FILE), (&long_functions, LONG_FUNCTIONS, FUNCTION)] {
        let longer: Vec<_> = found.iter().filter(|(place, _)| !listed.contains(&place.as_str())).collect();
        assert!(longer.is_empty(), "more than {most} lines: split along its ideas: {longer:?}");
        let done: Vec<_> = listed.iter().filter(|place| !found.contains_key(**place)).collect();
        assert!(done.is_empty(), "no longer beyond {most} lines: take out of the list: {done:?}");
    }
}

/// The scan itself: methods, signatures over many lines and declarations without a body, by counting.
#[test]
fn functions_are_counted() {
    let text = "pub(crate) fn one(\n    a: f64,\n) -> f64 {\n    a\n}\n\ntrait T {\n    fn two(&self);\n    const fn three() {\n        if true {\n        }\n    }\n}\n\nfn four() {}\n";
    assert_eq!(functions(text), [("one", 5), ("two", 1), ("three", 4), ("four", 1)]);
}
