//! Sources that pages for developers name.

use crate::files;
use std::fs;
use std::path::Path;

/// Each source that ARCHITECTURE.md or CONTRIBUTING.md names is there: `solve/time/method.rs` is one of the crate `solve`, `factor.rs` one of any folder.
#[test]
fn sources_that_pages_name_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = ["benches", "clients", "crates", "examples", "src", "tests"];
    let sources: Vec<String> = folders
        .iter()
        .flat_map(|folder| files(&root.join(folder)))
        .map(|path| path.strip_prefix(root).unwrap().to_string_lossy().replace('\\', "/"))
        .collect();
    let mut absent = Vec::new();
    let mut named = 0;
    for page in ["ARCHITECTURE.md", "CONTRIBUTING.md"] {
        let text = fs::read_to_string(root.join(page)).unwrap();
        for name in text.split('`').skip(1).step_by(2) {
            let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || "/._".contains(c));
            if !plain || !name.ends_with(".rs") || name.contains("NAME") {
                continue;
            }
            named += 1;
            let in_crate = name.split_once('/').map(|(first, rest)| format!("crates/{first}/src/{rest}"));
            let there = |source: &String| {
                source == name || Some(source) == in_crate.as_ref() || source.ends_with(&format!("/{name}"))
            };
            if !sources.iter().any(there) {
                absent.push(format!("{page}: {name}"));
            }
        }
    }
    assert!(named > 50, "{named} names");
    assert_eq!(absent, Vec::<String>::new());
}
