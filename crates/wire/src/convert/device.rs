//! Trials, replies and the errors of a device. Buffers are refilled in place: this runs once per Newton iteration.

use crate::proto;
use bimorph_device::{
    Agitation, Description, DeviceError, Mode, OpenRequest, PortInfo, PortKind, SignalInfo, SmallSignal, Status, Token,
    Trial, TrialReply,
};
use proto::fault::Kind as FaultKind;
use proto::trial_reply::Status as WireStatus;

/// A description as it travels.
pub fn description_to_wire(description: &Description) -> proto::DeviceDescription {
    let signal = |s: &SignalInfo| proto::Signal { name: s.name.clone(), unit: s.unit.clone() };
    proto::DeviceDescription {
        ports: description.ports.iter().map(|port| port.name.clone()).collect(),
        signals: description.signals.iter().map(signal).collect(),
        unknowns: description.unknowns as u64,
        port_kinds: description.ports.iter().map(|port| kind_to_wire(port.kind).into()).collect(),
    }
}

/// A description back.
pub fn description_from_wire(description: proto::DeviceDescription) -> Description {
    let signal = |s: proto::Signal| SignalInfo { name: s.name, unit: s.unit };
    Description {
        // a server from before there were kinds has electrical ports alone
        ports: (description.ports.into_iter())
            .zip(description.port_kinds.into_iter().map(kind_from_wire).chain(std::iter::repeat(PortKind::Electrical)))
            .map(|(name, kind)| PortInfo { name, kind })
            .collect(),
        signals: description.signals.into_iter().map(signal).collect(),
        unknowns: usize::try_from(description.unknowns).unwrap_or(usize::MAX),
    }
}

fn kind_to_wire(kind: PortKind) -> proto::PortKind {
    match kind {
        PortKind::Electrical => proto::PortKind::Electrical,
        PortKind::Force => proto::PortKind::Force,
        PortKind::Moment => proto::PortKind::Moment,
        PortKind::ForceRate => proto::PortKind::ForceRate,
        PortKind::MomentRate => proto::PortKind::MomentRate,
        PortKind::Thermal => proto::PortKind::Thermal,
        PortKind::Acceleration => proto::PortKind::Acceleration,
        PortKind::Rate => proto::PortKind::Rate,
        PortKind::Displacement => proto::PortKind::Displacement,
        PortKind::Rotation => proto::PortKind::Rotation,
    }
}

fn kind_from_wire(kind: i32) -> PortKind {
    PortKind::ALL.into_iter().find(|&known| i32::from(kind_to_wire(known)) == kind).unwrap_or_default()
}

/// A trial as it travels.
pub fn trial_to_wire(trial: &Trial<'_>) -> proto::TrialRequest {
    let mode = match trial.mode {
        Mode::Static => proto::Mode::Static,
        Mode::Transient => proto::Mode::Transient,
    };
    proto::TrialRequest {
        mode: mode.into(),
        parent: trial.parent.map_or(0, |token| token.0),
        t: trial.t,
        dt: trial.dt,
        voltages: trial.voltages.to_vec(),
    }
}

/// A trial that borrows its voltages from the message. The device itself checks lengths and values.
///
/// # Errors
/// An unknown mode.
pub fn trial_from_wire(request: &proto::TrialRequest) -> Result<Trial<'_>, DeviceError> {
    let mode = match proto::Mode::try_from(request.mode) {
        Ok(proto::Mode::Static) => Mode::Static,
        Ok(proto::Mode::Transient) => Mode::Transient,
        _ => {
            let (expected, got) = ("MODE_STATIC or MODE_TRANSIENT".to_owned(), request.mode.to_string());
            return Err(DeviceError::BadRequest { what: "mode", expected, got });
        }
    };
    let parent = (request.parent != 0).then_some(Token(request.parent));
    Ok(Trial { mode, parent, t: request.t, dt: request.dt, voltages: &request.voltages })
}

/// Moves a reply out for sending; its vectors travel, the rest stays.
pub fn reply_to_wire(reply: &mut TrialReply) -> proto::TrialReply {
    let (status, need_dt, reason) = match std::mem::take(&mut reply.status) {
        Status::Ok => (WireStatus::Ok, 0.0, String::new()),
        Status::NeedDt(dt) => (WireStatus::NeedDt, dt, String::new()),
        Status::Fail(reason) => (WireStatus::Fail, 0.0, reason),
    };
    proto::TrialReply {
        status: status.into(),
        token: reply.token.map_or(0, |token| token.0),
        currents: std::mem::take(&mut reply.currents),
        charges: std::mem::take(&mut reply.charges),
        di_dv: std::mem::take(&mut reply.di_dv),
        dq_dv: std::mem::take(&mut reply.dq_dv),
        outputs: std::mem::take(&mut reply.outputs),
        doutputs_dv: std::mem::take(&mut reply.doutputs_dv),
        dt_next: reply.dt_next,
        jumped: reply.jumped,
        need_dt,
        reason,
    }
}

/// Fills `reply` from a message.
///
/// # Errors
/// A status this client does not know: the server is newer.
pub fn reply_from_wire(wire: proto::TrialReply, reply: &mut TrialReply) -> Result<(), String> {
    reply.status = match WireStatus::try_from(wire.status) {
        Ok(WireStatus::Ok) => Status::Ok,
        Ok(WireStatus::NeedDt) => Status::NeedDt(wire.need_dt),
        Ok(WireStatus::Fail) => Status::Fail(wire.reason),
        _ => return Err(format!("trial status {} is not known to this client", wire.status)),
    };
    reply.token = (wire.token != 0).then_some(Token(wire.token));
    reply.currents = wire.currents;
    reply.charges = wire.charges;
    reply.di_dv = wire.di_dv;
    reply.dq_dv = wire.dq_dv;
    reply.outputs = wire.outputs;
    reply.doutputs_dv = wire.doutputs_dv;
    reply.dt_next = wire.dt_next;
    reply.jumped = wire.jumped;
    Ok(())
}

/// The request to open a device.
pub fn open_from_wire(wire: &proto::OpenRequest) -> OpenRequest {
    let noise = wire.noise.map(|noise| Agitation { seed: noise.seed, band: noise.band_hz });
    OpenRequest { ports: wire.ports.clone(), signals: wire.signals.clone(), noise }
}

/// A small-signal answer as it travels.
pub fn small_signal_to_wire(answer: &SmallSignal) -> proto::SmallSignal {
    let part = |values: &[[f64; 2]], k: usize| values.iter().map(|z| z[k]).collect();
    proto::SmallSignal {
        admittance_re: part(&answer.admittance, 0),
        admittance_im: part(&answer.admittance, 1),
        outputs_re: part(&answer.outputs, 0),
        outputs_im: part(&answer.outputs, 1),
        ..Default::default()
    }
}

/// Spectral densities as they travel.
pub fn noise_to_wire(noise: &[[f64; 2]]) -> proto::SmallSignal {
    let part = |k: usize| noise.iter().map(|z| z[k]).collect();
    proto::SmallSignal { noise_re: part(0), noise_im: part(1), ..Default::default() }
}

/// Fills `noise` from a message.
pub fn noise_from_wire(wire: &proto::SmallSignal, noise: &mut Vec<[f64; 2]>) {
    noise.clear();
    noise.extend(wire.noise_re.iter().zip(&wire.noise_im).map(|(&re, &im)| [re, im]));
}

/// Fills `answer` from a message.
pub fn small_signal_from_wire(wire: &proto::SmallSignal, answer: &mut SmallSignal) {
    let zip = |re: &[f64], im: &[f64]| re.iter().zip(im).map(|(&re, &im)| [re, im]).collect();
    answer.admittance = zip(&wire.admittance_re, &wire.admittance_im);
    answer.outputs = zip(&wire.outputs_re, &wire.outputs_im);
}

/// An error as it travels.
pub fn fault_to_wire(error: &DeviceError) -> proto::Fault {
    let kind = match error {
        DeviceError::UnknownPort { name, available } => FaultKind::UnknownPort(proto::UnknownName {
            name: name.clone(),
            available: available.clone(),
            hint: String::new(),
        }),
        DeviceError::UnknownSignal { name, hint } => FaultKind::UnknownSignal(proto::UnknownName {
            name: name.clone(),
            available: Vec::new(),
            hint: hint.clone(),
        }),
        DeviceError::UnknownToken(token) => FaultKind::UnknownToken(token.0),
        DeviceError::BadRequest { what, expected, got } => FaultKind::BadValue(proto::BadValue {
            what: (*what).to_owned(),
            expected: expected.clone(),
            got: got.clone(),
        }),
        DeviceError::NotOpen => FaultKind::NotOpen(proto::NotOpen {}),
        DeviceError::Remote { .. } => FaultKind::Refused(proto::Refused { code: tonic::Code::Unavailable as i32 }),
    };
    proto::Fault { kind: Some(kind), message: error.to_string() }
}

/// The error a fault stands for; what has no counterpart is the server's.
pub fn fault_from_wire(fault: proto::Fault, address: &str) -> DeviceError {
    match fault.kind {
        Some(FaultKind::UnknownPort(n)) => DeviceError::UnknownPort { name: n.name, available: n.available },
        Some(FaultKind::UnknownSignal(n)) => DeviceError::UnknownSignal { name: n.name, hint: n.hint },
        Some(FaultKind::UnknownToken(token)) => DeviceError::UnknownToken(Token(token)),
        Some(FaultKind::BadValue(v)) => {
            DeviceError::BadRequest { what: field_name(&v.what), expected: v.expected, got: v.got }
        }
        Some(FaultKind::NotOpen(_)) => DeviceError::NotOpen,
        Some(FaultKind::Refused(_)) | None => {
            DeviceError::Remote { address: address.to_owned(), reason: fault.message }
        }
    }
}

/// The error's field names are static in process; those known are restored, others keep their place in the text.
fn field_name(what: &str) -> &'static str {
    ["voltages", "dt", "t", "mode", "omega", "ports", "signals", "ranges", "parent"]
        .into_iter()
        .find(|name| *name == what)
        .unwrap_or("request")
}

#[cfg(test)]
mod tests {
    //! A reply keeps every bit over the wire, and an error comes back as the same error.
    use super::*;
    use prost::Message;

    #[test]
    fn replies_keep_their_bits() {
        let odd = [f64::MIN_POSITIVE / 4.0, -0.0, f64::INFINITY, 0.1 + 0.2, f64::from_bits(0x7ff8_0000_0000_1234)];
        let reply = TrialReply {
            token: Some(Token((1 << 53) - 1)),
            status: Status::Ok,
            currents: odd.to_vec(),
            charges: vec![1e-300],
            di_dv: vec![1.0, 2.0],
            dq_dv: vec![],
            outputs: vec![3.0],
            doutputs_dv: vec![-4.0],
            dt_next: f64::INFINITY,
            jumped: true,
        };
        let bytes = reply_to_wire(&mut reply.clone()).encode_to_vec();
        let mut back = TrialReply::default();
        let wire = proto::TrialReply::decode(bytes.as_slice()).expect("our own bytes");
        reply_from_wire(wire, &mut back).expect("a known status");
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&back.currents), bits(&odd));
        back.currents.clone_from(&reply.currents);
        assert_eq!(format!("{back:?}"), format!("{reply:?}"));
    }

    #[test]
    fn errors_come_back_as_themselves() {
        for error in [
            DeviceError::UnknownPort { name: "x".into(), available: vec!["a".into(), "b".into()] },
            DeviceError::UnknownSignal { name: "b.q".into(), hint: "try b.x".into() },
            DeviceError::UnknownToken(Token(7)),
            DeviceError::BadRequest { what: "voltages", expected: "2".into(), got: "3".into() },
            DeviceError::NotOpen,
        ] {
            assert_eq!(fault_from_wire(fault_to_wire(&error), "here"), error);
        }
    }
}
