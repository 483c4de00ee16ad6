//! Batched equilibria and modes: bit-identical to a single variant, or its modes to rounding, for any neighbours.

use super::{BEAMS, swept};
use bimorph::analysis::mesh::{self, MeshRequest};
use bimorph::analysis::modes::modes;
use bimorph::compile::{CompileOptions, CompiledModel, compile};
use bimorph::domains::System;
use bimorph::jobs::sweep::{Shard, SweepAnalysis};
use bimorph::multibody::BodyMatrix;
use bimorph::multibody::planar::Pose;
use bimorph::netlist::{Bundle, Setting};
use bimorph::solve::eigen::{Modes, lowest_modes};
use bimorph::solve::equilibrium::batch::{BatchPath, LaneEquilibrium};
use bimorph::solve::equilibrium::{Equilibrium, EquilibriumOptions};
use bimorph::solve::frequency::batch::LaneModes;
use bimorph::solve::path::SourcePath;

fn variants(text: &str, name: &str, values: &[f64]) -> Vec<CompiledModel> {
    let one = |value: &f64| {
        let set = vec![(name.to_owned(), Setting::Number(*value))];
        let options = CompileOptions { set, segments: Some(4), ..CompileOptions::default() };
        compile(&Bundle::from_text("variants.net", text), &options).expect("a variant")
    };
    values.iter().map(one).collect()
}

/// The equilibrium alone, and Newton's iterations; none past a fold.
fn alone(system: &System, volts: f64) -> Option<(Vec<Pose>, usize)> {
    let (from, to) = sources(system, volts);
    let path = SourcePath::new(&system.electrics, &from, &to, [0.0, 1.0]);
    let mut q = vec![Pose::zeros(); system.bodies()];
    let done = Equilibrium::new(system, EquilibriumOptions::default()).follow(system, &path, &mut q).ok()?;
    done.passed.is_empty().then_some((q, done.iterations))
}

fn sources(system: &System, volts: f64) -> (Vec<f64>, Vec<f64>) {
    let electrics = &system.electrics;
    let mut to = vec![0.0; electrics.sources()];
    let mut ports = vec![0.0; electrics.ports];
    ports.iter_mut().take(1).for_each(|port| *port = volts);
    electrics.fill_sources(&ports, &mut to);
    (vec![0.0; to.len()], to)
}

/// The same in lanes, some at a time.
fn together(variants: &[CompiledModel], volts: f64, at_once: usize) -> Vec<Option<(Vec<Pose>, usize)>> {
    let systems: Vec<&System> = variants.iter().map(|v| &v.parts.system).collect();
    let mut lanes = LaneEquilibrium::new(systems[0]).expect("lanes");
    let ends: Vec<_> = systems.iter().map(|system| sources(system, volts)).collect();
    let paths: Vec<_> = (systems.iter().zip(&ends))
        .map(|(system, (from, to))| SourcePath::new(&system.electrics, from, to, [0.0, 1.0]))
        .collect();
    let q = vec![Pose::zeros(); systems[0].bodies()];
    let ways: Vec<BatchPath<'_>> =
        systems.iter().zip(&paths).map(|(system, path)| BatchPath { system, path, q: &q }).collect();
    assert!(systems.iter().all(|system| lanes.fits(system)));
    ways.chunks(at_once)
        .flat_map(|ways| lanes.follow(ways))
        .map(|arrived| arrived.map(|arrived| (arrived.q, arrived.iterations)))
        .collect()
}

/// An equilibrium in a lane has the bits and the iterations of the variant alone: under forces, under heat with hinges
/// and guides, and across a comb. A plate that closes too far for one step is abandoned, without effect on its
/// neighbours.
#[test]
fn equilibria_are_those_alone() {
    let heated = "param w=2u
        process p = [Youngsmodulus=165e9 density=2300 h=2u thermalexpansion=2.6e-6 ambienttemperature=300 thermcond=50 sheetresistance=20]
        anchor p [a] []\nleft beam2det p [a m] [l=100u w=w oz=0.05]\nright beam2det p [m b] [l=100u w=w oz=-0.05]\nanchor p [b] []
        eground * [b] []\nheat port * [a] []\narm beam2d p [m t] [l=40u w=8u oz=pi/2]\nguide2d * [t] [oz=pi/2]
        comb comb2de p [t s] [N=20 gap=1u l=8u L=20u oz=pi/2]\nanchor p [s] []\neground * [t] []\nsense port * [s] []\n";
    let plate = "param k=1\nanchor * [f] [l=1u w=1u h=1u]\nmass2d * [m] [m=1e-10]\nguide2d * [m] []\nspring2d * [f m] [kx=k]\n\
                 anchor * [e] [l=1u w=1u h=1u]\ngap plategap2d * [m e] [A=1e-8 gap=2u]\neground * [m] []\nV port * [e] []\n";
    let widths: Vec<f64> = (0..11).map(|k| 1.8e-6 + 0.05e-6 * f64::from(k)).collect();
    let stiff: Vec<f64> = (1..12).map(|k| 10.0 * f64::from(k * k)).collect();
    // by small steps a beam that stiffens goes alone
    let pressed = &BEAMS.replace("F=100u", "F=5u");
    for (text, name, values, volts, least) in
        [(pressed.as_str(), "w", &widths, 0.0, 11), (heated, "w", &widths, 0.4, 11), (plate, "k", &stiff, 6.0, 6)]
    {
        let variants = variants(text, name, values);
        let expected: Vec<_> = variants.iter().map(|v| alone(&v.parts.system, volts)).collect();
        for at_once in [1, 3, 8] {
            let found = together(&variants, volts, at_once);
            assert!(found.iter().flatten().count() >= least, "{name} {at_once}: {found:?}");
            for (found, expected) in found.iter().zip(&expected) {
                if found.is_some() {
                    assert_eq!(found, expected);
                }
            }
        }
        assert!(expected.iter().flatten().all(|(q, _)| q.iter().any(|q| q.norm() > 1e-10)), "{text}");
    }
}

fn modes_alone(system: &System, count: usize) -> Modes {
    let (q, drive) = (vec![Pose::zeros(); system.bodies()], system.electrics.drive());
    let mut tangent = BodyMatrix::new(&system.model.pattern);
    system.tangent(&q, &drive, &mut tangent, &mut q.clone());
    lowest_modes(system, (&q, &drive), &tangent, count).expect("modes")
}

/// Modes in a lane: frequencies of the variant alone to rounding, residuals below what a mode may be relied on with, and the same bits in
/// any company. Two arms of one length have equal frequencies in one variant: it has none here.
#[test]
fn modes_are_those_alone() {
    let text = "param l=60u\nprocess p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] []\nbeam2d p [a m] [l=100u w=4u]\n\
                beam2d p [m b] [l=100u w=3u]\nanchor p [b] []\nbeam2d p [m t] [l=l w=1.5u oz=pi/2]\nanchor p [c] []\n\
                beam2d p [c d] [l=60u w=1.5u]\n";
    let lengths: Vec<f64> = (0..13).map(|k| 1e-6 * (54.0 + f64::from(k))).collect();
    let variants = variants(text, "l", &lengths);
    let systems: Vec<&System> = variants.iter().map(|v| &v.parts.system).collect();
    let first = modes_alone(systems[3], 5);
    let mut lanes = LaneModes::new(systems[3], first.shapes).expect("lanes");
    let mut found = Vec::new();
    for at_once in [1, 3, 8] {
        let now: Vec<_> = systems.chunks(at_once).flat_map(|some| lanes.find(some, 3)).collect();
        assert!(found.is_empty() || now == found, "{at_once}");
        found = now;
    }
    for (k, (system, found)) in systems.iter().zip(&found).enumerate() {
        let expected = modes_alone(system, 5);
        let Some(found) = found else { continue };
        for mode in 0..3 {
            let (own, alone) = (found.lambda[mode], expected.lambda[mode]);
            assert!((own / alone - 1.0).abs() < 1e-12, "{k} {mode}: {own} {alone}");
            assert!(found.residuals[mode] <= 1e-9, "{k} {mode}: {}", found.residuals[mode]);
        }
    }
    assert!(found.iter().flatten().count() >= 9, "{:?}", found.iter().map(Option::is_some).collect::<Vec<_>>());
    let twice = "param l=60u\nprocess p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] []\nbeam2d p [a b] [l=l w=2u]\n\
                 anchor p [c] []\nbeam2d p [c d] [l=60u w=2u]\n";
    let twins = super::batched::variants(twice, "l", &[50e-6, 60e-6]);
    let apart = modes_alone(&twins[0].parts.system, 4);
    let mut lanes = LaneModes::new(&twins[0].parts.system, apart.shapes).expect("lanes");
    let found = lanes.find(&[&twins[0].parts.system, &twins[1].parts.system], 2);
    assert!(found[0].is_some() && found[1].is_none());
}

/// Tables of statics and of modes are the same to the bit on one thread, on two, and put together from shards, where some points have
/// another topology, another mesh or no drawing.
#[test]
fn tables_are_the_same_in_any_company() {
    let text = format!("param more=0\n{BEAMS}if more\n[ tail beam2d p [t e] [l=20u w=1.5u oz=0] ]\n");
    let outputs = vec!["m.y".into(), "t.x".into()];
    let still = SweepAnalysis::Static { outputs, voltages: Vec::new() };
    let modes = SweepAnalysis::Modes { count: 3, voltages: Vec::new() };
    for (analysis, forces) in [(still, "F=1u,50u,2000u"), (modes, "F=0")] {
        let axes = [forces, "w=-1u,1.6u,1.8u,2u,2.1u,2.3u,2.6u", "l=90u:110u:3", "more=0,1"];
        let options = CompileOptions::default();
        let whole = swept(&text, &axes, analysis.clone(), &options, Shard::default());
        assert_eq!(whole.failed(), whole.rows.len() / 7, "{}", whole.to_csv());
        for count in [2, 5, 37] {
            let mut rows: Vec<_> = (0..count)
                .flat_map(|index| swept(&text, &axes, analysis.clone(), &options, Shard { index, count }).rows)
                .collect();
            rows.sort_by_key(|row| row.point);
            assert_eq!(rows, whole.rows);
        }
    }
}

/// A row of modes has the frequencies, to rounding, and the estimate, to a hundredth, of the variant alone on the mesh that the middle of the
/// grid has for 0.6 of the tolerance.
#[test]
fn rows_of_modes_are_modes_on_one_mesh() {
    let text = BEAMS.replace("F=100u", "F=0") + "mass2d * [t] [m=1e-12]\n";
    let modes_wanted = SweepAnalysis::Modes { count: 3, voltages: Vec::new() };
    let options = CompileOptions::default();
    let table = swept(&text, &["w=1.9u:2.1u:7"], modes_wanted, &options, Shard::default());
    let variant = |w: f64, tol: f64| {
        let set = vec![("w".to_owned(), Setting::Number(w))];
        let options = CompileOptions { set, tol, ..options.clone() };
        compile(&Bundle::from_text("beams.net", &text), &options).expect("a variant")
    };
    let request = MeshRequest::Modes { count: 3, voltages: &[] };
    let order = mesh::order(&variant(2e-6, 0.6 * options.tol), &request).expect("a mesh");
    for row in &table.rows {
        let Setting::Number(w) = row.parameters[0] else { panic!("a width") };
        let alone = modes(&variant(w, options.tol).with_order(order.clone()).expect("a mesh"), 3, &[]).expect("modes");
        for (found, alone) in row.values.as_ref().expect("modes").iter().zip(&alone.frequencies_hz) {
            assert!((found.expect("a mode") / alone - 1.0).abs() < 1e-12, "{w}: {found:?} {alone}");
        }
        let own = alone.errors.iter().map(|e| e.expect("an estimate").abs()).fold(0.0, f64::max);
        let reported = row.estimated_error.expect("an estimate");
        assert!((reported / own - 1.0).abs() < 1e-2, "{w}: {reported} {own}");
    }
}
