//! Faults around a running server: silent clients, changed or damaged files, and one client that takes all resources.

use crate::command::{Bench, PLATE};
use crate::monitoring::{block_on, get, start};
use crate::serve_process::Server;
use crate::stepping::{Stream, client, compiled};
use crate::tls_and_tokens::{TOKEN, access, bench as guarded, tls};
use bimorph::netlist::Bundle;
use bimorph::service::client::Client;
use bimorph::service::convert::model::bundle_to_wire;
use bimorph::service::proto;
use proto::bimorph_client::BimorphClient;
use proto::device_request::Kind as Ask;
use proto::job_metadata::State;
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;
use tonic::metadata::MetadataValue;
use tonic::service::interceptor::InterceptedService;
use tonic::transport::{Channel, Endpoint};
use tonic::{Code, Request, Status};

/// Tokens and certificates are read again at SIGHUP, also without TLS; a file that is wrong changes nothing; the server lives on.
#[test]
fn hangup_reads_tokens_and_certificates_again() {
    let bench = guarded();
    for (name, ending) in [("server", "pem"), ("server", "key")] {
        std::fs::copy(tls(&format!("{name}.{ending}")), bench.path(&format!("own.{ending}"))).expect("copied");
    }
    let mut server =
        Server::start(&bench, "--listen 127.0.0.1:0 --tls-cert own.pem --tls-key own.key --token-file tokens");
    let tokens = |token: &str| format!("carol {token}\n");
    let wait = |server: &mut Server, is_so: &dyn Fn() -> bool| {
        server.report("-HUP");
        let asked = std::time::Instant::now();
        while !is_so() {
            assert!(asked.elapsed() < Duration::from_secs(20), "it is not read");
            std::thread::sleep(Duration::from_millis(10));
        }
    };
    let address = server_uri(&server.address);
    let knows = |bench: &Bench, token: &str| {
        Client::connect_with(&address, &access(bench, Some(token)), Duration::from_secs(20))
            .and_then(|mut client| client.version())
            .is_ok()
    };
    assert!(knows(&bench, "alice") && !knows(&bench, "mallory"));
    // another client is known, and the first one is not
    std::fs::write(bench.path("tokens"), tokens("0123456789abcdef0123456789abcdee")).expect("written");
    wait(&mut server, &|| knows(&bench, "mallory"));
    assert!(!knows(&bench, "alice"));
    // a file that is wrong
    std::fs::write(bench.path("tokens"), "short\n").expect("written");
    server.report("-HUP");
    server.line("stay as they were");
    assert!(knows(&bench, "mallory"));
    // a certificate that has expired
    std::fs::write(bench.path("tokens"), tokens(TOKEN)).expect("written");
    for ending in ["pem", "key"] {
        std::fs::copy(tls(&format!("expired.{ending}")), bench.path(&format!("own.{ending}"))).expect("copied");
    }
    wait(&mut server, &|| !knows(&bench, "mallory"));
    assert!(!knows(&bench, "alice"), "its certificate is another one");
    assert_eq!(server.signal("-TERM"), Some(0));
}

fn server_uri(address: &str) -> String {
    if address.contains("://") { address.to_owned() } else { format!("https://{address}") }
}

/// A hangup of a server without files, before it has any client, neither.
#[test]
fn hangup_ends_no_server() {
    let bench = Bench::new(&[]);
    let mut server = Server::start(&bench, &format!("--listen unix://{}", bench.path("s").display()));
    server.report("-HUP");
    block_on(async {
        client(&server.address).await.info(proto::InfoRequest {}).await.expect("it is there");
    });
    assert_eq!(server.signal("-TERM"), Some(0));
    assert!(!bench.path("s").exists());
}

/// Two hundred silent connections do not block the metrics for others.
#[test]
fn silent_connections_to_the_metrics_make_room() {
    let bench = Bench::new(&[]);
    let (_server, metrics) = start(&bench, "");
    let silent: Vec<_> = (0..200).map(|_| TcpStream::connect(&metrics).expect("connects")).collect();
    for _ in 0..20 {
        assert_eq!(get(&metrics, "/ready").0, 200);
    }
    drop(silent);
}

/// With 64 open files, and many silent connections, a client is served; the server says how many fit, and so does the doctor.
#[test]
#[cfg(target_os = "linux")]
fn connections_fit_into_open_files() {
    let bench = Bench::new(&[("serve.toml", "listen = \"127.0.0.1:0\"\n")]);
    let within = |words: &str| {
        let mut shell = Command::new("sh");
        let script = format!("ulimit -n 64 && exec \"$0\" {words}");
        shell.args(["-c", &script, env!("CARGO_BIN_EXE_bimorph")]).current_dir(bench.path(""));
        shell
    };
    let server = Server::spawn(within("serve --listen 127.0.0.1:0"));
    let silent: Vec<_> = (0..200).map(|_| TcpStream::connect(&server.address).expect("connects")).collect();
    block_on(async {
        let asked = async {
            let endpoint = Endpoint::from_shared(format!("http://{}", server.address)).expect("a uri");
            // one that came at the same moment as others may have to make room
            loop {
                if let Ok(channel) = endpoint.connect().await
                    && BimorphClient::new(channel).info(proto::InfoRequest {}).await.is_ok()
                {
                    return;
                }
            }
        };
        tokio::time::timeout(Duration::from_secs(5), asked).await.expect("it is served");
    });
    drop(silent);
    let doctor = within("doctor --config serve.toml").output().expect("runs");
    let reported = String::from_utf8_lossy(&doctor.stdout).into_owned();
    assert!(reported.contains("missing  files    connections: 512 do not fit into 64 open files"), "{reported}");
    let whole = bench.run("doctor --config serve.toml");
    assert!(whole.stdout.contains("ok       files"), "{}", whole.stdout);
}

/// The only file of the folder whose name ends so.
fn file(folder: &Path, ending: &str) -> PathBuf {
    let mut found = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    found.find(|path| path.to_string_lossy().ends_with(ending)).expect("such a file")
}

fn flip(path: &Path) {
    let mut bytes = std::fs::read(path).expect("there");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(path, bytes).expect("written");
}

async fn rows(wire: &mut BimorphClient<Channel>, name: &str) -> Result<Vec<proto::JobRow>, Status> {
    let request = proto::FetchJobRequest { name: name.to_owned(), ..Default::default() };
    let mut stream = wire.fetch_job(request).await?.into_inner();
    let mut rows = Vec::new();
    while let Some(chunk) = stream.message().await? {
        rows.extend(chunk.rows);
    }
    Ok(rows)
}

/// A row of a finished job that is damaged is computed again, and the job is done only when it has all of them.
#[test]
fn damaged_rows_of_finished_jobs_are_computed_again() {
    let bench = Bench::new(&[]);
    let options = format!("--listen unix://{} --state-dir states", bench.path("s").display());
    let request = proto::SubmitJobRequest {
        bundle: Some(bundle_to_wire(&Bundle::from_text("plate.net", PLATE))),
        task: Some(proto::submit_job_request::Task::Sweep(proto::SweepSpec {
            parameters: vec![proto::SweepParameter {
                name: "gap".into(),
                values: Some(proto::sweep_parameter::Values::Linear(proto::Linear {
                    low: 1.5e-6,
                    high: 2.5e-6,
                    count: 100,
                })),
            }],
            analysis: Some(proto::sweep_spec::Analysis::Static(proto::SweepStatic::default())),
            ..Default::default()
        })),
        request_id: "one".into(),
        ..Default::default()
    };
    let mut server = Server::start(&bench, &options);
    let (name, before) = block_on(async {
        let mut wire = client(&server.address).await;
        let name = wire.submit_job(request.clone()).await.expect("submitted").into_inner().name;
        (name.clone(), rows(&mut wire, &name).await.expect("all rows"))
    });
    assert_eq!(before.len(), 100);
    assert_eq!(server.signal("-TERM"), Some(0));
    flip(&file(&bench.path("states/jobs"), ".rows"));
    let mut server = Server::start(&bench, &options);
    let sorted = |rows: Vec<proto::JobRow>| {
        let mut rows: Vec<_> = rows.into_iter().map(|row| row.row.expect("a row")).collect();
        rows.sort_by_key(|row| row.point);
        rows
    };
    block_on(async {
        let mut wire = client(&server.address).await;
        let after = rows(&mut wire, &name).await.expect("all rows");
        assert_eq!(sorted(after), sorted(before));
        let job = wire.get_job(proto::GetJobRequest { name: name.clone() }).await.expect("there").into_inner();
        let metadata = job.metadata.expect("metadata");
        assert_eq!((metadata.state(), metadata.rows), (State::Done, 100));
    });
    // and one that is damaged while the server runs is not done
    flip(&file(&bench.path("states/jobs"), ".rows"));
    block_on(async {
        let mut wire = client(&server.address).await;
        assert_eq!(rows(&mut wire, &name).await.expect_err("damaged").code(), Code::DataLoss);
        let job = wire.get_job(proto::GetJobRequest { name: name.clone() }).await.expect("there").into_inner();
        assert_eq!(job.metadata.expect("metadata").state(), State::Failed);
    });
    server.line_with(&["damaged", "1 of 100"]);
}

/// A stored session whose newest file is damaged continues from the state before; with both damaged, its owner receives
/// an error. The log has both.
#[test]
fn damaged_sessions_are_reported() {
    let bench = Bench::new(&[]);
    let options = format!("--listen unix://{} --state-dir states", bench.path("s").display());
    let mut server = Server::start(&bench, &options);
    let (session, tokens) = block_on(async {
        let mut wire = client(&server.address).await;
        let model = compiled(&mut wire).await;
        let open = proto::OpenRequest { model, ..Default::default() };
        let session = wire.open(open).await.expect("opens").into_inner().session;
        let attach = Ask::Attach(proto::Attach { session: session.clone() });
        let (mut stream, _) = Stream::start(&mut wire, attach).await.expect("attaches");
        let first = stream.step(0, 0).await.expect("a step").0.token;
        let second = stream.step(1, first).await.expect("a step").0.token;
        (session, [first, second])
    });
    server.signal("-KILL");
    // states are written in turn, the first of the session at its opening
    let folder = bench.path("states/sessions");
    let newest = [".0", ".1"]
        .map(|slot| file(&folder, slot))
        .into_iter()
        .max_by_key(|path| std::fs::metadata(path).and_then(|found| found.modified()).expect("a time"));
    flip(&newest.expect("two files"));
    let mut server = Server::start(&bench, &options);
    let attach = || Ask::Attach(proto::Attach { session: session.clone() });
    block_on(async {
        let mut wire = client(&server.address).await;
        let (_, opened) = Stream::start(&mut wire, attach()).await.expect("it goes on");
        assert_eq!(opened.accepted, tokens[0]);
    });
    server.line_with(&["not whole", &session]);
    server.signal("-KILL");
    for slot in [".0", ".1"] {
        let path = file(&folder, slot);
        std::fs::write(path, b"bimorph states 2 and nothing of them").expect("written");
    }
    let server = Server::start(&bench, &options);
    block_on(async {
        let mut wire = client(&server.address).await;
        let refused = Stream::start(&mut wire, attach()).await.err().expect("nothing is left");
        assert_eq!(refused.code(), Code::DataLoss, "{refused}");
    });
}

type Known =
    BimorphClient<InterceptedService<Channel, Box<dyn FnMut(Request<()>) -> Result<Request<()>, Status> + Send>>>;

async fn known(address: &str, token: &str) -> Known {
    let channel = Endpoint::from_shared(format!("http://{address}")).expect("a uri").connect().await.expect("connects");
    let value: MetadataValue<_> = format!("Bearer {token}").parse().expect("a header");
    let shows = move |mut request: Request<()>| {
        request.metadata_mut().insert("authorization", value.clone());
        Ok(request)
    };
    BimorphClient::with_interceptor(channel, Box::new(shows))
}

/// With tokens, and nothing said of limits, a client that takes all it can leaves sessions, jobs and models to another one, and never takes
/// a model whose session is open.
#[test]
fn one_client_leaves_the_others_their_part() {
    let bench = Bench::new(&[("tokens", "alice 0123456789abcdef-alice\nbob 0123456789abcdef-bob\n")]);
    let server = Server::start(&bench, "--listen 127.0.0.1:0 --token-file tokens");
    block_on(async {
        let mut alice = known(&server.address, "0123456789abcdef-alice").await;
        let mut bob = known(&server.address, "0123456789abcdef-bob").await;
        let bundle = |k: usize| Some(bundle_to_wire(&Bundle::from_text("plate.net", &format!("{PLATE}\n% {k}\n"))));
        let own = bob.compile(proto::CompileRequest { bundle: bundle(0), options: None }).await.expect("compiles");
        let own = own.into_inner().model.expect("a model").id;
        let mut last = String::new();
        for k in 1..=70 {
            let answer =
                alice.compile(proto::CompileRequest { bundle: bundle(k), options: None }).await.expect("compiles");
            last = answer.into_inner().model.expect("a model").id;
        }
        bob.describe(proto::DescribeRequest { model: own.clone() }).await.expect("it is there");
        let open = |model: &str| proto::OpenRequest { model: model.to_owned(), ..Default::default() };
        let (opened, refused) = loop_until(&mut alice, &open(&last)).await;
        assert_eq!((opened, refused.code()), (64, Code::ResourceExhausted), "{refused}");
        assert!(refused.message().starts_with("client_sessions"), "{refused}");
        bob.open(open(&own)).await.expect("bob has room");
        let endless = |k: usize| proto::SubmitJobRequest {
            bundle: bundle(0),
            task: Some(proto::submit_job_request::Task::Sweep(proto::SweepSpec {
                parameters: vec![proto::SweepParameter {
                    name: "gap".into(),
                    values: Some(proto::sweep_parameter::Values::Linear(proto::Linear {
                        low: 1.5e-6,
                        high: 2.5e-6,
                        count: 900_000,
                    })),
                }],
                analysis: Some(proto::sweep_spec::Analysis::PullIn(proto::SweepPullIn {
                    max_v: 30.0,
                    ..Default::default()
                })),
                ..Default::default()
            })),
            request_id: format!("{k}"),
            ..Default::default()
        };
        let mut jobs = 0;
        let refused = loop {
            match alice.submit_job(endless(jobs)).await {
                Ok(_) => jobs += 1,
                Err(status) => break status,
            }
        };
        assert_eq!((jobs, refused.code()), (8, Code::ResourceExhausted), "{refused}");
        bob.submit_job(endless(99)).await.expect("bob has room");
        // defaults are reported
        let settings = bob.info(proto::InfoRequest {}).await.expect("reported").into_inner().settings;
        let reported = settings.iter().find(|setting| setting.name == "client_sessions").expect("reported");
        assert_eq!((reported.value.as_str(), reported.source.as_str()), ("64", "default"));
    });
}

/// Opens sessions until one is refused: how many there are, and why not more.
async fn loop_until(client: &mut Known, open: &proto::OpenRequest) -> (usize, Status) {
    let mut opened = 0;
    loop {
        match client.open(open.clone()).await {
            Ok(_) => opened += 1,
            Err(status) => return (opened, status),
        }
    }
}
