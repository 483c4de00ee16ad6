//! `layout` and `convert` from outside: files, reports, and layouts where netlists go.

use crate::command::{Bench, CANTILEVER};

/// A netlist becomes a layout, the layout a netlist and a picture, and every analysis takes it as it is.
#[test]
fn there_and_back() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    for file in ["c.gds", "c.cif"] {
        let ran = bench.run(&format!("layout c.net -o {file}"));
        assert_eq!((ran.status, ran.stderr.as_str()), (0, ""), "{file}");
        assert!(ran.stdout.contains("on the masks of polymumps"), "{}", ran.stdout);
        let ran = bench.run(&format!("convert {file} -o back.net --picture back.svg"));
        assert_eq!((ran.status, ran.stderr.as_str()), (0, ""), "{file}");
        assert!(ran.stdout.contains("by labels") && ran.stdout.contains("not understood 0"), "{}", ran.stdout);
        let modes = |name: &str| {
            let ran = bench.run(&format!("modes {name} --count 2 --json"));
            assert_eq!(ran.status, 0, "{name}: {}", ran.stderr);
            let document: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
            document["frequencies_hz"].clone()
        };
        assert_eq!(modes("c.net"), modes("back.net"), "{file}");
        assert_eq!(modes("c.net"), modes(file), "{file}");
    }
}

/// Impossible requests are rejected with one message and without a file.
#[test]
fn refusals() {
    let bench = Bench::new(&[("c.net", CANTILEVER), ("broken.gds", "\0\u{6}\0\u{2}"), ("empty.cif", "E")]);
    for (words, expected) in [
        ("layout c.net -o c.txt", "a file that ends in .gds or .cif"),
        ("layout c.net -o no/c.gds", "no folder"),
        ("layout c.net -o c.gds --process other", "the known ones are polymumps, soi"),
        ("convert c.net -o x.net", "is no layout by its name"),
        ("convert broken.gds -o x.net", "byte 0"),
        ("convert empty.cif -o x.net", "there is no cell in it"),
        ("convert missing.gds", "cannot read missing.gds"),
        ("modes c.net --cell top", "--cell is for layouts"),
        ("convert empty.cif --picture x.raw", "expected a file that ends in .svg"),
    ] {
        let ran = bench.run(words);
        assert_eq!((ran.status, ran.stdout.as_str()), (1, ""), "{words}: {}", ran.stderr);
        assert!(ran.stderr.contains(expected) && ran.stderr.lines().count() == 1, "{words}: {}", ran.stderr);
    }
    assert_eq!(bench.files(), ["broken.gds", "c.net", "empty.cif"]);
}
