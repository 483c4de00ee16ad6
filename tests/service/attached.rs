//! A stream that is attached to a session.

use bimorph::service::proto;
use proto::bimorph_client::BimorphClient;
use proto::device_reply::Kind as ReplyKind;
use proto::device_request::Kind as Ask;
use tokio::sync::mpsc;
use tonic::transport::Channel;
use tonic::{Code, Streaming};

/// A stream that is attached to a session.
pub(crate) struct Attached {
    requests: mpsc::Sender<proto::DeviceRequest>,
    replies: Streaming<proto::DeviceReply>,
}

impl Attached {
    /// Joins a session that is there.
    pub(crate) async fn to(client: &mut BimorphClient<Channel>, session: &str) -> Self {
        Self::join(client, session).await.unwrap_or_else(|code| panic!("{code:?}")).0
    }

    /// Attaches to a session: its description, or the code of the error.
    pub(crate) async fn join(
        client: &mut BimorphClient<Channel>,
        session: &str,
    ) -> Result<(Self, proto::OpenResponse), Code> {
        let mut attached = Self::ask_to_join(client, session).await;
        match attached.answer().await {
            ReplyKind::Opened(opened) => Ok((attached, opened)),
            other => Err(refusal(&other)),
        }
    }

    /// Asks to join, and does not wait for the answer.
    pub(crate) async fn ask_to_join(client: &mut BimorphClient<Channel>, session: &str) -> Self {
        let (requests, queue) = mpsc::channel(4);
        let attach = Ask::Attach(proto::Attach { session: session.to_owned() });
        requests.send(proto::DeviceRequest { kind: Some(attach) }).await.expect("queued");
        let replies = client.trial(tokio_stream::wrappers::ReceiverStream::new(queue)).await.expect("a stream");
        Self { requests, replies: replies.into_inner() }
    }

    /// Says something that has no answer, or whose answer comes later.
    pub(crate) async fn say(&mut self, kind: Ask) {
        self.requests.send(proto::DeviceRequest { kind: Some(kind) }).await.expect("sent");
    }

    /// The next answer.
    pub(crate) async fn answer(&mut self) -> ReplyKind {
        let reply = self.replies.message().await.expect("a stream that goes on").expect("a reply");
        reply.kind.expect("a kind")
    }

    pub(crate) async fn ask(&mut self, kind: Ask) -> ReplyKind {
        self.say(kind).await;
        self.answer().await
    }

    pub(crate) async fn trial(&mut self, parent: u64, dt: f64, volts: f64) -> proto::TrialReply {
        match self.ask(trial(parent, dt, volts)).await {
            ReplyKind::Trial(reply) => reply,
            other => panic!("{other:?}"),
        }
    }

    /// Accepts a state, which then is kept.
    pub(crate) async fn accept(&mut self, token: u64) {
        match self.ask(Ask::Accept(proto::Accept { token, answer: true, warn: false })).await {
            ReplyKind::Accepted(accepted) => assert!(accepted.kept),
            other => panic!("{other:?}"),
        }
    }
}

/// A trial request of one port.
pub(crate) fn trial(parent: u64, dt: f64, volts: f64) -> Ask {
    let mode = if dt > 0.0 { proto::Mode::Transient } else { proto::Mode::Static };
    Ask::Trial(proto::TrialRequest { mode: mode.into(), parent, t: 0.0, dt, voltages: vec![volts] })
}

/// The code of a refusal.
pub(crate) fn refusal(reply: &ReplyKind) -> Code {
    let ReplyKind::Fault(fault) = reply else { panic!("{reply:?}") };
    match fault.kind {
        Some(proto::fault::Kind::Refused(proto::Refused { code })) => code.into(),
        _ => panic!("{fault:?}"),
    }
}
