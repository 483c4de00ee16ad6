//! Errors as gRPC statuses: one code for each kind, field violations where a field is to blame.
//!
//! A status travels in HTTP trailers, and clients refuse large ones (8 KiB is a common default), so text and
//! violations are cut to what fits; the call `Check` has all of it.

use bimorph_analysis::AnalysisError;
use bimorph_base::budget::Stopped;
use bimorph_base::{Diagnostics, Severity};
use bimorph_device::DeviceError;
use bimorph_export::ExportError;
use bimorph_model::compile::CompileError;
use bimorph_wire::convert::{Violation, options};
use tonic::codegen::http::HeaderMap;
use tonic::{Code, Status};
use tonic_types::{ErrorDetails, StatusExt};

/// Bytes of message text; percent-encoding may triple them.
const MESSAGE_BYTES: usize = 1000;
/// Bytes of field violations; base64 makes a third more of them.
const DETAIL_BYTES: usize = 2400;

/// INVALID_ARGUMENT for one field.
pub(super) fn violation(violation: Violation) -> Status {
    let message = format!("{}: {}", violation.field, violation.description);
    bad_request(&message, [violation])
}

/// INVALID_ARGUMENT with as many violations as fit.
pub(super) fn bad_request(message: &str, violations: impl IntoIterator<Item = Violation>) -> Status {
    let mut details = ErrorDetails::new();
    let (mut bytes, mut left) = (0, 0);
    for mut violation in violations {
        violation.field = cut(violation.field, DETAIL_BYTES / 8);
        violation.description = cut(violation.description, DETAIL_BYTES / 4);
        bytes += violation.field.len() + violation.description.len() + 8;
        if bytes > DETAIL_BYTES {
            left += 1;
        } else {
            details.add_bad_request_violation(violation.field, violation.description);
        }
    }
    if left > 0 {
        details.add_bad_request_violation("", format!("and {left} more; Check lists all"));
    }
    Status::with_error_details(Code::InvalidArgument, cut(message.to_owned(), MESSAGE_BYTES), details)
}

/// A compilation that gave no model.
pub(super) fn compile(error: &CompileError) -> Status {
    match error {
        CompileError::Netlist(diagnostics) => netlist(diagnostics),
        CompileError::Option(refused) => violation(options::refused(refused.clone())),
        other => violation(Violation::new("bundle", other.to_string())),
    }
}

fn netlist(diagnostics: &Diagnostics) -> Status {
    let errors = diagnostics.items.iter().filter(|d| d.severity == Severity::Error);
    let violations = errors.map(|d| {
        let help = if d.help.is_empty() { String::new() } else { format!("; {}", d.help) };
        let code = if d.code.is_empty() { String::new() } else { format!("{}: ", d.code) };
        let place = if d.line > 0 { format!("{}:{}:{}", d.file, d.line, d.column) } else { d.file.clone() };
        Violation::new(place, format!("{code}{}{help}", d.message))
    });
    bad_request(&diagnostics.render(false), violations)
}

/// An analysis without a result.
pub(super) fn analysis(error: AnalysisError) -> Status {
    match error {
        AnalysisError::BadRequest { what, detail } => violation(Violation::new(what, detail)),
        AnalysisError::Cancelled => Status::cancelled("cancelled"),
        other => Status::failed_precondition(cut(other.to_string(), MESSAGE_BYTES)),
    }
}

/// An analysis without a result, where an invalid request is the fault of `field`.
pub(super) fn analysis_of(field: &str, error: AnalysisError) -> Status {
    match error {
        AnalysisError::BadRequest { what, detail } => violation(Violation::new(field, format!("{what}: {detail}"))),
        other => analysis(other),
    }
}

/// A model that cannot be written.
pub(super) fn export(error: ExportError) -> Status {
    let message = error.to_string();
    match error {
        ExportError::Analysis(error) => analysis(error),
        ExportError::Device(error) => device(&error),
        ExportError::NoPorts | ExportError::Turning { .. } | ExportError::SameName { .. } => {
            violation(Violation::new("ports", message))
        }
        ExportError::BadName { .. } => violation(Violation::new("name", message)),
        _ => Status::failed_precondition(cut(message, MESSAGE_BYTES)),
    }
}

/// A device that refused a unary request.
pub(super) fn device(error: &DeviceError) -> Status {
    let message = error.to_string();
    match error {
        DeviceError::UnknownPort { .. } => violation(Violation::new("ports", message)),
        DeviceError::UnknownSignal { .. } => violation(Violation::new("signals", message)),
        DeviceError::BadRequest { what, expected, got } => {
            violation(Violation::new(*what, format!("expected {expected}, got {got}")))
        }
        DeviceError::UnknownToken(_) => Status::not_found(message),
        DeviceError::NotOpen => Status::failed_precondition(message),
        DeviceError::Remote { .. } => Status::unavailable(cut(message, MESSAGE_BYTES)),
    }
}

/// A computation that was stopped.
pub(super) fn stopped(why: Stopped) -> Status {
    match why {
        Stopped::Cancelled => Status::cancelled("cancelled"),
        Stopped::Late => Status::deadline_exceeded("its time is over"),
        limit => Status::resource_exhausted(format!("{limit}; Info lists the limits of this server")),
    }
}

/// ABORTED for an accept that comes after another stream has joined its session.
pub(super) fn overtaken(id: &str) -> Status {
    Status::aborted(format!("session \"{}\" is attached to a later stream; attach again", cut(id.to_owned(), 80)))
}

/// NOT_FOUND for an id.
pub(super) fn not_found(kind: &str, id: &str) -> Status {
    let id = cut(id.to_owned(), 80);
    let way_out = match kind {
        "model" => "compile it again: the same text gives the same id",
        "session" => "open one; sessions end with their stream, by Close, or after a time without use",
        _ => "submit it again; those that have ended are forgotten after a time without use",
    };
    Status::not_found(format!("no {kind} \"{id}\" here; {way_out}"))
}

/// DATA_LOSS for what a disk does not give back as it was.
pub(super) fn damaged(kind: &str, id: &str, way_out: &str) -> Status {
    Status::data_loss(format!("what is kept of {kind} \"{}\" is damaged; {way_out}", cut(id.to_owned(), 80)))
}

/// States that cannot be kept: RESOURCE_EXHAUSTED where there is no room for them, UNAVAILABLE for anything else.
pub(super) fn not_kept(what: &str, error: &std::io::Error) -> Status {
    use std::io::ErrorKind;
    let text = cut(format!("{what} not kept: {error}"), MESSAGE_BYTES);
    match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => Status::resource_exhausted(text),
        _ => Status::unavailable(text),
    }
}

/// RESOURCE_EXHAUSTED for a limit.
pub(super) fn limit(name: &str, most: usize, got: impl std::fmt::Display) -> Status {
    Status::resource_exhausted(format!("{name}: at most {most}, got {got}; Info lists the limits of this server"))
}

/// INTERNAL for a fault of ours that was caught.
pub(super) fn fault() -> Status {
    Status::internal("internal fault while answering this request; the server continues, its log has the place")
}

/// UNAVAILABLE while shutting down.
pub(super) fn stopping() -> Status {
    Status::unavailable("the server is shutting down")
}

fn cut(mut text: String, most: usize) -> String {
    if text.len() > most {
        let mut end = most;
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        text.truncate(end);
        text.push_str(" …");
    }
    text
}

/// Prefixes of `tonic`'s errors for undecodable or missing messages, which it reports as faults of the server.
const UNDECODABLE: [&str; 4] = [
    "failed to decode Protobuf message",
    "Missing request message",
    "protocol error: received message with",
    "Unexpected EOF decoding stream",
];

/// A request that is no message of the protocol is the client's fault: INVALID_ARGUMENT.
pub(super) fn say_undecodable(headers: &mut HeaderMap) {
    if headers.get("grpc-status").is_none_or(|code| code != "13") {
        return;
    }
    if let Some(reported) = Status::from_header_map(headers) {
        let _ = undecodable(&reported).add_header(headers);
    }
}

/// The same for a message of a stream.
pub(super) fn undecodable(reported: &Status) -> Status {
    let text = reported.message();
    if reported.code() == Code::Internal && UNDECODABLE.iter().any(|begin| text.starts_with(begin)) {
        return Status::invalid_argument(cut(
            format!("expected messages of the protocol (proto/bimorph): {text}"),
            MESSAGE_BYTES,
        ));
    }
    reported.clone()
}

#[cfg(test)]
mod tests {
    //! A bad netlist comes back by place, and however long it is, the status fits into trailers.
    use super::*;
    use bimorph_base::{Bundle, Diagnostic};
    use std::sync::Arc;

    fn diagnostics(count: usize) -> Diagnostics {
        let item = |line| Diagnostic {
            code: "E012".into(),
            severity: Severity::Error,
            file: "bank.net".into(),
            line,
            column: 7,
            width: 3,
            message: "unknown layer \"p9\"".into(),
            help: "layers are p1, p2".into(),
        };
        Diagnostics { items: (1..=count).map(item).collect(), bundle: Arc::new(Bundle::from_text("bank.net", "")) }
    }

    #[test]
    fn a_bad_netlist_is_blamed_by_place() {
        let status = compile(&CompileError::Netlist(diagnostics(2)));
        assert_eq!(status.code(), Code::InvalidArgument);
        let details = status.get_error_details();
        let violations = &details.bad_request().expect("a BadRequest").field_violations;
        assert_eq!(violations[1].field, "bank.net:2:7");
        assert_eq!(violations[1].description, "E012: unknown layer \"p9\"; layers are p1, p2");
    }

    #[test]
    fn a_status_fits_into_trailers() {
        let status = compile(&CompileError::Netlist(diagnostics(5000)));
        let encoded: usize = status.message().bytes().map(|b| if b.is_ascii_alphanumeric() { 1 } else { 3 }).sum();
        assert!(encoded + status.details().len() * 4 / 3 < 8000);
        let details = status.get_error_details();
        let last = details.bad_request().and_then(|b| b.field_violations.last()).expect("violations");
        assert!(last.description.contains("more; Check lists all"), "{last:?}");
    }
}
