//! Monitoring endpoints over plain HTTP/1.1 at an address of their own: `/metrics`, `/ready`, `/live`.
//!
//! They report nothing secret and require no token. A connection answers once and closes; few are open at once.

use super::report::{MonitoringState, busy, text};
use crate::server::ServeError;
use bimorph_http::HttpLimits;
use bimorph_wire::address::Address;
use std::time::Duration;
use tokio::net::TcpListener;
use tonic::codegen::http::{Method, Request, Response, StatusCode};

/// Longest time of a connection.
const PATIENCE: Duration = Duration::from_secs(5);
/// Limits of connections. Each answers once.
const LIMITS: HttpLimits = HttpLimits { connections: 16, head: PATIENCE, head_bytes: 8192, whole: Some(PATIENCE) };

/// Opens the address.
pub(crate) async fn bind(address: &Address) -> Result<(TcpListener, Address), ServeError> {
    let Address::Tcp(socket) = address else { return Err(ServeError::Metrics { address: address.clone() }) };
    let refused = |reason| ServeError::Bind { address: address.clone(), reason };
    let listener = TcpListener::bind(socket).await.map_err(refused)?;
    let bound = Address::Tcp(listener.local_addr().map_err(refused)?);
    Ok((listener, bound))
}

/// Answers until it is dropped.
pub(crate) async fn answer(listener: TcpListener, overseen: MonitoringState) {
    let answer = move |request: Request<_>| {
        let reply = reply(&request, &overseen);
        async { reply }
    };
    bimorph_http::serve(listener, LIMITS, answer).await;
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
