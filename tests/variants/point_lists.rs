//! Axes of options, and lists of points: each row is that of a sweep of its point alone.

use super::{BEAMS, statics, swept};
use bimorph::compile::CompileOptions;
use bimorph::jobs::sweep::{
    self, SampleGenerator, Sampling, Shard, SweepAnalysis, SweepParameter, SweepSpec, SweepTable,
};
use bimorph::netlist::{Bundle, Setting};

/// Parameters that go together.
fn together(columns: &[&str]) -> Vec<SweepParameter> {
    let axis = |(k, text): (usize, &&str)| SweepParameter { in_step: k > 0, ..text.parse().expect("an axis") };
    columns.iter().enumerate().map(axis).collect()
}

fn spec(parameters: Vec<SweepParameter>, analysis: SweepAnalysis) -> SweepSpec {
    SweepSpec { parameters, samples: None, analysis, shard: Shard::default(), threads: Some(2) }
}

fn run(spec: &SweepSpec) -> SweepTable {
    let bundle = Bundle::from_text("beams.net", BEAMS);
    sweep::check_names(spec, &bundle, &CompileOptions::default()).expect("names");
    sweep::run(spec, &bundle, &CompileOptions::default(), &|_| true).expect("a table")
}

fn refusal(parameters: Vec<SweepParameter>) -> String {
    let spec = spec(parameters, statics());
    let bundle = Bundle::from_text("beams.net", BEAMS);
    sweep::check_names(&spec, &bundle, &CompileOptions::default()).expect_err("refused").to_string()
}

/// Each value of an option has the bits of a sweep with that option, whether its points share meshes or are alone.
#[test]
fn options_vary_as_if_they_were_given() {
    let modes = || SweepAnalysis::Modes { count: 3, voltages: vec![] };
    let moves = || SweepAnalysis::Transient { stop: 2e-6, outputs: vec!["t.y".into()], voltages: vec![] };
    for analysis in [statics(), modes(), moves()] {
        for rest in [&[][..], &["w=1.8u:2.2u:3"]] {
            let tol = "option.tol=1e-2,1e-3".parse().expect("an axis");
            let axes: Vec<SweepParameter> = rest.iter().map(|text| text.parse().expect("an axis")).collect();
            let whole = run(&spec([vec![tol], axes].concat(), analysis.clone()));
            for (k, tol) in [1e-2, 1e-3].into_iter().enumerate() {
                let options = CompileOptions { tol, ..CompileOptions::default() };
                let own = swept(BEAMS, rest, analysis.clone(), &options, Shard::default());
                let part = &whole.rows[k * own.rows.len()..][..own.rows.len()];
                for (a, b) in part.iter().zip(&own.rows) {
                    assert_eq!((&a.values, a.estimated_error), (&b.values, b.estimated_error), "{tol} {rest:?}");
                    assert_eq!((&a.parameters[0], &a.parameters[1..]), (&Setting::Number(tol), &b.parameters[..]));
                }
            }
            assert_ne!(whole.rows.first().map(|row| &row.values), whole.rows.last().map(|row| &row.values));
        }
    }
}

/// Flags and names vary as numbers do, and mean something.
#[test]
fn flags_and_names_vary() {
    let axes = ["option.linear=true,false", "option.junctions=centreline,offset,calibrated", "option.segments=2,16"];
    let table = run(&spec(axes.map(|text| text.parse().expect("an axis")).to_vec(), statics()));
    let values: Vec<_> = table.rows.iter().map(|row| row.values.clone().expect("a result")).collect();
    assert_eq!(values.len(), 12);
    assert!((0..12).all(|i| (0..i).all(|k| values[i] != values[k])), "{}", table.to_csv());
}

/// A list of points has the rows that its points have in the grid of all of its values; with a grid beside it, at each of its points.
#[test]
fn points_are_those_of_the_grid() {
    let list = || together(&["w=1.8u,2u,2.2u", "F=20u,400u,100u"]);
    let grid = || together(&["w=1.8u,2u,2.2u"]).into_iter().chain(together(&["F=20u,100u,400u"])).collect();
    let options = || "option.segments=8".parse().expect("an axis");
    let whole = run(&spec([vec![options()], grid()].concat(), statics()));
    let listed = run(&spec([vec![options()], list()].concat(), statics()));
    let of_grid = [0, 5, 7].map(|k| &whole.rows[k]);
    assert_eq!(listed.rows.len(), 3);
    for (row, expected) in listed.rows.iter().zip(of_grid) {
        assert_eq!((&row.parameters, &row.values), (&expected.parameters, &expected.values));
    }
    let beside = run(&spec([list(), together(&["l=90u,100u"])].concat(), statics()));
    let lengths: Vec<_> = beside.rows.iter().map(|row| row.parameters.clone()).collect();
    assert_eq!(lengths.len(), 6);
    assert_eq!(lengths[3], [2e-6, 400e-6, 100e-6].map(Setting::Number));
    let of_shard = |index| run(&SweepSpec { shard: Shard { index, count: 4 }, ..spec(list(), statics()) });
    let shares: Vec<_> = (0..4).flat_map(|index| of_shard(index).rows).collect();
    let all = run(&spec(list(), statics()));
    assert!(shares.len() == 3 && shares.iter().zip(&all.rows).all(|(a, b)| a == b));
}

/// Samples are drawn at every point of a list: process corners with their scatter.
#[test]
fn corners_have_scatter() {
    let vary = vec!["l=normal:100u:1u".parse().expect("a distribution")];
    let asked = Sampling { vary, count: 5, seed: 3, ..Sampling::default() };
    let samples = Some(SampleGenerator::new(asked).expect("samples"));
    let corners = || together(&["w=1.8u,2.2u", "F=110u,90u"]);
    let table = run(&SweepSpec { samples, ..spec(corners(), statics()) });
    assert_eq!(table.parameters, ["w", "F", "l"]);
    let of = |k: usize| table.rows[5 * k..][..5].iter().map(|row| row.parameters.clone()).collect::<Vec<_>>();
    assert!(of(0).iter().all(|row| row[..2] == [1.8e-6, 110e-6].map(Setting::Number)));
    assert!(of(0).iter().zip(of(1)).all(|(a, b)| a[2] == b[2]));
    assert!(table.rows.iter().all(|row| row.values.is_ok()));
}

/// Unknown options and values, and inconsistent lists, are rejected before anything runs.
#[test]
fn slips_are_refused() {
    let axis = |text: &str| refusal(vec![text.parse().expect("an axis")]);
    for (text, reported) in [
        ("option.tool=1e-3", "one of tol, band"),
        ("option.tol=2", "above 0, below 1"),
        ("option.tol=coarse", "above 0, below 1"),
        ("option.segments=2.5", "1 to 100000"),
        ("option.segments=-1", "1 to 100000"),
        ("option.linear=1", "true or false"),
        ("option.junctions=soft", "centreline"),
    ] {
        assert!(axis(text).contains(reported), "{text}: {}", axis(text));
    }
    let short = refusal(together(&["w=1u,2u", "F=1u"]));
    assert!(short.contains("2 values, as w has"), "{short}");
    let first = SweepParameter { in_step: true, ..together(&["w=1u"]).remove(0) };
    assert!(refusal(vec![first]).contains("a parameter before it"));
    let twice = refusal(together(&["w=1u", "w=2u"]));
    assert!(twice.contains("\"w\" twice"), "{twice}");
}
