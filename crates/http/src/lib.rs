//! Small HTTP/1.1 servers: connections within limits, each request to one function.
//!
//! **Architecture invariant.** It knows no other crate, no address and no path: the live bench and the monitoring of a server bind, name
//! their paths and answer.

use hyper::body::{Body, Incoming};
use hyper::{Request, Response};
use hyper_util::rt::{TokioIo, TokioTimer};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::error::Error;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::task::{AbortHandle, JoinSet};

/// Pause after a failed accept (no file descriptors left, say), so that it does not spin.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// Limits of the connections of a server.
#[derive(Debug, Clone, Copy)]
pub struct HttpLimits {
    /// Connections open at once.
    pub connections: usize,
    /// Longest time until the head of a request has come.
    pub head: Duration,
    /// Longest head of a request (bytes).
    pub head_bytes: usize,
    /// Longest time of a connection, which then has one request; none: it stays open for more.
    pub whole: Option<Duration>,
}

/// Answers until it is dropped, and all connections with it. Where all places are taken, the oldest connection makes room: a request is
/// answered as it comes, so those that are open have sent none, or do not read.
pub async fn serve<A, F, B>(listener: TcpListener, limits: HttpLimits, answer: A)
where
    A: Fn(Request<Incoming>) -> F + Clone + Send + 'static,
    F: Future<Output = Response<B>> + Send,
    B: Body<Data: Send, Error: Into<Box<dyn Error + Send + Sync>>> + Send + 'static,
{
    let mut tasks = JoinSet::new();
    let mut open: VecDeque<AbortHandle> = VecDeque::new();
    loop {
        let Ok((socket, _)) = listener.accept().await else {
            tokio::time::sleep(ACCEPT_PAUSE).await;
            continue;
        };
        while tasks.try_join_next().is_some() {}
        open.retain(|task| !task.is_finished());
        if open.len() >= limits.connections
            && let Some(oldest) = open.pop_front()
        {
            oldest.abort();
        }
        let _ = socket.set_nodelay(true);
        let answer = answer.clone();
        open.push_back(tasks.spawn(async move {
            let service = hyper::service::service_fn(move |request| {
                let answered = answer(request);
                async move { Ok::<_, Infallible>(answered.await) }
            });
            let mut builder = hyper::server::conn::http1::Builder::new();
            builder.timer(TokioTimer::new()).header_read_timeout(limits.head).max_buf_size(limits.head_bytes);
            builder.keep_alive(limits.whole.is_none());
            let connection = builder.serve_connection(TokioIo::new(socket), service);
            let _ = match limits.whole {
                Some(whole) => tokio::time::timeout(whole, connection).await.unwrap_or(Ok(())),
                None => connection.await,
            };
        }));
    }
}
