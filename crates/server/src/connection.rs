//! A client's socket that the server can cut, and the places for such.
//!
//! A client that connects and says nothing is closed after the time for a handshake, and when all places are taken the
//! connection without calls that was idle for longest makes room: silent clients cannot lock others out.
//!
//! The HTTP layer waits for its clients when it shuts down; one that never answers would hold the server for as long as
//! it likes. So the socket itself listens for the order to cut: reads and writes then fail, and the layer above gives up.

use super::authentication::{Guard, NegotiatedSocket};
use super::limits::Limits;
use super::peer::{Peer, PeerIdentity};
use socket2::{SockRef, TcpKeepalive};
use std::cmp::Reverse;
use std::collections::BTreeSet;
use std::future::Future;
use std::io;
use std::pin::Pin;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpStream, UnixStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::Sleep;
use tokio_rustls::server::TlsStream;
use tokio_util::sync::{CancellationToken, WaitForCancellationFutureOwned};
use tonic::transport::server::Connected;

/// Bytes that a client has sent when it has begun HTTP/2: the preface and the head of its settings.
const GREETING: usize = 24 + 9;

enum ClientSocket {
    Tcp(TcpStream),
    Tls(Box<TlsStream<TcpStream>>),
    Unix(UnixStream),
}

/// The connections of a server and their places.
#[derive(Debug)]
pub(super) struct Connections {
    places: Arc<Semaphore>,
    open: Mutex<Vec<Weak<Peer>>>,
    handshake: Duration,
    keepalive: Duration,
    cutting: CancellationToken,
}

impl Connections {
    pub(super) fn new(limits: &Limits, cutting: &CancellationToken) -> Self {
        let places = Arc::new(Semaphore::new(limits.connections.min(Semaphore::MAX_PERMITS)));
        let Limits { handshake, keepalive, .. } = *limits;
        Self { places, open: Mutex::default(), handshake, keepalive, cutting: cutting.clone() }
    }

    /// Sets a socket so that its replies do not wait for others, and a peer that is gone is noticed.
    pub(super) fn prepare(&self, socket: &TcpStream) -> io::Result<()> {
        // Without this, replies wait for the peer's delayed acknowledgement: 40 ms a trial.
        socket.set_nodelay(true)?;
        // Asked by the system and not by HTTP/2: a circuit that is paused, whose program runs none of its threads, still answers.
        let (first, next) = (self.keepalive, self.keepalive / QUESTIONS);
        let second = Duration::from_secs(1);
        let asked = TcpKeepalive::new().with_time(first.max(second)).with_interval(next.max(second));
        SockRef::from(socket).set_tcp_keepalive(&asked.with_retries(QUESTIONS - 1))
    }

    /// A place for one more: a free one, or that of the connection without calls that was idle for longest.
    pub(super) async fn place(&self) -> Option<OwnedSemaphorePermit> {
        if let Ok(place) = Arc::clone(&self.places).try_acquire_owned() {
            return Some(place);
        }
        self.longest_idle()?.cut.cancel();
        tokio::time::timeout(LETTING_GO, Arc::clone(&self.places).acquire_owned()).await.ok()?.ok()
    }

    fn longest_idle(&self) -> Option<Arc<Peer>> {
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        open.retain(|presence| presence.strong_count() > 0);
        let idle = open.iter().filter_map(Weak::upgrade).filter(|presence| !presence.cut.is_cancelled());
        idle.filter_map(|presence| presence.idle().map(|time| (time, presence)))
            // among those that never greeted, the one that came first
            .max_by_key(|(time, presence)| (*time, Reverse(presence.opened)))
            .map(|(_, p)| p)
    }

    fn welcome(&self) -> Arc<Peer> {
        let presence = Peer::new(&self.cutting);
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        if open.len() >= 2 * self.places.available_permits().max(64) {
            open.retain(|presence| presence.strong_count() > 0);
        }
        open.push(Arc::downgrade(&presence));
        presence
    }

    /// Connections open.
    pub(super) fn open(&self) -> usize {
        let open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        open.iter().filter(|presence| presence.strong_count() > 0).count()
    }

    /// Numbers of the connections that are open.
    pub(super) fn numbers(&self) -> BTreeSet<u64> {
        let open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        open.iter().filter_map(Weak::upgrade).map(|presence| presence.number()).collect()
    }

    /// A connection over TCP in a place, once it is known how its client speaks; none when that fails, or takes longer than
    /// a handshake may.
    pub(super) async fn tcp(
        &self,
        socket: TcpStream,
        guard: &Guard,
        place: OwnedSemaphorePermit,
    ) -> Option<Connection> {
        let presence = self.welcome();
        let greeted = tokio::select! {
            greeted = tokio::time::timeout(self.handshake, guard.greet(socket)) => greeted,
            () = presence.cut.cancelled() => return None,
        };
        let (voice, who) = match greeted {
            Ok(Ok(greeted)) => greeted,
            Ok(Err(error)) => {
                tracing::info!(%error, "handshake refused");
                return None;
            }
            Err(_) => return None,
        };
        let socket = match voice {
            NegotiatedSocket::Plain(socket) => ClientSocket::Tcp(socket),
            NegotiatedSocket::Secure(stream) => ClientSocket::Tls(stream),
        };
        Some(self.connection(socket, presence, who, place))
    }

    /// A connection over a Unix socket in a place.
    pub(super) fn unix(&self, socket: UnixStream, place: OwnedSemaphorePermit) -> Connection {
        self.connection(ClientSocket::Unix(socket), self.welcome(), PeerIdentity::Local, place)
    }

    fn connection(
        &self,
        socket: ClientSocket,
        presence: Arc<Peer>,
        who: PeerIdentity,
        place: OwnedSemaphorePermit,
    ) -> Connection {
        let _ = presence.who.set(who);
        let cut = Box::pin(presence.cut.clone().cancelled_owned());
        let greeting = Some(Box::pin(tokio::time::sleep(self.handshake)));
        Connection { socket, cut, presence, greeting, read: 0, _place: place }
    }
}

/// Parts of the time of silence; a probe is sent after each but the last of a second such time.
const QUESTIONS: u32 = 6;

/// Longest time for a connection to release its permit.
const LETTING_GO: Duration = Duration::from_secs(1);

/// One accepted connection.
pub(super) struct Connection {
    socket: ClientSocket,
    cut: Pin<Box<WaitForCancellationFutureOwned>>,
    presence: Arc<Peer>,
    /// Runs until the client has greeted.
    greeting: Option<Pin<Box<Sleep>>>,
    /// Bytes read until then.
    read: usize,
    /// Its place among [`super::limits::Limits::connections`].
    _place: OwnedSemaphorePermit,
}

impl Connection {
    fn check(&mut self, cx: &mut Context<'_>) -> io::Result<()> {
        if self.cut.as_mut().poll(cx).is_ready() {
            return Err(io::Error::new(io::ErrorKind::ConnectionAborted, "the server has cut it"));
        }
        Ok(())
    }

    /// After a read of `bytes`: whether the client has greeted in time.
    fn greet(&mut self, bytes: usize, cx: &mut Context<'_>) -> io::Result<()> {
        let Some(greeting) = &mut self.greeting else { return Ok(()) };
        self.read += bytes;
        if self.read >= GREETING {
            self.greeting = None;
            self.presence.greeted.store(true, Ordering::Relaxed);
        } else if greeting.as_mut().poll(cx).is_ready() {
            return Err(io::Error::new(io::ErrorKind::TimedOut, "no greeting"));
        }
        Ok(())
    }
}

impl Connected for Connection {
    type ConnectInfo = Arc<Peer>;
    fn connect_info(&self) -> Arc<Peer> {
        Arc::clone(&self.presence)
    }
}

impl AsyncRead for Connection {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        self.check(cx)?;
        let before = buf.filled().len();
        let read = match &mut self.socket {
            ClientSocket::Tcp(socket) => Pin::new(socket).poll_read(cx, buf),
            ClientSocket::Tls(socket) => Pin::new(socket).poll_read(cx, buf),
            ClientSocket::Unix(socket) => Pin::new(socket).poll_read(cx, buf),
        };
        self.greet(buf.filled().len() - before, cx)?;
        read
    }
}

impl AsyncWrite for Connection {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &[u8]) -> Poll<io::Result<usize>> {
        self.check(cx)?;
        match &mut self.socket {
            ClientSocket::Tcp(socket) => Pin::new(socket).poll_write(cx, buf),
            ClientSocket::Tls(socket) => Pin::new(socket).poll_write(cx, buf),
            ClientSocket::Unix(socket) => Pin::new(socket).poll_write(cx, buf),
        }
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bufs: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        self.check(cx)?;
        match &mut self.socket {
            ClientSocket::Tcp(socket) => Pin::new(socket).poll_write_vectored(cx, bufs),
            ClientSocket::Tls(socket) => Pin::new(socket).poll_write_vectored(cx, bufs),
            ClientSocket::Unix(socket) => Pin::new(socket).poll_write_vectored(cx, bufs),
        }
    }

    fn is_write_vectored(&self) -> bool {
        match &self.socket {
            ClientSocket::Tls(socket) => socket.is_write_vectored(),
            ClientSocket::Tcp(_) | ClientSocket::Unix(_) => true,
        }
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        match &mut self.socket {
            ClientSocket::Tcp(socket) => Pin::new(socket).poll_flush(cx),
            ClientSocket::Tls(socket) => Pin::new(socket).poll_flush(cx),
            ClientSocket::Unix(socket) => Pin::new(socket).poll_flush(cx),
        }
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        match &mut self.socket {
            ClientSocket::Tcp(socket) => Pin::new(socket).poll_shutdown(cx),
            ClientSocket::Tls(socket) => Pin::new(socket).poll_shutdown(cx),
            ClientSocket::Unix(socket) => Pin::new(socket).poll_shutdown(cx),
        }
    }
}

#[cfg(test)]
mod tests {
    //! Of those that never greeted, the one that came first makes room.
    use super::*;

    #[test]
    fn the_oldest_silent_connection_makes_room() {
        let connections = Connections::new(&Limits::default(), &CancellationToken::new());
        let silent = [(); 3].map(|()| connections.welcome());
        let greeted = connections.welcome();
        greeted.greeted.store(true, Ordering::Relaxed);
        for expected in &silent {
            let found = connections.longest_idle().expect("one is silent");
            assert_eq!(found.number(), expected.number());
            found.cut.cancel();
        }
        assert_eq!(connections.longest_idle().map(|found| found.number()), Some(greeted.number()));
    }
}
