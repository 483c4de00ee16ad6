//! Many steps of sessions in one call, computed in bursts between which others have their turn, and streamed.

use super::chunks::MessageSink;
use super::pace::CHUNK_BYTES;
use super::session::Session;
use super::shared::{BimorphService, Reply};
use super::status;
use super::work::{CancellingStream, caught};
use bimorph_base::budget::Budget;
use bimorph_device::run::{Run, Stepped};
use bimorph_device::{Device, DeviceError, Token, TrialReply};
use bimorph_wire::convert::model::diagnostic_to_wire;
use bimorph_wire::convert::run::{self, Rows};
use bimorph_wire::convert::{Violation, device as wire, number};
use bimorph_wire::proto;
use prost::Message;
use std::collections::HashSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Response, Status};

/// A run as it is computed.
pub(super) type RunStream = CancellingStream<ReceiverStream<Result<proto::RunEvent, Status>>>;

/// Others of the session wait for so long at most, but for a step.
const BURST: Duration = Duration::from_millis(10);
/// Steps between two checks of the clock.
const UNWATCHED: usize = 8;
/// Rows are sent at least this often.
const LIVELINESS: Duration = Duration::from_millis(200);

/// Data that all lanes share.
struct RunContext {
    times: Vec<f64>,
    values: Option<Rows>,
    /// Whether currents and charges are wanted.
    ports: bool,
    /// Whether warnings of the states are wanted.
    warn: bool,
}

/// A session of a run.
struct RunLane {
    number: u32,
    session: Arc<Session>,
    run: Run,
    values: Option<Rows>,
    /// Places of the wanted signals among its own.
    signals: Vec<usize>,
    /// Steps taken.
    done: usize,
    given: Vec<f64>,
    /// Warnings of its states.
    warnings: Vec<proto::Diagnostic>,
}

impl BimorphService {
    /// Many steps of sessions.
    pub(super) async fn ran(&self, request: proto::RunRequest) -> Reply<RunStream> {
        let limits = &self.0.limits;
        let times = run::times(&request.times).map_err(status::violation)?;
        let mut course = RunContext { times, values: None, ports: request.ports, warn: request.warn };
        for (what, most, got) in
            [("sessions", limits.sessions, request.lanes.len()), ("signals", limits.signals, request.signals.len())]
        {
            if got > most {
                return Err(status::limit(what, most, got));
            }
        }
        let (mut lanes, mut values, mut shared) = (Vec::new(), 0usize, Some(request.values));
        let mut named = HashSet::new();
        for (number, lane) in (0..).zip(request.lanes) {
            if !named.insert(lane.session.clone()) {
                let twice = format!("expected each session once, got \"{}\" twice", lane.session);
                return Err(status::violation(Violation::new(format!("lanes[{number}].session"), twice)));
            }
            let session = self.0.session(&lane.session).await?;
            let opened = session.description.lock().map_or_else(|e| e.into_inner().clone(), |d| d.clone());
            let ports = opened.ports.len();
            if lane.values.is_empty()
                && let Some(bytes) = shared.take()
            {
                let rows = Rows::read("values", bytes, ports, course.times.len()).map_err(status::violation)?;
                course.values = Some(rows);
            }
            let lane = RunLane::new((number, lane), session, &opened, &request.signals, &course);
            lanes.push(lane.map_err(status::violation)?);
            let width = request.signals.len() + if course.ports { 2 * ports } else { 0 };
            values = values.saturating_add(course.times.len().saturating_mul(width));
        }
        if values > limits.transient_values {
            return Err(status::limit("transient_values", limits.transient_values, values));
        }
        let sending = self.sending()?;
        let place = self.0.work.place().await?;
        let budget = self.0.work.budget();
        let (outlet, receiver) = MessageSink::new(Arc::clone(&self.0));
        let mut outlet = outlet.with_place(place);
        let results = CancellingStream::new(ReceiverStream::new(receiver), budget.clone());
        let server = Arc::clone(&self.0);
        tokio::task::spawn_blocking(move || {
            let _sending = sending;
            let mut sender = Sender::new(course.times.len().saturating_mul(lanes.len()));
            for lane in lanes {
                if let Err(status) = lane.run((&course, &budget), &mut sender, &mut outlet, &server.metrics.trials) {
                    outlet.send(Err(status));
                    return;
                }
                if !outlet.wanted() {
                    return;
                }
            }
            sender.flush(&mut outlet);
        });
        Ok(Response::new(results))
    }
}

impl RunLane {
    fn new(
        (lane_number, lane): (u32, proto::RunLane),
        session: Arc<Session>,
        opened: &proto::DeviceDescription,
        signals: &[String],
        course: &RunContext,
    ) -> Result<Self, Violation> {
        let place = |field: &str| format!("lanes[{lane_number}].{field}");
        let ports = opened.ports.len();
        let t = number(&place("t"), lane.t, false)?;
        if course.times[0] <= t {
            let late = format!("expected a time after that of the state, {t:e} s, got {:e} s", course.times[0]);
            return Err(Violation::new("times[0]", late));
        }
        let start = Rows::read(&place("start"), lane.start, ports, 1)?;
        let mut given = Vec::with_capacity(ports);
        start.row(0, &mut given);
        let values = match lane.values {
            none if none.is_empty() => None,
            own => Some(Rows::read(&place("values"), own, ports, course.times.len())?),
        };
        if let (None, Some(shared)) = (&values, &course.values)
            && shared.ports() != ports
        {
            let other = format!("expected {ports} port values, as this session has ports, got {}", shared.ports());
            return Err(Violation::new(place("values"), other));
        }
        let from = (lane.parent != 0).then_some(Token(lane.parent));
        let signals = run::places(signals, opened)?;
        Ok(Self {
            number: lane_number,
            session,
            run: Run::new(from, t, given.clone()),
            values,
            signals,
            done: 0,
            given,
            warnings: Vec::new(),
        })
    }

    /// Runs it to its end, and adds its trials to a count.
    fn run(
        mut self,
        (course, budget): (&RunContext, &Budget),
        sender: &mut Sender,
        outlet: &mut MessageSink<proto::RunEvent>,
        trials: &AtomicU64,
    ) -> Result<(), Status> {
        let session = Arc::clone(&self.session);
        session.begin_run(budget);
        loop {
            let counted = self.run.trials();
            let stepped = session.burst(budget, |device| self.burst(device, course, sender));
            trials.fetch_add((self.run.trials() - counted) as u64, Ordering::Relaxed);
            let failed = stepped?.map_err(|error| status::device(&error))?;
            let ends = failed.is_some() || self.done == course.times.len();
            if ends {
                sender.ends(self.ended(failed.unwrap_or_default()));
            }
            if sender.is_due() {
                sender.flush(outlet);
            }
            if ends || !outlet.wanted() {
                session.finish_run(budget);
                return Ok(());
            }
            outlet.give_way();
        }
    }

    /// Steps until it is time for others; why a step has no answer.
    fn burst(
        &mut self,
        device: &mut dyn Device,
        course: &RunContext,
        sender: &mut Sender,
    ) -> Result<Option<String>, DeviceError> {
        let began = Instant::now();
        sender.begin(self.number, self.done);
        while self.done < course.times.len() {
            let values = self.values.as_ref().or(course.values.as_ref());
            values.into_iter().for_each(|values| values.row(self.done, &mut self.given));
            match self.run.step(device, course.times[self.done], &self.given)? {
                Stepped::Failed(why) => return Ok(Some(why)),
                Stepped::Taken => {
                    sender.push(self.run.last(), &self.signals, course.ports);
                    self.done += 1;
                    if let Some(token) = self.run.last().token.filter(|_| course.warn) {
                        self.warnings.extend(device.warns(token).iter().map(diagnostic_to_wire));
                    }
                }
            }
            if sender.is_full() || self.done.is_multiple_of(UNWATCHED) && began.elapsed() >= BURST {
                break;
            }
        }
        Ok(None)
    }

    fn ended(&mut self, error: String) -> proto::RunEnd {
        proto::RunEnd {
            lane: self.number,
            steps: self.done as u64,
            trials: self.run.trials() as u64,
            last: (self.done > 0).then(|| wire::reply_to_wire(&mut self.run.last().clone())),
            error,
            warnings: std::mem::take(&mut self.warnings),
        }
    }
}

impl Session {
    /// Works on the device for a short while. A stop by the budget leaves its states unchanged; a fault closes the
    /// session.
    fn burst<T>(&self, budget: &Budget, job: impl FnOnce(&mut dyn Device) -> T) -> Result<T, Status> {
        let mut device = self.lock()?;
        self.usage.touch();
        match caught(budget, || job(device.as_mut())) {
            Some(Ok(done)) => Ok(done),
            Some(Err(why)) => {
                device.recover();
                Err(status::stopped(why))
            }
            None => {
                self.fault();
                Err(status::fault())
            }
        }
    }
}

/// Rows and ends that are not sent yet.
struct Sender {
    event: proto::RunEvent,
    bytes: usize,
    since: Instant,
    /// Steps of all lanes that are done, and that there are.
    done: usize,
    steps: usize,
}

impl Sender {
    fn new(steps: usize) -> Self {
        Self { event: proto::RunEvent::default(), bytes: 0, since: Instant::now(), done: 0, steps }
    }

    /// Rows of a lane follow, from the one numbered `first` on.
    fn begin(&mut self, lane: u32, first: usize) {
        if self.event.rows.last().is_none_or(|rows| rows.lane != lane) {
            self.event.rows.push(proto::RunRows { lane, first: first as u64, ..Default::default() });
        }
    }

    fn push(&mut self, reply: &TrialReply, signals: &[usize], ports: bool) {
        let Some(rows) = self.event.rows.last_mut() else { return };
        signals.iter().for_each(|&signal| run::append(&mut rows.outputs, &[reply.outputs[signal]]));
        self.bytes += 8 * signals.len();
        if ports {
            run::append(&mut rows.currents, &reply.currents);
            run::append(&mut rows.charges, &reply.charges);
            self.bytes += 16 * reply.currents.len();
        }
        rows.count += 1;
        self.done += 1;
    }

    fn ends(&mut self, end: proto::RunEnd) {
        self.bytes += end.encoded_len();
        self.event.ends.push(end);
    }

    fn is_full(&self) -> bool {
        self.bytes >= CHUNK_BYTES / 2
    }

    fn is_due(&self) -> bool {
        self.is_full() || self.since.elapsed() >= LIVELINESS
    }

    fn flush(&mut self, outlet: &mut MessageSink<proto::RunEvent>) {
        if self.event.rows.is_empty() && self.event.ends.is_empty() {
            return;
        }
        let progress = self.done as f64 / self.steps.max(1) as f64;
        let event = proto::RunEvent { progress, ..std::mem::take(&mut self.event) };
        outlet.send(Ok(event));
        (self.bytes, self.since) = (0, Instant::now());
    }
}
