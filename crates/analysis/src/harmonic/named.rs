//! Inputs and outputs by name.

use crate::AnalysisError;
use crate::readout::ReadoutError;
use crate::readout::expression::{Expression, Quantity};
use crate::readout::ports::{OpenedPorts, PortResponse};
use crate::readout::signal::{ANCHOR_FORCES, Signal};
use bimorph_model::compile::CompiledModel;

/// Output of a response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ResponseRow {
    /// A signal.
    Signal(Signal),
    /// Current into a port.
    Current(usize),
}

/// Forces by the direction in which they act.
const FORCES: [(&str, &str); 3] = [("fx", "x"), ("fy", "y"), ("m", "rz")];

/// The name that a port has for a drive: `NODE.fx` acts on `NODE.x`.
fn port_name(compiled: &CompiledModel, drive: &str) -> String {
    if compiled.structure.port(drive).is_some() {
        return drive.to_owned();
    }
    let force = drive.rsplit_once('.').and_then(|(part, quantity)| {
        let (_, motion) = FORCES.iter().find(|(force, _)| *force == quantity)?;
        Some(format!("{part}.{motion}"))
    });
    force.unwrap_or_else(|| drive.to_owned())
}

/// The drive as the only port of the model.
///
/// # Errors
/// [`AnalysisError::BadRequest`] with what would be understood.
pub(crate) fn drive_port(compiled: &CompiledModel, drive: &str) -> Result<OpenedPorts, AnalysisError> {
    let refused = |detail: String| AnalysisError::BadRequest { what: format!("drive \"{drive}\""), detail };
    OpenedPorts::find(compiled, &[port_name(compiled, drive)]).map_err(|error| match error {
        ReadoutError::UnknownPort { available, .. } => {
            let ports = match available.as_slice() {
                [] => "the netlist has no ports".to_owned(),
                _ => format!("ports are {}", available.join(", ")),
            };
            let detail = match Signal::find(compiled, &port_name(compiled, drive)) {
                Err(ReadoutError::UnknownSignal { hint, .. }) => hint,
                _ => String::new(),
            };
            refused(format!(
                "expected NODE.fx, NODE.fy or NODE.m (a force or moment), NODE.ux, .uy or .urz (a driven anchor), a port, BEAM.T (heat) or frame.ax|ay|wz; {ports}; \
                 {detail}"
            ))
        }
        ReadoutError::BadPort { expected, got } => refused(format!("expected {expected}, got {got}")),
        other @ (ReadoutError::UnknownSignal { .. }
        | ReadoutError::BadExpression { .. }
        | ReadoutError::BadRange { .. }) => refused(other.to_string()),
    })
}

/// The name of what the place that is driven answers: the current into a port, the motion along a force.
pub(super) fn own_answer(compiled: &CompiledModel, drive: &str, ports: &OpenedPorts) -> Result<String, AnalysisError> {
    match ports.answers[0] {
        PortResponse::Current => Ok(format!("{drive}.i")),
        PortResponse::Motion(Signal::AnchorForce(_, direction)) => {
            let node = drive.rsplit_once('.').map_or(drive, |(node, _)| node);
            Ok(format!("{node}.{}", ANCHOR_FORCES[direction]))
        }
        PortResponse::Motion(_) | PortResponse::Rise(_) => Ok(port_name(compiled, drive)),
        PortResponse::Nothing => Err(AnalysisError::BadRequest {
            what: "signals".into(),
            detail: format!(
                "\"{drive}\" moves the frame and answers with nothing itself: name what is to be seen, as NODE.x"
            ),
        }),
    }
}

impl Quantity for ResponseRow {
    fn unit(&self) -> &'static str {
        match self {
            Self::Signal(signal) => signal.unit(),
            Self::Current(_) => "A",
        }
    }
}

impl ResponseRow {
    /// A signal, or `PORT.i`, the current into a port.
    fn find(compiled: &CompiledModel, name: &str) -> Result<Self, ReadoutError> {
        match name.strip_suffix(".i").and_then(|port| compiled.structure.port(port)) {
            Some(port) => Ok(Self::Current(port)),
            None => Signal::find(compiled, name).map(Self::Signal),
        }
    }
}

/// A signal, `PORT.i`, the current into a port, or a sum of these.
///
/// # Errors
/// [`AnalysisError::BadRequest`] with what would be understood.
pub(crate) fn row(compiled: &CompiledModel, text: &str) -> Result<Expression<ResponseRow>, AnalysisError> {
    bimorph_base::budget::check();
    Expression::find(text, |name| ResponseRow::find(compiled, name)).map_err(|error| {
        let unknown = matches!(error, ReadoutError::UnknownSignal { .. });
        let electrics = &compiled.parts.system.electrics;
        match AnalysisError::from(error) {
            AnalysisError::BadRequest { what, detail } if unknown && electrics.ports > 0 => {
                let ports = electrics.names[..electrics.ports].join(", ");
                AnalysisError::BadRequest { what, detail: format!("{detail}; or PORT.i, with the ports {ports}") }
            }
            error => error,
        }
    })
}

/// Unit of a row over that of the drive.
pub(super) fn unit(row: &Expression<ResponseRow>, drive: &str) -> String {
    let own = row.unit();
    if drive.contains(['/', '·']) { format!("{own}/({drive})") } else { format!("{own}/{drive}") }
}
