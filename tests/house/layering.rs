//! Crates stand in layers: a crate depends on the crates that are listed for it here and in its `lib.rs`, and on no other. The compiler keeps
//! what the manifests say; this keeps the manifests, and the order of modules within crates. Tests inside a file may look anywhere.

use crate::files;
use std::fs;
use std::path::Path;

/// Crates from the bottom up, each with the crates that it may depend on.
const CRATES: [(&str, &[&str]); 19] = [
    ("base", &[]),
    ("structure", &["base"]),
    ("document", &["base", "structure"]),
    ("multibody", &["base"]),
    ("domains", &["base", "structure", "multibody"]),
    ("solve", &["base", "multibody", "domains"]),
    ("netlist", &["base", "structure", "document"]),
    ("layout", &["base", "structure", "netlist"]),
    ("results", &["structure"]),
    ("model", &["base", "structure", "multibody", "domains", "solve"]),
    ("analysis", &["base", "structure", "multibody", "domains", "solve", "model"]),
    ("device", &["base", "multibody", "domains", "solve", "model", "analysis"]),
    ("export", &["base", "structure", "multibody", "domains", "solve", "results", "model", "analysis", "device"]),
    ("jobs", &["base", "structure", "netlist", "model", "analysis"]),
    ("cosim", &["structure", "results"]),
    ("http", &[]),
    (
        "view",
        &["base", "structure", "netlist", "layout", "results", "model", "analysis", "device", "jobs", "cosim", "http"],
    ),
    ("wire", &["base", "solve", "model", "analysis", "device", "export", "jobs"]),
    ("server", &["base", "netlist", "layout", "model", "analysis", "device", "export", "jobs", "http", "wire"]),
];

/// Modules of one crate from the bottom up: a module names modules before it alone. `*` is all that is not listed.
const MODULES: [(&str, &[&str]); 3] = [
    ("model", &["options", "discretize", "refine", "compile"]),
    ("solve", &["equations", "*"]),
    ("analysis", &["readout", "*"]),
];

#[test]
fn manifests_name_the_layers_below() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates");
    let mut found: Vec<String> =
        fs::read_dir(&root).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    let mut listed: Vec<&str> = CRATES.iter().map(|(name, _)| *name).collect();
    found.sort();
    listed.sort_unstable();
    assert_eq!(found, listed);
    for (place, (name, below)) in CRATES.iter().enumerate() {
        let manifest = fs::read_to_string(root.join(name).join("Cargo.toml")).unwrap();
        let dependencies = manifest.split("[dependencies]").nth(1).unwrap().split("\n[").next().unwrap();
        let own = |line: &str| line.strip_prefix("bimorph-").map(|rest| rest.split(' ').next().unwrap().to_owned());
        let depends: Vec<String> = dependencies.lines().filter_map(own).collect();
        assert_eq!(depends, *below, "crates/{name}/Cargo.toml");
        let lower = |other: &&&str| CRATES[..place].iter().any(|(lower, _)| *lower == **other);
        assert!(below.iter().all(|other| lower(&other)), "{name} depends on a crate above it");
        let lib = fs::read_to_string(root.join(name).join("src/lib.rs")).unwrap();
        assert!(lib.contains("**Architecture invariant.**"), "crates/{name}/src/lib.rs does not state its invariant");
    }
}

#[test]
fn no_module_names_a_module_above_it() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates");
    let mut faults = Vec::new();
    for (name, modules) in MODULES {
        let source = root.join(name).join("src");
        let layer = |module: &str| modules.iter().position(|listed| *listed == module).unwrap_or(modules.len() - 1);
        for path in files(&source) {
            let place = path.strip_prefix(&source).unwrap();
            let module = place.iter().next().unwrap().to_str().unwrap().trim_end_matches(".rs");
            let text = fs::read_to_string(&path).unwrap();
            let text = text.split("#[cfg(test)]").next().unwrap();
            for line in text.lines().filter(|line| module != "lib" && !line.trim_start().starts_with("//")) {
                for (_, rest) in line.match_indices("crate::").map(|(at, word)| line.split_at(at + word.len())) {
                    let named: String = rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                    if layer(&named) > layer(module) {
                        faults.push(format!("{name}: {}: {}", place.display(), line.trim()));
                    }
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Above the bodies a matrix over them is a `BodyMatrix`, whose blocks have the size of the plane: `planar::DOF` is that number, once.
#[test]
fn one_file_has_the_degrees_of_freedom_of_a_body() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates");
    let mut matrices = 0;
    for path in files(&root).iter().filter(|path| path.extension().is_some_and(|end| end == "rs")) {
        let place = path.strip_prefix(&root).unwrap();
        let text = fs::read_to_string(path).unwrap();
        matrices += text.matches("BodyMatrix").count();
        assert!(place.starts_with("multibody") || !text.contains("BlockMatrix"), "{}", place.display());
    }
    assert!(matrices > 200, "the scan finds the matrices: {matrices}");
}

#[test]
fn bodies_and_joints_have_no_voltages() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/multibody/src");
    for path in files(&source) {
        let text = fs::read_to_string(&path).unwrap();
        let code =
            text.split("#[cfg(test)]").next().unwrap().lines().filter(|line| !line.trim_start().starts_with("//"));
        let faults: Vec<&str> = code.filter(|line| line.to_lowercase().contains("volt")).collect();
        assert!(faults.is_empty(), "{}: {faults:?}", path.display());
    }
}
