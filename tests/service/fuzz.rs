//! Any bytes as messages and as snapshots: each call ends, with a status that is no fault of the server's, and the
//! server continues.
//!
//! Messages are sound ones of every call, changed at random: bits turned, bytes exchanged, stretches lost, doubled and
//! mixed, numbers made extreme. Snapshots are those of a session, changed in the same ways, with a recomputed checksum
//! as in a forgery. A few run with every test; `make fuzz` runs them for minutes.

use super::attached::{Attached, trial};
use super::test_server::{DEADLINE, Running, compiled, start_with};
use super::valid_requests::sound;
use bimorph::content::Fnv;
use bimorph::device::local::LocalDevice;
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use prost::Message;
use prost::bytes::{Buf, BufMut};
use proto::device_reply::Kind;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::time::{Duration, Instant};
use tokio_stream::StreamExt;
use tonic::codec::{Codec, DecodeBuf, Decoder, EncodeBuf, Encoder};
use tonic::codegen::http::uri::PathAndQuery;
use tonic::transport::{Channel, Endpoint};
use tonic::{Code, Status};

/// Calls with every test, and snapshots.
const QUICK: [usize; 2] = [600, 300];
/// Answers of a stream that are read at most.
const READ: usize = 200;

/// Messages as the bytes that they are.
#[derive(Default)]
struct Bytes;

impl Codec for Bytes {
    type Encode = Vec<u8>;
    type Decode = Vec<u8>;
    type Encoder = Self;
    type Decoder = Self;

    fn encoder(&mut self) -> Self {
        Self
    }

    fn decoder(&mut self) -> Self {
        Self
    }
}

impl Encoder for Bytes {
    type Item = Vec<u8>;
    type Error = Status;

    fn encode(&mut self, item: Vec<u8>, into: &mut EncodeBuf<'_>) -> Result<(), Status> {
        into.put_slice(&item);
        Ok(())
    }
}

impl Decoder for Bytes {
    type Item = Vec<u8>;
    type Error = Status;

    fn decode(&mut self, from: &mut DecodeBuf<'_>) -> Result<Option<Vec<u8>>, Status> {
        let mut item = vec![0; from.remaining()];
        from.copy_to_slice(&mut item);
        Ok(Some(item))
    }
}

/// A server with real devices, whose computations are short.
fn server() -> Running {
    let limits = Limits { cpu: Duration::from_secs(2), sweep_points: 1000, sweeps: 1000, ..Limits::default() };
    start_with("127.0.0.1:0", limits, |compiled| Box::new(LocalDevice::new(compiled)))
}

struct Maker(ChaCha8Rng);

impl Maker {
    fn below(&mut self, most: usize) -> usize {
        (self.0.next_u64() % most.max(1) as u64) as usize
    }

    /// Eight bytes of a number at the end of its range.
    fn extreme(&mut self) -> [u8; 8] {
        let numbers = [f64::NAN, f64::INFINITY, 1e300, -1.0, 1e-310, -0.0, f64::from_bits(u64::MAX), 1e18];
        numbers[self.below(numbers.len())].to_le_bytes()
    }

    /// Changes some bytes of `bytes`, or mixes those of `other` with them.
    fn change(&mut self, bytes: &mut Vec<u8>, other: &[u8]) {
        let (at, length) = (self.below(bytes.len()), 1 + self.below(24));
        let end = (at + length).min(bytes.len());
        match self.below(8) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << self.below(8),
            1 if !bytes.is_empty() => bytes[at] = self.0.next_u32() as u8,
            2 => drop(bytes.drain(at..end)),
            3 => {
                let again = bytes[at..end].repeat(1 + self.below(6));
                bytes.splice(at..at, again);
            }
            4 => drop(bytes.splice(at..at, [0xff; 9].into_iter().chain([1])).count()),
            5 if bytes.len() >= 8 => {
                let at = self.below(bytes.len() - 7);
                bytes[at..at + 8].copy_from_slice(&self.extreme());
            }
            6 => bytes.truncate(at),
            _ => {
                let from = self.below(other.len());
                let to = (from + length).min(other.len());
                bytes.splice(at..at, other[from..to].iter().copied());
            }
        }
    }
}

/// The server's end of a call: its answers' number, or its status.
async fn answered(channel: &Channel, call: &str, messages: Vec<Vec<u8>>) -> Result<usize, Status> {
    let path: PathAndQuery = format!("/bimorph.v1.Bimorph/{call}").parse().expect("a path");
    let mut grpc = tonic::client::Grpc::new(channel.clone());
    grpc.ready().await.expect("the server is there");
    let request = tonic::Request::new(tokio_stream::iter(messages));
    let mut answers = grpc.streaming(request, path, Bytes).await?.into_inner();
    let mut count = 0;
    while count < READ && answers.next().await.transpose()?.is_some() {
        count += 1;
    }
    Ok(count)
}

/// A session of the plate with an accepted state, and its snapshot.
async fn session(server: &Running) -> (String, String, Vec<u8>) {
    let mut client = server.client().await;
    let model = compiled(&mut client).await;
    let open = proto::OpenRequest { model: model.clone(), ports: vec![], signals: vec!["m.x".into()], noise: None };
    let session = client.open(open).await.expect("opens").into_inner().session;
    let mut stream = Attached::to(&mut client, &session).await;
    let first = stream.trial(0, 0.0, 1.0).await;
    stream.trial(first.token, 1e-7, 1.1).await;
    drop(stream);
    let request = proto::SnapshotRequest { session: session.clone(), token: 0 };
    let snapshot = client.snapshot(request).await.expect("a snapshot").into_inner().snapshot;
    (model, session, snapshot)
}

/// Calls until `done`, from `seed`.
fn messages(seed: u64, mut done: impl FnMut(usize) -> bool) {
    let server = server();
    let mut maker = Maker(ChaCha8Rng::seed_from_u64(seed));
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    let (mut count, mut fine) = (0, 0);
    runtime.block_on(async {
        let (model, own, snapshot) = session(&server).await;
        let channel = Endpoint::from_shared(server.address.uri()).expect("a uri").connect().await.expect("connects");
        let sound = sound(&model, &own, &snapshot);
        for (call, message) in &sound {
            // what is changed below is sound before it is changed, but for sessions, sweeps and jobs that are not there
            let answer = answered(&channel, call, vec![message.clone()]).await;
            let not_here = answer.as_ref().is_err_and(|status| status.code() == Code::NotFound);
            assert!(answer.is_ok() || not_here, "{call}: {answer:?}");
        }
        for none in [vec![], vec![vec![0xff]]] {
            let status = answered(&channel, "Describe", none).await.expect_err("no message of the protocol");
            assert_eq!(status.code(), Code::InvalidArgument, "{status:?}");
        }
        while !done(count) {
            let (call, first) = &sound[maker.below(sound.len())];
            let other = sound[maker.below(sound.len())].1.clone();
            let mut all = vec![first.clone()];
            if *call == "Trial" {
                let more = sound.iter().filter(|(call, _)| *call == "Trial").map(|(_, message)| message.clone());
                all.extend(more);
            }
            for _ in 0..1 + maker.below(4) {
                let at = maker.below(all.len());
                maker.change(&mut all[at], &other);
            }
            let reported = all.clone();
            match tokio::time::timeout(DEADLINE, answered(&channel, call, all)).await {
                Ok(Ok(_)) => fine += 1,
                Ok(Err(status)) => {
                    let fault = matches!(status.code(), Code::Unknown | Code::DataLoss | Code::Internal);
                    assert!(!fault, "seed {seed}, call {count}, {call}: {status:?}\n{reported:?}");
                }
                Err(_) => panic!("seed {seed}, call {count}, {call} has no end:\n{reported:?}"),
            }
            count += 1;
            if count.is_multiple_of(100) {
                let info = proto::InfoRequest {}.encode_to_vec();
                assert_eq!(answered(&channel, "Info", vec![info]).await.expect("it goes on"), 1);
            }
        }
    });
    println!("{count} calls, {fine} of them have an answer");
    assert!(fine > 0 && fine < count, "{fine} of {count}");
}

/// Snapshots until `done`, from `seed`: each is refused, or is a session whose next step is a reply with finite numbers.
fn snapshots(seed: u64, mut done: impl FnMut(usize) -> bool) {
    /// Name and version of the envelope, and its checksum.
    const HEAD: usize = 17;
    let server = server();
    let mut maker = Maker(ChaCha8Rng::seed_from_u64(seed));
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    let (mut count, mut opened) = (0, 0);
    runtime.block_on(async {
        let (model, _, sound) = session(&server).await;
        let mut client = server.client().await;
        while !done(count) {
            let mut body = sound[HEAD + 16..].to_vec();
            for _ in 0..1 + maker.below(3) {
                maker.change(&mut body, &sound);
            }
            let mut sealed = Fnv::default();
            sealed.bytes(&body);
            // one in eight with the checksum that it had
            let sum = if maker.below(8) == 0 {
                sound[HEAD..HEAD + 16].to_vec()
            } else {
                sealed.value().to_le_bytes().to_vec()
            };
            let snapshot = [&sound[..HEAD], &sum, &body].concat();
            let reported = format!("seed {seed}, snapshot {count}: {snapshot:?}");
            let request = proto::RestoreRequest { model: model.clone(), snapshot };
            match tokio::time::timeout(DEADLINE, client.restore(request)).await.expect(&reported) {
                Err(status) => {
                    let refused =
                        [Code::InvalidArgument, Code::FailedPrecondition, Code::ResourceExhausted, Code::NotFound];
                    assert!(refused.contains(&status.code()), "{status:?} {reported}");
                }
                Ok(restored) => {
                    opened += 1;
                    let session = restored.into_inner().session;
                    let mut stream = Attached::to(&mut client, &session).await;
                    let answer = stream.ask(trial(2, 1e-7, 1.2));
                    // a fault means that the state is invalid, or no longer there
                    if let Kind::Trial(reply) = tokio::time::timeout(DEADLINE, answer).await.expect(&reported)
                        && reply.status() == proto::trial_reply::Status::Ok
                    {
                        let mut numbers = reply.currents.iter().chain(&reply.charges).chain(&reply.di_dv);
                        assert!(numbers.all(|x| x.is_finite()), "{reply:?} {reported}");
                    }
                    drop(stream);
                    client.close(proto::CloseRequest { session }).await.expect(&reported);
                }
            }
            count += 1;
        }
    });
    println!("{count} snapshots, {opened} of them open");
    assert!(opened > 0 && opened < count, "{opened} of {count}");
}

#[test]
fn a_few_messages() {
    messages(1, |count| count >= QUICK[0]);
}

#[test]
fn a_few_snapshots() {
    snapshots(1, |count| count >= QUICK[1]);
}

/// For `FUZZ_MINUTES` (min), each time with others: the seed is the time, and is printed on failure.
fn for_minutes() -> (u64, impl FnMut(usize) -> bool) {
    let minutes: f64 = std::env::var("FUZZ_MINUTES").ok().and_then(|text| text.parse().ok()).unwrap_or(10.0);
    let end = Instant::now() + Duration::from_secs_f64(60.0 * minutes);
    let seed = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0, |d| d.as_secs());
    (seed, move |_| Instant::now() > end)
}

#[test]
#[ignore = "minutes: make fuzz"]
fn fuzz_messages() {
    let (seed, done) = for_minutes();
    messages(seed, done);
}

#[test]
#[ignore = "minutes: make fuzz"]
fn fuzz_snapshots() {
    let (seed, done) = for_minutes();
    snapshots(seed, done);
}
