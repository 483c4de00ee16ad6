//! Axes of a port's voltage: each row is what a sweep has that holds the port there.

use super::swept;
use bimorph::compile::CompileOptions;
use bimorph::jobs::sweep::{self, Shard, SweepAnalysis, SweepSpec, SweepTable};
use bimorph::netlist::{Bundle, Setting};

/// A beam that a plate pulls, with a heated arm beside it.
const SWITCH: &str = "param w=2u
process p = [Youngsmodulus=165e9 density=2300 h=2u thermalexpansion=2.6e-6 ambienttemperature=300 thermcond=50 sheetresistance=20]
anchor p [a] []
arm beam2d p [a m] [l=100u w=w]
mass2d * [m] [m=1e-12]
anchor * [e] [l=1u w=1u h=1u]
gap plategap2d * [m e] [A=1e-9 gap=2u oz=deg(90)]
eground * [m] []
V port * [e] []
anchor p [b] []
left beam2det p [b c] [l=100u w=w oz=0.1]
right beam2det p [c d] [l=100u w=w oz=-0.1]
anchor p [d] []
eground * [d] []
heat port * [b] []
";

fn analyses(held: &[(&str, f64)]) -> [SweepAnalysis; 3] {
    let voltages: Vec<(String, f64)> = held.iter().map(|(name, volts)| ((*name).to_owned(), *volts)).collect();
    let outputs: Vec<String> = ["m.y", "c.y"].map(str::to_owned).into();
    [
        SweepAnalysis::Static { outputs: outputs.clone(), voltages: voltages.clone() },
        SweepAnalysis::Modes { count: 2, voltages: voltages.clone() },
        SweepAnalysis::Transient { stop: 2e-6, outputs, voltages },
    ]
}

fn numbers(table: &SweepTable) -> Vec<Vec<f64>> {
    let row = |row: &sweep::SweepRow| row.values.as_ref().expect("a result").iter().flatten().copied().collect();
    table.rows.iter().map(row).collect()
}

/// With the voltage as an axis each point has the numbers that it has where the port is held at it, within the tolerance, and its
/// voltage stands in the row; more of it pulls further. (A run's first instant is held by no mesh at 1e-4, as its rows say.)
#[test]
fn rows_are_those_of_held_ports() {
    let axes = ["w=1.9u:2.1u:2", "V.v=0:12:3"];
    for (k, tol) in [1e-4, 1e-4, 1e-3].into_iter().enumerate() {
        let options = CompileOptions { tol, ..CompileOptions::default() };
        let across = swept(SWITCH, &axes, analyses(&[("heat", 0.3)])[k].clone(), &options, Shard::default());
        let found = numbers(&across);
        assert_eq!(across.parameters, ["w", "V.v"]);
        for (v, volts) in [0.0, 6.0, 12.0].into_iter().enumerate() {
            let held = swept(
                SWITCH,
                &axes[..1],
                analyses(&[("heat", 0.3), ("V", volts)])[k].clone(),
                &options,
                Shard::default(),
            );
            for (w, alone) in numbers(&held).iter().enumerate() {
                let at = 3 * w + v;
                assert_eq!(across.rows[at].parameters[1], Setting::Number(volts));
                let size = alone.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
                for (a, b) in found[at].iter().zip(alone) {
                    assert!((a - b).abs() <= 2.0 * tol * size, "{k} {volts} V: {a} {b}");
                }
            }
        }
        assert!((found[0][0] - found[2][0]).abs() > 1e-3 * found[0][0].abs(), "{k}: {found:?}");
    }
}

/// Any order of points and any shard gives the same bits.
#[test]
fn shards_have_the_same_bits() {
    let options = CompileOptions::default();
    let axes = ["V.v=0:12:5"];
    let whole = numbers(&swept(SWITCH, &axes, analyses(&[])[0].clone(), &options, Shard::default()));
    for index in 0..2 {
        let part = numbers(&swept(SWITCH, &axes, analyses(&[])[0].clone(), &options, Shard { index, count: 2 }));
        assert!(part.iter().zip(whole.iter().skip(index).step_by(2)).all(|(a, b)| a == b));
    }
}

/// Ports that are not there, are held besides, have a word for a voltage, or are to be raised anyway are refused before anything runs.
#[test]
fn slips_are_refused() {
    let refusal = |axis: &str, analysis: SweepAnalysis| {
        let parameters = vec![axis.parse().expect("an axis")];
        let spec = SweepSpec { parameters, samples: None, analysis, shard: Shard::default(), threads: Some(1) };
        let bundle = Bundle::from_text("switch.net", SWITCH);
        sweep::check_names(&spec, &bundle, &CompileOptions::default()).expect_err(axis).to_string()
    };
    let held = || analyses(&[("V", 1.0)])[0].clone();
    let none = refusal("W.v=0:1:2", held());
    assert!(none.contains("\"W.v\"") && none.contains("V.v, heat.v"), "{none}");
    let twice = refusal("V.v=0:1:2", held());
    assert!(twice.contains("\"V\" twice"), "{twice}");
    let word = refusal("heat.v=a,b", held());
    assert!(word.contains("a word"), "{word}");
    let raised = refusal("V.v=0:1:2", SweepAnalysis::PullIn { port: None, max: 10.0 });
    assert!(raised.contains("raises a port by itself"), "{raised}");
}
