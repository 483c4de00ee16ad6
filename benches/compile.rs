//! Time from netlist text to a ready model, order selection included, and of ten modes with their estimated errors.
//!
//!     cargo bench --no-default-features --bench compile
//!
//! Medians of single calls. The aims: a bank of three within 5 ms, the rotary stage within 50 ms, its modes within 50 ms.

use bimorph::analysis::modes::modes;
use bimorph::compile::{CompileOptions, CompiledModel, compile};
use bimorph::netlist::{Bundle, Setting, read_bundle};
use std::path::Path;
use std::time::Instant;

fn bundle(name: &str) -> Bundle {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(name);
    read_bundle(&path, &[]).unwrap_or_else(|e| panic!("{e}"))
}

/// Median of repeated calls (ms).
fn median(count: usize, mut call: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..count)
        .map(|_| {
            let start = Instant::now();
            call();
            1e3 * start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[count / 2]
}

fn report(name: &str, bundle: &Bundle, options: &CompileOptions) {
    let ready = || -> CompiledModel { compile(bundle, options).unwrap_or_else(|e| panic!("{e}")) };
    let compiled = ready();
    let compiling = median(31, || drop(ready()));
    let ringing = median(11, || drop(modes(&compiled, 10, &[])));
    let order = &compiled.order;
    println!(
        "{name:14} band {:>9} tol {:.0e}: {:5} unknowns, {:3} modes in band, estimate {}, {} models; \
         compile {compiling:8.3} ms, modes 1–10 {ringing:8.3} ms",
        options.band.map_or("–".into(), |b| format!("{:.0} kHz", b / 1e3)),
        options.tol,
        compiled.parts.system.model.unknowns(),
        order.modes_in_band,
        order.estimated_error.map_or("–".into(), |e| format!("{e:.1e}")),
        order.passes,
    );
}

fn main() {
    // the bench runs under `cargo test --benches` too, where there is nothing to measure
    if std::env::args().any(|a| a == "--test") {
        return;
    }
    let bank = bundle("bank/bank.net");
    let alone = vec![("comb".to_owned(), Setting::Number(0.0))];
    for (band, tol) in [(None, 1e-3), (Some(4.5e5), 1e-2), (Some(1.2e6), 1e-2), (Some(1.2e6), 1e-3)] {
        let options = CompileOptions { band, tol, set: alone.clone(), ..CompileOptions::default() };
        report("bank of three", &bank, &options);
    }
    let stage = bundle("rotary_stage/rotary_stage.net");
    for (band, tol) in [(None, 1e-3), (Some(1e5), 1e-2), (Some(1e5), 1e-3), (Some(4.5e5), 1e-2), (Some(4.5e5), 1e-3)] {
        report("rotary stage", &stage, &CompileOptions { band, tol, ..CompileOptions::default() });
    }
}
