//! Random request sequences never kill the server: after each, it still answers as before.

use super::echo::PANIC;
use super::test_server::{Running, block_on, compiled, start};
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use proptest::prelude::*;
use proto::device_request::Kind as Ask;
use std::sync::OnceLock;
use tokio_stream::StreamExt;

fn server() -> &'static Running {
    static SERVER: OnceLock<Running> = OnceLock::new();
    SERVER.get_or_init(|| start("127.0.0.1:0", Limits::default()))
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![any::<f64>(), Just(1.0), Just(PANIC), Just(f64::NAN), Just(0.0)]
}

/// Any message at all; "MODEL" stands for the id of a real model.
fn request() -> impl Strategy<Value = Option<Ask>> {
    let name = prop_oneof![Just("p".to_owned()), Just("q".to_owned()), Just("t".to_owned()), ".{0,8}"];
    let model = prop_oneof![4 => Just("MODEL".to_owned()), 1 => ".{0,40}"];
    let names = || prop::collection::vec(name.clone(), 0..3);
    let open = (model, names(), names()).prop_map(|(model, ports, signals)| {
        let signals = signals.into_iter().filter(|s| s == "t").collect();
        Ask::Open(proto::OpenRequest { model, ports, signals, noise: None })
    });
    let trial = (any::<i32>(), any::<u64>(), number(), number(), prop::collection::vec(number(), 0..4), any::<bool>())
        .prop_map(|(mode, parent, t, dt, voltages, plain)| {
            let (mode, parent) = if plain { (1, 0) } else { (mode, parent) };
            Ask::Trial(proto::TrialRequest { mode, parent, t, dt, voltages })
        });
    let accept =
        any::<u64>().prop_map(|token| Ask::Accept(proto::Accept { token, answer: token % 2 == 0, warn: false }));
    let linearize = (any::<u64>(), number())
        .prop_map(|(token, omega)| Ask::Linearize(proto::SmallSignalRequest { token, omega, noise: token % 2 == 0 }));
    let attach = ".{0,12}".prop_map(|session| Ask::Attach(proto::Attach { session }));
    prop_oneof![
        3 => open.prop_map(Some),
        6 => trial.prop_map(Some),
        2 => accept.prop_map(Some),
        2 => linearize.prop_map(Some),
        1 => attach.prop_map(Some),
        1 => Just(None),
    ]
}

/// Any values in the unary calls.
fn analysis() -> impl Strategy<Value = proto::TransientRequest> {
    (".{0,8}", number(), any::<u32>(), number(), prop::collection::vec(".{0,5}", 0..3)).prop_map(
        |(model, stop_s, points, tol, signals)| proto::TransientRequest {
            model: if model.len() % 2 == 0 { "MODEL".into() } else { model },
            stop_s,
            signals,
            points: points % 50,
            tol,
            ..Default::default()
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Every request but an accept without a reply has one reply, in order, for any content.
    #[test]
    fn streams_survive_anything(kinds in prop::collection::vec(request(), 1..24)) {
        block_on(async {
            let mut client = server().client().await;
            let model = compiled(&mut client).await;
            let requests: Vec<_> = kinds
                .into_iter()
                .map(|kind| match kind {
                    Some(Ask::Open(open)) if open.model == "MODEL" => {
                        Some(Ask::Open(proto::OpenRequest { model: model.clone(), ..open }))
                    }
                    other => other,
                })
                .map(|kind| proto::DeviceRequest { kind })
                .collect();
            let expected = requests.iter().filter(|r| !matches!(&r.kind, Some(Ask::Accept(a)) if !a.answer)).count();
            let replies = client.trial(tokio_stream::iter(requests)).await.expect("a stream").into_inner();
            let count = replies.map(|reply| reply.expect("a reply, not a broken stream")).collect::<Vec<_>>().await.len();
            assert_eq!(count, expected);
            compiled(&mut client).await;
        });
    }

    /// A transient with any values ends with a status, and the server continues.
    #[test]
    fn analyses_survive_anything(request in analysis()) {
        block_on(async {
            let mut client = server().client().await;
            let model = compiled(&mut client).await;
            let known = request.model == "MODEL";
            let request = proto::TransientRequest { model: if known { model } else { request.model }, ..request };
            if request.stop_s > 0.0 && request.stop_s < f64::INFINITY {
                // A real run; the other test files have those.
                return;
            }
            assert!(client.transient(request).await.is_err());
            compiled(&mut client).await;
        });
    }
}
