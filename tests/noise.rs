//! Noise of a device: every warm dissipative element is a source. Checked against the fluctuation–dissipation theorem,
//! which holds for any linear system in equilibrium (Callen and Welton 1951), and against closed forms.

use bimorph::compile::{CompileOptions, CompiledModel, Formulation, Junctions, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Agitation, Device, Mode, OpenRequest, PortKind, SmallSignal, Status, Token, Trial, TrialReply};
use bimorph::document::StructureDocument;
use bimorph::multibody::agitation::BOLTZMANN;
use bimorph::netlist::Bundle;
use nalgebra::Complex;
use std::sync::Arc;

const AMBIENT: f64 = 350.0;

/// A shuttle on two beams in gas, with a plate on one side and a comb on the other: all of it in equilibrium at 350 K.
const RESONATOR: &str = "
process p = [ Youngsmodulus=160e9 density=2300 viscosity=1.8e-5 fluid=2e-6 ambienttemperature=350 h=2u permittivity=8.854e-12 ]
anchor p [a] [l=10u w=10u h=2u]
upper beam2d p [a s] [l=120u w=2u]
lower beam2d p [s b] [l=90u w=2u]
anchor p [b] [l=10u w=10u h=2u]
rod beam2d p [s t] [l=40u w=4u oz=pi/2]
mass2d * [t] [m=2e-11 J=1e-20]
dash damper2d * [t e] [bx=3e-7 oz=pi/2]
comb comb2de p [t k] [N=40 gap=2u l=10u L=30u h=2u oz=pi/2]
anchor p [k] [l=5u w=5u h=2u]
plate plategap2d p [t e] [A=4e-10 gap=1.5u oz=0]
anchor p [e] [l=5u w=5u h=2u]
eground * [a] []
eground * [b] []
drive port * [k] []
sense port * [e] []
";

/// One heated beam between anchors, nothing to pull at.
const HEATER: &str = "
process p = [ Youngsmodulus=160e9 density=2300 sheetresistance=20 thermalexpansion=2.5e-6 ambienttemperature=300 thermcond=32 h=2u ]
anchor p [a] [l=10u w=10u h=2u]
beam beam2det p [a b] [l=120u w=2u]
anchor p [b] [l=10u w=10u h=2u]
eground * [b] []
heat port * [a] []
";

fn compiled(text: &str) -> Arc<CompiledModel> {
    let options = CompileOptions { junctions: Junctions::Centreline, ..CompileOptions::default() };
    Arc::new(compile(&Bundle::from_text("noise.net", text), &options).unwrap_or_else(|e| panic!("{e}")))
}

fn opened(compiled: &Arc<CompiledModel>, ports: &[&str], signals: &[&str]) -> LocalDevice {
    let mut device = LocalDevice::new(Arc::clone(compiled));
    let names = |list: &[&str]| list.iter().map(|name| (*name).to_owned()).collect();
    let request = OpenRequest { ports: names(ports), signals: names(signals), noise: None };
    device.open(&request).unwrap_or_else(|e| panic!("{e}"));
    device
}

fn balanced(device: &mut LocalDevice, given: &[f64]) -> (Token, TrialReply) {
    let mut reply = TrialReply::default();
    let request = Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: given };
    device.trial(&request, &mut reply).unwrap();
    assert_eq!(reply.status, Status::Ok);
    (reply.token.unwrap(), reply)
}

fn complex(z: [f64; 2]) -> Complex<f64> {
    Complex::new(z[0], z[1])
}

/// In equilibrium S = 2·k_B·T·(H + Hᴴ), where H is what takes power: the current per volt, the velocity per force. Ports of every
/// kind, charged, at frequencies below, at and above resonances, in a frame at rest and in one that turns at 3e4 rad/s, without and with
/// gas that compresses between the plates.
#[test]
fn fluctuation_is_dissipation() {
    let names = ["drive", "t.y", "sense", "t.vx", "s.rz", "frame.wz", "s.vrz"];
    let in_gas = RESONATOR.replace("A=4e-10", "l=20u w=20u fringe=none pressure=1e4");
    for (text, turning) in [(RESONATOR, 0.0), (RESONATOR, 3e4), (&in_gas, 0.0), (&in_gas, 3e4)] {
        let model = compiled(text);
        let mut device = opened(&model, &names, &[]);
        let (token, _) = balanced(&mut device, &[12.0, 0.0, -3.0, 0.0, 0.0, turning, 0.0]);
        let kinds =
            [PortKind::Electrical, PortKind::Force, PortKind::Electrical, PortKind::ForceRate, PortKind::Moment];
        let kinds = [&kinds[..], &[PortKind::Rate, PortKind::MomentRate]].concat();
        for omega in [1e3, 4e5, 1.1e6, 3e6, 2e7] {
            let (mut small, mut noise) = (SmallSignal::default(), Vec::new());
            device.linearize(token, omega, &mut small).unwrap();
            device.noise(token, omega, &mut noise).unwrap();
            let n = names.len();
            // rates of what is answered, so that each is the flow or motion that takes power
            let rate = |row: usize| match kinds[row] {
                PortKind::Force | PortKind::Moment => Complex::new(0.0, omega),
                _ => Complex::new(1.0, 0.0),
            };
            let takes_power = |row: usize| kinds[row] != PortKind::Rate;
            let h = |row: usize, column: usize| rate(row) * complex(small.admittance[row * n + column]);
            for i in (0..n).filter(|&i| takes_power(i)) {
                for j in (0..n).filter(|&j| takes_power(j)) {
                    let s = rate(i) * complex(noise[i * n + j]) * rate(j).conj();
                    let want = (h(i, j) + h(j, i).conj()) * 2.0 * BOLTZMANN * AMBIENT;
                    let size = (complex(noise[i * n + i]).norm() * complex(noise[j * n + j]).norm()).sqrt();
                    let size = size * rate(i).norm() * rate(j).norm();
                    assert!(size > 0.0);
                    // the part that takes no power is left of it as rounding
                    let rounding = 1e-11 * 4.0 * BOLTZMANN * AMBIENT * h(i, j).norm().max(h(j, i).norm());
                    let error = (s - want).norm();
                    assert!(error <= 1e-9 * size + rounding, "{} {}: {s:e} {want:e}", names[i], names[j]);
                }
            }
        }
    }
}

/// The displacement of a damped mass has 4·k_B·T·c·|χ|², the rate ω² times that, and their cross-spectrum is −iω times it; 27 °C where
/// the netlist names no temperature.
#[test]
fn a_damped_mass_has_the_closed_form() {
    let (m, c, k): (f64, f64, f64) = (1e-10, 5e-7, 4.0);
    let text = format!(
        "anchor * [g] [l=1u w=1u h=1u]\nmass2d * [m] [m={m} J=1e-20]\nspring2d * [g m] [kx={k} ky=1e3 krz=1]\ndamper2d * [g m] [bx={c}]\n"
    );
    let mut device = opened(&compiled(&text), &["m.x"], &["m.x", "m.vx"]);
    let (token, _) = balanced(&mut device, &[0.0]);
    for omega in [0.0, 1e4, 2e5, 1e6] {
        let mut noise = Vec::new();
        device.noise(token, omega, &mut noise).unwrap();
        let chi = 1.0 / Complex::new(k - m * omega * omega, omega * c);
        let want = 4.0 * BOLTZMANN * 300.15 * c * chi.norm_sqr();
        let of = |row: usize, column: usize| complex(noise[row * 3 + column]);
        for (row, column, factor) in [
            (0, 0, Complex::new(1.0, 0.0)),
            (1, 1, Complex::new(1.0, 0.0)),
            (2, 2, Complex::new(omega * omega, 0.0)),
            (1, 2, Complex::new(0.0, -omega)),
        ] {
            let error = (of(row, column) - factor * want).norm();
            assert!(error <= 1e-9 * want * factor.norm().max(f64::MIN_POSITIVE), "{omega:e} {row} {column}: {error:e}");
        }
    }
}

/// Lumped parts have the ambient temperature of their layer: 4·k_B·T·c/k² at low frequency (Callen and Welton 1951), whichever element of the layer comes
/// first. The temperature of a beam counts where there is one, and 27 °C where no layer gives any. Documents keep it.
#[test]
fn lumped_parts_are_at_the_temperature_of_their_layer() {
    let layer = "process cold = [ density=2300 h=2u ambienttemperature=77 ]\nprocess q = [ Youngsmodulus=160e9 density=2300 h=2u AMBIENT ]\n";
    let parts = "anchor * [g] []\nmass2d LAYER [m] [m=1e-10 J=1e-20]\nspring2d * [g m] [kx=4 ky=1e3 krz=1]\ndamper2d LAYER [g m] [bx=5e-7]\n";
    let beam = "beam2d q [m t] [l=10u w=4u]\n";
    for (text, temperature) in [
        (parts.replace("LAYER", "cold"), 77.0),
        (parts.replacen("LAYER", "*", 1).replace("LAYER", "cold"), 77.0),
        (parts.replace("LAYER", "*"), 300.15),
        (parts.replace("LAYER", "q"), 300.15),
        (format!("{}{beam}", parts.replace("LAYER", "cold")), 77.0),
        (format!("{}{}", parts.replace("LAYER", "cold"), beam).replace("beam2d q", "beam2d q2"), 350.0),
    ] {
        let warm = "process q2 = [ Youngsmodulus=160e9 density=2300 h=2u ambienttemperature=350 ]\n";
        let text = format!("{}{warm}{text}", layer.replace("AMBIENT", ""));
        let model = compiled(&text);
        let drawn =
            StructureDocument { source: String::new(), parameters: Vec::new(), structure: (*model.structure).clone() };
        let read = StructureDocument::read(&drawn.write().unwrap()).unwrap();
        assert_eq!(read.structure.ambient_temperature, model.structure.ambient_temperature);
        let mut device = opened(&model, &["m.x"], &[]);
        let (token, _) = balanced(&mut device, &[0.0]);
        let mut noise = Vec::new();
        device.noise(token, 1.0, &mut noise).unwrap();
        let want = 4.0 * BOLTZMANN * temperature * 5e-7 / 16.0;
        assert!((noise[0][0] / want - 1.0).abs() < 1e-6, "{temperature}: {:e} {want:e}", noise[0][0]);
    }
}

/// A beam that carries current has Johnson's noise at its own mean temperature: 4·k_B·(T₀ + rise)/R.
#[test]
fn a_heater_is_a_warm_resistor() {
    let mut device = opened(&compiled(HEATER), &["heat"], &["beam.T"]);
    for volts in [0.0, 0.5, 2.0] {
        let (token, reply) = balanced(&mut device, &[volts]);
        let mut noise = Vec::new();
        device.noise(token, 1e4, &mut noise).unwrap();
        let resistance = 20.0 * 120.0 / 2.0;
        let want = 4.0 * BOLTZMANN * reply.outputs[0] / resistance;
        println!("{volts} V: {:.1} K, {:e} A²/Hz", reply.outputs[0], noise[0][0]);
        assert!((noise[0][0] / want - 1.0).abs() <= 1e-12, "{:e} {want:e}", noise[0][0]);
    }
}

fn shaken(compiled: &Arc<CompiledModel>, signal: &str, seed: u64, band: Option<f64>) -> LocalDevice {
    let mut device = LocalDevice::new(Arc::clone(compiled));
    let noise = Some(Agitation { seed, band });
    device.open(&OpenRequest { ports: vec![], signals: vec![signal.into()], noise }).unwrap_or_else(|e| panic!("{e}"));
    device
}

/// The signal after each of so many steps from rest, and the last state.
fn run(device: &mut LocalDevice, given: &[f64], dt: f64, steps: usize) -> (Vec<f64>, Token) {
    let (mut token, mut reply) = balanced(device, given);
    let values = (0..steps).map(|_| {
        let request = Trial { mode: Mode::Transient, parent: Some(token), t: 0.0, dt, voltages: given };
        device.trial(&request, &mut reply).unwrap();
        assert_eq!(reply.status, Status::Ok);
        token = reply.token.unwrap();
        device.accept(token);
        reply.outputs[0]
    });
    (values.collect(), token)
}

/// A mass of 1 ng at 5 kHz.
fn mass(c: f64) -> Arc<CompiledModel> {
    compiled(&format!(
        "anchor * [g] [l=1u w=1u h=1u]\nmass2d * [m] [m=1e-9 J=1e-20]\nguide2d * [m] []\nspring2d * [g m] [kx=1]\ndamper2d * [g m] [bx={c}]\n"
    ))
}

/// Equipartition: over a long run ½k⟨x²⟩ = ½k_B·T and ½m⟨v²⟩ = ½k_B·T, within three standard deviations of the mean of
/// γT = 4000 correlation times, σ = √(2/γT) = 2.2 %. The band takes 0.2 % of it.
#[test]
fn every_degree_of_freedom_has_its_share() {
    let c = 6e-6;
    let model = mass(c);
    for seed in [1, 2] {
        let mut square = [0.0; 2];
        for (signal, square) in ["m.x", "m.vx"].into_iter().zip(&mut square) {
            let (values, _) = run(&mut shaken(&model, signal, seed, None), &[], 5e-6, 133_000);
            *square = values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64;
        }
        let energy = BOLTZMANN * 300.15;
        let shares = [square[0] / energy, 1e-9 * square[1] / energy];
        println!("seed {seed}: k<x2>/kT = {:.3}, m<v2>/kT = {:.3}", shares[0], shares[1]);
        assert!(shares.iter().all(|share| (share - 1.0).abs() < 3.0 * 0.0224), "{shares:?}");
    }
}

/// The same seed gives the same bits, also from a snapshot and when steps are tried and thrown away in between; another seed
/// another motion. A step over more cells than two is refused with the length of one.
#[test]
fn a_seed_decides() {
    let model = mass(6e-6);
    let (first, token) = run(&mut shaken(&model, "m.x", 7, Some(2e5)), &[], 2.5e-6, 50);
    assert!(first.iter().all(|x| x.abs() < 1e-8) && first.iter().any(|x| x.abs() > 1e-12), "{first:?}");
    let mut device = shaken(&model, "m.x", 7, Some(2e5));
    assert_eq!(run(&mut device, &[], 2.5e-6, 50), (first.clone(), token));
    assert_ne!(run(&mut shaken(&model, "m.x", 8, Some(2e5)), &[], 2.5e-6, 50).0, first);

    let mut reply = TrialReply::default();
    let step = |dt: f64| Trial { mode: Mode::Transient, parent: Some(token), t: 0.0, dt, voltages: &[] };
    device.trial(&step(5.1e-6), &mut reply).unwrap();
    assert_eq!(reply.status, Status::NeedDt(2.5e-6));
    device.trial(&step(1e-6), &mut reply).unwrap();
    assert!(reply.dt_next <= 2.5e-6);
    let mut other = LocalDevice::new(Arc::clone(&model));
    other.load(&device.save(Some(&[token])).unwrap()).unwrap();
    let (mut here, mut there) = (TrialReply::default(), TrialReply::default());
    device.trial(&step(2e-6), &mut here).unwrap();
    other.trial(&step(2e-6), &mut there).unwrap();
    assert_eq!(here, there);
    for band in [0.0, -1.0, 1e30, f64::NAN, f64::INFINITY] {
        let noise = Some(Agitation { seed: 1, band: Some(band) });
        let refused = LocalDevice::new(Arc::clone(&model)).open(&OpenRequest { noise, ..OpenRequest::default() });
        assert!(refused.unwrap_err().to_string().starts_with("noise band: expected a frequency above 0"));
    }
}

/// Both formulations of one mechanism are shaken by one force: within 5e-3 of the range of the motion, by which
/// their joints differ at 16 segments a beam (1.6e-3; 2e-2 at 2).
#[test]
fn formulations_feel_the_same() {
    let motion = |formulation| {
        let options = CompileOptions {
            formulation,
            tol: 1e-4,
            junctions: Junctions::Centreline,
            segments: Some(16),
            ..CompileOptions::default()
        };
        let model = Arc::new(compile(&Bundle::from_text("noise.net", RESONATOR), &options).unwrap());
        run(&mut shaken(&model, "t.y", 3, Some(1e6)), &[5.0, 0.0], 5e-7, 400).0
    };
    let (bodies, joints) = (motion(Formulation::Compliant), motion(Formulation::Rcr));
    let range = bodies.iter().map(|x| (x - bodies[0]).abs()).fold(0.0, f64::max);
    let apart = bodies.iter().zip(&joints).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("apart by {:e} of {range:e} m", apart / range);
    assert!(range > 1e-11 && apart < 5e-3 * range, "{apart:e} {range:e}");
}
