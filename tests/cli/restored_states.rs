//! Content of a folder of states after a kill, for any previous events: every state that a client may go back to, of
//! any age, and no model that is half written.

use crate::command::PLATE;
use crate::monitoring::block_on;
use crate::stepping::Killed;
use bimorph::netlist::Bundle;
use bimorph::service::convert::model::bundle_to_wire;
use bimorph::service::proto;
use std::fs::{self, File};
use std::time::{Duration, SystemTime};
use tonic::Code;

/// A client that did not receive the reply to an accept repeats its step, or takes another one, from the last state
/// that it knows. That state is stored on every path to it.
#[test]
fn the_state_before_is_kept_on_every_route() {
    block_on(async {
        let mut server = Killed::start("").await;
        let session = server.open().await;
        let known = server.attach(&session).await.step(0, 0).await.expect("steps").0.token;

        // the first accept of a fork
        let request = proto::ForkRequest { session: session.clone() };
        let fork = server.wire.fork(request).await.expect("forks").into_inner().session;
        let next = server.attach(&fork).await.step(1, known).await.expect("steps").0;
        server.again().await;
        assert_eq!(server.attach(&fork).await.step(1, known).await.expect("the state before is kept").0, next);

        // a step that is taken again after a kill, and killed again
        for _ in 0..3 {
            assert_eq!(server.attach(&session).await.step(1, known).await.expect("the state before is kept").0, next);
            server.again().await;
        }

        // another step after an answer that was lost
        let other = server.attach(&session).await.step(2, known).await.expect("steps").0;
        server.again().await;
        assert_eq!(server.attach(&session).await.step(2, known).await.expect("the state before is kept").0, other);
    });
}

/// A server that was down for long has all states within their lifetime: the time without use counts from its start.
#[test]
fn states_outlive_a_weekend() {
    block_on(async {
        let mut server = Killed::start("").await;
        let session = server.open().await;
        let known = server.attach(&session).await.step(0, 0).await.expect("steps").0.token;
        server.kill();
        for entry in fs::read_dir(server.bench.path("states/sessions")).expect("a folder") {
            let file = File::options().write(true).open(entry.expect("an entry").path()).expect("opens");
            file.set_modified(SystemTime::now() - Duration::from_secs(3 * 86_400)).expect("set");
        }
        server.revive("").await;
        server.attach(&session).await.step(1, known).await.expect("goes on");
    });
}

/// A netlist that the machine left half written when it lost its power is written anew when a session of it opens.
#[test]
fn a_model_that_is_cut_is_written_anew() {
    block_on(async {
        let mut server = Killed::start("").await;
        server.open().await;
        server.kill();
        let models = fs::read_dir(server.bench.path("states/models")).expect("a folder");
        for entry in models {
            let file = File::options().write(true).open(entry.expect("an entry").path()).expect("opens");
            file.set_len(9).expect("cut");
        }
        server.revive("").await;
        let session = server.open().await;
        server.again().await;
        server.attach(&session).await.step(0, 0).await.expect("its model is compiled again");
    });
}

/// A server that runs no programs runs none of those that it finds, and leaves them.
#[test]
fn programs_are_not_run_to_wake() {
    let text = "-- a cantilever\np1 = material {Youngsmodulus=160e9, density=2300, h=2u}\nanchor {node 'a'; material=p1}\n\
                beam2d {node 'a', node 'b'; material=p1, l=100u, w=2u}\n";
    block_on(async {
        let mut server = Killed::start("--limit program_bytes=1M").await;
        let bundle = Some(bundle_to_wire(&Bundle::from_text("a.net", text)));
        let request = proto::CompileRequest { bundle, options: None };
        let model = server.wire.compile(request).await.expect("compiles").into_inner().model.expect("a model").id;
        let session = server.wire.open(proto::OpenRequest { model, ..Default::default() }).await.expect("opens");
        let session = session.into_inner().session;
        server.again().await;
        let (code, message) = server.try_attach(&session).await.err().expect("a program");
        assert_eq!(code, Code::ResourceExhausted);
        assert!(message.starts_with("program_bytes"), "{message}");
        server.kill();
        server.revive("--limit program_bytes=1M").await;
        server.attach(&session).await;
    });
}

/// A session whose model was dropped still forks: it has its model.
#[test]
fn a_fork_needs_no_model_that_is_named() {
    block_on(async {
        let mut server = Killed::start("--limit models=1").await;
        let session = server.open().await;
        let other = PLATE.replace("gap=2u", "gap=3u");
        let bundle = Some(bundle_to_wire(&Bundle::from_text("plate.net", &other)));
        server.wire.compile(proto::CompileRequest { bundle, options: None }).await.expect("compiles");
        server.wire.fork(proto::ForkRequest { session }).await.expect("forks");
    });
}

/// As above for an unfinished job: its missing points are computed where programs are allowed again, and it reports the
/// reason until then.
#[test]
fn programs_are_not_run_to_go_on() {
    let text = "-- a cantilever\np1 = material {Youngsmodulus=160e9, density=2300, h=2u}\nanchor {node 'a'; material=p1}\n\
                beam2d {node 'a', node 'b'; material=p1, l=100u, w=2u}\n";
    block_on(async {
        let mut server = Killed::start("--limit program_bytes=1M").await;
        let bundle = Some(bundle_to_wire(&Bundle::from_text("a.net", text)));
        let modes = proto::sweep_spec::Analysis::Modes(proto::SweepModes { count: 1, ..Default::default() });
        let spec = proto::SweepSpec { analysis: Some(modes), ..Default::default() };
        let task = Some(proto::submit_job_request::Task::Sweep(spec));
        let request = proto::SubmitJobRequest { bundle, task, ..Default::default() };
        let name = server.wire.submit_job(request).await.expect("starts").into_inner().name;
        let first = ended(&mut server, &name).await;
        assert_eq!(first.metadata.as_ref().map(|about| (about.rows, about.failed)), Some((1, 0)));
        server.kill();
        let id = name.strip_prefix("jobs/").expect("a name");
        fs::remove_file(server.bench.path(&format!("states/jobs/{id}.end"))).expect("removed");
        File::create(server.bench.path(&format!("states/jobs/{id}.rows"))).expect("cut");
        server.revive("").await;
        let refused = ended(&mut server, &name).await;
        let Some(proto::job::Result::Error(error)) = refused.result else { panic!("{refused:?}") };
        assert!(
            error.code == Code::ResourceExhausted as i32 && error.message.starts_with("program_bytes"),
            "{error:?}"
        );
        server.kill();
        server.revive("--limit program_bytes=1M").await;
        assert_eq!(ended(&mut server, &name).await.result, first.result);
    });
}

/// A job as it ended.
async fn ended(server: &mut Killed, name: &str) -> proto::Job {
    let watch = proto::WatchJobRequest { name: name.to_owned() };
    let mut watched = server.wire.watch_job(watch).await.expect("it is kept").into_inner();
    let mut last = None;
    while let Some(job) = watched.message().await.expect("goes on") {
        last = Some(job);
    }
    last.filter(|job| job.done).expect("it ended")
}
