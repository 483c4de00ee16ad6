//! Every analysis after every other, in one run of ngspice: right, or one clear message.

use crate::support::{deck, versions};
use bimorph::cosim::{self, CosimError, CosimOptions};
use std::path::Path;

/// The plate under 2 V behind 10 kΩ and with a second port for S-parameters, with these commands. ngspice has no `.sens` in any
/// circuit with such ports: there they are left out.
fn text(commands: &[&str]) -> String {
    let (first, second) = if sensitive(commands) {
        ("", "")
    } else {
        (" portnum 1 z0 50", "Vp p 0 dc 0 ac 0 portnum 2 z0 1meg\nRp p a 1meg\n")
    };
    format!(
        "* two analyses\nVd in 0 dc 2 ac 1 SIN(2 0.1 10k){first}\nRd in a 10k\n{second}A1 %gd [a 0] %v [x] plate\n\
         .model plate bimorph(file=\"damped_plate.net\" ports=[\"drive\"] monitors=[\"m.x:1e6\"])\n\
         .control\n{}\nquit\n.endc\n.end\n",
        commands.join("\n")
    )
}

/// Whether `.sens` is among the commands, if only as one that does nothing.
fn sensitive(commands: &[&str]) -> bool {
    commands.iter().any(|command| command.contains("sens"))
}

fn outcome(ngspice: &Path, commands: &[&str]) -> Result<String, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(deck("damped_plate.net"), folder.path().join("damped_plate.net")).unwrap();
    let path = folder.path().join("deck.cir");
    std::fs::write(&path, text(commands)).unwrap();
    let options = CosimOptions { deck: path, ngspice: Some(ngspice.into()), capture: true, ..CosimOptions::default() };
    match cosim::run(&options, &|| true) {
        Ok(report) => Ok(report.output),
        Err(CosimError::Stopped { reason, .. }) => Err(reason),
        Err(CosimError::Failed { status, output, .. }) => Err(format!("FAILED {status}\n{output}")),
        Err(other) => Err(format!("FAILED {other}")),
    }
}

/// An analysis, what prints one number of it, and that number where the part is taken for what it is.
const ANALYSES: [(&str, &str, &str); 10] = [
    ("op", "op", "print v(x)"),
    ("dc", "dc Vd 1.9 2 0.1", "print v(x)[1]"),
    ("tran", "tran 1u 20u", "print v(x)[0]"),
    ("ac", "ac lin 1 1k 1k", "print mag(v(x))"),
    ("noise", "noise v(a) Vd lin 1 1k 1k", "print noise1.onoise_spectrum"),
    ("tf", "tf v(x) Vd", "print transfer_function"),
    ("sens", "sens v(x)", "print vd"),
    ("sp", "sp lin 1 100k 100k", "print mag(s_2_1)"),
    ("four", "tran 1u 200u\nfourier 10k v(x)", ""),
    ("pz", "pz in 0 a 0 vol pz", "print all"),
];

/// The number behind the last equals sign of the output, or its last total harmonic distortion.
fn number(output: &str) -> Option<f64> {
    let distortion = |l: &str| l.split_once("THD: ")?.1.split_whitespace().next()?.parse().ok();
    let of = |l: &str| l.split_once(" = ").and_then(|(_, v)| v.trim().parse().ok()).or_else(|| distortion(l));
    output.lines().filter_map(of).next_back()
}

/// Where the table of docs/project/validation.md stands.
const MARKS: [&str; 2] = ["<!-- analyses after each other -->\n", "<!-- end -->\n"];

/// The table of the documentation from the cells of each version: results on all versions, or by version.
fn documented(outcomes: &[(u32, Vec<Vec<char>>)]) -> String {
    let names: Vec<&str> = ANALYSES.iter().map(|(name, ..)| *name).collect();
    let mut table = format!("| first ↓ second → | {} |\n|---|{}\n", names.join(" | "), "---|".repeat(names.len()));
    for (row, name) in names.iter().enumerate() {
        table += &format!("| {name} |");
        for column in 0..names.len() {
            let of =
                |c: char| outcomes.iter().filter(move |(_, cells)| cells[row][column] == c).map(|(v, _)| v.to_string());
            let right: Vec<String> = of('r').collect();
            table += &match (right.len(), of('m').count()) {
                (n, _) if n == outcomes.len() => " right |".to_owned(),
                (_, n) if n == outcomes.len() => " message |".to_owned(),
                (0, _) => " – |".to_owned(),
                _ => format!(" right on {} |", right.join(", ")),
            };
        }
        table.push('\n');
    }
    table
}

/// Each analysis gives after each other what it gives alone, to 1e-6, and the table in docs/project/validation.md says so
/// (`BIMORPH_WRITE=1` writes it); `.pz` ends with a message that says what to do
/// instead. After `.sens`, ngspice 44 and 47 begin a transient at 0 V in any circuit, of a resistor and a capacitor, too:
/// nothing is asked of them there.
#[test]
fn every_analysis_after_every_other() {
    let versions = versions();
    let mut outcomes = Vec::new();
    for (version, ngspice) in &versions {
        let (version, ngspice) = (*version, ngspice.as_path());
        let mut cells = Vec::new();
        // in the circuit with two ports, and in the one without for what stands beside .sens
        let [alone, beside_sens] = ["", "* sens"].map(|circuit| {
            let of = |(_, run, print): &(&str, &str, &str)| {
                outcome(ngspice, &[circuit, run, print]).map(|text| number(&text))
            };
            ANALYSES.iter().map(of).collect::<Vec<Result<Option<f64>, String>>>()
        });
        let mut table = format!("ngspice {version}: first ↓ second →\n        alone");
        for ((name, ..), one) in ANALYSES.iter().zip(&alone) {
            table += &format!("\n{name:>6}: {one:?}");
        }
        let mut wrong = Vec::new();
        for (first, run, _) in &ANALYSES {
            let mut row = Vec::new();
            for (n, (second, run2, print)) in ANALYSES.iter().enumerate() {
                let want = if sensitive(&[run, run2]) { &beside_sens[n] } else { &alone[n] };
                if (*first == "sens" && *second == "sp") || (*first == "sp" && *second == "sens") {
                    row.push('-');
                    continue;
                }
                // A control section continues after a refused analysis, but the run as a whole is refused.
                if *first == "pz" || (*first == "sens" && version > 39) {
                    row.push(if *first == "pz" { 'm' } else { '-' });
                    continue;
                }
                let got = outcome(ngspice, &[run, run2, print]).map(|text| number(&text));
                let same = match (want, &got) {
                    (Ok(Some(a)), Ok(Some(b))) => (a / b - 1.0).abs() < 1e-6,
                    (Err(a), Err(b)) => a == b && a.contains(".pz"),
                    _ => false,
                };
                row.push(if want.is_ok() { 'r' } else { 'm' });
                if !same {
                    wrong.push(format!("{first} then {second}: {got:?}, alone {want:?}"));
                }
            }
            cells.push(row);
        }
        outcomes.push((version, cells));
        println!("{table}");
        assert!(wrong.is_empty(), "ngspice {version}:\n{}", wrong.join("\n"));
        let refused = alone[ANALYSES.len() - 1].as_ref().unwrap_err();
        assert_eq!(
            refused,
            ".pz knows no electro-mechanical parts; use .ac, or `bimorph modes` for natural frequencies"
        );
    }
    if outcomes.len() < 3 {
        return;
    }
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/project/validation.md");
    let text = std::fs::read_to_string(&docs).unwrap();
    let (head, rest) = text.split_once(MARKS[0]).expect("the mark of the table");
    let (table, tail) = rest.split_once(MARKS[1]).expect("the end of the table");
    let now = documented(&outcomes);
    if std::env::var_os("BIMORPH_WRITE").is_some() {
        std::fs::write(&docs, format!("{head}{}{now}{}{tail}", MARKS[0], MARKS[1])).unwrap();
    }
    assert_eq!(table, now, "docs/project/validation.md is of another state; BIMORPH_WRITE=1 writes the table");
}

/// A sweep begins from rest, for any analysis before it. Below pull-in (5.17 V) at 4 V the plate stands at the same
/// place with and without a previous operating point at 6 V, or a sweep above pull-in, in the same run.
#[test]
fn a_sweep_begins_from_rest() {
    let at_4_v = |lines: &str, ngspice: &Path| {
        let folder = tempfile::tempdir().unwrap();
        std::fs::copy(deck("damped_plate.net"), folder.path().join("damped_plate.net")).unwrap();
        let path = folder.path().join("deck.cir");
        let text = format!(
            "* sweeps\nVin a 0 dc 6 ac 1\nA1 %gd [a 0] %v [x] plate\n\
             .model plate bimorph(file=\"damped_plate.net\" ports=[\"drive\"] monitors=[\"m.x:1e6\"])\n{lines}\n.save all\n.print dc v(x)\n.end\n"
        );
        std::fs::write(&path, text).unwrap();
        let ngspice = Some(ngspice.into());
        let report =
            cosim::run(&CosimOptions { deck: path, ngspice, capture: true, ..CosimOptions::default() }, &|| true);
        let output = report.unwrap_or_else(|e| panic!("{e}")).output;
        let row = |line: &str| {
            let words: Vec<f64> = line.split_whitespace().map_while(|w| w.parse().ok()).collect();
            (words.len() == 3 && (words[1] - 4.0).abs() < 1e-9).then(|| words[2])
        };
        output.lines().find_map(row).unwrap_or_else(|| panic!("{output}"))
    };
    for (version, ngspice) in &versions() {
        let alone = at_4_v(".dc Vin 4 4.6 0.2", ngspice);
        assert!((alone - 0.2247).abs() < 1e-3, "{version}: {alone}");
        for before in [".ac dec 1 1k 10k", ".op"] {
            let after = at_4_v(&format!("{before}\n.dc Vin 4 4.6 0.2"), ngspice);
            assert!((after / alone - 1.0).abs() < 1e-6, "{version} after {before}: {after}, alone {alone}");
        }
    }
}
