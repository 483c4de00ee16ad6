//! Mechanics alone: tangent, factorization, solve and one Rodas4 step of a bank of three thermal bimorphs, and one
//! transient trial of the device with its partials.

use bimorph::compile::{CompileOptions, CompiledModel, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, Mode, OpenRequest, Trial, TrialReply};
use bimorph::domains::Ramp;
use bimorph::equations::Bodies;
use bimorph::multibody::planar::Pose;
use bimorph::multibody::{BodyMatrix, forces};
use bimorph::netlist::read_bundle;
use bimorph::solve::method::{Method, Motion};
use bimorph::solve::rodas4::Rodas4;
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;

/// The bank of the demonstration, resolved to 300 kHz at a tolerance of 1e-3.
fn bank() -> Arc<CompiledModel> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/bank/bank.net");
    let bundle = read_bundle(&path, &[]).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let options = CompileOptions { band: Some(3e5), ..CompileOptions::default() };
    Arc::new(compile(&bundle, &options).unwrap_or_else(|e| panic!("{e}")))
}

fn mechanics(c: &mut Criterion) {
    let compiled = bank();
    let system = &compiled.parts.system;
    let pattern = &system.model.pattern;
    let mut group = c.benchmark_group(format!("bank, {} unknowns", system.model.unknowns()));
    let n = system.bodies();
    let start = Motion::zeros(n);
    let mut motion = start.clone();
    for (k, q) in motion.q.iter_mut().enumerate() {
        *q = Pose::new(1e-8 * (k % 3) as f64, 1e-7, 1e-4);
    }
    let drive = system.electrics.drive();
    let mut tangent = BodyMatrix::new(pattern);
    let mut r = vec![Pose::zeros(); n];
    group.bench_function("residual", |b| b.iter(|| system.residual(black_box(&motion.q), &drive, &mut r)));
    group.bench_function("tangent and residual", |b| {
        b.iter(|| system.tangent(black_box(&motion.q), &drive, &mut tangent, &mut r));
    });
    forces::add_inertia(&system.model, 1e16, 1e8, &mut tangent);
    group.bench_function("factor", |b| {
        b.iter_batched_ref(|| tangent.clone(), |a| a.factor(pattern).map(|i| i.negative), BatchSize::SmallInput);
    });
    let mut factored = tangent.clone();
    factored.factor(pattern).unwrap_or_else(|e| panic!("{e:?}"));
    group.bench_function("solve", |b| {
        b.iter_batched_ref(|| motion.q.clone(), |x| factored.solve(pattern, x), BatchSize::SmallInput);
    });

    let mut rodas = Rodas4::new(system, &[]);
    let mut error = start.clone();
    let sources = vec![0.0; system.electrics.sources()];
    let rise = vec![0.0; system.electrics.heating.heaters.len()];
    let ramp = Ramp::new(&system.electrics, &sources, &sources, &rise, 1e-6);
    let mut bodies = Bodies::new(system, &ramp);
    group.bench_function("Rodas4 step", |b| {
        b.iter(|| {
            motion.q.copy_from_slice(&start.q);
            motion.v.copy_from_slice(&start.v);
            rodas.step(&mut bodies, 0.0, 1e-7, black_box(&mut motion), &mut error)
        });
    });

    let mut device = LocalDevice::new(Arc::clone(&compiled));
    device.open(&OpenRequest::default()).unwrap_or_else(|e| panic!("{e}"));
    let mut reply = TrialReply::default();
    let volts = vec![1.0; system.electrics.ports];
    let rest = Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: &volts };
    device.trial(&rest, &mut reply).unwrap_or_else(|e| panic!("{e}"));
    let step = Trial { mode: Mode::Transient, parent: reply.token, t: 1e-9, dt: 1e-9, voltages: &volts };
    group.bench_function("transient trial of one internal step, with partials", |b| {
        b.iter(|| device.trial(black_box(&step), &mut reply));
    });
    group.finish();
}

criterion_group!(benches, mechanics);
criterion_main!(benches);
