//! Subcircuits that `bimorph export --spice` writes, in ngspice, against the full model in the plug-in, both in one deck.

use crate::support::{complex, deviation, real, run, versions};
use bimorph::analysis::mesh::in_circuit;
use bimorph::compile::{CompileOptions, CompiledModel, compile};
use bimorph::cosim::CosimOptions;
use bimorph::export::compare::{ModelFit, fit};
use bimorph::export::names::Pins;
use bimorph::export::{ExportRequest, lumped, lumped_spice, spice};
use bimorph::netlist::read_bundle;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A model with its operating point, and its connections.
struct Scene {
    file: &'static str,
    /// Electrical ports with their voltages at the operating point (V).
    electrical: &'static [(&'static str, f64)],
    /// Ports that a force is given to.
    forces: &'static [&'static str],
    /// Signals, volts per unit.
    signals: &'static [(&'static str, f64)],
    /// Tolerance of the full model.
    tol: f64,
}

/// The bank of bimorphs, heated by 1 V and sensed by a comb at 10 V.
const BANK: Scene = Scene {
    file: "examples/bank/bank.net",
    electrical: &[("heat", 1.0), ("sense", 10.0)],
    forces: &["yoke.y"],
    signals: &[("yoke.y", 1e6), ("b1.hot.T", 1.0), ("low.vy", 1.0)],
    tol: 1e-3,
};

/// The comb resonator, driven at 20 V and sensed at 10 V.
const COMB: Scene = Scene {
    file: "examples/comb_resonator/comb_resonator.net",
    electrical: &[("drive", 20.0), ("sense", 10.0)],
    forces: &["shuttle.vx"],
    signals: &[("shuttle.x", 1e6), ("drive_comb.q", 1e15)],
    tol: 1e-3,
};

/// One mass between two combs, at voltages far from small: 5 V and 10 V.
const LUMPED_COMB: Scene = Scene {
    file: "tests/decks/comb.net",
    electrical: &[("drive", 5.0), ("sense", 10.0)],
    forces: &["m.x"],
    signals: &[("m.x", 1e6), ("m.vx", 1.0), ("right.q", 1e15), ("right.gap", 1e6), ("left.C", 1e15), ("right.F", 1e6)],
    tol: 1e-5,
};

/// A plate below its pull-in voltage of 5.1741 V.
const PLATE: Scene = Scene {
    file: "tests/decks/damped_plate.net",
    electrical: &[("drive", 5.0)],
    forces: &["m.vx"],
    signals: &[("m.x", 1e6), ("gap.q", 1e15), ("gap.gap", 1e6)],
    tol: 1e-5,
};

/// An accelerometer: one mass between two plates on three electrodes, on a frame.
const ACCELEROMETER: Scene = Scene {
    file: "tests/decks/accelerometer.net",
    electrical: &[("frame.ax", 100.0), ("top", 1.0), ("bottom", -1.0), ("middle", 0.3)],
    forces: &["m.x"],
    signals: &[("m.x", 1e6), ("m.vx", 1.0)],
    tol: 1e-5,
};

fn netlist(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(file)
}

impl Scene {
    fn compiled(&self) -> Arc<CompiledModel> {
        let bundle = read_bundle(&netlist(self.file), &[]).unwrap();
        let drawn = compile(&bundle, &CompileOptions::default()).unwrap_or_else(|e| panic!("{}: {e}", self.file));
        Arc::new(in_circuit(&drawn))
    }

    fn ports(&self) -> Vec<&'static str> {
        self.electrical.iter().map(|(name, _)| *name).chain(self.forces.iter().copied()).collect()
    }

    fn request(&self) -> ExportRequest {
        ExportRequest {
            ports: self.ports().into_iter().map(|name| (name.to_owned(), None)).collect(),
            signals: self.signals.iter().map(|(name, scale)| ((*name).to_owned(), *scale)).collect(),
            bias: self.electrical.iter().map(|(name, volts)| ((*name).to_owned(), *volts)).collect(),
            count: None,
            to: None,
            within: 1e-4,
            ranges: Vec::new(),
        }
    }

    fn exported(&self) -> ModelFit {
        fit(&self.compiled(), &self.request()).unwrap_or_else(|e| panic!("{}: {e}", self.file))
    }

    /// The subcircuit of a reduced model.
    fn linear(fitted: &ModelFit) -> String {
        let pins = Pins::of(&fitted.model.ports, &fitted.model.signals).unwrap();
        spice::write(fitted, &pins, "part", &["a test".to_owned()])
    }

    /// The subcircuit of the nonlinear model.
    fn whole(&self) -> String {
        let model = lumped::lump(&self.compiled(), &self.request()).unwrap_or_else(|e| panic!("{}: {e}", self.file));
        let pins = Pins::of(&model.ports, &model.signals).unwrap();
        lumped_spice::write(&model, &pins, "part", &["a test".to_owned()])
    }

    /// A deck with the full model on nodes that end in 1 and the written one on nodes that end in 2, both driven by the same; `driven` is
    /// what stands behind the source at a port.
    fn deck(&self, part: &str, driven: impl Fn(&str) -> String, analysis: &str) -> String {
        let mut deck = format!("* {}\n{part}", self.file);
        let (mut electrical, mut forces, mut plain) = (String::new(), String::new(), String::new());
        for (k, name) in self.ports().into_iter().enumerate() {
            let bias = self.electrical.get(k).map(|(_, volts)| *volts);
            for side in [1, 2] {
                let _ = match bias {
                    Some(volts) => writeln!(deck, "Vp{k}_{side} p{k}_{side} 0 DC {volts} {}", driven(name)),
                    None => writeln!(deck, "Ip{k}_{side} 0 p{k}_{side} DC 0 {}", driven(name)),
                };
            }
            let list = if bias.is_some() { &mut electrical } else { &mut forces };
            let _ = write!(list, "p{k}_1 0 ");
            let _ = write!(plain, "p{k}_2 0 ");
        }
        let shown = |side: usize| (0..self.signals.len()).map(|k| format!("s{k}_{side} ")).collect::<String>();
        let quoted = |names: Vec<String>| names.iter().map(|n| format!("\"{n}\" ")).collect::<String>();
        let ports = quoted(self.ports().iter().map(|n| (*n).to_owned()).collect());
        let monitors = quoted(self.signals.iter().map(|(n, scale)| format!("{n}:{scale:e}")).collect());
        let file = netlist(self.file);
        let forces = if forces.is_empty() { forces } else { format!("%hd {forces}") };
        let _ = write!(
            deck,
            "A1 [%gd {electrical}{forces}] %v [{}] full\n.model full bimorph(file=\"{}\" ports=[{ports}] \
             monitors=[{monitors}] tol={:e})\nX2 {plain}{}part\n{analysis}\n.end\n",
            shown(1),
            file.canonicalize().unwrap().display(),
            self.tol,
            shown(2),
        );
        deck
    }

    /// Outputs of either side: currents of sources, voltages across ports with forces, signals.
    fn read(&self, side: usize) -> Vec<(String, String)> {
        let electrical = self.electrical.len();
        let ports = self.ports().into_iter().enumerate().map(|(k, name)| {
            let column = if k < electrical { format!("i(vp{k}_{side})") } else { format!("v(p{k}_{side})") };
            (name.to_owned(), column)
        });
        let signals =
            self.signals.iter().enumerate().map(|(k, (name, _))| ((*name).to_owned(), format!("v(s{k}_{side})")));
        ports.chain(signals).collect()
    }

    fn run(&self, text: &str, ngspice: &Path) -> crate::support::Run {
        let folder = tempfile::tempdir().unwrap();
        let deck = folder.path().join("deck.cir");
        std::fs::write(&deck, text).unwrap();
        run(CosimOptions { deck, ngspice: Some(ngspice.to_owned()), ..CosimOptions::default() })
            .unwrap_or_else(|e| panic!("{}: {e}\n{text}", self.file))
    }
}

/// Every port and signal over every port agrees with the full model in `.ac`, to 1e-3 of its own value at every
/// frequency. The band is from a thousandth of the first mode to just below the second visible one. A sweep across the
/// first resonance agrees too.
#[test]
fn small_signals_are_those_of_the_full_model() {
    for scene in [BANK, COMB] {
        let fitted = scene.exported();
        let (first, end) = (fitted.model.modes[0].omega / std::f64::consts::TAU, 0.999 * fitted.band[1]);
        let around = format!(".ac lin 401 {:e} {:e}", 0.98 * first, 1.02 * first);
        let all = format!(".ac dec 200 {:e} {end:e}", 1e-3 * first);
        for (version, ngspice) in versions() {
            let mut largest_of_all = (0.0f64, String::new());
            for port in scene.ports() {
                let driven = |name: &str| if name == port { "AC 1".to_owned() } else { "AC 0".to_owned() };
                for sweep in [&all, &around] {
                    let run = scene.run(&scene.deck(&Scene::linear(&fitted), driven, sweep), &ngspice);
                    let plot = run.plot("AC");
                    for ((name, full), (_, written)) in scene.read(1).iter().zip(&scene.read(2)) {
                        let (full, written) = (complex(plot, full), complex(plot, written));
                        let size = |v: &[f64; 2]| v[0].hypot(v[1]);
                        let largest = full.iter().map(size).fold(0.0, f64::max);
                        let off = full.iter().zip(written).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]));
                        if largest < 1e-18 {
                            // motion does not act back on heat
                            assert!(off.fold(0.0, f64::max) < 1e-18, "{} {name} over {port}", scene.file);
                            continue;
                        }
                        let worst = off.zip(full).map(|(off, a)| off / size(a)).fold(0.0, f64::max);
                        if worst > largest_of_all.0 {
                            largest_of_all = (worst, format!("{name} over {port}"));
                        }
                        assert!(worst < 1e-3, "ngspice {version}, {} {name} over {port}: {worst:e}", scene.file);
                    }
                }
            }
            let (worst, place) = largest_of_all;
            let modes = fitted.model.modes.len();
            println!("ngspice {version}, {}, {modes} modes: .ac within {worst:.1e}, {place}", scene.file);
        }
    }
}

/// The nonlinear subcircuit in `.ac` and `.op` is the full model to 1e-6 of each value (rounding, and ngspice's tolerance at the
/// operating point), and in `.tran` after large steps to 1e-3 of range at equal steps.
#[test]
fn the_nonlinear_form_is_the_full_model() {
    let steps = [
        (LUMPED_COMB, "drive", "PULSE(5 15 2u 1u 1u 60u 200u)", ".tran 20n 90u 0 20n", 90e-6),
        (PLATE, "drive", "PULSE(0 4.9 2u 1u 1u 300u 1)", ".tran 200n 600u 0 200n", 600e-6),
        (ACCELEROMETER, "frame.ax", "PULSE(100 -300 2u 1u 1u 1 1)", ".tran 1u 1m 0 1u", 1e-3),
    ];
    let exact = ".options reltol=1e-9 vntol=1e-12 abstol=1e-18";
    for (scene, port, pulse, analysis, end) in steps {
        let part = scene.whole();
        for (version, ngspice) in versions() {
            let mut worst = [0.0f64; 3];
            let still = scene.run(&scene.deck(&part, |_| String::new(), &format!("{exact}\n.op")), &ngspice);
            let plot = still.plot("Operating");
            for ((name, full), (_, written)) in scene.read(1).iter().zip(&scene.read(2)) {
                let (full, written) = (real(plot, full)[0], real(plot, written)[0]);
                worst[0] = worst[0].max((full - written).abs() / (full.abs() + 1e-6));
                assert!(worst[0] < 1e-6, "ngspice {version}, {} {name}: {full:e} {written:e}", scene.file);
            }
            for port in scene.ports() {
                let driven = |name: &str| if name == port { "AC 1".to_owned() } else { "AC 0".to_owned() };
                let run = scene.run(&scene.deck(&part, driven, &format!("{exact}\n.ac dec 50 10 100k")), &ngspice);
                let plot = run.plot("AC");
                for ((name, full), (_, written)) in scene.read(1).iter().zip(&scene.read(2)) {
                    for (a, b) in complex(plot, full).iter().zip(complex(plot, written)) {
                        let (off, size) = ((a[0] - b[0]).hypot(a[1] - b[1]), a[0].hypot(a[1]));
                        if size > 1e-18 {
                            worst[1] = worst[1].max(off / size);
                        }
                        assert!(off < 1e-6 * size + 1e-18, "ngspice {version}, {} {name} over {port}", scene.file);
                    }
                }
            }
            let driven = |name: &str| if name == port { pulse.to_owned() } else { String::new() };
            let options = ".options reltol=1e-6 vntol=1e-9 abstol=1e-18 chgtol=1e-20";
            let run = scene.run(&scene.deck(&part, driven, &format!("{options}\n{analysis}")), &ngspice);
            let plot = run.plot("Transient");
            let t = real(plot, "time");
            let signals = scene.ports().len();
            for ((name, full), (_, written)) in scene.read(1).iter().zip(&scene.read(2)).skip(signals) {
                let off = deviation((t, real(plot, written)), (t, real(plot, full)), 0.0, end);
                println!("ngspice {version}, {} {name}: {off:.2e} of range", scene.file);
                worst[2] = worst[2].max(off);
            }
            let [op, ac, tran] = worst;
            println!("ngspice {version}, {}: .op {op:.1e}, .ac {ac:.1e}, .tran {tran:.1e}", scene.file);
            assert!(tran < 1e-3, "ngspice {version}, {}: {tran:e}", scene.file);
        }
    }
}

/// The nonlinear plate pulls in at √(8·k·g³/(27·ε·A)) = 5.1741 V, within the 1 mV of the sweep, and rests where contact begins, 0.1 µm
/// from the electrode, a nanometre further at most.
#[test]
fn the_nonlinear_plate_pulls_in() {
    let exact = (8.0f64 * 2e-6f64.powi(3) / (27.0 * 8.854e-12 * 1e-8)).sqrt();
    let part = PLATE.whole();
    for (version, ngspice) in versions() {
        let text = format!("* plate\n{part}V1 a 0 0\nX1 a 0 v 0 x q d part\n.dc V1 5 5.3 1m\n.end\n");
        let run = PLATE.run(&text, &ngspice);
        let plot = run.plot("DC");
        let (volts, x) = (real(plot, "v(a)"), real(plot, "v(x)"));
        let jump = x.iter().position(|x| *x > 1.0).unwrap();
        println!("ngspice {version}: pulls in at {} V, rests at {} um", volts[jump], x[x.len() - 1]);
        assert!((0.0..1.1e-3).contains(&(volts[jump] - exact)), "ngspice {version}: {} V", volts[jump]);
        assert!((1.9..1.901).contains(&x[x.len() - 1]), "ngspice {version}");
    }
}

/// At the operating point currents, places and temperatures are those of the full model, to 1e-6 of each.
#[test]
fn the_operating_point_is_that_of_the_full_model() {
    for scene in [BANK, COMB] {
        let fitted = scene.exported();
        for (version, ngspice) in versions() {
            let run = scene.run(&scene.deck(&Scene::linear(&fitted), |_| String::new(), ".op"), &ngspice);
            let plot = run.plot("Operating");
            for ((name, full), (_, written)) in scene.read(1).iter().zip(&scene.read(2)) {
                let (full, written) = (real(plot, full)[0], real(plot, written)[0]);
                println!("ngspice {version}, {} {name}: {full:e} {written:e}", scene.file);
                // what is 0 in the full model is so to a picoampere and a picometre
                assert!(
                    (full - written).abs() <= 1e-6 * full.abs() + 1e-12,
                    "ngspice {version}, {} {name}",
                    scene.file
                );
            }
        }
    }
}

/// After a small step of a voltage both move alike: displacement within 1e-3 of its range, at equal steps.
#[test]
fn a_small_step_moves_both_alike() {
    let bank = ("heat", "PULSE(1 1.0002 1u 1u 1u 1 1)", ".tran 50n 100u 0 50n", 100e-6);
    let comb = ("drive", "PULSE(20 20.002 1u 1u 1u 1 1)", ".tran 100n 200u 0 100n", 200e-6);
    for (scene, (port, pulse, analysis, end)) in [(BANK, bank), (COMB, comb)] {
        let fitted = scene.exported();
        let driven = |name: &str| if name == port { pulse.to_owned() } else { String::new() };
        for (version, ngspice) in versions() {
            let text = scene.deck(&Scene::linear(&fitted), driven, &format!(".options reltol=1e-6\n{analysis}"));
            let run = scene.run(&text, &ngspice);
            let plot = run.plot("Transient");
            let t = real(plot, "time");
            let off = deviation((t, real(plot, "v(s0_2)")), (t, real(plot, "v(s0_1)")), 0.0, end);
            println!("ngspice {version}, {}: {off:.2e} of range", scene.file);
            assert!(off < 1e-3, "ngspice {version}, {}: {off:e}", scene.file);
        }
    }
}
