//! docs/reference/netlist.md is complete and true: its examples load, and it names every element and every message.

use bimorph_base::Bundle;
use bimorph_netlist::{element_names, load};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn page() -> String {
    fs::read_to_string(Path::new(crate::ROOT).join("docs/reference/netlist.md")).expect("the page")
}

/// Every example loads without a message.
#[test]
fn examples_load() {
    let page = page();
    let examples: Vec<&str> = page.split("```netlist\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert!(examples.len() >= 4);
    for example in examples {
        let loaded =
            load(&Bundle::from_text("docs/reference/netlist.md", example), &[]).unwrap_or_else(|d| panic!("{d}"));
        assert!(loaded.warnings.items.is_empty(), "{}", loaded.warnings);
    }
}

/// Every built-in element is described.
#[test]
fn every_element() {
    let page = page();
    let missing: Vec<&str> = element_names().filter(|name| !page.contains(&format!("`{name}`"))).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

/// The codes in the table are those in the source: none is missing, none is left over.
#[test]
fn every_message() {
    let mut used = BTreeSet::new();
    let mut folders = vec![PathBuf::from(crate::ROOT).join("crates/netlist/src")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("the source") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                codes(&fs::read_to_string(&path).expect("text"), '"', &mut used);
            }
        }
    }
    let mut listed = BTreeSet::new();
    codes(&page(), ' ', &mut listed);
    codes(
        &fs::read_to_string(Path::new(crate::ROOT).join("crates/model/src/compile.rs")).expect("text"),
        '"',
        &mut used,
    );
    assert!(used.len() > 40);
    assert_eq!(used, listed);
}

/// Collects the words like E012 or W003 that stand between two `quote` characters.
fn codes(text: &str, quote: char, into: &mut BTreeSet<String>) {
    for word in text.split(quote) {
        let digits = word.strip_prefix(['E', 'W']).unwrap_or("");
        if digits.len() == 3 && digits.bytes().all(|b| b.is_ascii_digit()) {
            into.insert(word.to_owned());
        }
    }
}
