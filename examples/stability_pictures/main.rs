//! Draws docs/pictures/stability-*.svg from the measurements of tests/stability.
//!
//! `cargo run --release --no-default-features --example stability_pictures`

mod chart;
#[path = "../../tests/stability/main.rs"]
mod suite;

use bimorph::solve::continuation::Branch;
use chart::{Axis, Chart, Series, picture};
use suite::symbolic::Chosen;
use suite::{buckled, four_bar, inconsistent, no_pivot, squeezer, steps, stiffness, straight_arms, units};

fn linear(label: &'static str) -> Axis {
    Axis { label, log: false, range: None }
}

fn log(label: &'static str) -> Axis {
    Axis { label, log: true, range: None }
}

fn between(axis: Axis, low: f64, high: f64) -> Axis {
    Axis { range: Some([low, high]), ..axis }
}

fn line(name: &str, colour: usize, points: Vec<[f64; 2]>) -> Series {
    Series { name: name.to_owned(), colour, dots: false, dashed: false, points }
}

fn dotted(name: &str, colour: usize, points: Vec<[f64; 2]>) -> Series {
    Series { dots: true, ..line(name, colour, points) }
}

fn scaled(points: &[[f64; 2]], x: f64, y: f64) -> Vec<[f64; 2]> {
    points.iter().map(|p| [p[0] * x, p[1] * y]).collect()
}

/// Elimination without pivots.
fn elimination() -> Vec<Chart> {
    let bends = || (0..=12).map(|k| 10f64.powi(k - 15));
    let of = |count: usize, ours: bool| -> Vec<[f64; 2]> {
        bends()
            .map(|bent| {
                let (blind, recursion) = no_pivot::errors(Chosen::First, count, bent);
                [bent, if ours { recursion } else { blind }]
            })
            .collect()
    };
    let (blind, ours) = no_pivot::runs(Chosen::Last, 2, 1e-4);
    vec![
        Chart {
            title: "Error of the accelerations",
            x: log("bend of the arms from straight [rad]"),
            y: between(log("relative error"), 1e-16, 1e7),
            series: vec![
                dotted("no pivots, 1 bimorph", 3, of(1, false)),
                dotted("no pivots, 2 bimorphs (none at 0)", 1, of(2, false)),
                dotted("no pivots, 4 bimorphs (none at 0)", 2, of(4, false)),
                dotted("recursion, 4 bimorphs", 0, of(4, true)),
            ],
        },
        Chart {
            title: "Two bimorphs with error control",
            x: linear("time [µs]"),
            y: linear("first yoke [nm]"),
            series: vec![
                line("recursion", 0, scaled(&ours.track, 1e6, 1e9)),
                dotted("no pivots: comes to a stand", 1, scaled(&blind.track, 1e6, 1e9)),
            ],
        },
    ]
}

fn passage() -> Vec<Chart> {
    let rtol = 1e-8;
    let gap = |p: &four_bar::Passage| p.gap.iter().map(|g| [g[0], g[1].max(1e-17)]).collect::<Vec<_>>();
    let tolerances = [1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-12];
    let apart = |f: &dyn Fn(f64) -> f64| tolerances.iter().map(|&r| [r, f(r).min(10.0)]).collect::<Vec<_>>();
    vec![
        Chart {
            title: "Gap of the loops, tolerance 1e-8",
            x: linear("time [s]"),
            y: between(log("gap [m]"), 1e-17, 1e-5),
            series: vec![
                line("local pivots", 1, gap(&four_bar::with_feedback(0.0, rtol))),
                line("with feedback of 1/s", 2, gap(&four_bar::with_feedback(1.0, rtol))),
                line("singular path, projected", 0, gap(&four_bar::ours(rtol))),
            ],
        },
        Chart {
            title: "Distance from the exact place at 10 s (10: not reached)",
            x: log("tolerance"),
            y: between(log("distance [m]"), 1e-10, 1e5),
            series: vec![
                dotted("local pivots", 1, apart(&|r| four_bar::with_feedback(0.0, r).apart)),
                dotted("with feedback of 1/s", 2, apart(&|r| four_bar::with_feedback(1.0, r).apart)),
                dotted("with feedback of 5/s", 3, apart(&|r| four_bar::with_feedback(5.0, r).apart)),
                dotted("singular path, projected", 0, apart(&|r| four_bar::ours(r).apart)),
            ],
        },
    ]
}

fn kinks() -> Vec<Chart> {
    let of = |f: &dyn Fn(straight_arms::Shuttle) -> [f64; 3]| -> Vec<[f64; 2]> {
        let references = straight_arms::MIXED_REFERENCE.iter();
        references
            .map(|&(size, want)| {
                [size, straight_arms::error(f(straight_arms::shuttle(size, &straight_arms::MIXED)), want)]
            })
            .collect()
    };
    let counts = [10, 20, 50, 100, 200, 500, 1000];
    let crowds: Vec<_> = counts.iter().map(|&n| (n as f64, straight_arms::crowded(n))).collect();
    vec![
        Chart {
            title: "Six arms with mixed kinks, against 60 digits",
            x: log("kink [rad]"),
            y: between(log("relative error of the shuttle"), 1e-16, 1e5),
            series: vec![
                dotted("local pivots", 1, of(&|s| s.local)),
                dotted("dense, partial pivoting", 2, of(&|s| s.dense)),
                dotted("heavy rows", 0, of(&|s| s.ours)),
            ],
        },
        Chart {
            title: "One shuttle with straight arms",
            x: log("arms"),
            y: between(log("time of a reduction [µs]; rows"), 1.0, 1e4),
            series: vec![
                dotted("time", 0, crowds.iter().map(|(n, c)| [*n, c.1 * 1e6]).collect()),
                dotted("heavy rows together", 3, crowds.iter().map(|(n, c)| [*n, c.0.heavy as f64]).collect()),
            ],
        },
    ]
}

fn squeeze() -> Vec<Chart> {
    let (without, with) = squeezer::drifts(0.12);
    let floor = |p: &[[f64; 2]], low: f64| p.iter().map(|g| [g[0] * 1e3, g[1].max(low)]).collect::<Vec<_>>();
    let chart = |title, label, low, a: &[[f64; 2]], b: &[[f64; 2]]| Chart {
        title,
        x: linear("time [ms]"),
        y: log(label),
        series: vec![line("never projected", 1, floor(a, low)), line("projected", 0, floor(b, low))],
    };
    vec![
        chart("Loops", "gap [m]", 1e-18, &without.gap, &with.gap),
        chart("Energy less the motor's work", "change [J]", 1e-9, &without.energy, &with.energy),
    ]
}

fn initial() -> Vec<Chart> {
    let ends = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0];
    let kept: Vec<_> = ends.iter().map(|&t| (t, inconsistent::kept(t))).collect();
    let sizes = [1e-9, 1e-7, 1e-5, 1e-3, 1e-2, 1e-1];
    let closed: Vec<_> = sizes.iter().map(|&s| inconsistent::projected(s)).collect();
    vec![
        Chart {
            title: "A linkage that began 1e-6 rad off",
            x: log("time [s]"),
            y: between(log("gap [m]"), 1e-18, 1e0),
            series: vec![
                dotted("never projected", 1, kept.iter().map(|(t, g)| [*t, g[0]]).collect()),
                dotted("projected", 0, kept.iter().map(|(t, g)| [*t, g[1].max(1e-18)]).collect()),
            ],
        },
        Chart {
            title: "Projection of a first state",
            x: log("gap before [m]"),
            y: log("gap after [m]"),
            series: vec![dotted("projected", 0, closed.iter().map(|c| [c[0], c[1].max(1e-30)]).collect())],
        },
    ]
}

fn ratios() -> Vec<Chart> {
    let decades = || (3..=8).map(|e| 10f64.powi(e));
    let steps = |s: &stiffness::Released| s.work.steps as f64 / (1e6 * s.track.last().map_or(1.0, |p| p[0]));
    vec![
        Chart {
            title: "Steps at a tolerance of 1e-5",
            x: log("stiffness along over bending"),
            y: between(log("steps per µs"), 1.0, 1e6),
            series: vec![
                dotted("Rodas4", 0, decades().map(|r| [r, steps(&stiffness::implicit(r, 1e-5))]).collect()),
                dotted(
                    "explicit (Dormand–Prince)",
                    1,
                    decades().take(5).map(|r| [r, steps(&stiffness::explicit(r, 1e-5))]).collect(),
                ),
            ],
        },
        Chart {
            title: "Longest explicit step that stays bounded",
            x: log("stiffness along over bending"),
            y: log("step [s]"),
            series: vec![dotted("measured", 1, decades().map(|r| [r, stiffness::longest_explicit(r)]).collect())],
        },
    ]
}

fn buckling() -> Vec<Chart> {
    let of = |branch, keep: &dyn Fn(&(f64, f64, usize)) -> bool| -> Vec<[f64; 2]> {
        buckled::path(branch).iter().filter(|p| keep(p)).map(|p| [p.0, p.1 * 1e6]).collect()
    };
    let unstable = Series { dashed: true, ..line("one negative pivot", 1, of(Branch::Stay, &|p| p.2 > 0)) };
    vec![Chart {
        title: "A 200 µm column near its Euler load",
        x: between(linear("load over Euler's"), 0.9, 1.1),
        y: linear("tip sideways [µm]"),
        series: vec![
            line("no negative pivot", 0, of(Branch::Plus, &|p| p.0 >= 0.9)),
            line("no negative pivot (other side)", 0, of(Branch::Minus, &|p| p.0 >= 0.9)),
            unstable,
            dotted("Newton alone ends here", 3, vec![[0.99, 0.0], [f64::NAN, f64::NAN], [1.01, 0.0]]),
        ],
    }]
}

fn long_steps() -> Vec<Chart> {
    let (force, h, count) = (50e-6, 0.1e-6, 2000);
    let us = |track: Vec<[f64; 2]>| scaled(&track, 1e6, 1.0);
    vec![
        Chart {
            title: "Stiff bank released, steps of 0.1 µs",
            x: linear("time [µs]"),
            y: between(linear("energy over the first"), 0.0, 1.6),
            series: vec![
                line("midpoint rule: gains, then stops", 1, us(steps::midpoint(force, h, count))),
                line("average vector field", 0, us(steps::avf(force, h, count))),
                line("Rodas4", 2, us(steps::rodas4(force, h, count))),
            ],
        },
        Chart {
            title: "Explicit steps",
            x: linear("time [µs]"),
            y: between(log("energy over the first"), 1e-1, 1e4),
            series: vec![
                line("4 ns", 1, us(steps::explicit(force, 4e-9, 2000))),
                line("3 ns", 2, us(steps::explicit(force, 3e-9, 2000))),
                line("2 ns", 0, us(steps::explicit(force, 2e-9, 1000))),
            ],
        },
    ]
}

fn scales() -> Vec<Chart> {
    let right = &units::by_recursion(units::SI)[0];
    let numbers = || (-12..=12).map(|e| 10f64.powi(e));
    let penalty = |u| numbers().map(|rho| [rho, units::apart(&units::by_penalty(u, rho), right)]).collect::<Vec<_>>();
    let ours = units::apart(&units::by_recursion(units::SMALL)[0], right);
    vec![Chart {
        title: "A ladder in two systems of units",
        x: log("penalty, a bare number"),
        y: between(log("relative error"), 1e-16, 1e8),
        series: vec![
            dotted("penalty, SI", 1, penalty(units::SI)),
            dotted("penalty, µm–ng–µs", 2, penalty(units::SMALL)),
            line("recursion, one against the other", 0, numbers().map(|rho| [rho, ours]).collect()),
        ],
    }]
}

/// Function that draws one picture.
type Draw = fn() -> Vec<Chart>;

fn main() -> std::io::Result<()> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/pictures");
    let folder = std::env::args().nth(1).unwrap_or_else(|| folder.to_owned());
    let pictures: [(&str, Draw); 9] = [
        ("elimination", elimination),
        ("four-bar", passage),
        ("straight-arms", kinks),
        ("squeezer", squeeze),
        ("initial", initial),
        ("stiffness", ratios),
        ("buckling", buckling),
        ("steps", long_steps),
        ("units", scales),
    ];
    for (name, charts) in pictures {
        let path = format!("{folder}/stability-{name}.svg");
        std::fs::write(&path, picture(&charts()))?;
        println!("{path}");
    }
    Ok(())
}
