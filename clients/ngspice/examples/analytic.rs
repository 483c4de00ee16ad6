//! Another kind of device behind the plug-in: a code model of its own whose `bimorph` devices are written in Rust.
//!
//! The device is a moving plate between a drive gap and a sense comb, with one degree of freedom:
//!
//! ```text
//! m·x″ + b·x′ + k·x = ½·V_d²·C_d′(x) + ½·V_s²·C_s′(x),   C_d = ε·A/(g − x),   C_s = C₀ + c·x
//! ```
//!
//! Its file name chooses a behaviour: `plate` works; `plate.short` refuses steps beyond 50 ns; `plate.fails` finds no
//! answer after 10 µs; `plate.panics` has a bug. Build with `cargo build -p bimorph-ngspice --example analytic` and load
//! `target/debug/examples/libanalytic.so` with `pre_codemodel`.

use bimorph::device::{
    Description, Device, DeviceError, Mode, OpenRequest, PortInfo, PortKind, SignalInfo, SmallSignal, Status, Token,
    Trial, TrialReply,
};
use bimorph_ngspice::model_card::ModelCard;
use bimorph_ngspice::opener::OpenError;
use std::collections::BTreeMap;
use std::path::Path;

const MASS: f64 = 1e-10;
const STIFFNESS: f64 = 1.0;
const DAMPING: f64 = 2e-7;
const PERMITTIVITY_AREA: f64 = 8.854e-20;
const GAP: f64 = 2e-6;
const SENSE: f64 = 50e-15;
const SENSE_SLOPE: f64 = 1e-8;

/// Longest step of `plate.short` (s).
const SHORT: f64 = 50e-9;
/// When `plate.fails` ends (s).
const END: f64 = 10e-6;

#[derive(Debug, Clone, Copy, Default)]
struct State {
    x: f64,
    v: f64,
    a: f64,
}

struct Plate {
    behaviour: String,
    states: BTreeMap<Token, State>,
}

/// Force (N), ∂force/∂x, ∂force/∂V, capacitances (F) and their slopes.
struct Field {
    force: f64,
    slope: f64,
    by_voltage: [f64; 2],
    capacitance: [f64; 2],
    gradient: [f64; 2],
}

fn field(x: f64, v: &[f64]) -> Field {
    let gap = (GAP - x).max(0.02 * GAP);
    let (c, g) = (PERMITTIVITY_AREA / gap, PERMITTIVITY_AREA / (gap * gap));
    Field {
        force: 0.5 * v[0] * v[0] * g + 0.5 * v[1] * v[1] * SENSE_SLOPE,
        slope: v[0] * v[0] * g / gap,
        by_voltage: [v[0] * g, v[1] * SENSE_SLOPE],
        capacitance: [c, SENSE + SENSE_SLOPE * x],
        gradient: [g, SENSE_SLOPE],
    }
}

impl Plate {
    fn equilibrium(v: &[f64]) -> Option<(State, f64)> {
        let mut x = 0.0;
        for _ in 0..100 {
            let f = field(x, v);
            let stiffness = STIFFNESS - f.slope;
            let dx = (f.force - STIFFNESS * x) / if stiffness > 0.05 * STIFFNESS { stiffness } else { STIFFNESS };
            x += dx;
            if dx.abs() < 1e-18 {
                return Some((State { x, ..State::default() }, 1.0 / (STIFFNESS - field(x, v).slope)));
            }
        }
        None
    }

    /// Trapezoidal rule; from rest to motion the acceleration may jump, so a first step is backward Euler's.
    fn step(from: State, h: f64, v: &[f64]) -> Option<(State, f64)> {
        let th = if from.v == 0.0 && from.a == 0.0 { 1.0 } else { 0.5 };
        let mut x = from.x + h * from.v;
        for _ in 0..50 {
            let f = field(x, v);
            let v1 = ((x - from.x) / h - (1.0 - th) * from.v) / th;
            let a1 = (f.force - DAMPING * v1 - STIFFNESS * x) / MASS;
            let residual = v1 - from.v - h * (th * a1 + (1.0 - th) * from.a);
            let slope = 1.0 / (th * h) - h * th * (f.slope - DAMPING / (th * h) - STIFFNESS) / MASS;
            let dx = -residual / slope;
            x += dx;
            if dx.abs() < 1e-19 + 1e-12 * x.abs() {
                return Some((State { x, v: v1, a: a1 }, h * th / MASS / slope));
            }
        }
        None
    }
}

impl Device for Plate {
    fn open(&mut self, request: &OpenRequest) -> Result<Description, DeviceError> {
        self.states.clear();
        let port = |name: &str| PortInfo { name: name.to_owned(), kind: PortKind::Electrical };
        if let Some(name) = request.signals.iter().find(|s| *s != "plate.x") {
            return Err(DeviceError::UnknownSignal { name: name.clone(), hint: "there is plate.x".into() });
        }
        Ok(Description {
            ports: vec![port("drive"), port("sense")],
            signals: request.signals.iter().map(|s| SignalInfo { name: s.clone(), unit: "m".into() }).collect(),
            unknowns: 1,
        })
    }

    fn trial(&mut self, request: &Trial<'_>, reply: &mut TrialReply) -> Result<(), DeviceError> {
        let v = request.voltages;
        *reply = TrialReply { dt_next: f64::INFINITY, ..TrialReply::default() };
        let found = match request.mode {
            Mode::Static => Self::equilibrium(v),
            Mode::Transient => {
                let from = match request.parent {
                    Some(token) => *self.states.get(&token).ok_or(DeviceError::UnknownToken(token))?,
                    None => State::default(),
                };
                match self.behaviour.as_str() {
                    "plate.short" if request.dt > SHORT => {
                        reply.status = Status::NeedDt(SHORT);
                        return Ok(());
                    }
                    "plate.short" => reply.dt_next = SHORT,
                    "plate.fails" if request.t > END => {
                        reply.status = Status::Fail("the plate broke off".into());
                        return Ok(());
                    }
                    "plate.panics" if request.t > END => panic!("a bug"),
                    _ => {}
                }
                Self::step(from, request.dt, v)
            }
        };
        let Some((state, by_force)) = found else {
            reply.status = Status::Fail("no equilibrium was found".into());
            return Ok(());
        };
        let f = field(state.x, v);
        let dx = [f.by_voltage[0] * by_force, f.by_voltage[1] * by_force];
        reply.currents = vec![0.0; 2];
        reply.di_dv = vec![0.0; 4];
        for (n, volts) in v.iter().enumerate() {
            reply.charges.push(f.capacitance[n] * volts);
            for (k, dx) in dx.iter().enumerate() {
                let fixed = if n == k { f.capacitance[n] } else { 0.0 };
                reply.dq_dv.push(fixed + volts * f.gradient[n] * dx);
            }
        }
        reply.outputs = vec![state.x];
        reply.doutputs_dv = dx.to_vec();
        let bits = [state.x, state.v, state.a, v[0], v[1]].map(f64::to_bits);
        let hash = bits.iter().fold(1u64, |h, b| (h ^ b).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(23));
        let token = Token((hash >> 11) | 1);
        self.states.insert(token, state);
        reply.token = Some(token);
        Ok(())
    }

    fn accept(&mut self, _: Token) {}

    fn linearize(&mut self, token: Token, w: f64, reply: &mut SmallSignal) -> Result<(), DeviceError> {
        let state = *self.states.get(&token).ok_or(DeviceError::UnknownToken(token))?;
        // The voltages are those of the equilibrium: the sense port of the decks stands at 5 V, the drive at 2 V.
        let v = [2.0, 5.0];
        let f = field(state.x, &v);
        let (re, im) = (STIFFNESS - f.slope - MASS * w * w, w * DAMPING);
        let size = re * re + im * im;
        let dx = f.by_voltage.map(|b| [b * re / size, -b * im / size]);
        *reply = SmallSignal::default();
        for (n, volts) in v.iter().enumerate() {
            for (k, dx) in dx.iter().enumerate() {
                let fixed = if n == k { f.capacitance[n] } else { 0.0 };
                let q = [fixed + volts * f.gradient[n] * dx[0], volts * f.gradient[n] * dx[1]];
                reply.admittance.push([-w * q[1], w * q[0]]);
            }
        }
        reply.outputs = dx.to_vec();
        Ok(())
    }
}

fn open(card: &mut ModelCard, _: Option<&Path>) -> Result<Box<dyn Device>, OpenError> {
    Ok(Box::new(Plate { behaviour: card.file.clone(), states: BTreeMap::new() }))
}

extern "C" fn install() {
    bimorph_ngspice::set_opener(open);
}

// Runs when the library is loaded, before ngspice asks it for anything.
#[used]
#[unsafe(link_section = ".init_array")]
static INSTALL: extern "C" fn() = install;
