//! A sound message of every call.

use super::test_server::wire_bundle;
use bimorph::service::convert::run::pack;
use bimorph::service::proto;
use prost::Message;
use proto::device_request::Kind;

/// A call, and a sound message of it.
pub(crate) type Sound = (&'static str, Vec<u8>);

/// A port at a voltage.
fn volts() -> Vec<proto::Named> {
    vec![proto::Named { name: "drive".into(), value: 1.5 }]
}

fn options() -> Option<proto::CompileOptions> {
    Some(proto::CompileOptions { tol: Some(1e-3), segments: Some(3), ..Default::default() })
}

/// Of every call; several are as large as their fields are many.
pub(crate) fn sound(model: &str, session: &str, snapshot: &[u8]) -> Vec<Sound> {
    let model = || model.to_owned();
    [of_models(&model), of_sessions(&model, session, snapshot), of_jobs()].concat()
}

/// Of calls that compile and analyse.
fn of_models(model: &dyn Fn() -> String) -> Vec<Sound> {
    vec![
        ("Info", proto::InfoRequest {}.encode_to_vec()),
        ("Check", proto::CheckRequest { bundle: wire_bundle(), options: options() }.encode_to_vec()),
        ("Compile", proto::CompileRequest { bundle: wire_bundle(), options: options() }.encode_to_vec()),
        (
            "Convert",
            proto::ConvertRequest {
                name: "x.cif".into(),
                layout: b"DS 1 1 1;\nL POLY1;\nB 10000 200 5000 0;\nL ANCHOR1;\nB 600 600 0 0;\nDF;\nC 1;\nE\n"
                    .to_vec(),
                process: "polymumps".into(),
                ..Default::default()
            }
            .encode_to_vec(),
        ),
        ("Describe", proto::DescribeRequest { model: model() }.encode_to_vec()),
        ("Static", proto::StaticRequest { model: model(), voltages: volts(), ..Default::default() }.encode_to_vec()),
        ("Modes", proto::ModesRequest { model: model(), count: 2, voltages: volts(), quality: false }.encode_to_vec()),
        (
            "FrequencyResponse",
            proto::FrequencyResponseRequest {
                model: model(),
                drive: "drive".into(),
                signals: vec!["m.x".into()],
                from_hz: 1e3,
                to_hz: 1e5,
                points: 20,
                ..Default::default()
            }
            .encode_to_vec(),
        ),
        ("PullIn", proto::PullInRequest { model: model(), port: "drive".into(), max_v: 50.0 }.encode_to_vec()),
        (
            "Export",
            proto::ExportRequest {
                model: model(),
                ports: vec![proto::Scaled { name: "drive".into(), scale: Some(1.0) }],
                signals: vec![proto::Scaled { name: "m.x".into(), scale: Some(1e6) }],
                voltages: volts(),
                to_hz: 1e6,
                within: 1e-3,
                count: 1,
                name: "plate".into(),
                ..Default::default()
            }
            .encode_to_vec(),
        ),
        (
            "Path",
            proto::PathRequest {
                model: model(),
                along: "drive".into(),
                to: 8.0,
                signals: vec!["m.x".into()],
                points: 20,
                ..Default::default()
            }
            .encode_to_vec(),
        ),
        (
            "Transient",
            proto::TransientRequest {
                model: model(),
                stop_s: 1e-5,
                signals: vec!["m.x".into()],
                points: 20,
                tol: 1e-3,
                voltages: volts(),
                ..Default::default()
            }
            .encode_to_vec(),
        ),
    ]
}

/// Of calls about sessions.
fn of_sessions(model: &dyn Fn() -> String, session: &str, snapshot: &[u8]) -> Vec<Sound> {
    let session = session.to_owned();
    let open =
        || proto::OpenRequest { model: model(), ports: vec!["drive".into()], signals: vec!["m.x".into()], noise: None };
    let ask = |kind| proto::DeviceRequest { kind: Some(kind) }.encode_to_vec();
    let trial = proto::TrialRequest { mode: 2, parent: 0, t: 0.0, dt: 1e-7, voltages: vec![1.0] };
    vec![
        ("Open", open().encode_to_vec()),
        ("Trial", ask(Kind::Open(open()))),
        ("Trial", ask(Kind::Trial(trial))),
        ("Trial", ask(Kind::Attach(proto::Attach { session: session.clone() }))),
        ("Trial", ask(Kind::Linearize(proto::SmallSignalRequest { token: 0, omega: 1e5, noise: true }))),
        (
            "Linearize",
            proto::LinearizeRequest { session: session.clone(), token: 1, omega: vec![1e5, 1e6], noise: true }
                .encode_to_vec(),
        ),
        (
            "Run",
            proto::RunRequest {
                lanes: vec![proto::RunLane { session: session.clone(), start: pack(&[0.0]), ..Default::default() }],
                times: pack(&[1e-7, 2e-7]),
                values: pack(&[1.0]),
                signals: vec!["m.x".into()],
                ports: true,
                warn: false,
            }
            .encode_to_vec(),
        ),
        ("Snapshot", proto::SnapshotRequest { session: session.clone(), token: 0 }.encode_to_vec()),
        ("Restore", proto::RestoreRequest { model: model(), snapshot: snapshot.to_vec() }.encode_to_vec()),
        ("Fork", proto::ForkRequest { session: session.clone() }.encode_to_vec()),
        ("KeepAlive", proto::KeepAliveRequest { session, lease_s: 60.0 }.encode_to_vec()),
        ("Close", proto::CloseRequest { session: "none".into() }.encode_to_vec()),
    ]
}

/// Of calls about sweeps.
fn of_jobs() -> Vec<Sound> {
    let linear = proto::sweep_parameter::Values::Linear(proto::Linear { low: 0.0, high: 1.0, count: 3 });
    let statics = proto::SweepStatic { outputs: vec!["m.y".into()], voltages: volts() };
    let spec = proto::SweepSpec {
        parameters: vec![proto::SweepParameter { name: "V".into(), values: Some(linear) }],
        analysis: Some(proto::sweep_spec::Analysis::Static(statics)),
        ..Default::default()
    };
    vec![
        (
            "SubmitJob",
            proto::SubmitJobRequest {
                bundle: wire_bundle(),
                options: options(),
                task: Some(proto::submit_job_request::Task::Sweep(spec.clone())),
                share: true,
                ..Default::default()
            }
            .encode_to_vec(),
        ),
        (
            "SubmitSweep",
            proto::SubmitSweepRequest {
                bundle: wire_bundle(),
                options: options(),
                spec: Some(spec),
                ..Default::default()
            }
            .encode_to_vec(),
        ),
        ("GetJob", proto::GetJobRequest { name: "jobs/x".into() }.encode_to_vec()),
        ("ListJobs", proto::ListJobsRequest { page_size: 2, ..Default::default() }.encode_to_vec()),
        ("WatchJob", proto::WatchJobRequest { name: "jobs/x".into() }.encode_to_vec()),
        (
            "FetchJob",
            proto::FetchJobRequest { name: "jobs/x".into(), first_row: 1, only_finished: true }.encode_to_vec(),
        ),
        ("CancelJob", proto::CancelJobRequest { name: "jobs/x".into() }.encode_to_vec()),
        ("DeleteJob", proto::DeleteJobRequest { name: "jobs/x".into() }.encode_to_vec()),
        ("WatchSweep", proto::WatchSweepRequest { sweep: "x".into() }.encode_to_vec()),
        ("FetchSweep", proto::FetchSweepRequest { sweep: "x".into() }.encode_to_vec()),
        ("CancelSweep", proto::CancelSweepRequest { sweep: "x".into() }.encode_to_vec()),
    ]
}
