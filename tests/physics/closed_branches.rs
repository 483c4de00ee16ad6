//! Closed gaps: one answer of pull-in, statics, decks' sweeps and paths, and contact forces that balance.

use crate::contact::EPS;
use crate::{close, model};
use bimorph::analysis::continuation::{ContinuationRequest, ContinuationResult, PathInput, trace};
use bimorph::analysis::pull_in::pull_in;
use bimorph::compile::{CompileOptions, CompiledModel};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, Mode, OpenRequest, Status, Token, Trial, TrialReply};
use bimorph::solve::continuation::Branch;
use std::sync::Arc;

/// A plate of an area (m²) on a spring (N/m), in front of an electrode at a gap, which it touches at a distance (m).
#[derive(Debug, Clone, Copy)]
struct Plate {
    k: f64,
    area: f64,
    gap: f64,
    touch: f64,
}

impl Plate {
    fn model(&self) -> CompiledModel {
        let Self { k, area, gap, touch } = self;
        let text = format!(
            "anchor * [f] []
            spring2d * [f m] [kx={k:e}]
            mass2d * [m] [m=1e-9]
            guide2d * [m] []
            anchor * [e] []
            gap plategap2d * [m e] [A={area:e} gap={gap:e} touch={touch:e}]
            eground * [e] []
            drive port * [m e] []"
        );
        model(&text, &CompileOptions::default())
    }

    /// Force of contact at a distance (N): p = 0.2 TPa·(2(t − d)/t)³.
    fn contact(&self, d: f64) -> f64 {
        self.area * 2e11 * (2.0 * (self.touch - d).max(0.0) / self.touch).powi(3)
    }

    /// V² of the equilibrium at a distance (V²): ½εAV²/d² = k·(g − d) + F.
    fn squared(&self, d: f64) -> f64 {
        2.0 * d * d / (EPS * self.area) * (self.k * (self.gap - d) + self.contact(d))
    }

    /// The smallest voltage of the closed branch (V), by golden sections of its distance.
    fn release(&self) -> f64 {
        let share = 0.5 * (5f64.sqrt() - 1.0);
        let (mut a, mut b) = (0.75 * self.touch, self.touch);
        for _ in 0..120 {
            let (c, d) = (b - share * (b - a), a + share * (b - a));
            if self.squared(c) < self.squared(d) { b = d } else { a = c }
        }
        self.squared(f64::midpoint(a, b)).sqrt()
    }

    /// √(8kg³/27εA) (Nathanson 1967).
    fn pull_in(&self) -> f64 {
        (8.0 * self.k * self.gap.powi(3) / (27.0 * EPS * self.area)).sqrt()
    }
}

/// Plates of any stiffness, area and gap, their touching distance down to a thousandth of it.
fn plates(count: usize) -> Vec<Plate> {
    let mut seed = 3u64;
    let mut between = |low: f64, high: f64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low * (high / low).powf((seed >> 11) as f64 / (1u64 << 53) as f64)
    };
    let one = |_| {
        let gap = between(1e-6, 2e-4);
        Plate { k: between(1e-2, 1e3), area: between(1e-10, 1e-4), gap, touch: gap * between(1e-3, 0.3) }
    };
    (0..count).map(one).filter(|plate: &Plate| plate.touch > 2e-9 && plate.pull_in() < 900.0).collect()
}

/// Plates are released at the smallest voltage of their closed branch, down to 1e-3 of pull-in and of the gap: a closed form of their
/// contact law, within 1e-4.
#[test]
fn plates_are_released_as_their_law_says() {
    let all = plates(80);
    assert!(all.len() > 40, "{}", all.len());
    for plate in all {
        let found = pull_in(&plate.model(), None, 1000.0).unwrap_or_else(|e| panic!("{plate:?}: {e}"));
        close(found.pull_in_v, plate.pull_in(), 1e-6);
        let release = found.release_v.unwrap_or_else(|| panic!("{plate:?} {:e}: none", plate.release()));
        close(release, plate.release(), 1e-4);
        assert!(found.snaps_v.is_empty(), "{found:?}");
    }
}

/// Static trials of a device one after the other.
struct Sweep {
    device: LocalDevice,
    at: Option<Token>,
}

impl Sweep {
    fn new(compiled: CompiledModel) -> Self {
        let mut device = LocalDevice::new(Arc::new(compiled));
        let request = OpenRequest { ports: Vec::new(), signals: vec!["gap.gap".to_owned()], noise: None };
        device.open(&request).unwrap();
        Self { device, at: None }
    }

    /// Distance left at a voltage (m), from the state before.
    fn to(&mut self, volts: f64) -> f64 {
        let mut reply = TrialReply::default();
        let trial = Trial { mode: Mode::Static, parent: self.at, t: 0.0, dt: 0.0, voltages: &[volts] };
        self.device.trial(&trial, &mut reply).unwrap();
        assert_eq!(reply.status, Status::Ok, "{volts} V");
        self.at = reply.token;
        reply.outputs[0]
    }
}

/// A sweep of a deck lowers the voltage by hundredths of the release voltage: the plate opens at the step below it and not later, and
/// in each state before, attraction, spring and contact balance within 1e-4 of the attraction. Random plates, and one with a touching
/// distance of 5 nm.
#[test]
fn sweeps_open_where_paths_do() {
    let thin = Plate { k: 36.35, area: 8e-9, gap: 2.005e-6, touch: 5e-9 };
    for plate in plates(24).into_iter().take(8).chain([thin]) {
        let release = plate.release();
        let mut sweep = Sweep::new(plate.model());
        assert!(sweep.to(1.05 * plate.pull_in()) < plate.touch);
        for step in (101..=120).rev().map(f64::from) {
            let volts = step / 100.0 * release;
            let d = sweep.to(volts);
            assert!(d < plate.touch, "{plate:?} opens at {volts} for {release} V");
            let pull = 0.5 * EPS * plate.area * volts * volts / (d * d);
            let left = pull - plate.k * (plate.gap - d) - plate.contact(d);
            assert!(left.abs() < 1e-4 * pull, "{plate:?} at {volts} V: {left:e} of {pull:e}");
        }
        assert!(sweep.to(0.99 * release) > plate.touch, "{plate:?} stays closed below {release} V");
    }
}

/// A sweep through zero to the opposite voltage opens random plates, although contact is an equilibrium there as well.
#[test]
fn sweeps_through_zero_open() {
    for plate in plates(24).into_iter().take(8) {
        let mut sweep = Sweep::new(plate.model());
        assert!(sweep.to(1.05 * plate.pull_in()) < plate.touch);
        assert!(sweep.to(-1.5 * plate.release()) > plate.touch, "{plate:?}: closed from one side of zero to the other");
    }
}

/// Two plates in a row: the second on a spring of ½ N/m behind the first, which is on 1 N/m. Beyond 2 µm the first has closed, beyond
/// its own pull-in √(8kg³/27εA) from there (g = 5 µm less what the first moved) the second. Below √(2k(g₂ − g₁)t²/εA) that
/// opens again; the first, which it has pulled down, then opens with it: 0.475 V, and 0.655 V without the second snap.
#[test]
fn a_second_snap_holds_longer() {
    let text = "
        anchor * [f] []
        spring2d * [f q] [kx=1]
        mass2d * [q] [m=1e-12]
        guide2d * [q] []
        spring2d * [q r] [kx=0.5]
        mass2d * [r] [m=1e-12]
        guide2d * [r] []
        anchor * [d] []
        anchor * [e] []
        first plategap2d * [q d] [A=1e-8 gap=2u]
        second plategap2d * [r e] [A=1.5e-8 gap=5u]
        R * [q r] [R=1]
        R * [d e] [R=1]
        eground * [e] []
        drive port * [q e] []";
    let compiled = model(text, &CompileOptions::default());
    let touch = 0.1e-6f64;
    let only_first = (2.0 * 1.9e-6 * touch * touch / (EPS * 1e-8)).sqrt();
    let both = (2.0 * 0.5 * 3e-6 * touch * touch / (EPS * 1.5e-8)).sqrt();
    let snap = (8.0 * 0.5 * 3.1e-6f64.powi(3) / (27.0 * EPS * 1.5e-8)).sqrt();
    let found = pull_in(&compiled, None, 20.0).unwrap();
    assert!(found.held && found.snaps_v.len() == 1, "{found:?}");
    close(found.snaps_v[0], snap, 2e-3);
    close(found.release_v.unwrap(), both, 5e-3);
    close(found.release_before_snaps_v.unwrap(), only_first, 2e-2);
    // below the second snap no branch is held longer
    let found = pull_in(&compiled, None, 0.99 * snap).unwrap();
    assert!(found.snaps_v.is_empty() && found.release_before_snaps_v.is_none());
    close(found.release_v.unwrap(), only_first, 2e-2);
}

/// A cantilever of 80 µm over an electrode touches with its tip and then lies down: pull-in, the second snap and release are the limit
/// points of its path.
#[test]
fn snaps_are_limit_points_of_the_path() {
    let text = "
        dl = 5u
        anchor p1 [e(0)] []
        anchor p1 [f(0)] []
        for i=1:16 [
            beam2d p1 [e(i-1) e(i)] [l=dl w=0.5u]
            gap2dforce p1 [e(i-1) e(i) f(i-1) f(i)] [l=dl w1=0.5u w2=0.5u gap=2u touch=0.2u]
            R * [e(i-1) e(i)] [R=1]
            R * [f(i-1) f(i)] [R=1]
            anchor p1 [f(i)] []
        ]
        eground * [e(0)] []
        drive port * [f(0) e(0)] []";
    let compiled = model(text, &CompileOptions::default());
    let found = pull_in(&compiled, None, 20.0).unwrap();
    let request = ContinuationRequest {
        input: PathInput::Port("drive"),
        from: 0.0,
        to: 20.0,
        voltages: vec![],
        signals: vec![],
        branch: Branch::Plus,
        points: 3000,
    };
    let path: ContinuationResult = trace(&compiled, &request, &mut |_| true).unwrap();
    let limits: Vec<f64> = path.folds.iter().map(|p| p.value).collect();
    assert!(limits.len() >= 4 && found.snaps_v.len() == 1, "{limits:?} {found:?}");
    close(found.pull_in_v, limits[0], 1e-6);
    close(found.release_v.unwrap(), limits[1], 1e-5);
    close(found.snaps_v[0], limits[2], 1e-5);
}
