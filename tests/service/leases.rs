//! How long a session is kept without use, by the server that was asked and by the one after it.

use super::attached::Attached;
use super::test_server::{block_on, compiled, start_kept};
use bimorph::compile::CompiledModel;
use bimorph::device::Device;
use bimorph::device::local::LocalDevice;
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use proto::bimorph_client::BimorphClient;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use tonic::Code;
use tonic::transport::Channel;

fn device(compiled: Arc<CompiledModel>) -> Box<dyn Device> {
    Box::new(LocalDevice::new(compiled))
}

/// A kept session with an accepted state.
async fn kept(client: &mut BimorphClient<Channel>) -> (String, u64) {
    let model = compiled(client).await;
    let opened = client.open(proto::OpenRequest { model, ..Default::default() }).await.expect("opens").into_inner();
    let mut stream = Attached::to(client, &opened.session).await;
    let token = stream.trial(0, 0.0, 1.0).await.token;
    stream.accept(token).await;
    (opened.session, token)
}

async fn lease(client: &mut BimorphClient<Channel>, session: &str, lease_s: f64) -> Result<f64, Code> {
    let request = proto::KeepAliveRequest { session: session.to_owned(), lease_s };
    client.keep_alive(request).await.map(|reply| reply.into_inner().lease_s).map_err(|status| status.code())
}

/// Whether anything is left of a session.
fn is_left(folder: &Path, session: &str) -> bool {
    let files = std::fs::read_dir(folder.join("sessions")).expect("a folder");
    files.map(|file| file.expect("a file").file_name()).any(|name| name.to_string_lossy().starts_with(session))
}

/// A lease outlives the server as the states do. Of two sessions restored after a restart, the one without is removed
/// after `idle`, and then the other is still there, with the state that was accepted. A lease that was withdrawn has no
/// effect.
#[test]
fn a_lease_outlives_the_server() {
    let folder = tempfile::tempdir().expect("a folder");
    let server = start_kept(folder.path(), Limits::default(), device);
    let (leased, token, bare, back) = block_on(async {
        let mut client = server.client().await;
        let (leased, token) = kept(&mut client).await;
        let (bare, back) = (kept(&mut client).await.0, kept(&mut client).await.0);
        assert_eq!(lease(&mut client, &leased, 3600.0).await, Ok(3600.0));
        assert_eq!(lease(&mut client, &back, 3600.0).await, Ok(3600.0));
        lease(&mut client, &back, 0.0).await.expect("as long as any");
        (leased, token, bare, back)
    });
    drop(server);
    let limits = Limits { idle: Duration::from_millis(200), ..Limits::default() };
    let server = start_kept(folder.path(), limits, device);
    block_on(async {
        let mut client = server.client().await;
        for session in [&leased, &bare, &back] {
            let (stream, _) = Attached::join(&mut client, session).await.expect("wakes");
            drop(stream);
        }
        while is_left(folder.path(), &bare) || is_left(folder.path(), &back) {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        let (_stream, opened) = Attached::join(&mut client, &leased).await.expect("its lease lasts");
        assert_eq!(opened.accepted, token);
    });
}

/// A lease that cannot be kept is refused, as a state is, and the one before holds on.
#[test]
fn a_lease_that_cannot_be_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let server = start_kept(folder.path(), Limits::default(), device);
    let session = block_on(async { kept(&mut server.client().await).await.0 });
    drop(server);
    let server = start_kept(folder.path(), Limits { state_bytes: 1, ..Limits::default() }, device);
    block_on(async {
        let mut client = server.client().await;
        assert_eq!(lease(&mut client, &session, 60.0).await, Err(Code::ResourceExhausted));
        Attached::join(&mut client, &session).await.expect("it is still there");
    });
}
