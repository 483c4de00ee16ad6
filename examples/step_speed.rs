//! Time of a step of a lumped plate over an electrode, of the engine alone: trial and accept, as a circuit asks. It prints microseconds.
//!
//!     cargo run --release --example step_speed [STEPS]     default 100000

use bimorph::compile::{CompileOptions, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, Mode, OpenRequest, Status, Trial, TrialReply};
use bimorph::netlist::Bundle;
use std::sync::Arc;
use std::time::Instant;

/// That of scripts/step-cost-python.
const PLATE: &str = "anchor  * [f] [l=1u w=1u h=1u]
mass2d  * [m] [m=1e-10]
guide2d * [m] []
spring2d * [f m] [kx=1]
anchor  * [e] [l=1u w=1u h=1u]
plategap2d * [m e] [A=1e-8 gap=2u]
eground * [e] []
drive port * [m e] []
";
const DT: f64 = 1e-7;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let steps = std::env::args().nth(1).map_or(Ok(100_000), |count| count.parse::<u32>())?;
    let compiled = compile(&Bundle::from_text("plate.net", PLATE), &CompileOptions::default())?;
    let mut device = LocalDevice::new(Arc::new(compiled));
    device.open(&OpenRequest { signals: vec!["m.x".into()], ..OpenRequest::default() })?;
    let mut reply = TrialReply::default();
    device.trial(&Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: &[2.0] }, &mut reply)?;
    let start = Instant::now();
    for k in 0..steps {
        let volts = [2.0 + 0.1 * f64::from(k % 7)];
        let t = f64::from(k + 1) * DT;
        device.trial(&Trial { mode: Mode::Transient, parent: reply.token, t, dt: DT, voltages: &volts }, &mut reply)?;
        let token = reply.token.filter(|_| reply.status == Status::Ok).ok_or("a step was not taken")?;
        device.accept(token);
    }
    println!("{:.4}", 1e6 * start.elapsed().as_secs_f64() / f64::from(steps.max(1)));
    Ok(())
}
