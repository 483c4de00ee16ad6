//! Overhead of the plug-in around a device: one call by the host with a device that does nothing. Target: 0.3 µs.

mod host;

use bimorph::device::{
    Description, Device, DeviceError, OpenRequest, PortInfo, PortKind, SmallSignal, Token, Trial, TrialReply,
};
use bimorph_ngspice::model_card::ModelCard;
use bimorph_ngspice::opener::OpenError;
use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::path::Path;

const PORTS: usize = 2;

/// Capacitors of 1 F, without any mechanics.
struct Nothing;

impl Device for Nothing {
    fn open(&mut self, _: &OpenRequest) -> Result<Description, DeviceError> {
        let ports = (0..PORTS).map(|n| PortInfo { name: n.to_string(), kind: PortKind::Electrical }).collect();
        Ok(Description { ports, signals: Vec::new(), unknowns: 0 })
    }
    fn trial(&mut self, request: &Trial<'_>, reply: &mut TrialReply) -> Result<(), DeviceError> {
        reply.token = Some(Token(1));
        reply.currents.resize(PORTS, 0.0);
        reply.di_dv.resize(PORTS * PORTS, 0.0);
        reply.charges.clear();
        reply.charges.extend_from_slice(request.voltages);
        reply.dq_dv.clear();
        reply.dq_dv.extend([1.0, 0.0, 0.0, 1.0]);
        reply.dt_next = f64::INFINITY;
        Ok(())
    }
    fn accept(&mut self, _: Token) {}
    fn linearize(&mut self, _: Token, _: f64, _: &mut SmallSignal) -> Result<(), DeviceError> {
        Ok(())
    }
}

fn open(_: &mut ModelCard, _: Option<&Path>) -> Result<Box<dyn Device>, OpenError> {
    Ok(Box::new(Nothing))
}

fn call(c: &mut Criterion) {
    bimorph_ngspice::set_opener(open);
    let mut host = host::Host::new(PORTS);
    host.call(0.0, 0.0, 1.0);
    host.accept();
    // Backward Euler's first step: i = C·ΔV/h = 2 A over 1 s from 1 V to 3 V.
    assert_eq!(host.call(1.0, 0.0, 3.0), 2.0);
    c.bench_function("call around a trivial device, 2 ports", |b| {
        b.iter(|| host.call(black_box(1.0), black_box(0.0), black_box(3.0)))
    });
}

criterion_group!(benches, call);
criterion_main!(benches);
