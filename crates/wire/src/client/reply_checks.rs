//! Replies of a server are checked once, on receipt: a server may be of another version, faulty, or hostile. Shapes,
//! kinds, order and numbers must be the requested ones, and no text controls a terminal.

use crate::proto;
use bimorph_base::Diagnostic;
use bimorph_device::{DeviceError, Mode, OpenRequest, Trial};
use proto::trial_reply::Status as WireStatus;

/// Longest text of a server that is shown (byte).
const LONGEST: usize = 64 << 10;
/// Shortest next step that a device may require, in units of the previous step (1).
const SHORTEST: f64 = 1e-12;

/// Text of a server: line breaks and tabs stay, other control characters are written out, and what is very long is cut.
pub(super) fn text(said: &str) -> String {
    let mut shown = String::with_capacity(said.len().min(LONGEST));
    for c in said.chars() {
        if shown.len() >= LONGEST {
            shown.push_str(" …");
            break;
        }
        if c.is_control() && !matches!(c, '\n' | '\t') || is_invisible(c) {
            shown.extend(c.escape_unicode());
        } else {
            shown.push(c);
        }
    }
    shown
}

/// Marks that turn the direction of a text or hide in it.
fn is_invisible(c: char) -> bool {
    matches!(c, '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2060}'..='\u{2069}' | '\u{feff}')
}

/// The error of a server, whose words control no terminal.
pub(super) fn fault(error: DeviceError) -> DeviceError {
    match error {
        DeviceError::UnknownPort { name, available } => {
            DeviceError::UnknownPort { name: text(&name), available: available.iter().map(|name| text(name)).collect() }
        }
        DeviceError::UnknownSignal { name, hint } => {
            DeviceError::UnknownSignal { name: text(&name), hint: text(&hint) }
        }
        DeviceError::BadRequest { what, expected, got } => {
            DeviceError::BadRequest { what, expected: text(&expected), got: text(&got) }
        }
        DeviceError::Remote { address, reason } => DeviceError::Remote { address, reason: text(&reason) },
        DeviceError::UnknownToken(_) | DeviceError::NotOpen => error,
    }
}

/// Warnings of a compilation, whose words control no terminal.
pub(super) fn warnings(reported: &[proto::Diagnostic]) -> Vec<Diagnostic> {
    reported
        .iter()
        .map(|reported| Diagnostic::warning(&text(&reported.code), text(&reported.message), &text(&reported.help)))
        .collect()
}

/// A name of a port, a node or a signal.
fn name(what: &str, name: &str) -> Result<(), String> {
    let bad = name.is_empty() || name.len() > 4096 || name.chars().any(|c| c.is_control() || is_invisible(c));
    if bad { Err(format!("{what}: expected a name, got \"{}\"", text(name))) } else { Ok(()) }
}

pub(super) fn length(what: &str, got: usize, expected: usize) -> Result<(), String> {
    if got == expected { Ok(()) } else { Err(format!("{what}: expected {expected} numbers, got {got}")) }
}

fn finite(what: &str, values: &[f64]) -> Result<(), String> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(at) => Err(format!("{what}[{at}]: expected a finite number, got {}", values[at])),
    }
}

fn numbers(what: &str, values: &[f64], expected: usize) -> Result<(), String> {
    length(what, values.len(), expected)?;
    finite(what, values)
}

/// Description of a compiled model.
pub(super) fn model(described: &proto::ModelDescription) -> Result<(), String> {
    name("id of the model", &described.id)?;
    described.ports.iter().try_for_each(|port| name("port", port))?;
    described.nodes.iter().try_for_each(|node| name("node", node))
}

/// Description of an opened device: the requested ports and signals, in their order.
pub(super) fn opened(request: &OpenRequest, device: &proto::DeviceDescription) -> Result<(), String> {
    if !request.ports.is_empty() && request.ports != device.ports {
        return Err(format!(
            "ports: expected the {} requested, got {} others",
            request.ports.len(),
            device.ports.len()
        ));
    }
    device.ports.iter().try_for_each(|port| name("port", port))?;
    if !device.port_kinds.is_empty() && device.port_kinds.len() != device.ports.len() {
        return Err(format!("port_kinds: expected {}, got {}", device.ports.len(), device.port_kinds.len()));
    }
    if !device.signals.iter().map(|signal| &signal.name).eq(&request.signals) {
        return Err(format!(
            "signals: expected the {} requested, got {} others",
            request.signals.len(),
            device.signals.len()
        ));
    }
    let unit = |signal: &proto::Signal| signal.unit.is_empty() || name("unit", &signal.unit).is_ok();
    if device.signals.iter().all(unit) { Ok(()) } else { Err("units: expected names".to_owned()) }
}

/// The reply to a trial of a device with so many ports and signals.
pub(super) fn trial(request: &Trial<'_>, (p, s): (usize, usize), reply: &proto::TrialReply) -> Result<(), String> {
    match WireStatus::try_from(reply.status) {
        Ok(WireStatus::Ok) => {}
        Ok(WireStatus::NeedDt) => {
            let within = request.mode == Mode::Transient && reply.need_dt > 0.0 && reply.need_dt < request.dt;
            let expected = || {
                format!(
                    "need_dt: expected less than the step of {:e} s and above 0, got {:e}",
                    request.dt, reply.need_dt
                )
            };
            return if within { Ok(()) } else { Err(expected()) };
        }
        // a failure has its reason alone, and the reader rejects unknown kinds
        _ => return Ok(()),
    }
    if reply.token == 0 {
        return Err("token: expected one, got 0".to_owned());
    }
    for (what, values, expected) in [
        ("currents", &reply.currents, p),
        ("charges", &reply.charges, p),
        ("di_dv", &reply.di_dv, p * p),
        ("dq_dv", &reply.dq_dv, p * p),
        ("outputs", &reply.outputs, s),
        ("doutputs_dv", &reply.doutputs_dv, p * s),
    ] {
        numbers(what, values, expected)?;
    }
    let shortest = if request.mode == Mode::Transient { SHORTEST * request.dt } else { 0.0 };
    if reply.dt_next > shortest {
        Ok(())
    } else {
        Err(format!("dt_next: expected a time above {shortest:e} s, got {:e}", reply.dt_next))
    }
}

/// A small-signal answer of a device with so many ports and signals.
pub(super) fn small_signal((p, s): (usize, usize), answer: &proto::SmallSignal) -> Result<(), String> {
    numbers("admittance_re", &answer.admittance_re, p * p)?;
    numbers("admittance_im", &answer.admittance_im, p * p)?;
    numbers("outputs_re", &answer.outputs_re, p * s)?;
    numbers("outputs_im", &answer.outputs_im, p * s)
}

/// Spectral densities and cross-spectra of what is answered; empty of a device that makes no noise.
pub(super) fn noise((p, s): (usize, usize), answer: &proto::SmallSignal) -> Result<(), String> {
    if answer.noise_re.is_empty() && answer.noise_im.is_empty() {
        return Ok(());
    }
    let answers = p + s;
    numbers("noise_re", &answer.noise_re, answers * answers)?;
    numbers("noise_im", &answer.noise_im, answers * answers)
}

fn named(what: &str, values: &[proto::Named]) -> Result<(), String> {
    values.iter().try_for_each(|named| {
        name(what, &named.name)?;
        finite(&format!("{what} {}", named.name), &[named.value])
    })
}

/// A static equilibrium.
pub(super) fn statics(reply: &proto::StaticResponse) -> Result<(), String> {
    nodes(&reply.nodes)?;
    named("temperatures_k", &reply.temperatures_k)?;
    named("stresses_pa", &reply.stresses_pa)?;
    named("nominal_stresses_pa", &reply.nominal_stresses_pa)?;
    reply.anchor_forces.iter().try_for_each(|force| {
        name("anchor_forces", &force.name)?;
        finite(&format!("anchor_forces {}", force.name), &[force.fx, force.fy, force.m])
    })?;
    named("peak_temperatures_k", &reply.peak_temperatures_k)?;
    named("currents_a", &reply.currents_a)?;
    named("charges_c", &reply.charges_c)?;
    named("permanent_strains", &reply.permanent_strains)
}

/// Displacements of nodes.
fn nodes(nodes: &[proto::NodeMotion]) -> Result<(), String> {
    nodes.iter().try_for_each(|node| {
        name("node", &node.name)?;
        finite(&node.name, &[node.x, node.y, node.rz])
    })
}

/// An equilibrium path: a value of each signal and a number of eigenvalues at each point, and critical points among the points.
pub(super) fn path(signals: &[String], reply: &proto::PathResponse) -> Result<(), String> {
    let count = reply.values.len();
    finite("values", &reply.values)?;
    length("negative", reply.negative.len(), count)?;
    if !signals.is_empty() && !reply.signals.iter().map(|signal| &signal.name).eq(signals) {
        return Err(format!("signals: expected the {} requested, got {} others", signals.len(), reply.signals.len()));
    }
    for signal in &reply.signals {
        name("signal", &signal.name)?;
        numbers(&signal.name, &signal.values, count)?;
    }
    for (what, points) in [("limit_points", &reply.limit_points), ("bifurcations", &reply.bifurcations)] {
        for critical in points {
            finite(what, &[critical.value])?;
            if critical.point >= count as u64 {
                return Err(format!("{what}: expected one of the {count} points, got {}", critical.point));
            }
        }
    }
    nodes(&reply.last)
}

/// Modes: frequencies in their order, and a shape of each over all nodes.
pub(super) fn modes(reply: &proto::ModesResponse) -> Result<(), String> {
    reply.nodes.iter().try_for_each(|node| name("node", node))?;
    let (count, nodes) = (reply.frequencies_hz.len(), reply.nodes.len());
    finite("frequencies_hz", &reply.frequencies_hz)?;
    if reply.frequencies_hz.iter().any(|frequency| *frequency < 0.0) || !reply.frequencies_hz.is_sorted() {
        return Err("frequencies_hz: expected frequencies from the lowest one on".to_owned());
    }
    length("shapes", reply.shapes.len(), count)?;
    for shape in &reply.shapes {
        for (what, values) in [("x", &shape.x), ("y", &shape.y), ("rz", &shape.rz)] {
            numbers(what, values, nodes)?;
        }
    }
    Ok(())
}

/// A frequency response: a value of each signal at each frequency.
pub(super) fn response(signals: &[String], reply: &proto::FrequencyResponseReply) -> Result<(), String> {
    let count = reply.frequencies_hz.len();
    finite("frequencies_hz", &reply.frequencies_hz)?;
    // without signals it is what the driven place answers
    if !signals.is_empty() && !reply.signals.iter().map(|signal| &signal.name).eq(signals) {
        return Err(format!("signals: expected the {} requested, got {} others", signals.len(), reply.signals.len()));
    }
    for signal in &reply.signals {
        length(&signal.name, signal.re.len(), count)?;
        length(&signal.name, signal.im.len(), count)?;
    }
    Ok(())
}

/// A model for other simulators: names of pins, and a quality of each mode. Its text is not for terminals and stays as it is.
pub(super) fn export(reply: &proto::ExportResponse) -> Result<(), String> {
    name("name", &reply.name)?;
    reply.pins.iter().try_for_each(|pin| name("pin", pin))?;
    match &reply.content {
        Some(proto::export_response::Content::Linear(linear)) => {
            let count = linear.frequencies_hz.len();
            finite("frequencies_hz", &linear.frequencies_hz)?;
            length("quality", linear.quality.len(), count)?;
            length("numbers", linear.numbers.len(), count)?;
            finite("band", &[linear.from_hz, linear.to_hz])
        }
        Some(proto::export_response::Content::Nonlinear(_)) => Ok(()),
        Some(proto::export_response::Content::Reduced(reduced)) => {
            reduced.ranges.iter().try_for_each(|range| finite("ranges", &[range.low, range.high]))
        }
        None => Err("content: expected a linear or a nonlinear model".to_owned()),
    }
}

/// Samples that follow those until `last` (s): a value of each signal at each time.
pub(super) fn samples(last: f64, signals: usize, samples: &proto::Samples) -> Result<(), String> {
    finite("t", &samples.t)?;
    if samples.t.first().is_some_and(|first| *first < last) || !samples.t.is_sorted() {
        return Err("t: expected times in their order".to_owned());
    }
    length("signals", samples.signals.len(), signals)?;
    samples.signals.iter().try_for_each(|column| numbers("signal", &column.values, samples.t.len()))
}

#[cfg(test)]
mod tests {
    //! Requested replies pass, and all others are named in an error.
    use super::*;

    const STEP: Trial<'_> = Trial { mode: Mode::Transient, parent: None, t: 1e-6, dt: 1e-6, voltages: &[0.0, 0.0] };

    fn good() -> proto::TrialReply {
        proto::TrialReply {
            status: WireStatus::Ok.into(),
            token: 7,
            currents: vec![0.0; 2],
            charges: vec![0.0; 2],
            di_dv: vec![0.0; 4],
            dq_dv: vec![0.0; 4],
            outputs: vec![0.0],
            doutputs_dv: vec![0.0; 2],
            dt_next: f64::INFINITY,
            ..Default::default()
        }
    }

    #[test]
    fn replies_of_other_shapes_are_named() {
        let said = |change: fn(&mut proto::TrialReply)| {
            let mut reply = good();
            change(&mut reply);
            trial(&STEP, (2, 1), &reply).err().unwrap_or_default()
        };
        assert_eq!(said(|_| {}), "");
        let need = |reply: &mut proto::TrialReply, dt| (reply.status, reply.need_dt) = (WireStatus::NeedDt.into(), dt);
        for (begins, found) in [
            ("currents: expected 2 numbers, got 0", said(|r| r.currents.clear())),
            ("di_dv: expected 4 numbers, got 5", said(|r| r.di_dv.push(0.0))),
            ("charges[1]: expected a finite number, got NaN", said(|r| r.charges[1] = f64::NAN)),
            ("outputs[0]: expected a finite number, got inf", said(|r| r.outputs[0] = f64::INFINITY)),
            ("token", said(|r| r.token = 0)),
            ("dt_next", said(|r| r.dt_next = f64::NAN)),
            ("dt_next", said(|r| r.dt_next = 0.0)),
            ("dt_next", said(|r| r.dt_next = 1e-300)),
            ("need_dt", {
                let mut r = good();
                need(&mut r, f64::NAN);
                trial(&STEP, (2, 1), &r).expect_err("no time")
            }),
            ("need_dt", {
                let mut r = good();
                need(&mut r, 1e-6);
                trial(&STEP, (2, 1), &r).expect_err("no less")
            }),
        ] {
            assert!(found.starts_with(begins), "{begins}: {found}");
        }
    }

    #[test]
    fn text_controls_no_terminal() {
        assert_eq!(text("\u{1b}]0;x\u{7}a\nb\tc\u{202e}d"), "\\u{1b}]0;x\\u{7}a\nb\tc\\u{202e}d");
        assert!(text(&"x".repeat(1 << 20)).len() < LONGEST + 8);
        assert!(
            model(&proto::ModelDescription { id: "0".into(), ports: vec!["\u{1b}[2J".into()], ..Default::default() })
                .is_err()
        );
    }
}
