//! Bundles: which files are read, in which order they are found, and what is said when they are not.

use bimorph_base::{Bundle, Setting};
use bimorph_netlist::{load, read_bundle};
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = TempDir::new().expect("a folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("parent")).expect("folders");
        fs::write(path, text).expect("file");
    }
    folder
}

fn parameters(bundle: &Bundle) -> Vec<(String, Setting)> {
    load(bundle, &[]).unwrap_or_else(|d| panic!("{d}")).parameters
}

/// Includes are found beside the file that names them, and read once however often they are named.
#[test]
fn found_beside_the_including_file() {
    let folder = folder(&[
        ("root.net", "uses lib/a.net\nuses b.net\nuses b.net\nparam r=n"),
        ("lib/a.net", "uses deep.m % a comment follows\nparam a=1"),
        ("lib/deep.m", "n=0\nparam d=2"),
        ("b.net", "n=n+1"),
    ]);
    let bundle = read_bundle(&folder.path().join("root.net"), &[]).expect("readable");
    let names: Vec<&str> = bundle.files.keys().map(String::as_str).filter(|n| **n != bundle.root).collect();
    assert_eq!(names, ["b.net", "deep.m", "lib/a.net"]);
    let parameters: Vec<String> = parameters(&bundle).into_iter().map(|(n, v)| format!("{n} {v:?}")).collect();
    assert_eq!(parameters, ["d Number(2.0)", "a Number(1.0)", "r Number(1.0)"]);
}

/// A file's name in quotes may hold blanks and letters of any script.
#[test]
fn names_in_quotes() {
    let folder = folder(&[
        ("root.net", "uses \"ü dir/mein netz é.net\" % and a comment\nuses 'b c.net'\nparam r=a"),
        ("ü dir/mein netz é.net", "a=3"),
        ("b c.net", "param d=2"),
    ]);
    let bundle = read_bundle(&folder.path().join("root.net"), &[]).expect("readable");
    let parameters: Vec<String> = parameters(&bundle).into_iter().map(|(n, v)| format!("{n} {v:?}")).collect();
    assert_eq!(parameters, ["d Number(2.0)", "r Number(3.0)"]);
}

/// Of two files of one spelled name the first that the text meets counts, also when that is inside another file.
#[test]
fn first_met_counts() {
    let folder = folder(&[
        ("root.net", "uses lib/a.net\nuses x.net"),
        ("lib/a.net", "uses x.net"),
        ("lib/x.net", "param x=1"),
        ("x.net", "param x=2"),
    ]);
    let bundle = read_bundle(&folder.path().join("root.net"), &[]).expect("readable");
    assert_eq!(parameters(&bundle), [("x".to_owned(), Setting::Number(1.0))]);
}

/// The include folders are searched in their order, after the file's own folder.
#[test]
fn include_folders() {
    let folder = folder(&[
        ("main/root.net", "uses x.net\nuses y.net"),
        ("main/x.net", "param x=1"),
        ("one/x.net", "param x=2"),
        ("one/y.net", "param y=1"),
        ("two/y.net", "param y=2"),
    ]);
    let include: Vec<PathBuf> = ["one", "two"].iter().map(|n| folder.path().join(n)).collect();
    let bundle = read_bundle(&folder.path().join("main/root.net"), &include).expect("readable");
    let want = [("x".to_owned(), Setting::Number(1.0)), ("y".to_owned(), Setting::Number(1.0))];
    assert_eq!(parameters(&bundle), want);
}

/// A bundle needs no disk any more: it can be sent elsewhere and loaded there.
#[test]
fn self_contained() {
    let bundle = {
        let folder = folder(&[("root.net", "uses x.net"), ("x.net", "param x=1")]);
        read_bundle(&folder.path().join("root.net"), &[]).expect("readable")
    };
    assert_eq!(parameters(&bundle).len(), 1);
}

/// A missing file is reported where it is named; its possible definitions are reported once a name.
#[test]
fn missing_file() {
    let text = "uses lost.net\nanchor dev [a] []\nbeam2d dev [a b] [l=1u w=1u]\nanchor odd [b] []";
    let found = load(&Bundle::from_text("root.net", text), &[]).expect_err("a file is missing");
    let found: Vec<_> = found.items.iter().map(|d| (d.code.as_str(), d.line, d.column, d.message.as_str())).collect();
    assert_eq!(
        found,
        [
            ("E021", 1, 1, "cannot find the file `lost.net`"),
            ("E031", 2, 8, "unknown process layer `dev`"),
            ("E031", 4, 8, "unknown process layer `odd`"),
        ]
    );
}

/// A root that cannot be read is the only error of reading.
#[test]
fn missing_root() {
    assert!(read_bundle(&PathBuf::from("no such file.net"), &[]).is_err());
}

/// Errors inside an included file carry that file's name and line.
#[test]
fn errors_name_the_file() {
    let bundle = Bundle::from_text("root.net", "uses x.net\nparam a=1").with_file("x.net", "\nparam b=oops");
    let found = load(&bundle, &[]).expect_err("an undefined variable");
    assert_eq!((found.items[0].file.as_str(), found.items[0].line, found.items[0].column), ("x.net", 2, 9));
    assert!(found.render(false).contains(" --> x.net:2:9"), "{found}");
}

/// A netlist that includes itself, under its own or another spelling, is reported.
#[test]
fn includes_itself() {
    let folder = folder(&[("root.net", "uses root.net\nparam a=1")]);
    let bundle = read_bundle(&folder.path().join("root.net"), &[]).expect("readable");
    let found = load(&bundle, &[]).expect_err("includes itself");
    assert_eq!((found.items[0].code.as_str(), found.items[0].message.as_str()), ("E022", "`root.net` includes itself"));
}

/// Two files that include each other are read once each.
#[test]
fn include_cycles_end() {
    let folder =
        folder(&[("root.net", "uses a.net"), ("a.net", "uses b.net\nparam a=1"), ("b.net", "uses a.net\nparam b=1")]);
    let bundle = read_bundle(&folder.path().join("root.net"), &[]).expect("readable");
    assert_eq!(parameters(&bundle).len(), 2);
}

/// Includes nest at most ten deep, and are forty at most.
#[test]
fn limits() {
    let chain = |count: usize| {
        let mut bundle = Bundle::from_text("root.net", "uses f1");
        for i in 1..=count {
            let next = if i < count { format!("uses f{}", i + 1) } else { String::new() };
            bundle = bundle.with_file(&format!("f{i}"), &next);
        }
        load(&bundle, &[])
    };
    assert!(chain(10).is_ok());
    assert_eq!(chain(11).expect_err("too deep").items[0].code, "E023");
    let wide = |count: usize| {
        let root: String = (1..=count).map(|i| format!("uses f{i}\n")).collect();
        let bundle = (1..=count).fold(Bundle::from_text("root.net", &root), |b, i| b.with_file(&format!("f{i}"), ""));
        load(&bundle, &[])
    };
    assert!(wide(40).is_ok());
    assert_eq!(wide(41).expect_err("too many").items[0].code, "E024");
}

/// The disk holds the same limits: reading a long chain of files ends.
#[test]
fn reading_is_bounded() {
    let files: Vec<(String, String)> = (0..60).map(|i| (format!("f{i}"), format!("uses f{}", i + 1))).collect();
    let files: Vec<(&str, &str)> = files.iter().map(|(n, t)| (n.as_str(), t.as_str())).collect();
    let folder = folder(&files);
    let bundle = read_bundle(&folder.path().join("f0"), &[]).expect("readable");
    assert!(bundle.files.len() < 20, "{}", bundle.files.len());
    assert_eq!(load(&bundle, &[]).expect_err("too deep").items[0].code, "E023");
}

/// Bytes that are not UTF-8 (old comments) do not keep a netlist from loading.
#[test]
fn other_encodings() {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("root.net");
    fs::write(&path, b"% 10 \xb5m wide\nparam a=1").expect("file");
    assert_eq!(parameters(&read_bundle(&path, &[]).expect("readable")).len(), 1);
}

/// `uses degrees.net` turns `ox oy oz` of its own file to degrees, wherever it stands; other angles and other files
/// stay in radians. The argument `oz` of a subnet is in the unit of its own file. A file of that name is read as any
/// other.
#[test]
fn angles_in_degrees() {
    let layer = "process p1 = [Youngsmodulus=160e9 density=2000 h=2u]\n";
    let turned = "subnet turned [a b] [oz=0] [beam2d parent [a b] [l=10u w=1u]]\n";
    let other =
        "subnet other [a b] [oz=0] [beam2d parent [a m] [l=10u w=1u]\nbeam2d parent [m b] [l=10u w=1u oz=oz]]\n";
    let root = "uses other.net\nanchor p1 [a] []\nbeam2d p1 [a b] [l=10u w=1u oz=90]\nturned p1 [b c] [oz=45]\n\
                other p1 [c d] [oz=30]\nbeam3dlink p1 [d e] [l=10u w=1u oz=180 L1=10u oz1=pi/2]\nuses degrees.net\n";
    let bundle = Bundle::from_text("t.net", &format!("{layer}{turned}{root}")).with_file("other.net", other);
    let loaded = load(&bundle, &[]).unwrap_or_else(|d| panic!("{d}"));
    assert!(loaded.warnings.items.iter().all(|d| d.code != "W003"), "{}", loaded.warnings);
    let s = loaded.structure;
    let angles: Vec<f64> = s.beams.iter().map(|b| b.angle.to_degrees()).collect();
    for (got, want) in angles.iter().zip([90.0, 45.0, 30.0, 60.0, 180.0]) {
        assert!((got - want).abs() < 1e-9, "{angles:?}");
    }
    // the arm turns by pi/2 from 180 degrees: against y
    let at = |name: &str| s.nodes[s.node(name).expect(name).0].position;
    let (d, e) = (at("d"), at("e"));
    assert!((e[0] - d[0] + 10e-6).abs() < 1e-12 && (e[1] - d[1] + 10e-6).abs() < 1e-12, "{d:?} {e:?}");
    let own = bundle.with_file("degrees.net", "param own=1\n");
    let loaded = load(&own, &[]).unwrap_or_else(|d| panic!("{d}"));
    assert_eq!(loaded.parameters, [("own".to_owned(), Setting::Number(1.0))]);
    assert!(loaded.warnings.items.iter().any(|d| d.code == "W003" && d.help.contains("uses degrees.net")));
}
