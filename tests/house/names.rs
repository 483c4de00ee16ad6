//! A type's name is found by one search: no two top-level types of the workspace have the same name, but for a short list.

use crate::files;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Names that stand for more than one type, with the reason. Listed names that are unique again fail the test.
const SHARED: &[(&str, &str)] = &[("Stop", "the stop of a netlist, and Python's class for stopping a computation")];

/// Most definitions whose name occurs more than once.
const MAX_SHARED_DEFINITIONS: usize = 2 * SHARED.len();

/// Sources of the library, the command and the clients.
const FOLDERS: [&str; 5] = ["src", "crates", "clients/c/src", "clients/ngspice/src", "clients/python/native/src"];

/// The type that a line defines, if it stands at the left margin: rustfmt indents everything that is not top-level.
fn defined(line: &str) -> Option<&str> {
    let rest = match line.strip_prefix("pub") {
        Some(rest) => rest
            .strip_prefix('(')
            .and_then(|rest| rest.split_once(')'))
            .map_or(rest, |(_, rest)| rest)
            .strip_prefix(' ')?,
        None => line,
    };
    let (kind, rest) = rest.split_once(' ')?;
    let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
    (["struct", "enum", "trait", "type", "union"].contains(&kind) && end > 0).then(|| &rest[..end])
}

/// The places of every type, by name.
fn definitions(root: &Path) -> BTreeMap<String, Vec<String>> {
    let mut found = BTreeMap::<String, Vec<String>>::new();
    let all = FOLDERS.iter().flat_map(|folder| files(&root.join(folder)));
    for path in all.filter(|path| path.extension().is_some_and(|end| end == "rs")) {
        let place = path.strip_prefix(root).unwrap().display().to_string();
        let text = fs::read_to_string(&path).unwrap();
        for (number, line) in text.lines().enumerate() {
            if let Some(name) = defined(line) {
                found.entry(name.to_owned()).or_default().push(format!("{place}:{}", number + 1));
            }
        }
    }
    found
}

#[test]
fn type_names_are_unique() {
    let mut found = definitions(Path::new(env!("CARGO_MANIFEST_DIR")));
    assert!(found.len() > 1000, "the scan finds the types: {}", found.len());
    found.retain(|_, places| places.len() > 1);
    let listed = |name: &str| SHARED.iter().any(|(shared, _)| *shared == name);
    let new: Vec<_> = found.iter().filter(|(name, _)| !listed(name)).collect();
    assert!(new.is_empty(), "one name for more than one type: say in its name what the newer one is: {new:?}");
    let unique: Vec<_> = SHARED.iter().filter(|(name, _)| !found.contains_key(*name)).collect();
    assert!(unique.is_empty(), "unique again: take out of the list: {unique:?}");
    let count: usize = found.values().map(Vec::len).sum();
    assert!(count <= MAX_SHARED_DEFINITIONS, "{count} definitions share their names: {found:?}");
}

/// The scan itself: each kind of type, with and without a visibility, generics and bodies; nothing that is not a type.
#[test]
fn definitions_are_recognized() {
    let types = [
        "struct A;",
        "pub struct A(f64);",
        "pub(crate) enum A {",
        "pub(in crate::x) trait A<T>: B {",
        "type A<T> = B;",
        "union A {",
    ];
    for line in types {
        assert_eq!(defined(line), Some("A"), "{line}");
    }
    for line in ["pub use a::B;", "    struct A;", "fn a() {}", "pub fn a() {}", "// struct A", "impl A {", "}"] {
        assert_eq!(defined(line), None, "{line}");
    }
}
