//! A message costs what has arrived of it, and not what its head announces. Against the command itself, whose allocator is not that of
//! these tests.
#![cfg(target_os = "linux")]

use super::serve_process::{Victim, netlist};
use super::test_server::block_on;
use bimorph::service::proto;
use std::time::{Duration, Instant};
use tonic::Code;

/// Most memory of a server whose clients announce much and send nothing (kB).
const MAX_KB: u64 = 300 << 10;

/// A thousand calls of five bytes announce 64 MiB each, on twenty connections, in an address space of 6 GiB, which holds 96 of them.
/// `Info` and a `Check` of others are answered, and little memory is held.
#[test]
fn a_thousand_announcements() {
    let victim = Victim::within(6, &[]);
    block_on(async {
        let mut wire = victim.wire().await;
        let mut held = Vec::new();
        for _ in 0..20 {
            held.push(wire.announcing(50, 64 << 20).await);
        }
        let mut waits = Vec::new();
        for _ in 0..50 {
            let start = Instant::now();
            wire.info(proto::InfoRequest {}).await.expect("it is alive");
            waits.push(start.elapsed());
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        waits.sort();
        println!("Info: p50 {:?}, worst {:?}; {} MB", waits[25], waits[49], victim.peak_kb() >> 10);
        assert!(waits[49] < Duration::from_secs(5), "{waits:?}");
        let check = wire.check(proto::CheckRequest { bundle: netlist("anchor * [f] []"), options: None }).await;
        check.expect("others have room");
        drop(held);
    });
    assert!(victim.peak_kb() < MAX_KB, "{} kB", victim.peak_kb());
}

/// A message of 8 MiB that is sent whole is decoded whole, in frames of any size; one of more than a message may have is refused by
/// its head.
#[test]
fn long_messages_arrive() {
    let victim = Victim::started(&["--limit", "message_bytes=16M", "--limit", "connection_bytes=16M"]);
    block_on(async {
        let mut wire = victim.wire().await;
        let text = format!(
            "anchor * [f] []\n{}",
            "% a comment of sixty characters, of which there are very many\n".repeat(120_000)
        );
        let answer = wire.check(proto::CheckRequest { bundle: netlist(&text), options: None }).await.expect("decoded");
        assert!(answer.into_inner().rendered.contains("anchor"), "the netlist was read");
        let long = wire.check(proto::CheckRequest { bundle: netlist(&text.repeat(3)), options: None }).await;
        assert_eq!(long.expect_err("too long").code(), Code::ResourceExhausted);
        wire.info(proto::InfoRequest {}).await.expect("the connection goes on");
    });
}
