//! A panic is a bug in the plug-in. It never reaches ngspice, and prints nothing by itself: its text and place are kept
//! for the one message that ends the analysis.

use std::sync::{Mutex, PoisonError};

static LAST: Mutex<String> = Mutex::new(String::new());

/// Keeps the text of panics from now on. The hook is this library's own: the host's are not touched.
pub(crate) fn keep_quiet() {
    std::panic::set_hook(Box::new(|info| {
        let payload = info.payload();
        let text = payload.downcast_ref::<&str>().copied().or(payload.downcast_ref::<String>().map(String::as_str));
        let place = info.location().map(|l| format!(" at {}:{}", l.file(), l.line())).unwrap_or_default();
        *LAST.lock().unwrap_or_else(PoisonError::into_inner) = format!("{}{place}", text.unwrap_or("panic"));
    }));
}

/// The last panic's text and place.
pub(crate) fn last() -> String {
    LAST.lock().unwrap_or_else(PoisonError::into_inner).clone()
}
