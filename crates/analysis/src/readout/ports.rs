//! Ports: electrical ones of the netlist, and those that any node, heated beam or the frame offers by name.
//!
//! | name | kind | given | answered |
//! |---|---|---|---|
//! | of a `port` element | electrical | voltage (V) | current (A) and charge (C) |
//! | `NODE.x`, `.y`, `.rz` | mechanical | force (N), moment (N·m) | displacement (m, rad) |
//! | `NODE.vx`, `.vy`, `.vrz` | mechanical | force (N), moment (N·m) | velocity (m/s, rad/s) |
//! | `BEAM.T` | thermal | heat into the beam (W) | its mean rise above ambient (K) |
//! | `NODE.ux`, `.uy`, `.urz` of a driven anchor | mechanical | displacement (m), rotation (rad) | force (N), moment (N·m) |
//! | `frame.ax`, `.ay`, `.wz` | inertial | acceleration (m/s²), rate (rad/s) of the frame | nothing |
//!
//! The frame's rate needs the compliant formulation.
//!
//! A mechanical port is given the force and answers with the motion, not the other way round, so that one which nothing is
//! connected to is free, and the mechanism's own integrator moves it whatever steps the circuit takes.

use super::ReadoutError;
use super::port_kind::PortKind;
use super::signal::Signal;
use bimorph_domains::inputs::Input;
use bimorph_domains::{MaterialPoint, System};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::BodyId;
use bimorph_solve::equations::Joints;
use bimorph_structure::is_anchor_motion;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// How a port answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PortResponse {
    /// With the current and charge of this source.
    Current,
    /// With a motion.
    Motion(Signal),
    /// With the rise of this heater.
    Rise(usize),
    /// Not at all.
    Nothing,
}

/// The ports that a session was opened with.
#[derive(Debug)]
pub struct OpenedPorts {
    /// Index of each in the source vector.
    pub sources: Vec<usize>,
    /// Kind of each.
    pub kinds: Vec<PortKind>,
    /// Response of each.
    pub answers: Vec<PortResponse>,
    /// The model with the inputs among its members; `None` without inputs.
    pub system: Option<Arc<System>>,
}

impl OpenedPorts {
    /// Finds ports by name; no names: every electrical one.
    ///
    /// # Errors
    /// [`ReadoutError::UnknownPort`], [`ReadoutError::BadPort`] for a port that cannot be.
    pub fn find(compiled: &CompiledModel, names: &[String]) -> Result<Self, ReadoutError> {
        let system = &compiled.parts.system;
        let electrics = &system.electrics;
        let known: HashMap<&str, usize> =
            electrics.names[..electrics.ports].iter().enumerate().map(|(k, name)| (name.as_str(), k)).collect();
        let mut found = Self { sources: Vec::new(), kinds: Vec::new(), answers: Vec::new(), system: None };
        if names.is_empty() {
            found.sources = (0..electrics.ports).collect();
            found.kinds = vec![PortKind::Electrical; electrics.ports];
            found.answers = vec![PortResponse::Current; electrics.ports];
            return Ok(found);
        }
        let own = electrics.inputs.len();
        let (mut inputs, mut given) = (electrics.inputs.clone(), HashSet::new());
        for name in names {
            bimorph_base::budget::check();
            if !given.insert(name.as_str()) {
                return Err(ReadoutError::BadPort {
                    expected: "each port once: it has one voltage".into(),
                    got: format!("\"{name}\" twice"),
                });
            }
            let (source, kind, answer) = match known.get(name.as_str()) {
                Some(&source) => (source, PortKind::Electrical, PortResponse::Current),
                None if let Some(source) = system.anchor_source(name) => of_anchor(system, source),
                None => {
                    let (input, kind, answer) = offered(compiled, name)?;
                    inputs.push(input);
                    (electrics.voltages() + inputs.len() - 1, kind, answer)
                }
            };
            found.sources.push(source);
            found.kinds.push(kind);
            found.answers.push(answer);
        }
        if inputs.len() > own {
            found.system =
                Some(Arc::new(System { electrics: Arc::new(electrics.with_inputs(inputs)), ..system.clone() }));
        }
        Ok(found)
    }

    /// How many they are.
    pub fn len(&self) -> usize {
        self.sources.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Joint coordinates of the model with the inputs.
    pub fn joints(&self, joints: &Arc<Joints>) -> Arc<Joints> {
        match &self.system {
            None => Arc::clone(joints),
            Some(system) => {
                let closures = System { electrics: Arc::clone(&system.electrics), ..joints.closures.clone() };
                Arc::new(Joints { closures, ..Joints::clone(joints) })
            }
        }
    }
}

/// The port of the motion of an anchor.
fn of_anchor(system: &System, source: usize) -> (usize, PortKind, PortResponse) {
    let (anchor, direction) = system.anchor_input(source).unwrap_or_default();
    let kind = if direction == 2 { PortKind::Rotation } else { PortKind::Displacement };
    (source, kind, PortResponse::Motion(Signal::AnchorForce(anchor, direction)))
}

/// Checks that each range of the options is that of a port: of one of `opened`, or of another one of the model, which a session holds at 0.
/// Case counts where two ports differ by it alone.
///
/// # Errors
/// [`ReadoutError::BadRange`]: a range of no port, or two of one port.
pub fn check_ranges(compiled: &CompiledModel, opened: &[String]) -> Result<(), ReadoutError> {
    let Some(ranges) = &compiled.options.ranges else { return Ok(()) };
    let electrics = &compiled.parts.system.electrics;
    let own = &electrics.names[..electrics.ports];
    let mut found: Vec<&str> = Vec::new();
    for (name, [low, high]) in ranges.all() {
        let known = || opened.iter().chain(own).map(String::as_str);
        let listed = known().find(|port| port == name).or_else(|| known().find(|port| port.eq_ignore_ascii_case(name)));
        let port = match listed {
            Some(port) => port,
            None if OpenedPorts::find(compiled, std::slice::from_ref(name)).is_ok() => name,
            None => {
                let mut seen = HashSet::new();
                let names: Vec<&str> = known().filter(|name| seen.insert(*name)).collect();
                let names = if names.is_empty() { "it has no electrical one".to_owned() } else { names.join(", ") };
                return Err(ReadoutError::BadRange {
                    expected: format!(
                        "the name of a port of this model ({names}; NODE.x|y|rz, NODE.vx|vy|vrz, BEAM.T, frame.ax|ay)"
                    ),
                    got: format!("\"{name}:{low:e}:{high:e}\""),
                });
            }
        };
        if found.contains(&port) {
            let (expected, got) = ("one range for each port".into(), format!("two of \"{port}\""));
            return Err(ReadoutError::BadRange { expected, got });
        }
        found.push(port);
    }
    Ok(())
}

/// The port that a node, a beam or the frame offers under this name.
fn offered(compiled: &CompiledModel, name: &str) -> Result<(Input, PortKind, PortResponse), ReadoutError> {
    let inertial = |input, kind| Ok((input, kind, PortResponse::Nothing));
    match name {
        "frame.ax" => return inertial(Input::Acceleration { axis: 0 }, PortKind::Acceleration),
        "frame.ay" => return inertial(Input::Acceleration { axis: 1 }, PortKind::Acceleration),
        "frame.wz" if compiled.joints.is_some() => {
            return Err(ReadoutError::BadPort {
                expected: "formulation=compliant, in which a frame may turn".into(),
                got: format!("\"{name}\" with formulation={}", compiled.options.formulation.name()),
            });
        }
        "frame.wz" => return inertial(Input::Rate, PortKind::Rate),
        _ => {}
    }
    let refused = |expected: &str, got: &str| {
        Err(ReadoutError::BadPort { expected: expected.into(), got: format!("\"{name}\", {got}") })
    };
    match Signal::find(compiled, name) {
        Ok(signal @ (Signal::Displacement(point, direction) | Signal::Rate(point, direction))) => {
            if !movable(&compiled.parts.system, point, direction) {
                return refused("a node and a direction that can move", "which is held");
            }
            let kind = match (signal, direction) {
                (Signal::Displacement(..), 2) => PortKind::Moment,
                (Signal::Displacement(..), _) => PortKind::Force,
                (_, 2) => PortKind::MomentRate,
                _ => PortKind::ForceRate,
            };
            Ok((Input::Force { point, direction }, kind, PortResponse::Motion(signal)))
        }
        Ok(Signal::Temperature(heater)) => Ok((Input::Heat { heater }, PortKind::Thermal, PortResponse::Rise(heater))),
        Ok(Signal::Prescribed(_)) => refused(
            "a beam that knows heat",
            "whose temperature is prescribed; draw it as beam2det to give it a thermal port",
        ),
        Ok(
            Signal::Stress(_)
            | Signal::Bearing(_)
            | Signal::Conductance(..)
            | Signal::Charge(_)
            | Signal::Distance(_)
            | Signal::Capacitance(_)
            | Signal::Pull(_)
            | Signal::AnchorForce(..),
        ) => refused("NODE.x|y|rz|vx|vy|vrz, BEAM.T or frame.ax|ay|wz", "which can be monitored but not driven"),
        Err(_) if is_anchor_motion(name) => {
            refused("the motion of an anchor with `moves=1`", "of which there is none at that node")
        }
        Err(_) => {
            let electrics = &compiled.parts.system.electrics;
            let available = electrics.names[..electrics.ports].to_vec();
            Err(ReadoutError::UnknownPort { name: name.into(), available })
        }
    }
}

/// Whether a force in that direction does anything.
fn movable(system: &System, point: MaterialPoint, direction: usize) -> bool {
    let BodyId::Free(k) = point.body else { return false };
    let Some(free) = &system.model.bodies[k].free else { return true };
    let mut wrench = nalgebra::Vector3::zeros();
    wrench[direction] = 1.0;
    if direction < 2 {
        wrench.z = if direction == 0 { -point.arm.y } else { point.arm.x };
    }
    (**free * wrench).amax() > 0.0
}
