//! Clients of an earlier version are understood: their bytes, not only their messages.

use bimorph::service::in_process::InProcessServer;
use bimorph::service::proto;
use tonic::Code;

/// Requests of older clients, byte by byte as version 0.1 encoded them, are accepted, and the replies are unchanged.
#[test]
fn bytes_of_older_clients_are_understood() {
    fn field(number: u8, bytes: &[u8]) -> Vec<u8> {
        let mut length = bytes.len();
        let mut out = vec![number << 3 | 2];
        while length > 127 {
            out.push((length & 127) as u8 | 128);
            length >>= 7;
        }
        out.push(length as u8);
        out.extend(bytes);
        out
    }
    let inside = InProcessServer::new().expect("a thread");
    let text = super::test_server::PLATE;
    let file = [field(1, b"plate.net"), field(2, text.as_bytes())].concat();
    let bundle = [field(1, b"plate.net"), field(2, &file)].concat();
    // V from 0 to 1 in 5 values; pull-in below 1 V, which no point has
    let linear = [&[0x11][..], &1f64.to_le_bytes(), &[0x18, 5]].concat();
    let axis = [field(1, b"V"), field(2, &linear)].concat();
    let pull_in = [field(1, b"drive"), [&[0x11][..], &1f64.to_le_bytes()].concat()].concat();
    let spec = [field(1, &axis), field(4, &pull_in)].concat();
    let submit = [field(1, &bundle), field(3, &spec), field(4, b"mine")].concat();
    let answer = inside.call("SubmitSweep", &submit, &|| true).expect("starts");
    assert_eq!((&answer[..2], &answer[34..]), (&[0x0a, 32][..], &[0x10, 5][..]));
    assert_eq!(inside.call("SubmitSweep", &submit, &|| true).expect("is known"), answer);
    let sweep = field(1, &answer[2..34]);
    let mut states = inside.stream("WatchSweep", &sweep).expect("a stream");
    let mut last = Vec::new();
    while let Some(state) = states.next(&|| true).expect("goes on") {
        last = state;
    }
    assert_eq!(last, [0x08, 2, 0x10, 5, 0x18, 5, 0x20, 5], "done, 5 of 5, 5 failed");
    let mut table = inside.stream("FetchSweep", &sweep).expect("a stream");
    let chunk = table.next(&|| true).expect("goes on").expect("a chunk");
    assert!(chunk.starts_with(&field(1, b"V")), "parameters first");
    let rows = <proto::SweepChunk as prost::Message>::decode(&*chunk).expect("a chunk").rows;
    assert!(rows.iter().map(|row| (row.point, row.error.is_empty())).eq((0..5).map(|point| (point, false))));
    assert!(table.next(&|| true).expect("goes on").is_none());
    assert!(inside.call("CancelSweep", &sweep, &|| true).expect("forgotten").is_empty());
    assert_eq!(inside.call("CancelSweep", &sweep, &|| true).expect_err("is gone").code(), Code::NotFound);
}
