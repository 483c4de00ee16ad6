//! Fingers of a comb that close in a circuit on a beam whose sections have no inertia.

use bimorph_base::Bundle;
use bimorph_device::local::LocalDevice;
use bimorph_device::{Device, Mode, OpenRequest, Status, Trial, TrialReply};
use bimorph_model::compile::{CompileOptions, draw};
use bimorph_netlist::NetlistSource;
use std::sync::Arc;

/// Fingers drawn in the middle of their gaps, on a cantilever that 20 nN push aside.
const COMB: &str = "process p = [ Youngsmodulus=160e9 density=2330 h=10u ]
    anchor p [a] []
    beam2d p [a m] [l=200u w=2u]
    beam2d p [m r] [l=20u w=10u]
    comb2de p [r s] [N=20 gap=2u l=10u L=20u]
    f2d * [r] [F=20n oz=pi/2]
    anchor p [s] []
    eground * [r] []
    drive port * [s] []";

/// The last status of a ramp from 0 to 12 V in 60 µs, which closes the fingers, and the time reached (s).
fn ramp(options: &CompileOptions) -> (Status, f64) {
    let bundle = Bundle::from_text("comb.net", COMB);
    let compiled = draw(&NetlistSource::new(&bundle), options).and_then(|drawn| drawn.compile());
    let mut device = LocalDevice::new(Arc::new(compiled.unwrap_or_else(|e| panic!("{e}"))));
    device.open(&OpenRequest { ports: Vec::new(), signals: vec!["r.y".to_owned()], noise: None }).unwrap();
    let (mut reply, mut parent, mut t, mut dt) = (TrialReply::default(), None, 0.0, 0.5e-6);
    while t < 70e-6 {
        let volts = [f64::min((t + dt) * 0.2e6, 12.0)];
        let mode = if parent.is_none() { Mode::Static } else { Mode::Transient };
        let at_rest = [0.0];
        let voltages: &[f64] = if parent.is_none() { &at_rest } else { &volts };
        device.trial(&Trial { mode, parent, t: t + dt, dt, voltages }, &mut reply).unwrap();
        match reply.status {
            Status::Ok => {}
            Status::NeedDt(shorter) => {
                dt = shorter;
                continue;
            }
            Status::Fail(_) => break,
        }
        device.accept(reply.token.unwrap());
        if parent.is_some() {
            t += dt;
            dt = 0.5e-6;
        }
        parent = reply.token;
    }
    (reply.status, t)
}

/// The impact needs the inertia of sections: without it the run fails there and its message says what to give, with it the run continues.
#[test]
fn an_impact_without_inertia_names_the_remedy() {
    let without = CompileOptions { tol: 1e-2, segments: Some(2), ..CompileOptions::default() };
    let (status, t) = ramp(&without);
    let Status::Fail(text) = status else { panic!("{status:?} at {t}") };
    assert!(t > 10e-6 && text.contains("give the model `rotary_inertia=true`"), "{text}");
    let (status, t) = ramp(&CompileOptions { rotary_inertia: true, ..without });
    assert!(status == Status::Ok && t >= 70e-6, "{status:?} at {t}");
}
