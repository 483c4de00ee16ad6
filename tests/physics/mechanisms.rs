//! Whole mechanisms: the XY quarter stage of the paper, and two of SUGAR's demonstrations.

use crate::{balance, close, linear, model, node};
use bimorph::analysis::modes::modes;
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, CompiledModel};
use bimorph::netlist::Setting;

/// Two orthogonal banks of five bimorphs (206 µm hot arms) push a rigid 60 µm plate through 80 µm tethers; a force along x
/// acts on the plate.
const QUARTER_STAGE: &str = "
param F=0
subnet arm [o] [m=1] [
  anchor parent [a] [l=10u w=10u oz=pi]
  anchor parent [g] [l=10u w=10u oz=pi]
  beam2d parent [a t] [l=206u w=2u]
  beam2d parent [t c] [l=23u w=13u oz=-m*pi/2]
  beam2d parent [c f] [l=112u w=8u oz=pi]
  beam2d parent [f g] [l=94u w=1.9u oz=pi]
  beam2d parent [c o] [l=24u w=3u]
]
subnet row [out] [m=1] [
  arm parent [y(1)] [m=m]
  for k=2:4 [
    arm parent [y(k)] [m=m]
    beam2d parent [y(k-1) y(k)] [l=49.5u w=11u oz=m*pi/2]
  ]
  arm parent [out] [m=m]
  beam2d parent [y(4) out] [l=49.5u w=11u oz=m*pi/2]
]
A row p1 [pa] []
B row p1 [pb] [m=-1 oz=-pi/2]
beam2d p1 [pa sa] [l=80u w=2u oz=pi/2]
beam2d p1 [pb sb] [l=80u w=2u oz=pi]
link2d * [sa c] [l=30u oz=pi/2]
link2d * [sb c] [l=30u oz=pi]
plate2d p1 [c] [l=60u w=60u]
f2d * [c] [F=F]
";

fn stage(force: f64, options: &CompileOptions) -> CompiledModel {
    let set = vec![("F".to_owned(), Setting::Number(force))];
    model(QUARTER_STAGE, &CompileOptions { set, ..options.clone() })
}

/// Under 100 µN along x the stage moves (8.52, 1.060) µm, and (7.129, 1.1473) µm in small displacements (independent
/// corotational and linear frames): within 0.5 % and 0.01 %.
#[test]
fn quarter_stage_statics() {
    for (options, x, y, tolerance) in
        [(CompileOptions::default(), 8.52e-6, 1.060e-6, 5e-3), (linear(), 7.129e-6, 1.1473e-6, 1e-4)]
    {
        let c = node(&balance(&stage(1e-4, &options), &[]), "c");
        close(c.x, x, tolerance);
        close(c.y, y, tolerance);
    }
}

/// Released from there, without damping, its x crosses zero at 3.42, 9.46, 16.28 and 22.43 µs (independent frame, HHT):
/// within 0.5 %.
#[test]
fn quarter_stage_release() {
    let options = CompileOptions { undamped: true, ..CompileOptions::default() };
    let (held, free) = (stage(1e-4, &options), stage(0.0, &options));
    let asked = TransientOptions {
        stop: 24e-6,
        signals: vec!["c.x".into()],
        release: Some(&held),
        ..TransientOptions::default()
    };
    let found = transient(&free, &asked, &mut |_, _| {}, &mut |_| true).unwrap();
    let x = &found.signals[0].2;
    let crossings: Vec<f64> = (1..x.len())
        .filter(|&k| x[k - 1] * x[k] < 0.0)
        .map(|k| found.t[k - 1] + (found.t[k] - found.t[k - 1]) * x[k - 1] / (x[k - 1] - x[k]))
        .collect();
    for (found, want) in crossings.iter().zip([3.42e-6, 9.46e-6, 16.28e-6, 22.43e-6]) {
        close(*found, want, 5e-3);
    }
    assert_eq!(crossings.len(), 4);
}

/// SUGAR's tang resonator, two half suspensions and a dog bone of 24 beams: 30 µN on its middle move it by 21.9992018 µm
/// (SUGAR 2.0, stock demo), to 1e-8.
#[test]
fn tang_resonator() {
    let text = "
    subnet suspension [l r] [] [
      for k=1:3 [ beam2d parent [t(k-1) t(k)] [l=30u w=2u] ]
      beam2d parent [t(0) l] [l=150u w=2u oz=-pi/2]
      beam2d parent [t(3) r] [l=150u w=2u oz=-pi/2]
      for k=1:2 [
        beam2d parent [t(k) e(k)] [l=150u w=2u oz=-pi/2]
        anchor parent [e(k)] [l=5u w=10u oz=-pi/2]
      ]
    ]
    subnet bone [m top bottom tip] [] [
      beam2d parent [top s] [l=20u w=20u oz=-pi/2]
      beam2d parent [s bottom] [l=20u w=20u oz=-pi/2]
      beam2d parent [m s] [l=45u w=20u]
      beam2d parent [s base] [l=20u w=20u]
      beam2d parent [base tip] [l=50u w=100u]
    ]
    f2d * [j] [F=30u]
    suspension p1 [e h] []
    suspension p1 [o l] [oz=pi]
    bone p1 [j h o t] []
    bone p1 [j l e v] [oz=pi]";
    close(node(&balance(&model(text, &linear()), &[]), "j").x, 2.19992018234532e-5, 1e-8);
}

/// SUGAR's multi-mode resonator, a proof mass on a slender beam inside a suspended frame: six frequencies of a finely
/// divided SUGAR 2.0 run, within 0.2 %.
#[test]
fn multimode_resonator() {
    let text = "
    anchor p1 [r1] [l=5u w=10u]
    anchor p1 [r2] [l=5u w=10u]
    beam2d p1 [r1 a] [l=150u w=2u oz=pi]
    beam2d p1 [r2 b] [l=150u w=2u oz=pi]
    beam2d p1 [a c] [l=50u w=5u oz=pi/2]
    beam2d p1 [a b] [l=50u w=5u oz=-pi/2]
    beam2d p1 [b d] [l=50u w=5u oz=-pi/2]
    beam2d p1 [c e] [l=150u w=2u]
    beam2d p1 [d f] [l=150u w=2u]
    beam2d p1 [e g] [l=50u w=20u]
    beam2d p1 [g p] [l=50u w=20u]
    beam2d p1 [g h] [l=75u w=20u oz=-pi/2]
    beam2d p1 [h i] [l=75u w=20u oz=-pi/2]
    beam2d p1 [f i] [l=50u w=20u]
    beam2d p1 [i q] [l=50u w=20u]
    beam2d p1 [h k] [l=300u w=2u]
    beam2d p1 [k m] [l=196u w=116u]";
    let compiled = model(text, &CompileOptions { band: Some(3e5), ..CompileOptions::default() });
    let found = modes(&compiled, 6, &[]).unwrap().frequencies_hz;
    let want =
        [1554.76457037644, 18623.7477677747, 27165.652658913, 111567.511621121, 114404.522008679, 198384.753038686];
    assert_eq!(found.len(), want.len());
    for (found, want) in found.iter().zip(want) {
        close(*found, want, 2e-3);
    }
}
