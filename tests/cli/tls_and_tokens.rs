//! TCP clients: `serve --tls-cert --tls-key --tls-client-ca --token-file`, over real sockets.
//!
//! The certificates are those of tests/tls: of one authority for this machine, an expired one, and one of a stranger.

use crate::command::{Bench, PLATE, Ran};
use crate::serve_process::Server;
use bimorph::compile::CompileOptions;
use bimorph::device::{Device, OpenRequest};
use bimorph::netlist::Bundle;
use bimorph::service::client::{Client, RemoteDevice};
use bimorph::service::credentials::Access;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::time::Duration;
use tonic::transport::Endpoint;
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_client::HealthClient;

const PATIENCE: Duration = Duration::from_secs(30);
pub(crate) const TOKEN: &str = "0123456789abcdef0123456789abcdef";

/// A file of certificates.
pub(crate) fn tls(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/tls")).join(name)
}

/// A folder with two token files: the server's and a wrong one.
pub(crate) fn bench() -> Bench {
    Bench::new(&[
        ("tokens", &format!("# who may ask\nalice {TOKEN}\nbob ffffffffffffffff\n")),
        ("alice", TOKEN),
        ("mallory", "0123456789abcdef0123456789abcdee"),
        ("plate.net", PLATE),
    ])
}

/// Options of a server with a certificate.
pub(crate) fn certified(name: &str) -> String {
    let (certificate, key) = (tls(&format!("{name}.pem")), tls(&format!("{name}.key")));
    format!("--listen 127.0.0.1:0 --tls-cert {} --tls-key {}", certificate.display(), key.display())
}

/// A client that trusts the authority and shows a token.
pub(crate) fn access(bench: &Bench, token: Option<&str>) -> Access {
    Access {
        authority: Some(tls("authority.pem")),
        token_file: token.map(|name| bench.path(name)),
        ..Access::default()
    }
}

fn with_certificate(access: Access, name: &str) -> Access {
    let (certificate, key) = (Some(tls(&format!("{name}.pem"))), Some(tls(&format!("{name}.key"))));
    Access { certificate, key, ..access }
}

/// Calls for the version: an error's code and message.
pub(crate) fn asked(address: &str, access: &Access) -> Result<String, (String, String)> {
    Client::connect_with(address, access, PATIENCE)
        .and_then(|mut client| client.version())
        .map_err(|error| (error.code, error.message))
}

fn refused(address: &str, access: &Access, code: &str, said: &str) {
    let (got, message) = asked(address, access).expect_err(said);
    assert_eq!(got, code, "{message}");
    assert!(message.contains(said), "expected \"{said}\", got \"{message}\"");
}

/// A token over TLS: served with the right one; none and a wrong one are UNAUTHENTICATED; whether the server is well
/// may be asked without. A plain client on a TLS address receives an error that says so, and a TLS client on a plain
/// address too.
#[test]
fn tokens_over_tls() {
    let bench = bench();
    let server = Server::start(&bench, &format!("{} --token-file tokens", certified("server")));
    let (address, right) = (server.address.as_str(), access(&bench, Some("alice")));
    assert!(address.starts_with("https://127.0.0.1:"), "{address}");
    assert_eq!(asked(address, &right).as_deref(), Ok(env!("CARGO_PKG_VERSION")));
    let bundle = Bundle::from_text("plate.net", PLATE);
    let mut device = RemoteDevice::connect_with(address, right.clone(), &bundle, &CompileOptions::default(), PATIENCE)
        .expect("compiles over TLS");
    device.open(&OpenRequest::default()).expect("a stream opens over TLS");

    refused(address, &access(&bench, None), "Unauthenticated", "requires a token: --token-file");
    refused(address, &access(&bench, Some("mallory")), "Unauthenticated", "none of this server's");
    let plain = address.replace("https://", "http://");
    refused(&plain, &right, "Unauthenticated", "speaks TLS: connect with https://");
    refused(address, &Access { authority: None, ..right.clone() }, "InvalidArgument", "BIMORPH_CA");
    let stranger = Access { authority: Some(tls("stranger.pem")), ..right.clone() };
    refused(address, &stranger, "Unavailable", "not of the authority");

    let open = Server::start(&bench, "--listen 127.0.0.1:0");
    refused(&format!("https://{}", open.address), &right, "Unavailable", "speaks no TLS");
}

/// Without TLS, on this machine, tokens are required over TCP and not over a Unix socket; health is open.
#[test]
fn tokens_without_tls() {
    let bench = bench();
    let socket = format!("unix://{}", bench.path("s.sock").display());
    let mut server = Server::start(&bench, &format!("--listen 127.0.0.1:0 --listen {socket} --token-file tokens"));
    let address = server.address.clone();
    assert_eq!(server.line("listening on "), socket);
    assert!(asked(&address, &access(&bench, Some("tokens"))).is_ok(), "the same file serves a single client");
    refused(&address, &access(&bench, None), "Unauthenticated", "requires a token");
    assert!(asked(&socket, &access(&bench, None)).is_ok(), "its mode lets in the owner alone");

    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    let well = runtime.block_on(async {
        let endpoint = Endpoint::from_shared(format!("http://{address}")).expect("a uri");
        let mut client = HealthClient::new(endpoint.connect().await.expect("connects"));
        client.check(HealthCheckRequest { service: String::new() }).await
    });
    assert!(well.is_ok(), "{well:?}");
}

/// A server whose certificate has expired is not talked to.
#[test]
fn an_expired_server() {
    let bench = bench();
    let server = Server::start(&bench, &certified("expired"));
    refused(&server.address, &access(&bench, Some("alice")), "Unavailable", "the server's certificate has expired");
}

/// Certificates of clients: served with a good one; none, an expired one and a stranger's are refused in the handshake.
#[test]
fn certificates_of_clients() {
    let bench = bench();
    let authority = tls("authority.pem");
    let server = Server::start(&bench, &format!("{} --tls-client-ca {}", certified("server"), authority.display()));
    let plain = access(&bench, None);
    assert!(asked(&server.address, &with_certificate(plain.clone(), "client")).is_ok());
    refused(&server.address, &plain, "Unavailable", "requires a client certificate");
    refused(&server.address, &with_certificate(plain.clone(), "client-expired"), "Unavailable", "it has expired");
    refused(&server.address, &with_certificate(plain.clone(), "client-stranger"), "Unavailable", "not of an authority");
    let halved = Access { certificate: Some(tls("client.pem")), ..plain };
    refused(&server.address, &halved, "InvalidArgument", "go together");
}

/// The command shows what its options and its environment say, to sweeps and to circuits' servers alike.
#[test]
fn commands_show_them_too() {
    let bench = bench();
    let server = Server::start(&bench, &format!("{} --token-file tokens", certified("server")));
    let words = format!("sweep plate.net --param gap=2u:3u:2 --analysis modes --count 1 --to {}", server.address);
    let shown = format!("{words} --ca {} --token-file alice", tls("authority.pem").display());
    let Ran { status, stdout, stderr } = bench.run(&shown);
    assert_eq!(status, 0, "{stderr}");
    assert_eq!(stdout.lines().count(), 3, "{stdout}");
    let mut command = bench.command(&words);
    let ran = command.env("BIMORPH_CA", tls("authority.pem")).env("BIMORPH_TOKEN_FILE", bench.path("alice")).output();
    let ran = ran.expect("it runs");
    assert_eq!(String::from_utf8_lossy(&ran.stdout), stdout, "{}", String::from_utf8_lossy(&ran.stderr));
    // an empty variable says nothing, and stops nothing that needs no server
    let here = words.split(" --to ").next().expect("words");
    let ran = bench.command(here).env("BIMORPH_CA", "").env("BIMORPH_CLIENT_KEY", "").output().expect("it runs");
    assert_eq!(String::from_utf8_lossy(&ran.stdout), stdout, "{}", String::from_utf8_lossy(&ran.stderr));
    let without = bench.run(&format!("{words} --ca {}", tls("authority.pem").display()));
    assert_eq!(without.status, 1);
    assert!(without.stderr.contains("requires a token"), "{}", without.stderr);
}

/// Addresses that others can reach require TLS and a client authentication; the message names the missing one. Files
/// that cannot be used are named, and a token is not sent unencrypted to another machine.
#[test]
fn what_is_not_enough_is_refused() {
    let bench = bench();
    let everywhere = certified("server").replace("127.0.0.1:0", "0.0.0.0:0");
    for (options, said) in [
        ("--listen 0.0.0.0:0".to_owned(), "--tls-cert"),
        ("--listen 0.0.0.0:0 --token-file tokens".to_owned(), "--tls-cert"),
        (everywhere.clone(), "--token-file"),
        ("--listen https://127.0.0.1:0".to_owned(), "--tls-cert and --tls-key"),
        (format!("--tls-cert {}", tls("server.pem").display()), "go together"),
        (format!("--tls-client-ca {}", tls("authority.pem").display()), "needs TLS"),
        ("--token-file nosuch".to_owned(), "token file nosuch"),
        ("--token-file plate.net".to_owned(), "token file plate.net:1"),
        (certified("server").replace("server.key", "client.key"), "server.pem"),
        (certified("server").replace("server.key", "server.pem"), "expected a private key"),
    ] {
        let ran = bench.run(&format!("serve {options}"));
        assert_eq!(ran.status, 1, "{options}");
        assert!(ran.stderr.contains(said), "{options}: {}", ran.stderr);
    }
    let server = Server::start(&bench, &format!("{everywhere} --token-file tokens"));
    let (_, port) = server.address.rsplit_once(':').expect("a port");
    assert!(asked(&format!("https://localhost:{port}"), &access(&bench, Some("alice"))).is_ok());
    refused("192.0.2.1:9", &access(&bench, Some("alice")), "InvalidArgument", "not sent unencrypted");
}

/// The doctor checks the files of settings: valid ones are reported, an expired certificate and a folder that cannot be
/// made are errors with a remedy.
#[test]
fn the_doctor_looks_at_settings() {
    let bench = bench();
    let settings = |certificate: &str, folder: &str| {
        let (certificate, key) = (tls(&format!("{certificate}.pem")), tls(&format!("{certificate}.key")));
        let text = format!(
            "tls_cert = \"{}\"\ntls_key = \"{}\"\ntoken_file = \"tokens\"\nstate_dir = \"{folder}\"\n",
            certificate.display(),
            key.display()
        );
        std::fs::write(bench.path("serve.toml"), text).expect("written");
        bench.run("doctor --config serve.toml")
    };
    let good = settings("server", "states");
    assert_eq!(good.status, 0, "{}{}", good.stdout, good.stderr);
    assert!(good.stdout.contains("more days; 2 tokens"), "{}", good.stdout);
    assert!(good.stdout.contains("ok       states   0 sessions"), "{}", good.stdout);
    assert!(!bench.path("states").exists(), "looking makes nothing");
    assert!(good.stdout.contains("others can read tokens: chmod 600"), "{}", good.stdout);
    let expired = settings("expired", "tokens/states");
    assert_eq!(expired.status, 1);
    for said in ["missing  access   certificate ", "it has expired", "missing  states   state folder "] {
        assert!(expired.stdout.contains(said), "{}", expired.stdout);
    }
}

/// A token file that others can read causes a warning at the start of a server, and a private one does not.
#[test]
fn a_token_file_that_others_can_read() {
    use std::fs::{Permissions, set_permissions};
    use std::os::unix::fs::PermissionsExt;
    let bench = bench();
    for (mode, reported) in [(0o644, true), (0o600, false)] {
        set_permissions(bench.path("tokens"), Permissions::from_mode(mode)).expect("set");
        // it ends by itself, at an address that metrics cannot have
        let ran = bench.run("serve --listen 127.0.0.1:0 --token-file tokens --metrics unix:///tmp/nosuch");
        assert_eq!(ran.status, 1);
        assert_eq!(ran.stderr.contains("others can read this file: chmod 600"), reported, "{mode:o}: {}", ran.stderr);
    }
}

/// A client that begins a handshake and stays silent blocks no other client, and loses its connection in time.
#[test]
fn an_unfinished_handshake_ends() {
    let bench = bench();
    let server = Server::start(&bench, &format!("{} --limit handshake=0.5", certified("server")));
    let place = server.address.trim_start_matches("https://");
    let mut silent = TcpStream::connect(place).expect("connects");
    silent.write_all(&[0x16, 3, 1]).expect("sent");
    assert!(asked(&server.address, &access(&bench, None)).is_ok(), "others are served meanwhile");
    silent.set_read_timeout(Some(PATIENCE)).expect("set");
    let mut rest = Vec::new();
    assert!(silent.read_to_end(&mut rest).is_ok_and(|_| rest.is_empty()), "{rest:?}");
}
