//! Many steps of a device on a server in one call.

use super::RemoteDevice;
use super::link::{Rpc, is_broken, reason, unexpected};
use super::reply_checks;
use crate::convert::device as wire;
use crate::convert::run::{pack, unpack};
use crate::proto;
use bimorph_device::run::{DriveSchedule, Ran, Start};
use bimorph_device::{DeviceError, Mode, Trial, TrialReply};
use tonic::{Code, Status, Streaming};

impl RemoteDevice {
    /// Steps from a state along a course, as [`bimorph_device::run::steps`] does in process, with the same bits. The
    /// deadline bounds the time between two messages of the server, which sends one each second or more often. A
    /// [`RemoteDevice::resuming`] device cannot continue from a state of a run on another server.
    ///
    /// # Errors
    /// [`DeviceError`]; a step without a result is not an error of the call, see [`Ran::error`].
    pub fn run(&mut self, start: &Start<'_>, course: &DriveSchedule<'_>) -> Result<Ran, DeviceError> {
        let request = |session: String| proto::RunRequest {
            lanes: vec![proto::RunLane {
                session,
                parent: start.state.map_or(0, |token| token.0),
                t: start.t,
                start: pack(start.given),
                values: Vec::new(),
            }],
            times: pack(course.times),
            values: pack(course.values),
            signals: course.signals.to_vec(),
            ports: course.ports,
            warn: false,
        };
        self.begin();
        let shape = self.shape();
        let (mut ran, mut ended) = (Ran::default(), false);
        let mut events = self.about(async |mut rpc, session| rpc.run(request(session)).await)?.into_inner();
        while let Some(event) = self.next(&mut events)? {
            if ended && !(event.rows.is_empty() && event.ends.is_empty()) {
                return Err(self.unexpected_run("rows after the end of the run"));
            }
            for rows in event.rows {
                rows_fit(&rows, course, shape, ran.steps).map_err(|what| self.unexpected_run(&what))?;
                ran.steps += rows.count as usize;
                ran.outputs.extend(unpack(&rows.outputs));
                ran.currents.extend(unpack(&rows.currents));
                ran.charges.extend(unpack(&rows.charges));
            }
            for end in event.ends {
                end_fits(&end, ran.steps, course.times.len()).map_err(|what| self.unexpected_run(&what))?;
                ran.trials = usize::try_from(end.trials).unwrap_or(usize::MAX);
                ran.error = (!end.error.is_empty()).then(|| reply_checks::text(&end.error));
                if let Some(last) = end.last {
                    let t = course.times[ran.steps - 1];
                    let trial = Trial { mode: Mode::Transient, parent: None, t, dt: 0.0, voltages: &[] };
                    let mut reply = TrialReply::default();
                    reply_checks::trial(&trial, shape, &last)
                        .and_then(|()| wire::reply_from_wire(last, &mut reply))
                        .map_err(|what| self.unexpected_run(&what))?;
                    ran.last = Some(reply);
                }
                ended = true;
            }
            self.begin();
        }
        if ended { Ok(ran) } else { Err(self.lose(&Status::unavailable("the stream ended before the run did"))) }
    }

    /// A call about the session that is open.
    fn about<T>(&mut self, call: impl AsyncFnOnce(Rpc, String) -> Result<T, Status>) -> Result<T, DeviceError> {
        let (Some(link), Some(stream)) = (&self.link, self.stream.as_ref().filter(|stream| stream.is_open())) else {
            return Err(self.closed());
        };
        let called = link.call(call(link.rpc.clone(), stream.session.clone()));
        called.map_err(|status| if is_broken(&status) { self.lose(&status) } else { self.remote(reason(&status)) })
    }

    /// The next message of a stream.
    fn next<T>(&mut self, stream: &mut Streaming<T>) -> Result<Option<T>, DeviceError> {
        let Some(link) = &self.link else { return Err(self.closed()) };
        link.call(stream.message()).map_err(|status| match status.code() {
            Code::DeadlineExceeded => self.lose(&status),
            _ if is_broken(&status) => self.lose(&status),
            _ => self.remote(reason(&status)),
        })
    }

    fn unexpected_run(&mut self, what: &str) -> DeviceError {
        self.lose(&unexpected(what))
    }
}

/// Rows of a run that follow those of the `before` first steps, of a device with so many ports and signals.
fn rows_fit(
    rows: &proto::RunRows,
    course: &DriveSchedule<'_>,
    (p, _): (usize, usize),
    before: usize,
) -> Result<(), String> {
    let count = rows.count as usize;
    if rows.lane != 0 || rows.first != before as u64 || count > course.times.len() - before {
        return Err(format!(
            "rows: expected those from {before} on, got {count} of lane {} from {}",
            rows.lane, rows.first
        ));
    }
    let of_ports = if course.ports { p } else { 0 };
    for (what, bytes, width) in [
        ("outputs", &rows.outputs, course.signals.len()),
        ("currents", &rows.currents, of_ports),
        ("charges", &rows.charges, of_ports),
    ] {
        if bytes.len() != 8 * count * width {
            return Err(format!("{what}: expected {} numbers, got {} bytes", count * width, bytes.len()));
        }
        if let Some((at, value)) = unpack(bytes).enumerate().find(|(_, value)| !value.is_finite()) {
            return Err(format!("{what}[{at}]: expected a finite number, got {value}"));
        }
    }
    Ok(())
}

/// The end of a run of `steps` steps, of which so many have come.
fn end_fits(end: &proto::RunEnd, came: usize, steps: usize) -> Result<(), String> {
    if end.lane != 0 || end.steps != came as u64 || end.error.is_empty() != (came == steps) {
        let said = if end.error.is_empty() { "no error" } else { "an error" };
        return Err(format!("end: expected that of {came} of {steps} steps, got one of {} with {said}", end.steps));
    }
    reply_checks::length("last", usize::from(end.last.is_some()), usize::from(came > 0))
}

#[cfg(test)]
mod tests {
    //! Requested rows and ends pass, and all others are named in an error.
    use super::*;

    fn rows(first: u64, count: u32, outputs: &[f64]) -> proto::RunRows {
        let outputs = pack(outputs);
        proto::RunRows {
            first,
            count,
            outputs,
            currents: pack(&[0.0; 2]),
            charges: pack(&[0.0; 2]),
            ..Default::default()
        }
    }

    #[test]
    fn rows_of_other_shapes_are_named() {
        let signals = ["m.x".to_owned()];
        let course = DriveSchedule { times: &[1.0, 2.0, 3.0], values: &[0.0], signals: &signals, ports: true };
        let said = |rows: &proto::RunRows, before| rows_fit(rows, &course, (1, 5), before).err().unwrap_or_default();
        assert_eq!(said(&rows(0, 2, &[0.0; 2]), 0), "");
        for (begins, rows, before) in [
            ("rows: expected those from 1", rows(0, 2, &[0.0; 2]), 1),
            ("rows: expected those from 2", rows(2, 2, &[0.0; 2]), 2),
            ("outputs: expected 2 numbers", rows(0, 2, &[0.0; 3]), 0),
            ("outputs[1]: expected a finite number, got NaN", rows(0, 2, &[0.0, f64::NAN]), 0),
            ("currents: expected 1 numbers", rows(0, 1, &[0.0]), 0),
            ("rows", proto::RunRows { lane: 1, ..rows(0, 2, &[0.0; 2]) }, 0),
        ] {
            assert!(said(&rows, before).starts_with(begins), "{begins}: {}", said(&rows, before));
        }
        let end = |steps, error: &str, last| proto::RunEnd { steps, error: error.into(), last, ..Default::default() };
        let reply = Some(proto::TrialReply::default());
        assert!(end_fits(&end(3, "", reply.clone()), 3, 3).is_ok());
        assert!(end_fits(&end(2, "why", reply.clone()), 2, 3).is_ok());
        assert!(end_fits(&end(0, "why", None), 0, 3).is_ok());
        for (wrong, came) in [
            (end(2, "", reply.clone()), 2),
            (end(3, "why", reply.clone()), 3),
            (end(3, "", None), 3),
            (end(3, "", reply.clone()), 2),
            (end(0, "why", reply), 0),
        ] {
            assert!(end_fits(&wrong, came, 3).is_err(), "{wrong:?}");
        }
    }
}
