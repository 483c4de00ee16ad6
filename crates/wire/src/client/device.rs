//! A device on a server, over one bidirectional stream.

use super::link::{ServerLink, is_not_found, reason, unexpected};
use super::replay::Replay;
use super::reply_checks;
use super::trial_stream::{OpenTrialStream, ended, open_request};
use crate::convert::device as wire;
use crate::credentials::Access;
use crate::proto;
use bimorph_base::{Bundle, Diagnostic};
use bimorph_device::{Description, Device, DeviceError, OpenRequest, SmallSignal, Token, Trial, TrialReply};
use bimorph_model::compile::CompileOptions;
use proto::device_reply::Kind as ReplyKind;
use proto::device_request::Kind as RequestKind;
use std::time::{Duration, Instant};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Code, Status};

/// Pause between two attempts to reach a server that went away.
const PAUSE: Duration = Duration::from_millis(50);

/// Requests that may wait to be sent with the next call: accepts, whose replies are not awaited.
const QUEUE: usize = 64;

/// A [`Device`] whose model is held by a server. Every call returns within the deadline.
///
/// After a lost connection or a late reply the device is closed (its states are on the server); [`Device::open`]
/// connects again and starts a new epoch. A [`RemoteDevice::resuming`] one reconnects to its server first.
#[derive(Debug)]
pub struct RemoteDevice {
    address: String,
    access: Access,
    bundle: Bundle,
    options: CompileOptions,
    deadline: Duration,
    model: String,
    /// Warnings of the server from the compilation of the model.
    warnings: Vec<Diagnostic>,
    /// Declared before `link`: a stream is dropped before the runtime that drives it.
    pub(super) stream: Option<OpenTrialStream>,
    pub(super) link: Option<ServerLink>,
    /// Why the link was lost, for calls that come after.
    lost: Option<String>,
    /// The request that opened it.
    asked: OpenRequest,
    /// Requests to repeat to a restarted server; `None`: nothing is repeated.
    replay: Option<Replay>,
    /// When the call at hand must have ended.
    until: Instant,
    /// The state whose warnings were requested; it is evaluated where it is accepted.
    watched: Option<Token>,
}

impl RemoteDevice {
    /// Connects to `uri` (`unix:///path`, `host:port`, `https://host:port`), showing what the environment says
    /// ([`Access::from_environment`]), sends the netlist and compiles it there. `deadline` bounds this and every later call.
    ///
    /// # Errors
    /// [`DeviceError::Remote`], naming the address and what happened: no server, a netlist with errors, a limit.
    pub fn connect(
        uri: &str,
        bundle: &Bundle,
        options: &CompileOptions,
        deadline: Duration,
    ) -> Result<Self, DeviceError> {
        Self::connect_with(uri, Access::from_environment(), bundle, options, deadline)
    }

    /// The same, showing `access`.
    ///
    /// # Errors
    /// [`DeviceError::Remote`].
    pub fn connect_with(
        uri: &str,
        access: Access,
        bundle: &Bundle,
        options: &CompileOptions,
        deadline: Duration,
    ) -> Result<Self, DeviceError> {
        let mut device = Self {
            address: uri.to_owned(),
            access,
            bundle: bundle.clone(),
            options: options.clone(),
            deadline,
            model: String::new(),
            warnings: Vec::new(),
            stream: None,
            link: None,
            lost: None,
            asked: OpenRequest::default(),
            replay: None,
            until: Instant::now() + deadline,
            watched: None,
        };
        device.reach().map_err(|status| device.lose(&status))?;
        Ok(device)
    }

    /// The same device with resumption: if a server is reached again within the deadline, it repeats the trials that
    /// led to its states. They have the same tokens and bits there.
    #[must_use]
    pub fn resuming(mut self) -> Self {
        self.replay = Some(Replay::default());
        self
    }

    /// Warnings of the server from the compilation of the model, its mesh in a circuit included.
    pub fn warnings(&self) -> &[Diagnostic] {
        &self.warnings
    }

    /// The server's address, as given.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// Connects and compiles.
    fn reach(&mut self) -> Result<(), Status> {
        let left = self.until.saturating_duration_since(Instant::now());
        let mut link = ServerLink::connect(&self.address, &self.access, left)?;
        link.deadline = self.deadline;
        link.end_by(self.until);
        let described = link.compile(&self.bundle, &self.options)?;
        self.warnings = reply_checks::warnings(&described.warnings);
        self.model = described.id;
        self.link = Some(link);
        Ok(())
    }

    /// Starts the stream.
    fn start(&mut self) -> Result<(), Status> {
        if self.link.is_none() {
            self.reach()?;
        }
        let Some(link) = &self.link else { return Err(Status::unavailable("not connected")) };
        let (requests, queue) = mpsc::channel(QUEUE);
        let mut rpc = link.rpc.clone();
        let replies = link.call(rpc.trial(ReceiverStream::new(queue)))?.into_inner();
        self.stream = Some(OpenTrialStream::new(requests, replies));
        Ok(())
    }

    /// One request and its reply, with another attempt where the server comes back.
    fn ask(&mut self, request: RequestKind) -> Result<ReplyKind, DeviceError> {
        if self.link.is_none() || self.stream.is_none() {
            return Err(self.closed());
        }
        let from = match &request {
            RequestKind::Trial(trial) => Some(trial.parent),
            RequestKind::Linearize(small) => Some(small.token),
            _ => None,
        };
        let again = from.filter(|_| self.replay.is_some()).map(|from| (from, request.clone()));
        let status = match self.send(request) {
            Err(status) => status,
            answer => return answer.map_err(|status| self.lose(&status)),
        };
        let back = match again {
            Some((from, request)) if status.code() != Code::DeadlineExceeded => {
                self.resume(from).and_then(|()| self.send(request).ok())
            }
            _ => None,
        };
        back.ok_or_else(|| self.lose(&status))
    }

    /// One request and its reply on the stream there is.
    fn send(&mut self, request: RequestKind) -> Result<ReplyKind, Status> {
        let Self { link: Some(link), stream: Some(stream), .. } = self else { return Err(ended()) };
        link.call(stream.ask(request))
    }

    /// Reaches the server again within the deadline and leads it to the state of a token; none where that cannot be done.
    fn resume(&mut self, token: u64) -> Option<()> {
        let way = self.replay.as_ref()?.way(token)?;
        loop {
            (self.stream, self.link) = (None, None);
            if self.start().is_ok() {
                break;
            }
            if Instant::now() + PAUSE > self.until {
                return None;
            }
            std::thread::sleep(PAUSE);
        }
        let ReplyKind::Opened(opened) = self.send(open_request(&self.model, &self.asked)).ok()? else { return None };
        let device = opened.device.unwrap_or_default();
        reply_checks::opened(&self.asked, &device).ok()?;
        self.stream.as_mut()?.open(&opened.session, &device);
        for trial in way {
            self.send(RequestKind::Trial(trial)).ok().filter(|reply| matches!(reply, ReplyKind::Trial(_)))?;
        }
        Some(())
    }

    /// A call begins, which ends within the deadline whatever it takes.
    pub(super) fn begin(&mut self) {
        self.until = Instant::now() + self.deadline;
        self.link.iter().for_each(|link| link.end_by(self.until));
    }

    /// Content of a checked reply; an unexpected reply loses the connection.
    fn checked(&mut self, found: Result<(), String>) -> Result<(), DeviceError> {
        found.map_err(|what| self.lose(&unexpected(&what)))
    }

    pub(super) fn shape(&self) -> (usize, usize) {
        self.stream.as_ref().map_or((0, 0), OpenTrialStream::shape)
    }

    fn small_signal(&mut self, request: proto::SmallSignalRequest) -> Result<proto::SmallSignal, DeviceError> {
        if !self.opened() {
            return Err(self.closed());
        }
        self.begin();
        match self.ask(RequestKind::Linearize(request))? {
            ReplyKind::Linearized(answer) => Ok(answer),
            ReplyKind::Fault(fault) => Err(self.fault(fault)),
            _ => Err(self.unexpected()),
        }
    }

    fn opened(&self) -> bool {
        self.stream.as_ref().is_some_and(OpenTrialStream::is_open)
    }

    /// The error of a device that is not open: never opened, or lost since.
    pub(super) fn closed(&self) -> DeviceError {
        match &self.lost {
            Some(reason) => self.remote(format!("{reason} (the device must be opened again)")),
            None => DeviceError::NotOpen,
        }
    }

    /// Drops a link whose replies can no longer be matched with requests.
    pub(super) fn lose(&mut self, status: &Status) -> DeviceError {
        self.stream = None;
        self.link = None;
        let reason = reason(status);
        self.lost = Some(reason.clone());
        self.remote(reason)
    }

    pub(super) fn remote(&self, reason: String) -> DeviceError {
        DeviceError::Remote { address: self.address.clone(), reason }
    }

    fn unexpected(&mut self) -> DeviceError {
        self.lose(&unexpected("one of another kind than the request"))
    }

    fn fault(&mut self, fault: proto::Fault) -> DeviceError {
        reply_checks::fault(wire::fault_from_wire(fault, &self.address))
    }

    /// Opens on the stream there is.
    fn open_here(&mut self) -> Result<ReplyKind, DeviceError> {
        self.ask(open_request(&self.model, &self.asked))
    }
}

impl Device for RemoteDevice {
    fn open(&mut self, request: &OpenRequest) -> Result<Description, DeviceError> {
        self.begin();
        self.asked.clone_from(request);
        if let Some(replay) = &mut self.replay {
            replay.clear();
        }
        let fresh = self.stream.is_none();
        if fresh {
            self.start().map_err(|status| self.lose(&status))?;
        }
        let mut reply = self.open_here();
        // A stream of an earlier run may have ended meanwhile, and a server drops models: repeat once on a new stream.
        let stale = match &reply {
            Ok(reply) => is_not_found(reply),
            Err(_) => !fresh,
        };
        if stale {
            (self.stream, self.link) = (None, None);
            self.start().map_err(|status| self.lose(&status))?;
            reply = self.open_here();
        }
        match reply? {
            ReplyKind::Opened(opened) => {
                let device = opened.device.unwrap_or_default();
                self.checked(reply_checks::opened(request, &device))?;
                self.lost = None;
                self.stream.iter_mut().for_each(|stream| stream.open(&opened.session, &device));
                Ok(wire::description_from_wire(device))
            }
            ReplyKind::Fault(fault) => Err(self.fault(fault)),
            _ => Err(self.unexpected()),
        }
    }

    fn trial(&mut self, request: &Trial<'_>, reply: &mut TrialReply) -> Result<(), DeviceError> {
        if !self.opened() {
            return Err(self.closed());
        }
        self.begin();
        let asked = wire::trial_to_wire(request);
        let remembered = self.replay.is_some().then(|| asked.clone());
        match self.ask(RequestKind::Trial(asked))? {
            ReplyKind::Trial(answer) => {
                self.checked(reply_checks::trial(request, self.shape(), &answer))?;
                let answer = proto::TrialReply { reason: reply_checks::text(&answer.reason), ..answer };
                let read = wire::reply_from_wire(answer, reply);
                let stream = self.stream.as_mut();
                let found = read.and_then(|()| stream.map_or(Ok(()), |stream| stream.order.check(request, reply)));
                self.checked(found)?;
                if let (Some(replay), Some(asked), Some(token)) = (&mut self.replay, &remembered, reply.token) {
                    replay.made(token.0, asked);
                }
                Ok(())
            }
            ReplyKind::Fault(fault) => Err(self.fault(fault)),
            _ => Err(self.unexpected()),
        }
    }

    fn accept(&mut self, token: Token) {
        if let Some(replay) = &mut self.replay {
            replay.accept(token.0);
        }
        if let Some(stream) = &self.stream {
            let warn = self.watched == Some(token);
            let accept = proto::Accept { token: token.0, answer: false, warn };
            // Advisory: when the queue is full, the next one says as much.
            stream.report(RequestKind::Accept(accept));
        }
    }

    /// Warnings of accepted states before this one, which have come with replies: no request waits for them. Those of this state come with
    /// the reply after its accept.
    fn warns(&mut self, token: Token) -> Vec<Diagnostic> {
        self.watched = Some(token);
        let reported = self.stream.as_mut().map(|stream| std::mem::take(&mut stream.warnings));
        reply_checks::warnings(&reported.unwrap_or_default())
    }

    fn linearize(&mut self, token: Token, omega: f64, reply: &mut SmallSignal) -> Result<(), DeviceError> {
        let answer = self.small_signal(proto::SmallSignalRequest { token: token.0, omega, noise: false })?;
        self.checked(reply_checks::small_signal(self.shape(), &answer))?;
        wire::small_signal_from_wire(&answer, reply);
        Ok(())
    }

    fn noise(&mut self, token: Token, omega: f64, reply: &mut Vec<[f64; 2]>) -> Result<(), DeviceError> {
        let answer = self.small_signal(proto::SmallSignalRequest { token: token.0, omega, noise: true })?;
        if !answer.admittance_re.is_empty() {
            return Err(self.remote("it is of an earlier version, which knows no noise".into()));
        }
        self.checked(reply_checks::noise(self.shape(), &answer))?;
        wire::noise_from_wire(&answer, reply);
        Ok(())
    }
}
