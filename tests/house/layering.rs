//! Modules stand in layers: a module names modules of lower layers, never one of its own layer or above. Tests inside a file may look anywhere.

use crate::files;
use std::fs;
use std::path::Path;

const FLOORS: [&[&str]; 14] = [
    &["budget", "sets"],
    &["structure", "multibody"],
    &["domains"],
    &["netlist", "layout", "results"],
    &["options", "equations", "input"],
    &["content", "discretize", "solve"],
    &["refine"],
    &["compile"],
    &["readout"],
    &["analysis"],
    &["device"],
    &["jobs", "cosim", "export"],
    &["service"],
    &["cli", "main"],
];

/// Words that belong to one floor and those above it.
const RESERVED: [(&str, usize); 4] = [("tonic::", 12), ("tokio::", 12), ("prost::", 12), ("clap::", 13)];

fn floor(module: &str) -> Option<usize> {
    FLOORS.iter().position(|floor| floor.contains(&module))
}

#[test]
fn no_layer_names_a_layer_above_it() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut faults = Vec::new();
    for path in files(&source) {
        let place = path.strip_prefix(&source).unwrap();
        let module = place.iter().next().unwrap().to_str().unwrap().trim_end_matches(".rs");
        if module == "lib" {
            continue;
        }
        let own = floor(module).unwrap_or_else(|| panic!("{module} stands on no floor: give it one"));
        let text = fs::read_to_string(&path).unwrap();
        let text = text.split("#[cfg(test)]").next().unwrap();
        let code: Vec<&str> = text.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
        for line in &code {
            for (_, rest) in line.match_indices("crate::").map(|(at, word)| line.split_at(at + word.len())) {
                let named: String = rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                if named != module && floor(&named).is_some_and(|other| other >= own) {
                    faults.push(format!("{}: {}", place.display(), line.trim()));
                }
            }
            for (word, lowest) in RESERVED {
                if own < lowest && line.contains(word) {
                    faults.push(format!("{}: {}", place.display(), line.trim()));
                }
            }
        }
        if module == "multibody" && code.iter().any(|line| line.to_lowercase().contains("volt")) {
            faults.push(format!("{}: bodies and joints know no volts", place.display()));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
