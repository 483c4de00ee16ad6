//! A device without mechanics: every answer is a short closed form of the request, so a test knows it, and a benchmark
//! measures the wire alone.

use bimorph::compile::CompiledModel;
use bimorph::device::{
    Description, Device, DeviceError, Mode, OpenRequest, PortInfo, PortKind, SignalInfo, SmallSignal, Status, Token,
    Trial, TrialReply,
};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Two ports whatever the netlist says, i_k = v_k · 1 mS, q_k = v_k² · 1 pF; signals give t. Tokens are hashes of the
/// request. A voltage of exactly 666 V is a fault of the device: it panics.
pub(crate) struct Echo {
    ports: usize,
    signals: usize,
    tokens: BTreeSet<u64>,
}

/// The voltage at which the device panics (V).
pub(crate) const PANIC: f64 = 666.0;

/// Makes the device; has the type of `bimorph::service::server::MakeDevice`.
pub(crate) fn echo(_: Arc<CompiledModel>) -> Box<dyn Device> {
    Box::new(Echo { ports: 0, signals: 0, tokens: BTreeSet::new() })
}

fn hash(request: &Trial<'_>) -> u64 {
    let mut h = 0xcbf2_9ce4_8422_2325_u64;
    let mut mix = |x: u64| h = (h ^ x).wrapping_mul(0x0000_0100_0000_01b3).rotate_left(17);
    mix(request.parent.map_or(0, |token| token.0));
    mix(request.dt.to_bits());
    request.voltages.iter().for_each(|v| mix(v.to_bits()));
    (h & ((1 << 53) - 1)).max(1)
}

impl Device for Echo {
    fn open(&mut self, request: &OpenRequest) -> Result<Description, DeviceError> {
        let names = ["p", "q"];
        for port in &request.ports {
            if !names.contains(&port.as_str()) {
                let available = names.map(str::to_owned).to_vec();
                return Err(DeviceError::UnknownPort { name: port.clone(), available });
            }
        }
        if let Some(name) = request.signals.iter().find(|name| name.as_str() != "t") {
            return Err(DeviceError::UnknownSignal { name: name.clone(), hint: "the only one is t".into() });
        }
        let ports = if request.ports.is_empty() { names.map(str::to_owned).to_vec() } else { request.ports.clone() };
        (self.ports, self.signals) = (ports.len(), request.signals.len());
        self.tokens.clear();
        Ok(Description {
            ports: ports.into_iter().map(|name| PortInfo { name, kind: PortKind::Electrical }).collect(),
            signals: request.signals.iter().map(|name| SignalInfo { name: name.clone(), unit: "s".into() }).collect(),
            unknowns: 3,
        })
    }

    fn trial(&mut self, request: &Trial<'_>, reply: &mut TrialReply) -> Result<(), DeviceError> {
        if self.ports == 0 {
            return Err(DeviceError::NotOpen);
        }
        if request.voltages.len() != self.ports {
            let (expected, got) = (self.ports.to_string(), request.voltages.len().to_string());
            return Err(DeviceError::BadRequest { what: "voltages", expected, got });
        }
        if let Some(parent) = request.parent.filter(|parent| !self.tokens.contains(&parent.0)) {
            return Err(DeviceError::UnknownToken(parent));
        }
        assert!(request.voltages.iter().all(|v| *v != PANIC), "asked to panic");
        *reply = TrialReply::default();
        if request.mode == Mode::Transient && request.dt > 1.0 {
            reply.status = Status::NeedDt(0.5);
            return Ok(());
        }
        let token = hash(request);
        self.tokens.insert(token);
        reply.token = Some(Token(token));
        for (k, v) in request.voltages.iter().enumerate() {
            reply.currents.push(v * 1e-3);
            reply.charges.push(v * v * 1e-12);
            for j in 0..self.ports {
                reply.di_dv.push(if j == k { 1e-3 } else { 0.0 });
                reply.dq_dv.push(if j == k { 2e-12 * v } else { 0.0 });
            }
        }
        reply.outputs = vec![request.t; self.signals];
        reply.doutputs_dv = vec![0.0; self.signals * self.ports];
        reply.dt_next = f64::INFINITY;
        Ok(())
    }

    fn accept(&mut self, token: Token) {
        self.tokens.retain(|held| *held == token.0);
    }

    fn linearize(&mut self, token: Token, omega: f64, reply: &mut SmallSignal) -> Result<(), DeviceError> {
        if !self.tokens.contains(&token.0) {
            return Err(DeviceError::UnknownToken(token));
        }
        let entry = |k: usize| if k.is_multiple_of(self.ports + 1) { [1e-3, omega * 1e-12] } else { [0.0, 0.0] };
        reply.admittance = (0..self.ports * self.ports).map(entry).collect();
        reply.outputs = vec![[0.0, 0.0]; self.signals * self.ports];
        Ok(())
    }
}
