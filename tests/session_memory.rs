//! Memory of a session.

use bimorph::compile::{CompileOptions, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, Mode, OpenRequest, Trial, TrialReply};
use bimorph::domains::Ramp;
use bimorph::equations::Bodies;
use bimorph::netlist::read_bundle;
use bimorph::solve::method::{Method, Motion};
use bimorph::solve::rodas4::Rodas4;
use std::path::Path;
use std::sync::Arc;

#[global_allocator]
static HEAP: dhat::Alloc = dhat::Alloc;

/// The bank of three bimorphs of the demonstration at 84 unknowns: the compiled model with an opened session stays below
/// 200 kB after a hundred accepted steps with rejected trials between them, and a Rodas4 step allocates nothing.
#[test]
fn a_bank_session_is_small_and_steps_allocate_nothing() {
    let _profiler = dhat::Profiler::builder().testing().build();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/bank/bank.net");
    let options = CompileOptions { band: Some(3e5), ..CompileOptions::default() };
    let before = dhat::HeapStats::get().curr_bytes;
    let compiled = Arc::new(compile(&read_bundle(&path, &[]).unwrap(), &options).unwrap());
    let mut device = LocalDevice::new(Arc::clone(&compiled));
    device.open(&OpenRequest::default()).unwrap();
    let mut reply = TrialReply::default();
    let ports = compiled.parts.system.electrics.ports;
    let mut ask = |mode, parent, volts: f64| {
        let voltages = vec![volts; ports];
        device.trial(&Trial { mode, parent, t: 0.0, dt: 1e-9, voltages: &voltages }, &mut reply).unwrap();
        let token = reply.token;
        if let (Some(token), Mode::Transient) = (token, mode) {
            device.accept(token);
        }
        token
    };
    let mut parent = ask(Mode::Static, None, 0.0);
    for k in 0..100 {
        ask(Mode::Static, parent, 0.1);
        parent = ask(Mode::Transient, parent, 1e-3 * f64::from(k % 7));
    }
    let used = dhat::HeapStats::get().curr_bytes - before;
    // of which 30,000 are the derivatives of the losses of contact, that of its comb at the sides of the fingers
    assert!(used < 210_000, "{used} bytes");

    let system = &compiled.parts.system;
    let mut rodas = Rodas4::new(system, &[]);
    let (mut motion, mut error) = (Motion::zeros(system.bodies()), Motion::zeros(system.bodies()));
    let sources = vec![1.0; system.electrics.sources()];
    let rise = vec![0.0; system.electrics.heating.states()];
    let ramp = Ramp::new(&system.electrics, &sources, &sources, &rise, 1e-6);
    let mut bodies = Bodies::new(system, &ramp);
    let blocks = dhat::HeapStats::get().total_blocks;
    for _ in 0..10 {
        rodas.step(&mut bodies, 0.0, 1e-8, &mut motion, &mut error).unwrap();
    }
    assert_eq!(dhat::HeapStats::get().total_blocks, blocks);
    println!("a compiled bank session of {} unknowns takes {used} bytes", system.model.unknowns());
}
