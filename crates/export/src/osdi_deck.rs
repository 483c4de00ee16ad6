//! A deck of ngspice (44 or later) that loads an exported module as OSDI, holds it at its operating point and sweeps its band.
//!
//! Each port has a source against ground: a voltage of the operating point, or a current of 0 where a flow is given. The
//! first of them has the small signal of 1.

use super::file::{ExportedFile, FileContent};
use super::linear::ReducedPort;
use bimorph_device::PortKind;
use std::fmt::Write;

/// Points of a decade of the sweep.
const PER_DECADE: usize = 20;

/// The deck of `file`, whose compiled module is the file `library`; `ports` are those of
/// [`write_with_ports`](super::file::FileRequest::write_with_ports).
pub fn write(file: &ExportedFile, ports: &[ReducedPort], library: &str) -> String {
    let version = env!("CARGO_PKG_VERSION");
    let ExportedFile { name, pins, content, .. } = file;
    let mut text = format!("* {name} as OSDI in ngspice 44 or later, written by bimorph {version} export\n");
    let node = |k: usize| &pins[2 * k];
    let mut shown: Vec<String> = Vec::new();
    let mut device = String::from("N1");
    for k in 0..ports.len() {
        let _ = write!(device, " {} 0", node(k));
    }
    for pin in &pins[2 * ports.len()..] {
        let _ = write!(device, " {pin}");
        shown.push(format!("v({pin})"));
    }
    let _ = writeln!(text, "{device} part\n.model part {name}");
    for (k, port) in ports.iter().enumerate() {
        let small = u8::from(k == 0);
        let _ = writeln!(text, "* {}: {}", port.name, port.meaning());
        if port.kind.given_flow() {
            let _ = writeln!(text, "Isrc{0} 0 {1} DC 0 AC {small}", k + 1, node(k));
            shown.push(format!("v({})", node(k)));
        } else {
            let bias = port.bias.unwrap_or(0.0);
            let _ = writeln!(text, "Vsrc{0} {1} 0 DC {bias:e} AC {small}", k + 1, node(k));
            if port.kind == PortKind::Electrical {
                shown.push(format!("i(vsrc{})", k + 1));
            }
        }
    }
    let _ = writeln!(text, ".control\npre_osdi {library}\nop\nprint {}", shown.join(" "));
    if let FileContent::Linear(linear) = content {
        let [from, to] = linear.band_hz;
        let magnitudes: Vec<String> = shown.iter().map(|shown| format!("abs({shown})")).collect();
        let _ = writeln!(text, "ac dec {PER_DECADE} {from:e} {to:e}\nprint {}", magnitudes.join(" "));
    }
    text.push_str(".endc\n.end\n");
    text
}
