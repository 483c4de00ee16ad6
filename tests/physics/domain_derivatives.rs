//! Force, tangent, charge and change with the voltage of every domain with a potential are derivatives of one energy, at random states, contact included.

use crate::model;
use bimorph::compile::CompileOptions;
use bimorph::domains::{Configuration, Domain, Member};
use bimorph::multibody::BodyMatrix;
use bimorph::multibody::planar::Pose;

/// Members, each with the voltage (V) across it, and the sizes of random displacements (m) and rotations (rad).
const CASES: [(&str, f64, [f64; 2], &str); 8] = [
    (
        "comb",
        30.0,
        [0.4e-6, 2e-3],
        "process p = [ density=2300 h=20u ]
        mass2d * [m] [m=1e-10 J=1e-20]
        spring2d * [f m] [kx=1 ky=1 krz=1e-9]
        anchor p [f] [l=1u w=1u]
        c comb2de p [m e] [N=40 gap=2u l=10u L=30u w=2u fringe=exact]
        mass2d * [e] [m=1e-10 J=1e-20]
        spring2d * [f e] [kx=1 ky=1 krz=1e-9]",
    ),
    (
        "comb pressed",
        30.0,
        [10e-9, 2e-4],
        "process p = [ density=2300 h=20u ]
        mass2d * [m] [m=1e-10 J=1e-20]
        spring2d * [f m] [kx=1 ky=1 krz=1e-9]
        anchor p [f] [l=1u w=1u]
        c comb2de p [m e] [N=40 gap=2u l=10u L=30u w=2u fringe=exact misalign=1.699u touch=0.3u oz=0.4]
        mass2d * [e] [m=1e-10 J=1e-20]
        spring2d * [f e] [kx=1 ky=1 krz=1e-9]",
    ),
    (
        "plates",
        9.0,
        [0.5e-6, 5e-3],
        "anchor * [f] []
        mass2d * [m] [m=1e-10 J=1e-20]
        spring2d * [f m] [kx=1 ky=1 krz=1e-9]
        link2d * [m tip] [l=3u oz=1.2]
        mass2d * [e] [m=1e-10 J=1e-20]
        spring2d * [f e] [kx=1 ky=1 krz=1e-9]
        g plategap2d * [tip e] [A=1e-8 l=100u w=100u gap=2u h=2u fringe=exact td=0.1u er=4 touch=0.1u oz=0.3]",
    ),
    (
        "plates pressed",
        9.0,
        [10e-9, 1e-3],
        "anchor * [f] []
        mass2d * [m] [m=1e-10 J=1e-20]
        spring2d * [f m] [kx=1 ky=1 krz=1e-9]
        link2d * [m tip] [l=3u oz=1.2]
        mass2d * [e] [m=1e-10 J=1e-20]
        spring2d * [f e] [kx=1 ky=1 krz=1e-9]
        g plategap2d * [tip e] [A=1e-8 gap=0.105u touch=0.1u fringe=none oz=0.3]",
    ),
    (
        "facing beams",
        40.0,
        [0.5e-6, 5e-3],
        "process s = [ Youngsmodulus=160e9 Poisson=0 density=2330 h=20u ]
        anchor s [a] [l=1u w=1u]
        beam2d s [a b] [l=100u w=2u]
        g gap2dforce s [a b c d] [l=100u w1=2u w2=2u gap=2u h=20u touch=0.2u]
        beam2d s [c d] [l=100u w=2u]
        anchor s [c] [l=1u w=1u]",
    ),
    (
        "facing beams pressed",
        20.0,
        [60e-9, 2e-3],
        "process s = [ Youngsmodulus=160e9 Poisson=0 density=2330 h=20u ]
        anchor s [a] [l=1u w=1u]
        beam2d s [a b] [l=100u w=2u]
        g gap2dforce s [a b c d] [l=100u w1=2u w2=2u gap=0.25u h=20u touch=0.2u]
        beam2d s [c d] [l=100u w=2u]
        anchor s [c] [l=1u w=1u]",
    ),
    (
        "stop",
        0.0,
        [8e-9, 2e-3],
        "anchor * [f] []
        mass2d * [m] [m=1e-10 J=1e-20]
        spring2d * [f m] [kx=1 ky=1 krz=1e-9]
        link2d * [m tip] [l=3u oz=1.2]
        mass2d * [e] [m=1e-10 J=1e-20]
        spring2d * [f e] [kx=1 ky=1 krz=1e-9]
        s stop2d * [tip e] [gap=4n back=4n A=1e-10 oz=0.3]",
    ),
    (
        "polynomial spring",
        0.0,
        [0.5e-6, 5e-2],
        "anchor * [f] []
        mass2d * [m] [m=1e-10 J=1e-20]
        spring2d * [f m] [kx=1 ky=1 krz=1e-9 kx2=1e5 kx3=4e11]
        guide2d * [m] []",
    ),
];

/// Random displacements of all bodies.
fn random(seed: &mut u64, count: usize, [size, turn]: [f64; 2]) -> Vec<Pose> {
    let mut next = || {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 40) as f64 / f64::from(1 << 23) - 1.0
    };
    (0..count).map(|_| Pose::new(size * next(), size * next(), turn * next())).collect()
}

/// Force, tangent and changes of the charge and with the voltage are derivatives of −½CV² and the energy of contact, each to 1e-7 of the sum of its terms, or of a millionth of the largest sum. They are compared with
/// differences of fourth order at 100 random states of each case, along random directions. Every domain that has a potential is among the cases.
#[test]
fn every_domain_has_one_energy() {
    let mut seen = [false; 5];
    for (name, volts, size, text) in CASES {
        let compiled = model(text, &CompileOptions { segments: Some(4), ..CompileOptions::default() });
        let system = &compiled.parts.system;
        let (n, pattern) = (system.bodies(), &system.model.pattern);
        let mut seed = 5;
        let mut pressed = 0;
        let mut compared: [Vec<(usize, f64, f64, f64)>; 4] = Default::default();
        for member in &system.members {
            seen[match member {
                Member::CombDrive(_) => 0,
                Member::Electrodes(_) => 1,
                Member::FacingBeams(_) => 2,
                Member::StopPair(_) => 3,
                Member::PolynomialSpring(_) => 4,
                // rates alone, with tests of their own in squeeze_film.rs and dashpot.rs
                Member::Dashpot(_) | Member::PlateFilm(_) | Member::CombFilm(_) | Member::FacingFilm(_) => continue,
            }] = true;
            for k in 0..100 {
                let q = random(&mut seed, n, size);
                let way = random(&mut seed, n, size.map(|size| 2e-4 * size));
                let moved = |h: f64| -> Vec<Pose> { q.iter().zip(&way).map(|(q, w)| q + w * h).collect() };
                let at = |q: &[Pose], of: &dyn Fn(Configuration<'_>) -> f64| of(Configuration { q, linear: false });
                let four = |of: &dyn Fn(f64) -> f64| (8.0 * (of(1.0) - of(-1.0)) - of(2.0) + of(-2.0)) / 12.0;
                let dot = |a: &[Pose], b: &[Pose]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
                let terms =
                    |a: &[Pose], b: &[Pose]| a.iter().zip(b).map(|(a, b)| a.component_mul(b).abs().sum()).sum::<f64>();
                let energy = |at: Configuration<'_>| {
                    member.energy(at, volts) + member.contact_energy(at) - 0.5 * volts * volts * member.capacitance(at)
                };
                let force = |q: &[Pose], volts: f64| {
                    let mut r = vec![Pose::zeros(); n];
                    member.add_force(Configuration { q, linear: false }, volts, &mut r);
                    r
                };
                let here = Configuration { q: &q, linear: false };
                pressed += usize::from(member.bearing(here) > 0.0);
                let f = force(&q, volts);
                let slope = four(&|h| at(&moved(h), &energy));
                let mut close = |found: f64, wanted: f64, scale: f64, what: usize| {
                    compared[what].push((k, found, wanted, scale));
                };
                // energies of 1 to 1e4 times their change cancel
                let rounding = 1e-8 * energy(here).abs();
                close(slope, dot(&f, &way), terms(&f, &way) + rounding, 0);
                let mut tangent = BodyMatrix::new(pattern);
                member.add_tangent(here, volts, pattern, &mut tangent);
                let mut change = vec![Pose::zeros(); n];
                tangent.multiply_add(pattern, &way, &mut change);
                let other = random(&mut seed, n, size);
                let found = four(&|h| dot(&force(&moved(h), volts), &other));
                let scale = terms(&change, &other) + 1e-8 * terms(&f, &other);
                close(found, dot(&change, &other), scale, 1);
                let found = four(&|h| at(&moved(h), &|at| member.capacitance(at)));
                let wanted = member.capacitance_change(here, &way);
                close(found, wanted, wanted.abs() + 1e-6 * member.capacitance(here), 2);
                let mut by_volts = vec![Pose::zeros(); n];
                member.add_force_change(here, volts, 1e-3, &mut by_volts);
                // of second degree in the voltage
                let found = 0.5 * (dot(&force(&q, volts + 1e-3), &other) - dot(&force(&q, volts - 1e-3), &other));
                let scale = terms(&by_volts, &other) + 1e-7 * terms(&f, &other);
                close(found, dot(&by_volts, &other), scale, 3);
            }
        }
        for (what, compared) in ["energy", "tangent", "charge", "voltage"].iter().zip(&compared) {
            // a contact that has just begun is smaller than the error of a difference across its beginning
            let floor = 1e-6 * compared.iter().map(|(.., scale)| *scale).fold(0.0, f64::max);
            for (k, found, wanted, scale) in compared {
                assert!((found - wanted).abs() <= 1e-7 * scale.max(floor), "{name} {k}, {what}: {found:e} {wanted:e}");
            }
        }
        assert_eq!(pressed >= 20, name.ends_with("pressed") || name == "stop", "{name}: {pressed}");
    }
    assert_eq!(seen, [true; 5]);
}
