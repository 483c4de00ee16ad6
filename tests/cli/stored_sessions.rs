//! `serve --state-dir`: accepted states outlive a server that is killed at any moment; none is lost and none doubled.

use crate::command::Bench;
use crate::serve_process::Server;
use crate::stepping::{Stream, client, compiled};
use bimorph::service::proto;
use proto::device_request::Kind as Ask;
use std::process::Command;
use std::time::Duration;

/// Longest life of a server that is to be killed, from where its fate is decided (µs).
const LONGEST_LIFE: u64 = 4000;

/// Numbers without chance: SplitMix64 (Steele, Lea, Flood 2014).
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    pub(crate) fn below(&mut self, most: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % most
    }
}

/// Kills a process that soon does not live any more.
pub(crate) fn kill_after(id: u32, life: Duration) {
    std::thread::spawn(move || {
        std::thread::sleep(life);
        let _ = Command::new("kill").args(["-KILL", &id.to_string()]).status();
    });
}

/// A run through so many killed servers has the bits of one without kills: confirmed states are there again, with the
/// state before, and each step is in the run once. Prints the number of kills between a step and the reply to its
/// accept.
async fn killed(kills: usize) {
    let bench = Bench::new(&[]);
    let options = format!("--listen unix://{} --state-dir states", bench.path("s").display());
    let mut server = Server::start(&bench, &options);
    let mut wire = client(&server.address).await;
    let model = compiled(&mut wire).await;
    let request = proto::OpenRequest { model, ports: vec![], signals: vec!["m.x".into()], noise: None };

    let session = wire.open(request.clone()).await.expect("opens").into_inner();
    assert!(session.kept && session.accepted == 0);
    let attach = || Ask::Attach(proto::Attach { session: session.session.clone() });
    let (mut stream, _) = Stream::start(&mut wire, attach()).await.expect("attaches");
    let (mut numbers, mut parent, mut between) = (Numbers(12), 0, 0);
    let mut done: Vec<proto::TrialReply> = Vec::new();
    for round in 0..=kills {
        if round < kills {
            kill_after(server.id(), Duration::from_micros(numbers.below(LONGEST_LIFE)));
        }
        let last = done.len() + 20;
        while round < kills || done.len() < last {
            match stream.step(done.len(), parent).await {
                Ok((reply, kept)) => {
                    assert!(kept);
                    parent = reply.token;
                    done.push(reply);
                }
                Err(_) if round < kills => break,
                Err(status) => panic!("{status}"),
            }
        }
        if round == kills {
            break;
        }
        assert_eq!(server.signal("-KILL"), None);
        server = Server::start(&bench, &options);
        wire = client(&server.address).await;
        let (again, opened) = Stream::start(&mut wire, attach()).await.expect("it is kept");
        stream = again;
        if opened.accepted != parent {
            // accepted, and killed before the reply: the step is repeated, with the same state
            between += 1;
            let (reply, _) = stream.step(done.len(), parent).await.expect("the state before is kept as well");
            assert_eq!(reply.token, opened.accepted);
            parent = reply.token;
            done.push(reply);
        }
    }
    let (mut whole, opened) = Stream::start(&mut wire, Ask::Open(request)).await.expect("the model is here");
    assert!(!opened.kept, "a session of a stream ends with it");
    let (mut expected, mut parent) = (Vec::new(), 0);
    for step in 0..done.len() {
        let (reply, kept) = whole.step(step, parent).await.expect("steps");
        assert!(!kept);
        parent = reply.token;
        expected.push(reply);
    }
    assert_eq!(done, expected);
    println!("{kills} kills, {} steps, {between} kills between a state and the word of it", done.len());
}

fn run(kills: usize) {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    runtime.block_on(killed(kills));
}

/// Three kills.
#[test]
fn three_kills() {
    run(3);
}

/// A hundred: `make soak`.
#[test]
#[ignore = "a minute; make soak"]
fn soak_kills() {
    run(100);
}

/// Steps of a stored session with and without syncing, beside one that is not stored: `make soak` prints them.
#[test]
#[ignore = "a measurement; make soak"]
fn soak_cost_of_keeping() {
    const STEPS: u32 = 2000;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    for options in ["", "--state-dir states --state-unsynced", "--state-dir states"] {
        let bench = Bench::new(&[]);
        let server = Server::start(&bench, &format!("--listen unix://{} {options}", bench.path("s").display()));
        let per_step = runtime.block_on(async {
            let mut wire = client(&server.address).await;
            let model = compiled(&mut wire).await;
            let request = proto::OpenRequest { model, ports: vec![], signals: vec![], noise: None };
            let session = wire.open(request).await.expect("opens").into_inner().session;
            let attach = Ask::Attach(proto::Attach { session });
            let (mut stream, _) = Stream::start(&mut wire, attach).await.expect("attaches");
            let (start, mut parent) = (std::time::Instant::now(), 0);
            for step in 0..STEPS {
                parent = stream.step(step as usize, parent).await.expect("steps").0.token;
            }
            start.elapsed() / STEPS
        });
        println!("{per_step:?} a step with an accept that is answered, serve {options}");
    }
}
