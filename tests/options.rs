//! Every front end has every option of a model, under its name, in its unit, with its default and within its range.
//!
//! The files generated from the table (docs/reference/options.md, fields in proto/, the keywords of the Python client) are
//! compared with it; `BIMORPH_WRITE=1 cargo test --test options` regenerates them.

use bimorph::analysis::integrator::Integrator;
use bimorph::analysis::transient::TransientOptions;
use bimorph::options::analysis::{ANALYSES, MODES_COUNT, PATH_POINTS, TRAN_POINTS, TRAN_RHO};
use bimorph::options::{CompileOptions, MODEL, ModelOption, OptionDescription, OptionValue, Range};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

// the plug-in's own file: what it declares to ngspice, and what it makes of a line
#[allow(unreachable_pub)]
#[path = "../clients/ngspice/src/deck_options.rs"]
mod deck_options;

fn place(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// `text` in lines of at most `width` characters, each after `head`.
fn wrapped(text: &str, head: &str, width: usize) -> String {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last_mut().expect("never empty");
        if !line.is_empty() && head.len() + line.chars().count() + 1 + word.chars().count() > width {
            lines.push(word.to_owned());
        } else {
            *line += if line.is_empty() { "" } else { " " };
            *line += word;
        }
    }
    lines.iter().map(|line| format!("{head}{line}\n")).collect()
}

/// Meaning of an option, with its range and default, in one sentence each.
fn sentences(about: &OptionDescription) -> String {
    let unit = if matches!(about.unit, "" | "1") { String::new() } else { format!(" [{}]", about.unit) };
    match about.range {
        Range::Flag => format!("{}.", about.about()),
        Range::Names(_) => format!("{}. One of {}; default: {}.", about.about(), about.range, about.by_default()),
        _ => format!("{}{unit}. Range: {}; default: {}.", about.about(), about.range, about.by_default()),
    }
}

fn rows() -> String {
    let mut text =
        String::from("| option | on the wire | unit | range | default | meaning |\n|---|---|---|---|---|---|\n");
    for ModelOption { about, .. } in MODEL.iter() {
        let (default, range) = (about.by_default(), about.range.to_string());
        let unit = if about.unit.is_empty() { "–" } else { about.unit };
        text +=
            &format!("| `{}` | `{}` | {unit} | {range} | {default} | {} |\n", about.name, about.wire, about.about());
    }
    text
}

fn analysis_rows() -> String {
    let mut text = String::from(
        "| command | option | on the wire | unit | range | default | meaning |\n|---|---|---|---|---|---|---|\n",
    );
    for (command, about) in ANALYSES {
        let unit = if about.unit.is_empty() { "–" } else { about.unit };
        text += &format!(
            "| {command} | `{}` | `{}` | {unit} | {} | {} | {} |\n",
            about.name,
            about.wire,
            about.range,
            about.by_default(),
            about.about()
        );
    }
    text
}

fn fields() -> String {
    let mut text = String::new();
    for ModelOption { about, number, .. } in MODEL.iter() {
        let kind = match about.range {
            // presence distinguishes a default that is true from a false that was sent
            Range::Flag if about.default == OptionValue::Flag(true) => "optional bool",
            Range::Flag => "bool",
            Range::Count(..) => "optional uint32",
            Range::Above(..) | Range::Within(..) => "optional double",
            Range::Names(_) | Range::Ranges => "string",
        };
        text += &wrapped(&sentences(about), "  // ", 120);
        text += &format!("  {kind} {} = {number};\n", about.wire);
    }
    text
}

fn python() -> String {
    let mut text = String::from(
        "\"\"\"Options of a model. Written from crates/model/src/options/model.rs by ``BIMORPH_WRITE=1 cargo test --test options``.\"\"\"\n\n\
         from __future__ import annotations\n\nfrom typing import Literal, TypedDict\n\n\n\
         class Options(TypedDict, total=False):\n    \"\"\"Keywords of ``compile`` and ``sweep``; those left out, or None, have their defaults.\"\"\"\n",
    );
    for ModelOption { about, .. } in MODEL.iter() {
        let kind = match about.range {
            Range::Flag => "bool".to_owned(),
            Range::Count(..) => "int".to_owned(),
            Range::Above(..) | Range::Within(..) => "float".to_owned(),
            Range::Names(names) => {
                let names: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
                format!("Literal[{}]", names.join(", "))
            }
            Range::Ranges => "str".to_owned(),
        };
        text += &format!("\n    {}: {kind} | None\n", about.name);
        let quoted = wrapped(&sentences(about), "    ", 112);
        text += &format!("    \"\"\"{}\"\"\"\n", quoted.trim());
    }
    text += "\n\nWIRE = {\n";
    for ModelOption { about, .. } in MODEL.iter() {
        text += &format!("    \"{}\": \"{}\",\n", about.name, about.wire);
    }
    text + "}\n\"\"\"Field on the wire of each option.\"\"\"\n"
}

/// The text between two lines that hold the markers, or all of it.
fn section<'a>(text: &'a str, markers: Option<[&str; 2]>) -> [&'a str; 3] {
    let Some([first, last]) = markers else { return ["", text, ""] };
    let start = text.find(first).unwrap_or_else(|| panic!("no {first}")) + first.len() + 1;
    let end = text[..text.find(last).unwrap_or_else(|| panic!("no {last}"))].rfind('\n').map_or(0, |k| k + 1);
    [&text[..start], &text[start..end], &text[end..]]
}

/// The generated files agree with the table.
#[test]
fn files_are_as_written_from_the_table() {
    let proto = ["written from the table in crates/model/src/options/model.rs.", "// end of the options"];
    for (path, markers, want) in [
        ("docs/reference/options.md", Some(["<!-- options -->", "<!-- end of options -->"]), rows()),
        ("docs/reference/options.md", Some(["<!-- analyses -->", "<!-- end of analyses -->"]), analysis_rows()),
        ("proto/bimorph/v1/model.proto", Some(proto), fields()),
        ("clients/python/src/bimorph/options.py", None, python()),
    ] {
        let text = fs::read_to_string(place(path)).unwrap_or_default();
        let [before, found, after] = section(&text, markers);
        if std::env::var_os("BIMORPH_WRITE").is_some() {
            fs::write(place(path), format!("{before}{want}{after}")).expect("written");
        } else {
            assert_eq!(found, want, "{path}: run BIMORPH_WRITE=1 cargo test --test options");
        }
    }
}

/// Runs the command on a small netlist; exit status, standard output and standard error.
fn bimorph(words: &[String]) -> (Option<i32>, String, String) {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(
        folder.path().join("c.net"),
        "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] [l=1u w=1u]\nbeam2d p [a b] [l=100u w=2u]\n",
    )
    .expect("written");
    let ran = Command::new(env!("CARGO_BIN_EXE_bimorph")).args(words).current_dir(&folder).output().expect("it runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (ran.status.code(), text(&ran.stdout), text(&ran.stderr))
}

/// A value of an option just inside its range and one beyond it, as text; none where every value is inside.
fn inside_and_beyond(about: &OptionDescription) -> (OptionValue, Option<OptionValue>) {
    match about.range {
        Range::Flag => (OptionValue::Flag(true), None),
        Range::Count(low, high) => (OptionValue::Count(low), Some(OptionValue::Count(high + 1))),
        Range::Above(low, high) => {
            (OptionValue::Number(low + 0.01 * (high - low)), Some(OptionValue::Number(2.0 * high)))
        }
        Range::Within(low, high) => (OptionValue::Number(low), Some(OptionValue::Number(2.0 * high))),
        Range::Names(names) => (OptionValue::Name(names[0].to_owned()), Some(OptionValue::Name("nosuch".to_owned()))),
        Range::Ranges => (OptionValue::Name("b.x:0:1".to_owned()), Some(OptionValue::Name("b.x:1:0".to_owned()))),
    }
}

fn written(value: &OptionValue) -> Option<String> {
    match value {
        OptionValue::Unset | OptionValue::Flag(_) => None,
        OptionValue::Name(name) => Some(name.clone()),
        other => Some(other.to_string()),
    }
}

/// The one comparison of all front ends: names, units, defaults and ranges of every option in the command, a deck, the
/// protocol, Python and docs/. The command and the deck answer for themselves; the wire, Python and docs/ by what is
/// written there.
#[test]
fn every_front_takes_the_same_options() {
    let (_, help, _) = bimorph(&["static".into(), "--help".into()]);
    let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
    let proto = fs::read_to_string(place("proto/bimorph/v1/model.proto")).expect("the messages");
    let client = fs::read_to_string(place("clients/python/src/bimorph/options.py")).expect("the client");
    let docs = fs::read_to_string(place("docs/reference/options.md")).expect("the page");
    let deck = deck_options::declared();
    assert_eq!(deck.len(), MODEL.len());
    let defaults = CompileOptions::default();
    for (option, declared) in MODEL.iter().zip(&deck) {
        let about = &option.about;
        let (name, default) = (about.name, about.by_default());
        let unit = if matches!(about.unit, "" | "1") { String::new() } else { format!("[{}]", about.unit) };
        let (inside, beyond) = inside_and_beyond(about);

        // the command: help has name, unit and default; a value beyond the range is refused with name and range
        let flag = format!("--{}", about.flag());
        let of = help.split(&flag).nth(1).unwrap_or_else(|| panic!("no {flag} in the help"));
        let of = of.split(" --").next().unwrap_or(of);
        assert!(of.contains(&unit), "{flag}: {of}");
        assert!(about.range == Range::Flag || of.contains(&format!("[default: {default}]")), "{flag}: {of}");
        let command = |value: &OptionValue| {
            let words = ["check".to_owned(), "c.net".into(), "--json".into(), flag.clone()];
            bimorph(&words.into_iter().chain(written(value)).collect::<Vec<_>>())
        };
        let (status, out, err) = command(&inside);
        assert_eq!(status, Some(0), "{flag} {inside}: {err}");
        if name != "segments" {
            let document: serde_json::Value = serde_json::from_str(&out).expect("a document");
            let reported = match &inside {
                OptionValue::Number(x) => document[about.wire].as_f64() == Some(*x),
                OptionValue::Flag(flag) => document[about.wire].as_bool() == Some(*flag),
                OptionValue::Name(name) => document[about.wire].as_str() == Some(name),
                _ => false,
            };
            assert!(reported, "{flag}: {out}");
        }
        if let Some(beyond) = &beyond {
            let (status, _, err) = command(beyond);
            assert_eq!(status, Some(1), "{flag} {beyond}");
            assert!(err.contains(&flag) && err.contains(&about.expected()), "{flag} {beyond}: {err}");
        }

        // the deck: the same name, its default, and the same refusal
        assert_eq!(declared.name, name);
        assert!(declared.text.contains(&about.about()) && declared.text.contains(&unit), "{}", declared.text);
        let mut options = CompileOptions { tol: 0.5, band: Some(1.0), segments: Some(9), ..defaults.clone() };
        deck_options::choose(&mut options, option, &declared.default).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(options.value(option), about.default, "the default of {name} in a deck");
        deck_options::choose(&mut options, option, &deck_options::written(&inside)).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(options.value(option), inside, "{name} in a deck");
        if let Some(beyond) = &beyond {
            let refused = deck_options::choose(&mut options, option, &deck_options::written(beyond)).expect_err(name);
            assert_eq!((refused.option, refused.expected), (name, about.expected()));
        }

        // the wire, Python and docs/: name, unit, range and default stand there
        let field =
            proto.find(&format!(" {} = {};", about.wire, option.number)).unwrap_or_else(|| panic!("no field {name}"));
        let keyword = client.find(&format!("\n    {name}: ")).unwrap_or_else(|| panic!("no keyword {name}"));
        let row =
            docs.lines().find(|line| line.starts_with(&format!("| `{name}` |"))).unwrap_or_else(|| panic!("no {name}"));
        assert!(client.contains(&format!("    \"{name}\": \"{}\",\n", about.wire)));
        let plain = |text: &str| text.replace("//", " ").split_whitespace().collect::<Vec<_>>().join(" ");
        let said = plain(&sentences(about));
        assert!(plain(&proto[..field]).contains(&said), "the field of {name} says something else");
        assert!(plain(&client[keyword..]).contains(&said), "the keyword {name} says something else");
        for part in [about.unit, &about.range.to_string(), &default, &about.about()] {
            assert!(row.contains(part), "{name}: {row} lacks {part}");
        }
    }
}

/// Options of single analyses: the command shows the default and refuses what is beyond the range by name; the wire and Python
/// say the same default.
#[test]
fn analyses_take_the_same_options() {
    for (command, about) in ANALYSES {
        let flag = format!("--{}", about.flag());
        let (_, help, _) = bimorph(&[command.to_owned(), "--help".into()]);
        let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
        let (_, of) = help.rsplit_once(&format!("{flag} <")).unwrap_or_else(|| panic!("{command} has no {flag}"));
        let of = of.split(" --").next().unwrap_or(of);
        assert!(of.contains(&about.about()), "{command} {flag}: {of}");
        let default = about.by_default();
        assert!(
            about.default == OptionValue::Unset || of.contains(&format!("[default: {default}]")),
            "{command} {flag}: {of}"
        );
        let Some(beyond) = inside_and_beyond(about).1.and_then(|value| written(&value)) else { continue };
        let mut words = vec![command.to_owned(), "c.net".into()];
        match command {
            "tran" => words.extend(["--stop", "1u"].into_iter().filter(|_| about.name != "stop").map(str::to_owned)),
            "ac" => {
                words.extend(["--drive".to_owned(), "b.fy".into(), "--by-modes".into()]);
                let band = [("from", "1"), ("to", "2")].into_iter().filter(|(name, _)| *name != about.name);
                words.extend(band.flat_map(|(name, value)| [format!("--{name}"), value.to_owned()]));
            }
            "path" => words.extend(["--along".to_owned(), "loads=0:1".into()]),
            "chart" => words.extend(["--signals".to_owned(), "b.x".into()]),
            _ => {}
        }
        let (status, _, err) = bimorph(&[words, vec![flag.clone(), beyond]].concat());
        assert_eq!(status, Some(1), "{command} {flag}: {err}");
        assert!(err.contains(&flag) && err.contains(&about.expected()), "{command} {flag}: {err}");
    }
    let proto = fs::read_to_string(place("proto/bimorph/v1/analysis.proto")).expect("the messages");
    assert!(proto.contains(&format!("{}; 0: {}.", TRAN_POINTS.range, TRAN_POINTS.count())));
    let proto = fs::read_to_string(place("proto/bimorph/v1/path.proto")).expect("the messages");
    assert!(proto.contains(&format!("{}; 0: {}.", PATH_POINTS.range, PATH_POINTS.count())));
    let client = fs::read_to_string(place("clients/python/src/bimorph/model.py")).expect("the client");
    assert!(client.contains(&format!("points: int = {},", PATH_POINTS.count())));
    assert!(client.contains(&format!("points: int = {},", TRAN_POINTS.count())));
    assert!(client.contains(&format!("count: int = {},", MODES_COUNT.count())));
    assert_eq!((TransientOptions::default().points, Integrator::RHO), (TRAN_POINTS.count(), TRAN_RHO.number()));
}

/// Ranges of ports are for circuits and reduced motions: analyses refuse them, `check` compares their names with the ports, and each error has the range.
#[test]
fn analyses_refuse_ranges_of_ports() {
    let words = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
    for command in [
        &["static", "c.net"][..],
        &["modes", "c.net"],
        &["ac", "c.net", "--drive", "b.fy", "--by-modes", "--from", "1", "--to", "2"],
        &["sweep", "c.net", "--analysis", "static", "--param", "w=1,2"],
        &["export", "c.net", "--spice", "--ports", "b.x"],
    ] {
        let (status, _, err) = bimorph(&[words(command), words(&["--ranges", "b.x:0:1"])].concat());
        assert_eq!(status, Some(1), "{command:?}: {err}");
        assert!(err.contains("--ranges: expected none in this command"), "{command:?}: {err}");
        assert!(err.contains("got \"b.x:0:1\""), "{command:?}: {err}");
    }
    let reduced = &["tran", "c.net", "--stop", "1u", "--formulation", "reduced"][..];
    for (command, expected) in [
        (&reduced[..4], "--formulation reduced beside it"),
        (reduced, "electrical ports of the model"),
        (&[reduced, &["--release", "w"]].concat(), "none with --release"),
    ] {
        let (status, _, err) = bimorph(&[words(command), words(&["--ranges", "b.x:0:1"])].concat());
        assert_eq!(status, Some(1), "{command:?}: {err}");
        assert!(err.contains(&format!("--ranges: expected {expected}")), "{command:?}: {err}");
        assert!(err.contains("got \"b.x:0:1\""), "{command:?}: {err}");
    }
    for (ranges, expected) in [
        ("gate:0:1", "--ranges: expected the name of a port of this model (it has no electrical one; NODE.x|y|rz"),
        ("b.x:0:1,gate:0:1", "got \"gate:0e0:1e0\""),
        ("b.x:0:1,b.y:2:1", "got \"b.y:2:1\""),
        ("b.x:0:1,b.x:0:2", "got \"b.x\" twice"),
        ("b.x:nan:1", "got \"b.x:nan:1\""),
    ] {
        let (status, _, err) = bimorph(&words(&["check", "c.net", "--ranges", ranges]));
        assert_eq!(status, Some(1), "{ranges}: {err}");
        assert!(err.contains(expected), "{ranges}: {err}");
    }
}
