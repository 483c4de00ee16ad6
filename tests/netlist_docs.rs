//! The pages of the netlist language are complete and true: their examples load, and they list every element with its parameters, every entry of a
//! message, and nothing else.

use bimorph::compile::{CompileOptions, compile};
use bimorph::netlist::{Bundle, element_descriptions, load};
use bimorph::readout::expression::Quantity;
use bimorph::readout::signal;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Warnings that examples of elements may have, which their blocks explain.
const EXPLAINED: &[&str] = &["W013", "W021", "W022", "W030", "W039"];

fn place(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn page(name: &str) -> String {
    fs::read_to_string(place("docs/reference").join(name)).expect("the page")
}

/// Every example loads, without a message that its page does not explain.
#[test]
fn examples_load() {
    for (name, least, explained) in [("netlist.md", 2, &[][..]), ("elements.md", 40, EXPLAINED)] {
        let page = page(name);
        let examples: Vec<&str> =
            page.split("```netlist\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
        assert!(examples.len() >= least, "{name}: {} examples", examples.len());
        for example in examples {
            let loaded = load(&Bundle::from_text(name, example), &[]).unwrap_or_else(|d| panic!("{d}"));
            let unexplained = loaded.warnings.items.iter().find(|warning| !explained.contains(&warning.code.as_str()));
            assert!(unexplained.is_none(), "{example}\n{}", loaded.warnings);
        }
    }
    let sugar3 = page("sugar.md");
    let example = sugar3.split("```lua\n").nth(1).and_then(|rest| rest.split("```").next()).expect("an example");
    let loaded = load(&Bundle::from_text("sugar.md", example), &[]).unwrap_or_else(|d| panic!("{d}"));
    assert!(loaded.warnings.items.is_empty(), "{}", loaded.warnings);
}

/// Words in backticks.
fn quoted(text: &str) -> BTreeSet<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

/// Each element has one block, whose table has the parameters of the source, and which has an example of it and a picture; no block has a name that is no element.
#[test]
fn every_element_has_its_block() {
    let (page, pictures_folder) = (page("elements.md"), place("docs/pictures/elements"));
    let (mut documented, mut blocks) = (BTreeSet::new(), 0);
    for block in page.split("\n### ").skip(1) {
        let title = block.lines().next().expect("a title");
        let Some((_, rest)) = block.split_once("\nNames: ") else { continue };
        let (head, body) = rest.split_once("\n\n").expect("a paragraph");
        let (names, nodes) = head.split_once("Nodes: ").unwrap_or_else(|| panic!("{title}: no nodes"));
        let names = quoted(names);
        let mut parameters = BTreeSet::new();
        for name in &names {
            let element = element_descriptions().find(|element| element.name == *name);
            let element = element.unwrap_or_else(|| panic!("{title}: {name} is no element"));
            parameters.extend(element.parameters);
            assert!(
                element.nodes.split(" or ").all(|list| nodes.contains(list)),
                "{name}: {} in {nodes}",
                element.nodes
            );
            assert!(documented.insert(*name), "{name} has two blocks");
        }
        let rows = body.lines().filter(|line| line.starts_with("| `"));
        let listed: BTreeSet<&str> = rows.flat_map(|row| quoted(row.split('|').nth(1).expect("a cell"))).collect();
        assert_eq!(listed, parameters, "parameters of {title}");
        let example = body.split("```netlist\n").nth(1).unwrap_or_else(|| panic!("{title}: no example"));
        let example = example.split("```").next().expect("an end");
        assert!(example.split_whitespace().any(|word| names.contains(word)), "{title}: its example has none of it");
        let pictures = block.split("](../pictures/elements/").skip(1).filter_map(|rest| rest.split(')').next());
        let missing: Vec<&str> = pictures.clone().filter(|name| !pictures_folder.join(name).is_file()).collect();
        assert!(missing.is_empty() && pictures.count() > 0, "{title}: no picture, or missing ones: {missing:?}");
        blocks += 1;
    }
    let all: BTreeSet<&str> = element_descriptions().map(|element| element.name).collect();
    assert_eq!(documented, all);
    assert!(blocks >= 40, "{blocks}");
}

/// Adds the codes in the sources below a folder.
fn used_below(folder: PathBuf, into: &mut BTreeSet<String>) {
    for entry in fs::read_dir(folder).expect("the source") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            used_below(path, into);
        } else if path.extension().is_some_and(|end| end == "rs") {
            codes(&fs::read_to_string(&path).expect("text"), '"', into);
        }
    }
}

/// The codes in the tables are those in the sources: none is missing, none is left over.
#[test]
fn every_message() {
    let mut used = BTreeSet::new();
    let crates = fs::read_dir(place("crates")).expect("crates").map(|entry| entry.expect("a crate").path().join("src"));
    for folder in crates.chain([place("src"), place("clients/ngspice/src")]) {
        used_below(folder, &mut used);
    }
    let mut listed = BTreeSet::new();
    let page = page("codes.md");
    let rows = page.lines().filter(|line| line.starts_with("| "));
    rows.for_each(|row| codes(row.split(" | ").next().expect("a cell"), ' ', &mut listed));
    assert!(used.len() > 90, "{}", used.len());
    assert_eq!(used, listed);
}

/// The table of signals has each name that a model of one of each kind of part has, with its unit, and no other.
#[test]
fn every_signal() {
    let netlist = "process p1 = [ Youngsmodulus=165e9 density=2300 h=2u thermalexpansion=2.7e-6 sheetresistance=20 thermcond=34 ambienttemperature=300 ]
        anchor p1 [a] []
        BEAM beam2det p1 [a NODE] [l=100u w=2u]
        GAP plategap2d p1 [NODE e] [A=1e-9 gap=2u oz=-pi/2]
        STOP stop2d * [NODE] [gap=1u hardness=2G contactresistivity=22n]
        anchor p1 [e] []
        COMB comb2de p1 [NODE f] [N=10 gap=2u l=10u L=30u]
        anchor p1 [f] []
        spring2d * [NODE ANCHOR] [kx=1 l=20u]
        anchor p1 [ANCHOR] [moves=1]
        eground * [e] []
        PORT port * [a e] []";
    let compiled = compile(&Bundle::from_text("all.net", netlist), &CompileOptions::default()).expect("compiles");
    let page = page("signals.md");
    let table = page.split("\n## ").next().expect("the first table");
    let mut listed = BTreeSet::new();
    for row in table.lines().filter(|line| {
        line.starts_with("| `") && !["PORT", "COMB.side", "BEAM.nominal"].iter().any(|of| line.contains(of))
    }) {
        let cells: Vec<&str> = row.split(" | ").collect();
        for name in quoted(cells[0]) {
            let found = signal::Signal::find(&compiled, name).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(found.unit(), cells[1], "{name}");
            listed.insert(name.to_owned());
        }
    }
    // stops and combs are gaps too, driven anchors are nodes, and this is what they have beside one; runs alone have COMB.side and BEAM.nominal
    let shared = |name: &String| ["STOP.", "COMB.", "ANCHOR."].iter().any(|of| name.starts_with(of));
    let own =
        |name: &String| !shared(name) || ["STOP.G", "ANCHOR.fx", "ANCHOR.fy", "ANCHOR.m"].contains(&name.as_str());
    let names = signal::names(&compiled).into_iter().filter(own);
    assert_eq!(listed, names.collect());
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
