//! Beams that carry current: temperature, expansion, port currents.

use crate::{balance, close, model, node};
use bimorph::compile::CompileOptions;

/// A uniform clamped heater rises by V²/(12ρk) on average, whatever its length: 1e-9 relative at 3 V, ρ = 2e-5 Ω·m and
/// k = 41 W/(m·K), and draws V/R.
#[test]
fn clamped_heater() {
    for length in [50e-6, 200e-6] {
        let text = format!(
            "anchor p1 [a] [l=5u w=5u]\nbar beam2det p1 [a b] [l={length:e} w=2u resistivity=2e-5 thermalexpansion=0]\n\
             anchor p1 [b] [l=5u w=5u]\nbar2 beam2det p1 [a c] [l=10u w=2u oz=pi/2 resistivity=2e-5]\n\
             eground * [b] []\nheat port * [a] []"
        );
        let result = balance(&model(&text, &CompileOptions::default()), &[("heat", 3.0)]);
        let rise = result.temperatures_k[0].1 - 293.0;
        close(rise, 9.0 / (12.0 * 2e-5 * 41.0), 1e-9);
        close(result.currents_a[0].1, 3.0 * 4e-12 / (2e-5 * length), 1e-12);
    }
}

/// A bar of 50 and 150 µm on both sides of a rigid block, whose sides a wire connects, is one bar of 200 µm. The rise
/// at 3 V, averaged by length, is V²/(12ρk), and the current V/R. Without the wire no current would flow.
#[test]
fn a_wire_leads_current_and_heat_through_a_rigid_body() {
    let text = "
        anchor p1 [a] []
        left beam2det p1 [a b] [l=50u w=2u resistivity=2e-5 thermalexpansion=0]
        link2d * [b c] [l=20u]
        wire * [b c] []
        right beam2det p1 [c d] [l=150u w=2u resistivity=2e-5 thermalexpansion=0]
        anchor p1 [d] []
        eground * [d] []
        heat port * [a] []";
    let result = balance(&model(text, &CompileOptions::default()), &[("heat", 3.0)]);
    let rise = |k: usize| result.temperatures_k[k].1 - 293.0;
    close(0.25 * rise(0) + 0.75 * rise(1), 9.0 / (12.0 * 2e-5 * 41.0), 1e-9);
    close(result.currents_a[0].1, 3.0 * 4e-12 / (2e-5 * 200e-6), 1e-12);
}

/// SUGAR's heatuator1 (hot 150 × 2, bridge 4 × 2, cold 112.5 × 20, flexure 37.5 × 2 µm) with k = 41, ρ = 4e-5 and
/// α = 2.33e-6: the tip moves −0.1157, −0.4623, −1.0379 µm at 1, 2, 3 V (independent frame solver), within 0.1 %.
#[test]
fn heatuator() {
    let text = "
        anchor p1 [a] [l=10u w=10u oz=pi]
        hot  beam2det p1 [a t] [l=150u w=2u resistivity=4e-5]
        bar  beam2det p1 [t c] [l=4u w=2u oz=-pi/2 resistivity=4e-5]
        cold beam2det p1 [c f] [l=112.5u w=20u oz=pi resistivity=4e-5]
        flex beam2det p1 [f g] [l=37.5u w=2u oz=pi resistivity=4e-5]
        anchor p1 [g] [l=10u w=10u oz=pi]
        eground * [g] []
        heat port * [a] []";
    let compiled = model(text, &CompileOptions::default());
    for (volts, tip) in [(1.0, -0.1157e-6), (2.0, -0.4623e-6), (3.0, -1.0379e-6)] {
        close(node(&balance(&compiled, &[("heat", volts)]), "t").y, tip, 1e-3);
    }
}

/// A chevron of two 200 µm legs at a prescribed temperature: SUGAR 2.0's linear figures for its ETA1 demo at 1° to 20° and a
/// rise of 310 K with α = 2.6e-6.
#[test]
fn chevron_at_a_prescribed_temperature() {
    let sugar = [
        (1, 6.9541119067023e-6),
        (2, 4.26891205507476e-6),
        (5, 1.82571038188501e-6),
        (10, 9.25337598084594e-7),
        (20, 4.70961757598845e-7),
    ];
    for (angle, apex) in sugar {
        let netlist = format!(
            "process hotpoly : p1 = [thermalexpansion=2.6e-6 ambienttemperature=0]
             anchor p1 [a] [l=10u w=10u oz=-pi/2]
             beam3d hotpoly [a c] [l=200u w=2u oz=deg({angle}) T=310]
             beam3d hotpoly [c b] [l=200u w=2u oz=-deg({angle}) T=310]
             anchor p1 [b] [l=10u w=10u oz=-pi/2]"
        );
        let options = CompileOptions { linear: true, ..CompileOptions::default() };
        close(node(&balance(&model(&netlist, &options), &[]), "c").y, apex, 1e-9);
    }
}

/// A straight clamped beam heated beyond its buckling strain, π²w²/3L² = 3.3e-4 at 200 × 2 µm, bows out to one side: the
/// straight line is still an equilibrium there, but no stable one. The bow is that of the elastica to a tenth:
/// rise² = (4/π²)·L²·(strain − critical) for a cosine.
#[test]
fn a_straight_heated_beam_buckles() {
    let strain = 1e-3;
    let text = format!(
        "process warm : p1 = [thermalexpansion=1e-6 ambienttemperature=0]\nanchor p1 [a] [l=5u w=5u]\n\
         beam3d warm [a m] [l=100u w=2u T={t}]\nbeam3d warm [m b] [l=100u w=2u T={t}]\nanchor p1 [b] [l=5u w=5u]",
        t = strain / 1e-6
    );
    let result = balance(&model(&text, &CompileOptions::default()), &[]);
    assert!(result.jumped && !result.pulled_in);
    let critical = std::f64::consts::PI.powi(2) / 3.0 * (2.0f64 / 200.0).powi(2);
    let bow = 2.0 / std::f64::consts::PI * 200e-6 * (strain - critical).sqrt();
    close(node(&result, "m").y.abs(), bow, 0.1);
}
