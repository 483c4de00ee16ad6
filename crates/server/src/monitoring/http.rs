//! Monitoring endpoints over plain HTTP/1.1 at an address of their own: `/metrics`, `/ready`, `/live`.
//!
//! They report nothing secret and require no token. A connection answers once and closes; few are open at once.

use super::report::{MonitoringState, busy, text};
use crate::server::ServeError;
use bimorph_wire::address::Address;
use hyper_util::rt::{TokioIo, TokioTimer};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::task::{AbortHandle, JoinSet};
use tonic::codegen::http::{Method, Request, Response, StatusCode};

/// Connections open at once.
const MAX_CONNECTIONS: usize = 16;
/// Longest time for one.
const PATIENCE: Duration = Duration::from_secs(5);

/// Opens the address.
pub(crate) async fn bind(address: &Address) -> Result<(TcpListener, Address), ServeError> {
    let Address::Tcp(socket) = address else { return Err(ServeError::Metrics { address: address.clone() }) };
    let refused = |reason| ServeError::Bind { address: address.clone(), reason };
    let listener = TcpListener::bind(socket).await.map_err(refused)?;
    let bound = Address::Tcp(listener.local_addr().map_err(refused)?);
    Ok((listener, bound))
}

/// Answers until it is dropped. A request is answered as it comes, so those that are open have not asked, or do not read: where all
/// places are taken, the oldest one makes room.
pub(crate) async fn answer(listener: TcpListener, overseen: MonitoringState) {
    // ends all that are open when this is dropped
    let mut tasks = JoinSet::new();
    let mut open: VecDeque<AbortHandle> = VecDeque::new();
    loop {
        let Ok((socket, _)) = listener.accept().await else {
            tokio::time::sleep(Duration::from_millis(50)).await;
            continue;
        };
        while tasks.try_join_next().is_some() {}
        open.retain(|task| !task.is_finished());
        if open.len() >= MAX_CONNECTIONS
            && let Some(oldest) = open.pop_front()
        {
            oldest.abort();
        }
        let overseen = overseen.clone();
        open.push_back(tasks.spawn(async move {
            let service = hyper::service::service_fn(move |request| {
                let reply = reply(&request, &overseen);
                async { Ok::<_, Infallible>(reply) }
            });
            let mut builder = hyper::server::conn::http1::Builder::new();
            builder.timer(TokioTimer::new()).header_read_timeout(PATIENCE).keep_alive(false).max_buf_size(8192);
            let _ = tokio::time::timeout(PATIENCE, builder.serve_connection(TokioIo::new(socket), service)).await;
        }));
    }
}

fn reply<B>(request: &Request<B>, overseen: &MonitoringState) -> Response<String> {
    let (status, body) = match (request.method(), request.uri().path()) {
        (&Method::GET, "/metrics") => (StatusCode::OK, text(&overseen.shared, &overseen.gate)),
        (&Method::GET, "/live") => (StatusCode::OK, "alive\n".to_owned()),
        (&Method::GET, "/ready") => match busy(&overseen.shared, &overseen.gate) {
            None => (StatusCode::OK, "ready\n".to_owned()),
            Some(why) => (StatusCode::SERVICE_UNAVAILABLE, format!("not ready: {why}\n")),
        },
        (&Method::GET, _) => (StatusCode::NOT_FOUND, "expected /metrics, /ready or /live\n".to_owned()),
        _ => (StatusCode::METHOD_NOT_ALLOWED, "expected GET\n".to_owned()),
    };
    let mut response = Response::new(body);
    *response.status_mut() = status;
    let kind = tonic::codegen::http::HeaderValue::from_static("text/plain; version=0.0.4; charset=utf-8");
    response.headers_mut().insert("content-type", kind);
    response
}
