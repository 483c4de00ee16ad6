//! Codes of calls, the message of each thread, and the border that no panic crosses.

use bimorph::analysis::AnalysisError;
use bimorph::compile::CompileError;
use bimorph::device::DeviceError;
use bimorph::document::UnwritableStructure;
use bimorph::input::FrontError;
use bimorph::readout::ReadoutError;
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char, c_int};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

/// Codes of the header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub(crate) enum CallCode {
    Ok = 0,
    BadArgument = 1,
    CannotRead = 2,
    BadModel = 3,
    UnknownName = 4,
    UnknownState = 5,
    NoSolution = 6,
    Busy = 7,
    Internal = 8,
}

/// A failed call.
#[derive(Debug)]
pub(crate) struct CallFault {
    code: CallCode,
    message: String,
}

impl CallFault {
    pub(crate) fn new(code: CallCode, message: impl Into<String>) -> Self {
        Self { code, message: message.into() }
    }

    pub(crate) fn argument(message: impl Into<String>) -> Self {
        Self::new(CallCode::BadArgument, message)
    }
}

impl From<FrontError> for CallFault {
    fn from(error: FrontError) -> Self {
        let code = match error {
            FrontError::Read { .. } => CallCode::CannotRead,
            FrontError::Netlist { .. } => CallCode::BadArgument,
            _ => CallCode::BadModel,
        };
        Self::new(code, error.to_string())
    }
}

impl From<CompileError> for CallFault {
    fn from(error: CompileError) -> Self {
        let code = if matches!(error, CompileError::Option(_)) { CallCode::BadArgument } else { CallCode::BadModel };
        Self::new(code, error.to_string().trim_end())
    }
}

impl From<UnwritableStructure> for CallFault {
    fn from(error: UnwritableStructure) -> Self {
        Self::new(CallCode::BadModel, error.to_string())
    }
}

impl From<AnalysisError> for CallFault {
    fn from(error: AnalysisError) -> Self {
        Self::new(CallCode::NoSolution, error.to_string())
    }
}

impl From<ReadoutError> for CallFault {
    fn from(error: ReadoutError) -> Self {
        Self::new(CallCode::UnknownName, error.to_string())
    }
}

impl From<DeviceError> for CallFault {
    fn from(error: DeviceError) -> Self {
        let code = match error {
            DeviceError::UnknownPort { .. } | DeviceError::UnknownSignal { .. } => CallCode::UnknownName,
            DeviceError::UnknownToken(_) => CallCode::UnknownState,
            _ => CallCode::BadArgument,
        };
        Self::new(code, error.to_string())
    }
}

thread_local! {
    /// Message of the last failed call.
    static MESSAGE: RefCell<CString> = RefCell::default();
    /// Text and place of the last panic.
    static PANIC: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Keeps the message of a fault for this thread.
pub(crate) fn keep(message: &str) {
    let text = terminated(message);
    // a thread that is ending has no message any more
    let _ = MESSAGE.try_with(|kept| kept.replace(text));
}

/// A text with a zero byte behind it, up to the first zero byte inside it.
pub(crate) fn terminated(text: &str) -> CString {
    let whole = text.split('\0').next().unwrap_or("");
    CString::new(whole).unwrap_or_default()
}

/// Panics print nothing: their text and place go into the message of the call. The hook is this library's own, since it has its own copy of the
/// standard library.
fn quiet_panics() {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        std::panic::set_hook(Box::new(|info| {
            let text = info.to_string();
            let _ = PANIC.try_with(|kept| kept.replace(text));
        }));
    });
}

/// Runs a call: its fault becomes a code and the message of this thread.
pub(crate) fn call(job: impl FnOnce() -> Result<(), CallFault>) -> c_int {
    quiet_panics();
    let fault = match catch_unwind(AssertUnwindSafe(job)) {
        Ok(Ok(())) => return CallCode::Ok as c_int,
        Ok(Err(fault)) => fault,
        Err(_) => {
            let text = PANIC.try_with(RefCell::take).unwrap_or_default();
            CallFault::new(CallCode::Internal, format!("internal fault; this call has no result: {text}"))
        }
    };
    keep(&fault.message);
    fault.code as c_int
}

/// The same for calls that return a value, with another one for a fault.
pub(crate) fn value<T>(otherwise: T, job: impl FnOnce() -> Result<T, CallFault>) -> T {
    let mut found = None;
    call(|| {
        found = Some(job()?);
        Ok(())
    });
    found.unwrap_or(otherwise)
}

/// Message of the last failed call of this thread.
// SAFETY: no other symbol of a program has this name.
#[unsafe(no_mangle)]
pub extern "C" fn bimorph_error() -> *const c_char {
    let empty: &CStr = c"";
    MESSAGE.try_with(|kept| kept.borrow().as_ptr()).unwrap_or(empty.as_ptr())
}
