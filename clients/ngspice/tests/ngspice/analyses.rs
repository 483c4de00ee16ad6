//! Every analysis after every other, in one run of ngspice: right, or one clear message.

use crate::support::{deck, versions};
use bimorph::cosim::{self, CosimError, CosimOptions};
use std::path::Path;

/// The plate under 2 V behind 10 kΩ, with these commands.
fn text(commands: &[&str]) -> String {
    format!(
        "* two analyses\nVd in 0 dc 2 ac 1 SIN(2 0.1 10k)\nRd in a 10k\nA1 %gd [a 0] %v [x] plate\n\
         .model plate bimorph(file=\"damped_plate.net\" ports=[\"drive\"] monitors=[\"m.x:1e6\"])\n\
         .control\n{}\nquit\n.endc\n.end\n",
        commands.join("\n")
    )
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
const ANALYSES: [(&str, &str, &str); 8] = [
    ("op", "op", "print v(x)"),
    ("dc", "dc Vd 1.9 2 0.1", "print v(x)[1]"),
    ("tran", "tran 1u 20u", "print v(x)[0]"),
    ("ac", "ac lin 1 1k 1k", "print mag(v(x))"),
    ("noise", "noise v(a) Vd lin 1 1k 1k", "print noise1.onoise_spectrum"),
    ("tf", "tf v(x) Vd", "print transfer_function"),
    ("sens", "sens v(x)", "print vd"),
    ("pz", "pz in 0 a 0 vol pz", "print all"),
];

/// The number behind the last equals sign of the output.
fn number(output: &str) -> Option<f64> {
    output.lines().filter_map(|l| l.split_once(" = ")).filter_map(|(_, v)| v.trim().parse().ok()).next_back()
}

/// Each analysis gives after each other what it gives alone, to 1e-6; `.pz` ends with a message that says what to do
/// instead. After `.sens`, ngspice 44 and 47 begin a transient at 0 V in any circuit, of a resistor and a capacitor, too:
/// nothing is asked of them there.
#[test]
fn every_analysis_after_every_other() {
    for (version, ngspice) in versions() {
        let alone: Vec<Result<Option<f64>, String>> = (ANALYSES.iter())
            .map(|(_, run, print)| outcome(&ngspice, &[run, print]).map(|text| number(&text)))
            .collect();
        let mut table = format!("ngspice {version}: first ↓ second →\n        alone");
        for ((name, ..), one) in ANALYSES.iter().zip(&alone) {
            table += &format!("\n{name:>6}: {one:?}");
        }
        let mut wrong = Vec::new();
        for (first, run, _) in &ANALYSES {
            for ((second, run2, print), want) in ANALYSES.iter().zip(&alone) {
                // A control section goes on after a refused analysis, but the run as a whole is refused.
                if *first == "pz" || (*first == "sens" && version > 39) {
                    continue;
                }
                let got = outcome(&ngspice, &[run, run2, print]).map(|text| number(&text));
                let same = match (want, &got) {
                    (Ok(Some(a)), Ok(Some(b))) => (a / b - 1.0).abs() < 1e-6,
                    (Err(a), Err(b)) => a == b && a.contains(".pz"),
                    _ => false,
                };
                if !same {
                    wrong.push(format!("{first} then {second}: {got:?}, alone {want:?}"));
                }
            }
        }
        println!("{table}");
        assert!(wrong.is_empty(), "ngspice {version}:\n{}", wrong.join("\n"));
        let refused = alone[7].as_ref().unwrap_err();
        assert_eq!(
            refused,
            ".pz knows no electro-mechanical parts; use .ac, or `bimorph modes` for natural frequencies"
        );
    }
}
