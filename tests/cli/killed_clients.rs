//! Clients that are killed at any moment, in the middle of a step too. The server continues, accepted states are there,
//! each step is in the run once, and unreachable sessions are gone.

use crate::command::Bench;
use crate::monitoring::{block_on, get, start, value};
use crate::serve_process::Server;
use crate::stepping::{Stream, client, compiled};
use bimorph::service::proto;
use proto::device_request::Kind as Ask;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Where a client goes, and which session it steps; without one it opens its own of a model.
const ADDRESS: &str = "KILLED_ADDRESS";
const SESSION: &str = "KILLED_SESSION";
const MODEL: &str = "KILLED_MODEL";
/// Most checks until the server has released the resources of a killed client.
const LOOKS: usize = 5000;

fn open(model: &str) -> Ask {
    Ask::Open(proto::OpenRequest { model: model.to_owned(), signals: vec!["m.x".into()], ..Default::default() })
}

/// No test but the client: it steps until it is killed, and says of which states it has heard.
#[test]
#[ignore = "a client that the tests beside it start and kill"]
fn one_client() {
    let var = |name| std::env::var(name).ok();
    let Some(address) = var(ADDRESS) else { return };
    block_on(async {
        let mut wire = client(&address).await;
        let first = match (var(SESSION), var(MODEL)) {
            (Some(session), _) => Ask::Attach(proto::Attach { session }),
            (None, model) => open(&model.expect("a model")),
        };
        let (mut stream, _) = Stream::start(&mut wire, first).await.expect("a stream");
        let mut parent = 0;
        for step in 0.. {
            parent = stream.step(step, parent).await.expect("steps").0.token;
            println!("heard {parent}");
        }
    });
}

/// Runs a client until it has received so many states, kills it, and returns all received states.
fn killed(address: &str, session: Option<&str>, model: &str, after: usize) -> Vec<u64> {
    let mut command = Command::new(std::env::current_exe().expect("this program"));
    command.args(["killed_clients::one_client", "--exact", "--ignored", "--nocapture"]);
    command.env(ADDRESS, address).env(MODEL, model).envs(session.map(|session| (SESSION, session)));
    let mut child = command.stdout(Stdio::piped()).spawn().expect("it starts");
    let lines = BufReader::new(child.stdout.take().expect("its words")).lines().map_while(Result::ok);
    let mut heard = Vec::new();
    for line in lines {
        let Some(token) = line.split("heard ").nth(1) else { continue };
        // the last word may be cut short by the kill
        heard.extend(token.parse::<u64>());
        if heard.len() == after {
            child.kill().expect("it is killed");
        }
    }
    child.wait().expect("it has ended");
    heard
}

/// So many clients are killed, every other one on a kept session and the others on one of their own.
fn run(clients: usize) {
    let bench = Bench::new(&[]);
    let (server, metrics): (Server, String) = start(&bench, "--state-dir states --state-unsynced --max-sessions 200");
    let address = format!("http://{}", server.address);
    block_on(async {
        let mut wire = client(&address).await;
        let model = compiled(&mut wire).await;
        let mut sessions = Vec::new();
        for _ in 0..clients {
            let Ask::Open(request) = open(&model) else { panic!("an open") };
            sessions.push(wire.open(request).await.expect("opens").into_inner().session);
        }
        let mut heard: Vec<Vec<u64>> = Vec::new();
        for (batch, ids) in sessions.chunks(10).enumerate() {
            let running: Vec<_> = (ids.iter().enumerate())
                .flat_map(|(k, id)| [(k, Some(id.clone())), (k, None)])
                .map(|(k, id)| {
                    let (address, model) = (address.clone(), model.clone());
                    // 1 to 41 states, by a stride that is prime to their number
                    let after = 1 + (10 * batch + k) * 17 % 41;
                    std::thread::spawn(move || (id.is_some(), killed(&address, id.as_deref(), &model, after)))
                })
                .collect();
            let done = running.into_iter().map(|one| one.join().expect("it was killed"));
            heard.extend(done.filter(|(kept, _)| *kept).map(|(_, heard)| heard));
        }
        let most = heard.iter().map(Vec::len).max().expect("clients") + 3;
        let (mut whole, _) = Stream::start(&mut wire, open(&model)).await.expect("a stream");
        let (mut expected, mut parent) = (Vec::new(), 0);
        for step in 0..most {
            let reply = whole.step(step, parent).await.expect("steps").0;
            parent = reply.token;
            expected.push(reply);
        }
        let mut between = 0;
        for (id, heard) in sessions.iter().zip(&heard) {
            assert!(!heard.is_empty());
            assert!(heard.iter().eq(expected[..heard.len()].iter().map(|reply| &reply.token)), "{heard:?}");
            let attach = Ask::Attach(proto::Attach { session: id.clone() });
            let (mut stream, opened) = Stream::start(&mut wire, attach).await.expect("it is there");
            let mut parent = *heard.last().expect("states");
            // accepted, and killed before the reply
            between += usize::from(opened.accepted != parent);
            assert!([parent, expected[heard.len()].token].contains(&opened.accepted), "{}", opened.accepted);
            for (step, expected) in expected.iter().enumerate().skip(heard.len()).take(3) {
                let reply = stream.step(step, parent).await.expect("goes on").0;
                assert_eq!(&reply, expected);
                parent = reply.token;
            }
            drop(stream);
            wire.close(proto::CloseRequest { session: id.clone() }).await.expect("closes");
        }
        drop(whole);
        let left = || {
            let text = get(&metrics, "/metrics").1;
            ["bimorph_sessions", "bimorph_calls", "bimorph_held_bytes", "bimorph_kept_bytes"].map(|m| value(&text, m))
        };
        for _ in 0..LOOKS {
            if left() == [0.0; 4] {
                break;
            }
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
        assert_eq!(left(), [0.0; 4], "sessions, calls, held and kept bytes");
        println!(
            "{clients} clients of kept sessions and {clients} others killed, {between} between a state and the word of it"
        );
    });
}

/// Five of each.
#[test]
fn five_killed_clients() {
    run(5);
}

/// A hundred of each: `make soak`.
#[test]
#[ignore = "minutes; make soak"]
fn soak_a_hundred_killed_clients() {
    run(100);
}
