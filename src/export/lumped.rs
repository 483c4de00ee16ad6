//! A mechanism of rigid parts that only slide, with its nonlinear forces: what [`super::spice`] and [`super::verilog_a`] write with
//! `--nonlinear`.
//!
//! Where every part moves along fixed directions and springs are linear in that, the whole model is
//! ```text
//! M·ẍ + C·ẋ + K·x = f₀ + Σ_g n_g·(½·V_g²·C_g′(u_g) − P_g(u_g)) + Σ_q b_q·f_q − M·a        u_g = n_gᵀ·x
//! Q_g = C_g(u_g)·V_g,      V_g = Σ rows·voltages,      i = G·voltages + Σ rows·dQ_g/dt
//! ```
//! with the gap functions C_g of [`crate::gaps::capacitor`] and what bears where parts touch, P_g of [`crate::gaps::contact`] and
//! [`crate::gaps::stop`]. Nothing is linearised, and no operating point is needed.

use super::ExportError;
use super::Request;
use super::linear::{Port, SignalShown};
use super::mechanism::port_names;
use crate::analysis::signal::Signal;
use crate::compile::Compiled;
use crate::device::PortKind;
use crate::device::ports::{Answer, Ports};
use crate::device::scale::Scale;
use crate::gaps::capacitor::Capacitor;
use crate::gaps::contact::Contact;
use crate::gaps::stop::Stop;
use crate::gaps::{Gap, Input, Point, System};
use crate::multibody::BodyId;
use crate::multibody::forces::{add_damping, add_elastic};
use crate::multibody::planar::Pose;
use nalgebra::{DMatrix, DVector, Vector2};

/// Most coordinates of a lumped mechanism.
const MOST: usize = 24;
/// What the rate of a part is measured in that no spring holds [rad/s].
const UNHELD: f64 = 1e5;
/// Share of a spring's force that may be beside a straight line [1].
const STRAIGHT: f64 = 1e-9;

/// Way of one part along one direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinate {
    /// Name of the part.
    pub name: String,
    /// Its body.
    body: usize,
    /// Direction as drawn.
    pub direction: Vector2<f64>,
    /// Mass [kg].
    pub mass: f64,
    /// What its rate is measured in: that many per second of a micrometre is 1 V [rad/s].
    pub omega: f64,
}

/// What a gap does.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// Capacitance, and contact where parts touch.
    Field(Capacitor, Option<Contact>),
    /// A stop, with its ways ahead and back [m].
    Stop([Option<f64>; 2], Stop),
}

/// A gap with what it depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct LumpedGap {
    /// Its name.
    pub name: String,
    /// n: approach per coordinate [1].
    pub along: DVector<f64>,
    /// What it does.
    pub law: Law,
    /// Voltage per voltage of each port [1].
    pub by_port: DVector<f64>,
    /// Voltage by the netlist's own sources [V].
    pub constant: f64,
}

/// What a port or signal reads.
#[derive(Debug, Clone, PartialEq)]
pub enum Reading {
    /// Current of an electrical port: conductance to each port [S], and what the netlist's own sources drive [A].
    Current(DVector<f64>, f64),
    /// A displacement, per coordinate.
    Place(DVector<f64>),
    /// A rate, per coordinate.
    Rate(DVector<f64>),
    /// Charge of a gap.
    Charge(usize),
    /// Capacitance of a gap.
    Capacitance(usize),
    /// Force of a gap's voltage.
    Pull(usize),
    /// Distance left in a gap: at rest [m], and its sign with the approach.
    Distance(usize, f64, f64),
    /// A constant.
    Constant(f64),
    /// Nothing.
    Nothing,
}

/// The model.
#[derive(Debug, Clone, PartialEq)]
pub struct Lumped {
    /// Ports; they have no operating point.
    pub ports: Vec<Port>,
    /// Signals.
    pub signals: Vec<SignalShown>,
    /// Coordinates.
    pub coordinates: Vec<Coordinate>,
    /// C [N·s/m].
    pub damping: DMatrix<f64>,
    /// K [N/m].
    pub stiffness: DMatrix<f64>,
    /// f₀: dead loads and built-in strain [N].
    pub load: DVector<f64>,
    /// Force per unit of what is given to each port, coordinates × ports [N per N, kg].
    pub push: DMatrix<f64>,
    /// Gaps.
    pub gaps: Vec<LumpedGap>,
    /// What each port answers, then what each signal shows, in SI.
    pub rows: Vec<Reading>,
    /// Volts or amperes of the circuit per unit of each row.
    pub scales: Vec<f64>,
    /// Unit of what is given per volt or ampere of the circuit, of each port.
    pub given: Vec<f64>,
}

/// The lumped model of a request; its operating point, modes and errors are not looked at.
///
/// # Errors
/// [`ExportError::NotLumped`] where a part can turn, a spring is not linear, or something heats.
pub fn lump(compiled: &Compiled, request: &Request) -> Result<Lumped, ExportError> {
    let (names, across): (Vec<_>, Vec<_>) = port_names(compiled, request)?.into_iter().unzip();
    let ports = Ports::find(compiled, &names)?;
    let system = ports.system.as_deref().unwrap_or(&compiled.parts.system);
    let electrics = &system.electrics;
    if let Some(k) = ports.kinds.iter().position(|kind| *kind == PortKind::Rate) {
        return Err(ExportError::Turning { port: names[k].clone() });
    }
    if !electrics.heating.heaters.is_empty() {
        let beam = &compiled.structure.beams[compiled.parts.heaters[0]].name;
        return Err(ExportError::NotLumped { why: format!("beam \"{beam}\" heats") });
    }
    let mut coordinates = coordinates(system)?;
    let n = coordinates.len();
    let (stiffness, force) = springs(system, &coordinates)?;
    for (k, c) in coordinates.iter_mut().enumerate() {
        let omega = (stiffness[(k, k)] / c.mass).sqrt();
        c.omega = if omega.is_finite() && omega > 0.0 { omega } else { UNHELD };
    }
    let mut drag = vec![Pose::zeros(); system.bodies()];
    let mut damping = DMatrix::zeros(n, n);
    for k in 0..n {
        drag.fill(Pose::zeros());
        add_damping(&system.model, &moved(system, &coordinates, k, 1.0), &mut drag);
        for j in 0..n {
            damping[(j, k)] = drag[coordinates[j].body].xy().dot(&coordinates[j].direction);
        }
    }
    let along = |point: &Point, axis: Vector2<f64>| {
        let of = |c: &Coordinate| if point.body == BodyId::Free(c.body) { c.direction.dot(&axis) } else { 0.0 };
        DVector::from_iterator(n, coordinates.iter().map(of))
    };
    let mut load = -force;
    for dead in &system.loads {
        load += along(&dead.point, dead.force);
    }
    let mut push = DMatrix::zeros(n, names.len());
    for (q, &source) in ports.sources.iter().enumerate() {
        let column = match source.checked_sub(electrics.voltages()).map(|k| electrics.inputs[k]) {
            Some(Input::Force { point, direction }) => along(&point, axis(direction)),
            Some(Input::Acceleration { axis: a }) => {
                DVector::from_iterator(n, coordinates.iter().map(|c| -c.mass * c.direction[a]))
            }
            _ => continue,
        };
        push.set_column(q, &column);
    }
    let by_port = |row: &dyn Fn(usize) -> f64| {
        let fixed: f64 = electrics.fixed.iter().enumerate().map(|(k, v)| row(electrics.ports + k) * v).sum();
        (DVector::from_iterator(names.len(), ports.sources.iter().map(|&s| row(s))), fixed)
    };
    let gap = |(g, gap): (usize, &Gap)| {
        let (approach, law) = match gap {
            Gap::Single { approach, capacitor, contact } => (approach, Law::Field(*capacitor, *contact)),
            Gap::Stop { approach, ways, stop } => (approach, Law::Stop(*ways, *stop)),
            Gap::Facing { .. } => {
                let why = format!("gap \"{}\" lies along beams", compiled.parts.gap_names[g]);
                return Err(ExportError::NotLumped { why });
            }
        };
        let (by_port, constant) = by_port(&|s| electrics.gap_rows[(g, s)]);
        let name = compiled.parts.gap_names[g].clone();
        let along = along(&approach.a, approach.axis) - along(&approach.b, approach.axis);
        Ok(LumpedGap { name, along, law, by_port, constant })
    };
    let gaps = system.gaps.iter().enumerate().map(gap).collect::<Result<Vec<_>, _>>()?;
    let of_signal = |signal: &Signal| match *signal {
        Signal::Displacement(_, 2) | Signal::Rate(_, 2) => Ok(Reading::Constant(0.0)),
        Signal::Displacement(point, d) => Ok(Reading::Place(along(&point, axis(d)))),
        Signal::Rate(point, d) => Ok(Reading::Rate(along(&point, axis(d)))),
        Signal::Prescribed(t) => Ok(Reading::Constant(t)),
        Signal::Charge(g) => Ok(Reading::Charge(g)),
        Signal::Capacitance(g) => Ok(Reading::Capacitance(g)),
        Signal::Pull(g) => Ok(Reading::Pull(g)),
        Signal::Distance(g) => match gaps[g].law {
            Law::Field(capacitor @ Capacitor::Comb { .. }, _) => Ok(Reading::Distance(g, capacitor.distance(0.0), 1.0)),
            Law::Field(capacitor, _) => Ok(Reading::Distance(g, capacitor.distance(0.0), -1.0)),
            Law::Stop(..) => Err(ExportError::NotLumped {
                why: format!("\"{}\" is a stop, whose distance has a corner", gaps[g].name),
            }),
        },
        // of beams that heat, which have been refused
        Signal::Temperature(_) => Ok(Reading::Nothing),
    };
    let mut rows = Vec::new();
    for (answer, &source) in ports.answers.iter().zip(&ports.sources) {
        rows.push(match answer {
            Answer::Current => {
                let (row, constant) = by_port(&|s| electrics.conductance[(source, s)]);
                Reading::Current(row, constant)
            }
            Answer::Motion(signal) => of_signal(signal)?,
            Answer::Rise(_) | Answer::Nothing => Reading::Nothing,
        });
    }
    let mut signals = Vec::new();
    for (name, scale) in &request.signals {
        let signal = Signal::find(compiled, name)?;
        rows.push(of_signal(&signal)?);
        signals.push(SignalShown { name: name.clone(), unit: signal.unit(), scale: *scale });
    }
    let scaled: Vec<Scale> = ports.kinds.iter().zip(&across).map(|(kind, across)| Scale::new(*kind, *across)).collect();
    let port = |k: usize| {
        let (kind, scale) = (ports.kinds[k], scaled[k]);
        let across = if kind.given_flow() { scale.answered } else { 1.0 / scale.given };
        Port { name: names[k].clone(), kind, across, bias: None }
    };
    Ok(Lumped {
        ports: (0..names.len()).map(port).collect(),
        scales: scaled.iter().map(|s| s.answered).chain(signals.iter().map(|s| s.scale)).collect(),
        given: scaled.iter().map(|s| s.given).collect(),
        signals,
        coordinates,
        damping,
        stiffness,
        load,
        push,
        gaps,
        rows,
    })
}

fn axis(direction: usize) -> Vector2<f64> {
    if direction == 0 { Vector2::x() } else { Vector2::y() }
}

/// The directions in which bodies slide.
fn coordinates(system: &System) -> Result<Vec<Coordinate>, ExportError> {
    let refused = |why: String| Err(ExportError::NotLumped { why });
    let mut out: Vec<Coordinate> = Vec::new();
    for (body, part) in system.model.bodies.iter().enumerate() {
        let name = part.name.to_string();
        let Some(free) = &part.free else { return refused(format!("part \"{name}\" can turn")) };
        if free.column(2).amax() > 1e-9 {
            return refused(format!("part \"{name}\" can turn"));
        }
        if free.trace().round() > 0.0 && part.mass <= 0.0 {
            return refused(format!("part \"{name}\" has no mass"));
        }
        let directions = match free.trace().round() as usize {
            0 => vec![],
            1 => {
                let column = if free[(0, 0)] >= free[(1, 1)] { 0 } else { 1 };
                vec![Vector2::new(free[(0, column)], free[(1, column)]).normalize()]
            }
            _ => vec![Vector2::x(), Vector2::y()],
        };
        out.extend(directions.into_iter().map(|direction| Coordinate {
            name: name.clone(),
            body,
            direction,
            mass: part.mass,
            omega: 1.0,
        }));
    }
    match out.len() {
        0 => refused("nothing moves".into()),
        n if n > MOST => refused(format!("{n} directions in which parts slide are more than {MOST}")),
        _ => Ok(out),
    }
}

/// A displacement `way` along coordinate `k`.
fn moved(system: &System, coordinates: &[Coordinate], k: usize, way: f64) -> Vec<Pose> {
    let mut q = vec![Pose::zeros(); system.bodies()];
    let c = &coordinates[k];
    q[c.body] = Pose::new(c.direction.x * way, c.direction.y * way, 0.0);
    q
}

/// K and the force at rest; refused where springs are not linear over the ways that gaps leave. Sets no scale.
fn springs(system: &System, coordinates: &[Coordinate]) -> Result<(DMatrix<f64>, DVector<f64>), ExportError> {
    let (n, drive) = (coordinates.len(), system.electrics.drive());
    let elastic = |q: &[Pose]| -> DVector<f64> {
        let mut r = vec![Pose::zeros(); q.len()];
        add_elastic(&system.model, q, &drive.rest(), &mut r);
        DVector::from_iterator(n, coordinates.iter().map(|c| r[c.body].xy().dot(&c.direction)))
    };
    let way = 10.0 * system.length_scale;
    let rest = elastic(&vec![Pose::zeros(); system.bodies()]);
    let mut stiffness = DMatrix::zeros(n, n);
    for k in 0..n {
        let there = elastic(&moved(system, coordinates, k, way)) - elastic(&moved(system, coordinates, k, -way));
        stiffness.set_column(k, &(there / (2.0 * way)));
    }
    let stiffness = (&stiffness + stiffness.transpose()) * 0.5;
    // all corners of a few patterns of ways: any coupling of two coordinates shows
    for pattern in 0..n + 2 {
        let ways = DVector::from_fn(n, |k, _| {
            way * (0.3 + ((7 * k + 3 * pattern) % 11) as f64 / 11.0) * if (k + pattern) % 2 == 0 { 1.0 } else { -1.0 }
        });
        let mut q = vec![Pose::zeros(); system.bodies()];
        for k in 0..n {
            for (to, x) in q.iter_mut().zip(moved(system, coordinates, k, ways[k])) {
                *to += x;
            }
        }
        let (found, straight) = (elastic(&q), &rest + &stiffness * &ways);
        let size = stiffness.amax() * way + rest.amax();
        if let Some(k) = (0..n).find(|&k| (found[k] - straight[k]).abs() > STRAIGHT * size) {
            let why = format!("the springs at part \"{}\" are not linear", coordinates[k].name);
            return Err(ExportError::NotLumped { why });
        }
    }
    Ok((stiffness, rest))
}
