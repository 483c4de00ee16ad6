//! `bimorph._native`: the service in the process of a Python program. Messages of the protocol go in and out as bytes.
//! A rejected call raises a [`Refusal`] with its code, so that the package uses it like a server.
//!
//! Python's lock is released while anything is computed. Nothing starts at import; an [`Engine`] has threads, and none
//! of them survives a fork: the package makes one for each process.

use bimorph::service::client;
use bimorph::service::in_process::{DeviceChannel, InProcessServer, ReplyMessages};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyOSError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;
use tonic::Status;

create_exception!(_native, Refusal, PyException, "What a call refuses: (code, message, details).");

/// Runs without Python's lock; a fault inside is a refusal as any other.
fn run<T: Send>(py: Python<'_>, job: impl FnOnce() -> Result<T, Status> + Send) -> PyResult<T> {
    let fault = |_| Err(Status::internal("internal fault; this call has no answer"));
    let done = py.detach(|| catch_unwind(AssertUnwindSafe(job)).unwrap_or_else(fault));
    done.map_err(|status| refusal(&status))
}

/// As above for long calls: `job` receives a function that returns whether its reply is still needed.
fn wait<T: Send>(
    py: Python<'_>,
    stop: Option<&Stop>,
    job: impl FnOnce(&dyn Fn() -> bool) -> Result<T, Status> + Send,
) -> PyResult<T> {
    let interrupt = Mutex::new(None);
    let wanted = || {
        let signals = Python::attach(|py| py.check_signals());
        let calm = signals.is_ok();
        *interrupt.lock().unwrap_or_else(PoisonError::into_inner) = signals.err();
        calm && stop.is_none_or(|stop| !stop.0.load(Ordering::Relaxed))
    };
    let done = run(py, || job(&wanted));
    // Ctrl-C is what Python says of it
    interrupt.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(done, Err)
}

fn refusal(status: &Status) -> PyErr {
    Refusal::new_err((status.code() as i32, status.message().to_owned(), status.details().to_vec()))
}

/// Stops the computations that were begun with it.
#[pyclass(frozen)]
struct Stop(AtomicBool);

#[pymethods]
impl Stop {
    #[new]
    fn new() -> Self {
        Self(AtomicBool::new(false))
    }

    /// Now, and whatever is begun with it later.
    fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// The service in this process.
#[pyclass(frozen)]
struct Engine(InProcessServer);

#[pymethods]
impl Engine {
    #[new]
    fn new() -> PyResult<Self> {
        InProcessServer::new().map(Self).map_err(|error| PyOSError::new_err(error.to_string()))
    }

    /// A call with one answer, by its name in the protocol.
    #[pyo3(signature = (name, request, stop=None))]
    fn call<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        request: &[u8],
        stop: Option<PyRef<'py, Stop>>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let stop: Option<&Stop> = stop.as_ref().map(|stop| &**stop);
        Ok(PyBytes::new(py, &wait(py, stop, |wanted| self.0.call(name, request, wanted))?))
    }

    /// A call with many answers.
    fn stream(&self, py: Python<'_>, name: &str, request: &[u8]) -> PyResult<Stream> {
        Ok(Stream(Mutex::new(Some(run(py, || self.0.stream(name, request))?))))
    }

    /// The questions of one device.
    fn line(&self) -> Line {
        Line(Mutex::new(Some(self.0.questions())))
    }
}

/// Answers of a call that has many.
#[pyclass(frozen)]
struct Stream(Mutex<Option<ReplyMessages>>);

#[pymethods]
impl Stream {
    /// The next answer; None after the last.
    #[pyo3(signature = (stop=None))]
    fn answer<'py>(&self, py: Python<'py>, stop: Option<PyRef<'py, Stop>>) -> PyResult<Option<Bound<'py, PyBytes>>> {
        let stop: Option<&Stop> = stop.as_ref().map(|stop| &**stop);
        let next = wait(py, stop, |wanted| {
            let mut answers = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            answers.as_mut().map_or(Ok(None), |answers| answers.next(wanted))
        })?;
        Ok(next.map(|bytes| PyBytes::new(py, &bytes)))
    }

    /// Ends it: its computation stops.
    fn cancel(&self, py: Python<'_>) {
        py.detach(|| *self.0.lock().unwrap_or_else(PoisonError::into_inner) = None);
    }
}

/// The questions of one device, in order.
#[pyclass(frozen)]
struct Line(Mutex<Option<DeviceChannel>>);

#[pymethods]
impl Line {
    /// The reply to a question; none to one that expects none, or where the line is closed.
    fn ask<'py>(&self, py: Python<'py>, request: &[u8]) -> PyResult<Option<Bound<'py, PyBytes>>> {
        let reply = run(py, || {
            let mut questions = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            questions.as_mut().map_or(Ok(None), |questions| questions.ask(request))
        })?;
        Ok(reply.map(|bytes| PyBytes::new(py, &bytes)))
    }

    /// Ends a session that is this line's own.
    fn close(&self, py: Python<'_>) {
        py.detach(|| *self.0.lock().unwrap_or_else(PoisonError::into_inner) = None);
    }
}

/// Connections to servers.
#[pyclass(frozen)]
struct Servers(client::TrialConnections);

#[pymethods]
impl Servers {
    #[new]
    fn new() -> PyResult<Self> {
        client::TrialConnections::new().map(Self).map_err(|error| PyOSError::new_err(error.to_string()))
    }

    /// The questions of one device on the server at an address without TLS, each answered within `patience` [s], over the connection of
    /// that number.
    fn line(
        &self,
        py: Python<'_>,
        address: &str,
        authorization: Option<&str>,
        patience: f64,
        connection: usize,
    ) -> PyResult<RemoteLine> {
        let patience = Duration::try_from_secs_f64(patience).unwrap_or(Duration::MAX);
        let line = wait(py, None, |wanted| self.0.open((address, connection), authorization, patience, wanted))?;
        Ok(RemoteLine(Mutex::new(Some(line))))
    }
}

/// The questions of one device on a server, in order.
#[pyclass(frozen)]
struct RemoteLine(Mutex<Option<client::TrialChannel>>);

#[pymethods]
impl RemoteLine {
    /// The reply to a question within `patience` [s]; none to one that expects none, or where the line is closed.
    fn ask<'py>(&self, py: Python<'py>, request: &[u8], patience: f64) -> PyResult<Option<Bound<'py, PyBytes>>> {
        let patience = Duration::try_from_secs_f64(patience).unwrap_or(Duration::MAX);
        let reply = wait(py, None, |wanted| {
            let mut line = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            line.as_mut().map_or(Ok(None), |line| line.ask(request, patience, wanted))
        })?;
        Ok(reply.map(|bytes| PyBytes::new(py, &bytes)))
    }

    /// Ends the stream. A concurrent caller first receives its reply, or its timeout ends.
    fn close(&self, py: Python<'_>) {
        py.detach(|| *self.0.lock().unwrap_or_else(PoisonError::into_inner) = None);
    }
}

/// The service in this process.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Engine>()?;
    module.add_class::<Stream>()?;
    module.add_class::<Line>()?;
    module.add_class::<Stop>()?;
    module.add_class::<Servers>()?;
    module.add_class::<RemoteLine>()?;
    module.add("Refusal", module.py().get_type::<Refusal>())?;
    module.add("VERSION", env!("CARGO_PKG_VERSION"))
}
