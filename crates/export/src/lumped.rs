//! A mechanism of rigid parts in pure translation, with its nonlinear forces: the model that [`super::spice`] and
//! [`super::verilog_a`] write with `--nonlinear`.
//!
//! Where every part moves along fixed directions and springs are linear in that, the whole model is
//! ```text
//! M·ẍ + C·ẋ + K·x = f₀ + Σ_g n_g·(½·V_g²·C_g′(u_g) − P_g(u_g)) + Σ_q b_q·f_q − M·a        u_g = n_gᵀ·x
//! Q_g = C_g(u_g)·V_g,      V_g = Σ rows·voltages,      i = G·voltages + Σ rows·dQ_g/dt
//! ```
//! with the gap functions C_g of [`bimorph_domains::capacitor`] and what bears where parts touch, P_g of [`bimorph_domains::contact`] and
//! [`bimorph_domains::stop`]. Nothing is linearised, and no operating point is needed.

mod model;
mod sliding;

use super::ExportError;
use super::ExportRequest;
use super::linear::{ReducedPort, SignalShown};
use super::mechanism::{port_names, refuse_driven};
use bimorph_analysis::readout::expression::Quantity;
use bimorph_analysis::readout::ports::{OpenedPorts, PortResponse};
use bimorph_analysis::readout::signal::Signal;
use bimorph_device::PortKind;
use bimorph_device::scale::PortScale;
use bimorph_device::surroundings;
use bimorph_domains::capacitor::Capacitor;
use bimorph_domains::drive::Electrics;
use bimorph_domains::{Domain, Input, Member, PointLaw, System};
use bimorph_model::compile::CompiledModel;
pub use model::{Coordinate, Law, LumpedGap, LumpedModel, LumpedOutput};
use nalgebra::{DMatrix, DVector};
use sliding::{FREE_RATE, along, axis, coordinates, dampers, springs};

/// Part of a motion across the fingers of a comb that is rounding of its direction (1).
const ALONG: f64 = 1e-9;

/// The lumped model of a request; its operating point, modes and errors are not used.
///
/// # Errors
/// [`ExportError::NotLumped`] where a part can turn, a spring is not linear, or something heats.
pub fn lump(compiled: &CompiledModel, request: &ExportRequest) -> Result<LumpedModel, ExportError> {
    let (names, across): (Vec<_>, Vec<_>) = port_names(compiled, request)?.into_iter().unzip();
    let ports = OpenedPorts::find(compiled, &names)?;
    let system = ports.system.as_deref().unwrap_or(&compiled.parts.system);
    let electrics = &system.electrics;
    if let Some(k) = ports.kinds.iter().position(|kind| *kind == PortKind::Rate) {
        return Err(ExportError::Turning { port: names[k].clone() });
    }
    refuse_driven(compiled)?;
    if !electrics.heating.heaters.is_empty() {
        let beam = &compiled.structure.beams[compiled.parts.heaters[0]].name;
        return Err(ExportError::NotLumped { why: format!("beam \"{beam}\" heats") });
    }
    let mut coordinates = coordinates(system)?;
    let (stiffness, force) = springs(system, &coordinates)?;
    for (k, c) in coordinates.iter_mut().enumerate() {
        let omega = (stiffness[(k, k)] / c.mass).sqrt();
        c.omega = if omega.is_finite() && omega > 0.0 { omega } else { FREE_RATE };
    }
    let damping = dampers(system, &coordinates);
    let mut load = -force;
    for dead in &system.loads {
        load += along(&coordinates, &dead.point, dead.force);
    }
    let push = pushes(electrics, &ports, &coordinates);
    let gaps = gaps(compiled, system, &ports, &coordinates)?;
    let (mut rows, mut signals) = (Vec::new(), Vec::new());
    for (answer, &source) in ports.answers.iter().zip(&ports.sources) {
        rows.push(match answer {
            PortResponse::Current => {
                let (row, constant) = by_port(electrics, &ports, &|s| electrics.conductance[(source, s)]);
                LumpedOutput::Current(row, constant)
            }
            PortResponse::Motion(signal) => reading(signal, &coordinates, &gaps)?,
            PortResponse::Rise(_) | PortResponse::Nothing => LumpedOutput::Nothing,
        });
    }
    for (name, scale) in &request.signals {
        let signal = Signal::find(compiled, name)?;
        rows.push(reading(&signal, &coordinates, &gaps)?);
        signals.push(SignalShown { name: name.clone(), unit: signal.unit(), scale: *scale });
    }
    let scaled: Vec<PortScale> =
        ports.kinds.iter().zip(&across).map(|(kind, across)| PortScale::new(*kind, *across)).collect();
    let port = |k: usize| {
        let (kind, scale) = (ports.kinds[k], scaled[k]);
        let across = if kind.given_flow() { scale.answered } else { 1.0 / scale.given };
        ReducedPort { name: names[k].clone(), kind, across, bias: None }
    };
    Ok(LumpedModel {
        ports: (0..names.len()).map(port).collect(),
        scales: scaled.iter().map(|s| s.answered).chain(signals.iter().map(|s| s.scale)).collect(),
        given: scaled.iter().map(|s| s.given).collect(),
        signals,
        temperature: surroundings(compiled),
        coordinates,
        damping,
        stiffness,
        load,
        push,
        gaps,
        rows,
    })
}

/// Force per unit of what is given to each port, coordinates × ports (N per N, kg).
fn pushes(electrics: &Electrics, ports: &OpenedPorts, coordinates: &[Coordinate]) -> DMatrix<f64> {
    let n = coordinates.len();
    let mut push = DMatrix::zeros(n, ports.sources.len());
    for (q, &source) in ports.sources.iter().enumerate() {
        let column = match source.checked_sub(electrics.voltages()).map(|k| electrics.inputs[k]) {
            Some(Input::Force { point, direction }) => along(coordinates, &point, axis(direction)),
            Some(Input::Acceleration { axis: a }) => {
                DVector::from_iterator(n, coordinates.iter().map(|c| -c.mass * c.direction[a]))
            }
            _ => continue,
        };
        push.set_column(q, &column);
    }
    push
}

/// A linear function of the sources, over the ports; and what the netlist's own sources make of it.
fn by_port(electrics: &Electrics, ports: &OpenedPorts, row: &dyn Fn(usize) -> f64) -> (DVector<f64>, f64) {
    let fixed: f64 = electrics.fixed.iter().enumerate().map(|(k, v)| row(electrics.ports + k) * v).sum();
    (DVector::from_iterator(ports.sources.len(), ports.sources.iter().map(|&s| row(s))), fixed)
}

/// The first gap with an electrode that floats.
pub(super) fn floating_gap<'a>(compiled: &'a CompiledModel, system: &System) -> Option<&'a str> {
    let group = system.electrics.floating.groups().first()?;
    compiled.parts.gap_names.get(group.gaps.first()?.gap).map(String::as_str)
}

/// Every gap of the mechanism.
fn gaps(
    compiled: &CompiledModel,
    system: &System,
    ports: &OpenedPorts,
    coordinates: &[Coordinate],
) -> Result<Vec<LumpedGap>, ExportError> {
    let electrics = &system.electrics;
    if let Some(gap) = floating_gap(compiled, system) {
        let why = format!("an electrode of \"{gap}\" floats, which joins gaps (tie it to a port, a source or ground)");
        return Err(ExportError::NotLumped { why });
    }
    // what acts without sides comes after all gaps; where it adds no force, its damping is among that of the parts
    let acts = |(_, gap): &(usize, &Member)| gap.is_gap() || gap.is_active(1.0) && !gap.is_gas();
    let mut films: Vec<_> = system.members.iter().filter_map(Domain::film).collect();
    let mut found = Vec::new();
    for (g, gap) in system.members.iter().enumerate().filter(acts) {
        let laws = gap.laws();
        // parts that slide do not turn: a spring about z has no force
        if laws.is_empty() && gap.is_gap() {
            let why = match compiled.parts.gap_names.get(g) {
                Some(name) => format!("gap \"{name}\" lies along beams"),
                None => "a force acts on it that is neither that of a field nor of a stop".to_owned(),
            };
            return Err(ExportError::NotLumped { why });
        }
        if let Some((across, _)) = gap.side_room()
            && (along(coordinates, &across.a, across.axis) - along(coordinates, &across.b, across.axis)).amax() > ALONG
        {
            let comb = &compiled.parts.gap_names[g];
            let why = format!("the fingers of \"{comb}\" can move across their gaps (hold the part with a `guide2d`)");
            return Err(ExportError::NotLumped { why });
        }
        if gap.slides() {
            let why = "friction acts across a stop (leave out `friction`)".to_owned();
            return Err(ExportError::NotLumped { why });
        }
        for (approach, law) in laws {
            let (by_port, constant) = by_port(electrics, ports, &|s| electrics.gap_rows[(g, s)]);
            let name = compiled.parts.gap_names.get(g).map_or("of a nonlinear spring", String::as_str).to_owned();
            let along = along(coordinates, &approach.a, approach.axis) - along(coordinates, &approach.b, approach.axis);
            // fingers that cannot move aside do not touch
            let loss = gap.loss().filter(|_| gap.side_room().is_none()).map_or(0.0, |loss| loss.coefficient());
            let own = films.iter().position(|(of, ..)| **of == approach);
            let film = own.map(|k| films.remove(k)).map(|(_, drawn, film)| (drawn, film));
            found.push(LumpedGap { name, along, law, loss, film, by_port, constant });
        }
    }
    if system.members.iter().any(|member| member.is_gas() && member.film().is_none()) {
        let why = "gas acts that compresses (use filmstates=0), or that slides between fingers".to_owned();
        return Err(ExportError::NotLumped { why });
    }
    let plain = |member: &Member| member.point_laws().iter().all(PointLaw::is_plain);
    if !system.members.iter().all(plain) {
        let why = "gas flows through holes or a slit, whose law is not written (leave out the gas)".to_owned();
        return Err(ExportError::NotLumped { why });
    }
    Ok(found)
}

/// The output expression of a signal.
fn reading(signal: &Signal, coordinates: &[Coordinate], gaps: &[LumpedGap]) -> Result<LumpedOutput, ExportError> {
    match *signal {
        Signal::Displacement(_, 2) | Signal::Rate(_, 2) => Ok(LumpedOutput::Constant(0.0)),
        Signal::Displacement(point, d) => Ok(LumpedOutput::Place(along(coordinates, &point, axis(d)))),
        Signal::Rate(point, d) => Ok(LumpedOutput::Rate(along(coordinates, &point, axis(d)))),
        Signal::Prescribed(t) => Ok(LumpedOutput::Constant(t)),
        Signal::Charge(g) => Ok(LumpedOutput::Charge(g)),
        Signal::Capacitance(g) => Ok(LumpedOutput::Capacitance(g)),
        Signal::Pull(g) => Ok(LumpedOutput::Pull(g)),
        Signal::Distance(g) => match gaps[g].law {
            Law::Field(capacitor @ Capacitor::Comb { .. }, _) => {
                Ok(LumpedOutput::Distance(g, capacitor.distance(0.0), 1.0))
            }
            Law::Field(capacitor, _) => Ok(LumpedOutput::Distance(g, capacitor.distance(0.0), -1.0)),
            Law::Stop(..) => Ok(LumpedOutput::Way(g)),
            Law::Spring(_) | Law::Comb(_) | Law::Across => Ok(LumpedOutput::Nothing),
        },
        Signal::Bearing(g) => Ok(LumpedOutput::Bearing(g)),
        Signal::Conductance(g, metals) => Ok(LumpedOutput::Conductance(g, metals)),
        Signal::Stress(_) => Err(ExportError::NotLumped { why: "the stress of a beam has a corner".to_owned() }),
        // of beams that heat and of driven anchors, which have been refused
        Signal::AnchorForce(..) | Signal::Temperature(_) => Ok(LumpedOutput::Nothing),
    }
}
