//! A server on a thread of its own, stopped when the test drops it.

use super::echo::echo;
use bimorph::compile::CompileOptions;
use bimorph::netlist::Bundle;
use bimorph::service::address::Address;
use bimorph::service::authentication::GuardFiles;
use bimorph::service::client::RemoteDevice;
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use bimorph::service::server::{MakeDevice, ServeError, ServeOptions, run_with};
use proto::bimorph_client::BimorphClient;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::sync::oneshot;
use tonic::transport::{Channel, Endpoint};

/// Long enough for a loaded machine, short enough for a hang to be seen.
pub(crate) const DEADLINE: Duration = Duration::from_secs(20);

/// A running server.
pub(crate) struct Running {
    pub address: Address,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<Result<(), ServeError>>>,
}

/// Starts a server with the echo device.
pub(crate) fn start(listen: &str, limits: Limits) -> Running {
    start_with(listen, limits, echo)
}

/// Starts a server.
pub(crate) fn start_with(listen: &str, limits: Limits, make: MakeDevice) -> Running {
    start_in(None, listen, limits, make)
}

/// Starts a server on port 0 whose states outlive it in a folder.
pub(crate) fn start_kept(folder: &Path, limits: Limits, make: MakeDevice) -> Running {
    start_in(Some(folder.to_owned()), "127.0.0.1:0", limits, make)
}

fn start_in(state_dir: Option<PathBuf>, listen: &str, limits: Limits, make: MakeDevice) -> Running {
    let listen = vec![listen.parse().expect("an address")];
    start_as(ServeOptions { listen, limits, state_dir, state_unsynced: true, ..ServeOptions::default() }, make)
}

/// Starts a server on port 0 that knows its clients by the tokens of a file.
pub(crate) fn start_guarded(tokens: &Path, limits: Limits, make: MakeDevice) -> Running {
    let listen = vec!["127.0.0.1:0".parse().expect("an address")];
    let guard = GuardFiles { token_file: Some(tokens.to_owned()), ..GuardFiles::default() };
    start_as(ServeOptions { listen, limits, guard, ..ServeOptions::default() }, make)
}

fn start_as(options: ServeOptions, make: MakeDevice) -> Running {
    let (stop, stopped) = oneshot::channel::<()>();
    let (ready, bound) = std::sync::mpsc::channel();
    let ready = Box::new(move |addresses: &[Address]| ready.send(addresses[0].clone()).expect("the test waits"));
    let options = ServeOptions { ready, ..options };
    let thread = std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        let outcome = runtime.block_on(run_with(options, make, async {
            let _ = stopped.await;
        }));
        runtime.shutdown_background();
        outcome
    });
    let address = bound.recv_timeout(DEADLINE).expect("the server starts");
    Running { address, stop: Some(stop), thread: Some(thread) }
}

impl Running {
    /// Stops it and waits for its end.
    pub(crate) fn stop(&mut self) -> Result<(), ServeError> {
        drop(self.stop.take());
        self.thread.take().map_or(Ok(()), |thread| thread.join().expect("the server does not panic"))
    }

    /// Requests it to stop.
    pub(crate) fn report(&mut self) {
        drop(self.stop.take());
    }

    /// An asynchronous client.
    pub(crate) async fn client(&self) -> BimorphClient<Channel> {
        let endpoint = Endpoint::from_shared(self.address.uri()).expect("a uri").timeout(DEADLINE);
        BimorphClient::new(endpoint.connect().await.expect("the server answers"))
    }

    /// A blocking device.
    pub(crate) fn device(&self) -> RemoteDevice {
        RemoteDevice::connect(&self.address.uri(), &bundle(), &CompileOptions::default(), DEADLINE)
            .expect("the server compiles")
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.stop();
    }
}

/// A lumped plate on a spring, k = 1 N/m, with one electrical port: `drive`.
pub(crate) const PLATE: &str = "param V=0
anchor  * [f] [l=1u w=1u h=1u]
mass2d  * [m] [m=1e-10]
guide2d * [m] []
spring2d * [f m] [kx=1]
anchor  * [e] [l=1u w=1u h=1u]
plategap2d * [m e] [A=1e-8 gap=2u]
eground * [e] []
drive port * [m e] []
";

/// The plate as a bundle.
pub(crate) fn bundle() -> Bundle {
    Bundle::from_text("plate.net", PLATE)
}

/// The plate as it travels.
pub(crate) fn wire_bundle() -> Option<proto::Bundle> {
    Some(bimorph::service::convert::model::bundle_to_wire(&bundle()))
}

/// Compiles the plate; its id.
pub(crate) async fn compiled(client: &mut BimorphClient<Channel>) -> String {
    let request = proto::CompileRequest { bundle: wire_bundle(), options: None };
    let response = client.compile(request).await.expect("the plate compiles").into_inner();
    response.model.expect("a description").id
}

/// Runs a future to its end on this thread.
pub(crate) fn block_on<T>(future: impl Future<Output = T>) -> T {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    runtime.block_on(async { tokio::time::timeout(3 * DEADLINE, future).await.expect("the test does not hang") })
}
