//! The reduced model of [`bimorph::export`] against the device that it stands for, at frequencies of the test's own.

use bimorph::analysis::readout::ports::OpenedPorts;
use bimorph::compile::{CompileOptions, CompiledModel, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::scale::PortScale;
use bimorph::device::{Device, Mode, OpenRequest, SmallSignal, Trial, TrialReply};
use bimorph::export::compare::{ModelFit, fit};
use bimorph::export::flexible::{FlexibleModel, FlexibleOutput, flexible};
use bimorph::export::{ExportError, ExportRequest};
use bimorph::netlist::{Bundle, read_bundle};
use bimorph::solve::reduced::polynomial::statics::equilibrium;
use nalgebra::Complex;
use std::f64::consts::TAU;
use std::path::Path;
use std::sync::Arc;

fn compiled(file: &str, options: CompileOptions) -> Arc<CompiledModel> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    Arc::new(compile(&read_bundle(&path, &[]).unwrap(), &options).unwrap_or_else(|e| panic!("{file}: {e}")))
}

fn request(ports: &[&str], signals: &[&str], bias: &[(&str, f64)]) -> ExportRequest {
    ExportRequest {
        ports: ports.iter().map(|p| ((*p).to_owned(), None)).collect(),
        signals: signals.iter().map(|s| ((*s).to_owned(), 1.0)).collect(),
        bias: bias.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect(),
        count: None,
        to: None,
        within: 1e-4,
        ranges: Vec::new(),
    }
}

/// Largest deviation of the model from [`Device::linearize`] over the largest value of its curve, at 41 frequencies of the band.
fn deviation(compiled: &Arc<CompiledModel>, request: &ExportRequest, fitted: &ModelFit) -> f64 {
    let mut device = LocalDevice::new(Arc::clone(compiled));
    let ports: Vec<String> = request.ports.iter().map(|(n, _)| n.clone()).collect();
    let signals = request.signals.iter().map(|(n, _)| n.clone()).collect();
    let opened = device.open(&OpenRequest { ports: ports.clone(), signals, noise: None }).unwrap();
    let bias = |name: &String| request.bias.iter().find(|(n, _)| n == name).map_or(0.0, |(_, v)| *v);
    let voltages: Vec<f64> = ports.iter().map(bias).collect();
    let mut reply = TrialReply::default();
    device
        .trial(&Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: &voltages }, &mut reply)
        .unwrap();
    let scales: Vec<PortScale> = opened.ports.iter().map(|p| PortScale::new(p.kind, None)).collect();
    let (p, mut small) = (scales.len(), SmallSignal::default());
    let [low, high] = fitted.band;
    let rows = fitted.model.rows();
    let (mut worst, mut largest) = (vec![0.0f64; rows * p], vec![0.0f64; rows * p]);
    for k in 0..41 {
        let omega = TAU * low * (high / low).powf((f64::from(k) + 0.37) / 41.5);
        device.linearize(reply.token.unwrap(), omega, &mut small).unwrap();
        let y = fitted.model.response(omega).unwrap();
        for row in 0..rows {
            for q in 0..p {
                let ([re, im], scale) = if row < p {
                    (small.admittance[row * p + q], scales[row].answered)
                } else {
                    (small.outputs[(row - p) * p + q], 1.0)
                };
                let exact = Complex::new(re, im) * (scale * scales[q].given);
                worst[row * p + q] = worst[row * p + q].max((y[(row, q)] - exact).norm());
                largest[row * p + q] = largest[row * p + q].max(exact.norm());
            }
        }
    }
    // a coupling that symmetry forbids is rounding in both
    let most = |q: usize, row: usize| {
        let column =
            (0..rows).filter(|r| fitted.model.row_name(*r).contains('.') == fitted.model.row_name(row).contains('.'));
        column.map(|r| largest[r * p + q]).fold(0.0, f64::max)
    };
    (0..rows * p).filter(|k| largest[*k] > 1e-9 * most(k % p, k / p)).map(|k| worst[k] / largest[k]).fold(0.0, f64::max)
}

/// Every kind of port and signal, with heaters behind a lag, on the bank, the resonator and the gyroscope: the model is within 1e-3 of
/// the device between the frequencies at which it was fitted, too.
#[test]
fn it_is_the_device_in_small_signals() {
    let bank = request(
        &["heat", "sense", "yoke.y", "low.vx", "high.rz", "b1.hot.T", "frame.ax"],
        &["yoke.x", "yoke.vy", "b2.hot.T"],
        &[("heat", 1.5), ("sense", 20.0)],
    );
    let comb = request(
        &["drive", "sense", "shuttle.x"],
        &["shuttle.vx", "drive_comb.gap"],
        &[("drive", 30.0), ("sense", 5.0)],
    );
    for (file, request) in [("examples/bank/bank.net", bank), ("examples/comb_resonator/comb_resonator.net", comb)] {
        let compiled = compiled(file, CompileOptions::default());
        let fitted = fit(&compiled, &request).unwrap();
        let off = deviation(&compiled, &request, &fitted);
        println!("{file}: {} modes, own check {:.1e}, here {off:.1e}", fitted.model.modes.len(), fitted.error);
        assert!(fitted.error <= 1e-4 && off < 1e-3, "{file}: {off:e}");
    }
}

/// Without damping, resonances have no height, and the model is made all the same.
#[test]
fn an_undamped_mechanism() {
    let compiled = compiled(
        "examples/comb_resonator/comb_resonator.net",
        CompileOptions { undamped: true, ..CompileOptions::default() },
    );
    let request = request(&["drive", "sense"], &["shuttle.x"], &[("drive", 20.0), ("sense", 10.0)]);
    let fitted = fit(&compiled, &request).unwrap();
    assert!(fitted.error <= 1e-4 && fitted.model.damping.amax() == 0.0);
    assert!(deviation(&compiled, &request, &fitted) < 1e-3);
}

/// Parallel chevron legs have modes that lie within 1 % of each other and do not show at their resonances. All of those
/// in the band are kept where those that show are not enough: 14 modes do. (Without them 120 modes had an error of
/// 0.86.)
#[test]
fn modes_that_hide_each_other_are_kept() {
    let text = "
        process si = [Youngsmodulus=160e9 density=2330 h=12u thermalexpansion=2.6e-6 resistivity=3e-4 thermcond=80 specificheat=700
            ambienttemperature=300 viscosity=1.8e-5 fluid=2u]
        for i=1:5
        [
          anchor si [a(i)] [l=10u w=10u]
          left(i) beam2det si [a(i) c(i)] [l=250u w=3u oz=deg(3)]
          right(i) beam2det si [c(i) b(i)] [l=250u w=3u oz=-deg(3)]
          anchor si [b(i)] [l=10u w=10u]
          R * [drive a(i)] [R=1]
          R * [b(i) gnd] [R=1]
        ]
        for i=1:4
        [
          beam2d si [c(i) c(i+1)] [l=15u w=25u oz=pi/2]
        ]
        eground * [gnd] []
        heat port * [drive] []";
    let compiled = Arc::new(compile(&Bundle::from_text("legs", text), &CompileOptions::default()).unwrap());
    let request = request(&["heat"], &["c(2).y"], &[("heat", 2.0)]);
    let fitted = fit(&compiled, &request).unwrap();
    let off = deviation(&compiled, &request, &fitted);
    println!("{} modes, own check {:.1e}, here {off:.1e}", fitted.model.modes.len(), fitted.error);
    assert!(fitted.error <= 1e-4 && off < 1e-3 && fitted.model.modes.len() <= 20, "{off:e}");
}

/// A linear model is written as `.ac` has it, without what stress adds to its stiffness: heated and biased.
#[test]
fn a_linear_model() {
    let compiled = compiled("examples/bank/bank.net", CompileOptions { linear: true, ..CompileOptions::default() });
    let request = request(&["heat", "sense"], &["yoke.y", "b1.hot.T"], &[("heat", 2.0), ("sense", 20.0)]);
    let fitted = fit(&compiled, &request).unwrap();
    let off = deviation(&compiled, &request, &fitted);
    println!("{} modes, own check {:.1e}, here {off:.1e}", fitted.model.modes.len(), fitted.error);
    assert!(fitted.error <= 1e-4 && off < 1e-3, "{off:e}");
}

/// No more modes than requested are kept, and the error is reported.
#[test]
fn a_count_is_kept() {
    let compiled = compiled("examples/bank/bank.net", CompileOptions::default());
    let request =
        ExportRequest { count: Some(1), to: Some(1e6), ..request(&["heat", "sense"], &["yoke.y"], &[("heat", 1.0)]) };
    let fitted = fit(&compiled, &request).unwrap();
    assert_eq!(fitted.model.modes.iter().filter(|m| m.number.is_some()).count(), 1);
    assert!(fitted.error > 1e-2);
}

/// A plate on its spring 0.1 % below pull-in is still written; beyond it there is no equilibrium to be linear about, or it is closed.
#[test]
fn next_to_pull_in() {
    let compiled = compiled("tests/decks/plate.net", CompileOptions::default());
    // √(8·k·g³/(27·ε·A)) = 5.1741 V
    let fitted = fit(&compiled, &request(&["drive"], &["m.x"], &[("drive", 5.1741 * 0.999)])).unwrap();
    let soft = fitted.model.modes[0].omega / TAU;
    assert!(soft < 0.5 * 15_915.5, "{soft}");
    let frame = fit(&compiled, &request(&["frame.wz"], &[], &[]));
    assert!(matches!(frame, Err(ExportError::Turning { .. })), "{frame:?}");
}

/// A clamped beam of 200 µm × 2 µm with a force at its middle, through which it stretches: stiffness grows by more than half up to 60 µN.
const STRETCHED: &str = "process p = [ Youngsmodulus=160e9 density=2330 h=10u ]
anchor p [a] []
beam2d p [a m] [l=100u w=2u]
beam2d p [m b] [l=100u w=2u]
anchor p [b] []
";

/// The flexible model of a netlist for a range of one port, and the values of its one signal at static drives of that port.
fn flexible_values(
    model: &Arc<CompiledModel>,
    (port, range): (&str, [f64; 2]),
    (signal, within): (&str, f64),
    drives: &[f64],
) -> (FlexibleModel, Vec<[f64; 2]>) {
    let mut request = request(&[port], &[signal], &[]);
    (request.within, request.ranges) = (within, vec![(port.to_owned(), range)]);
    let written = flexible(model, &request).unwrap();
    let mut device = LocalDevice::new(Arc::clone(model));
    let ports = vec![port.to_owned()];
    device.open(&OpenRequest { ports: ports.clone(), signals: vec![signal.to_owned()], noise: None }).unwrap();
    let opened = OpenedPorts::find(model, &ports).unwrap();
    let system = opened.system.as_deref().unwrap_or(&model.parts.system);
    let electrics = &system.electrics;
    let of = &written.fitted.model;
    let probe = written.rows.iter().rev().find_map(|row| match row {
        FlexibleOutput::Probe(p) => Some(*p),
        _ => None,
    });
    let values = drives.iter().map(|given| {
        let mut reply = TrialReply::default();
        let trial = Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: &[*given] };
        device.trial(&trial, &mut reply).unwrap();
        let mut u = vec![0.0; electrics.sources()];
        electrics.fill_sources(&vec![0.0; electrics.ports], &mut u);
        u[opened.sources[0]] = *given;
        let mut drive = electrics.drive();
        electrics.steady(&u, &mut vec![0.0; electrics.heating.states()], &mut drive);
        let mut x = vec![0.0; of.size()];
        assert!(equilibrium(of, &drive, &mut x), "{given}");
        [of.probes.values(&of.monomials.values(&x))[probe.unwrap()], reply.outputs[0]]
    });
    let values = values.collect();
    (written, values)
}

/// Equilibria of the polynomials are those of the device within 1e-3 of the largest one in the range: a beam that stretches under forces of both
/// signs, and the bank under the voltage of its heaters. Both have fewer than a fifth of the strains as coordinates. The yoke of the bank moves
/// across the fingers of its comb, which changes the capacitance by 6e-3.
#[test]
fn polynomials_have_the_equilibria_of_the_device() {
    let text = Arc::new(compile(&Bundle::from_text("beam.net", STRETCHED), &CompileOptions::default()).unwrap());
    let bank = compiled("examples/bank/bank.net", CompileOptions::default());
    let force: [f64; 4] = [-55e-6, -20e-6, 10e-6, 60e-6];
    let cases = [
        (text, ("m.y", [-60e-6, 60e-6]), "m.y", force.to_vec()),
        (bank, ("heat", [0.0, 2.0]), "yoke.y", vec![0.4, 1.1, 1.7, 2.0]),
    ];
    for (model, port, signal, drives) in cases {
        let (written, values) = flexible_values(&model, port, (signal, 1e-3), &drives);
        let fitted = &written.fitted;
        let [displacements, capacitances] = fitted.errors;
        assert!(displacements <= 1e-3, "{signal}: {displacements:e}");
        assert!(capacitances <= if signal == "yoke.y" { 1e-3 } else { 0.0 }, "{signal}: {capacitances:e}");
        assert!(5 * fitted.model.size() <= written.strains.max(40), "{}", fitted.model.size());
        let most = values.iter().map(|[_, full]| full.abs()).fold(0.0, f64::max);
        for [found, full] in values {
            assert!((found - full).abs() <= 1e-3 * most, "{signal}: {found:e} {full:e}");
        }
    }
}

/// Ranges in which nothing moves, and parts for which polynomials find no equilibrium, such as a beam buckled by a strained package, are refused with a reason.
#[test]
fn ranges_without_a_model_are_refused() {
    let refused = |text: &str, range: [f64; 2]| {
        let model = Arc::new(compile(&Bundle::from_text("beam.net", text), &CompileOptions::default()).unwrap());
        let mut request = request(&["m.y"], &["m.y"], &[]);
        (request.within, request.ranges) = (1e-3, vec![("m.y".to_owned(), range)]);
        flexible(&model, &request).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let nothing = refused(STRETCHED, [1e-320, 2e-320]);
    assert!(nothing.contains("nothing acts on it in these ranges"), "{nothing}");
    let strained = STRETCHED.replace("h=10u", "h=10u packagestrain=-1e-2");
    assert_ne!(strained, STRETCHED);
    let buckled = refused(&strained, [-1e-6, 1e-6]);
    assert!(buckled.contains("--nonlinear writes no reduced model"), "{buckled}");
}

/// Fast coordinates of a comb have inertia where its fingers close across their gaps in the ranges, on a cantilever that pulls in at 8.87 V: the force of the
/// impact would make them run away. Those of the bank, whose fingers stay apart, follow their forces at once.
#[test]
fn fast_coordinates_of_closing_fingers_have_inertia() {
    let text = "process p = [Youngsmodulus=160e9 density=2330 h=10u]
anchor p [a] []
beam2d p [a m] [l=200u w=2u]
beam2d p [m r] [l=20u w=10u]
sense comb2de p [r s] [N=20 gap=2u l=10u L=20u misalign=0.1u]
anchor p [s] []
eground * [r] []
drive port * [s] []
";
    let options = CompileOptions { tol: 1e-4, ..CompileOptions::default() };
    let comb = Arc::new(compile(&Bundle::from_text("comb.net", text), &options).unwrap());
    let bank = compiled("examples/bank/bank.net", CompileOptions::default());
    let cases = [(comb, vec![("drive", 12.0)], "r.y"), (bank, vec![("heat", 2.0), ("sense", 41.0)], "yoke.y")];
    let following = cases.map(|(model, ranges, signal)| {
        let ports: Vec<&str> = ranges.iter().map(|(port, _)| *port).collect();
        let mut request = request(&ports, &[signal], &[]);
        request.within = 1e-3;
        request.ranges = ranges.iter().map(|(port, most)| ((*port).to_owned(), [0.0, *most])).collect();
        let fitted = flexible(&model, &request).unwrap().fitted;
        let slowest = fitted.model.mass.iter().copied().fold(0.0, f64::max);
        assert!(fitted.error <= 1e-3 && fitted.model.mass.iter().any(|mass| *mass < 1e-3 * slowest), "{signal}");
        fitted.follows.iter().filter(|follows| **follows).count()
    });
    assert!(following[0] == 0 && following[1] > 0, "{following:?}");
}
