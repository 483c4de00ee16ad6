//! What a mechanism of any size costs in memory.

#[path = "topologies/mod.rs"]
mod topologies;

use bimorph::gaps::System;
use bimorph::gaps::drive::Electrics;
use bimorph::solve::method::Motion;
use bimorph::solve::rodas4::Rodas4;

#[global_allocator]
static HEAP: dhat::Alloc = dhat::Alloc;

/// Bytes per body that a model, its motion, an error estimate and the storage of Rodas4 hold; and at the highest, while
/// they were made.
fn bytes(name: &str, coordinates: usize) -> (usize, usize, usize) {
    let drawing = topologies::sized(name, coordinates);
    let _profiler = dhat::Profiler::builder().testing().build();
    let model = drawing.model();
    let system =
        System { model, gaps: Vec::new(), loads: Vec::new(), electrics: Electrics::default(), length_scale: 2e-6 };
    let n = system.bodies();
    let kept = (Rodas4::new(&system, &[]), Motion::zeros(n), Motion::zeros(n));
    let stats = dhat::HeapStats::get();
    drop((kept, system));
    (n, stats.curr_bytes / n, stats.max_bytes / n)
}

/// A million bodies fit into 1 GB (10⁹ bytes): each body, with its joints, its share of the tangent and everything that a
/// Rodas4 step needs, takes no more bytes than stand here; neither does making the model take more. Counted at 10⁵ bodies.
#[test]
fn a_body_takes_less_than_a_kilobyte() {
    let most = [("chain", 840), ("ladder", 930), ("arms", 860), ("bank", 850), ("quarter", 850), ("rotary", 850)];
    for (name, most) in most {
        let (n, held, peak) = bytes(name, 300_000);
        println!("{name}: {n} bodies, {held} bytes a body, {peak} at the highest");
        assert!(held <= most && peak <= 1000, "{name}: {held} bytes a body, {peak} at the highest");
    }
}

/// The same at a million bodies.
#[test]
#[ignore = "takes 1 GB"]
fn a_million_bodies_take_less_than_a_gigabyte() {
    for name in topologies::NAMES {
        let (n, held, peak) = bytes(name, 3_000_000);
        println!("{name}: {n} bodies, {held} bytes a body, {peak} at the highest");
        assert!(peak * n <= 1_000_000_000, "{name}");
    }
}
