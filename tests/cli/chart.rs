//! `bimorph chart`, and the baselines behind `--solver`.

use crate::command::{Bench, CANTILEVER, number};
use serde_json::Value;

const CHART: &str = "chart c.net --set F=1u --release F --stop 8u --points 41 --signals b.y --undamped \
                     --methods rodas4,radau5 --tols 1e-1,1e-2,1e-3 --bands 1M,4M,16M --repeat 1";

/// Points of one part, by a key that must be there.
fn part<'a>(chart: &'a Value, part: &str) -> Vec<&'a Value> {
    chart["points"].as_array().expect("points").iter().filter(|p| p["part"] == part).collect()
}

/// A tighter tolerance gives a smaller error, a finer model one nearer to the finest, and the linear frame stays where its
/// linearity leaves it; work is counted for each.
#[test]
fn errors_fall_with_work() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let chart = bench.json(CHART);
    let precision = part(&chart, "precision");
    // two methods on bodies, one in joint coordinates
    assert_eq!(precision.len(), 9);
    for method in precision.chunks(3) {
        let errors: Vec<f64> = method.iter().map(|p| number(&p["measured"]["error"])).collect();
        let solves: Vec<f64> = method.iter().map(|p| number(&p["measured"]["solves"])).collect();
        assert!(errors[2] < 0.5 * errors[0] && solves[2] > solves[0], "{errors:?} {solves:?}");
    }
    // the larger of both references: joint coordinates have none but their own method's
    assert!(number(&chart["reference_error"]) < number(&precision[8]["measured"]["error"]));
    let order = part(&chart, "order");
    // two coarser models of the compliant formulation, three frames; the finest is what they are measured against
    assert_eq!(order.iter().filter(|p| p["formulation"] == "compliant").count(), 2);
    assert_eq!(order.iter().filter(|p| p["formulation"] == "frame").count(), 3);
    assert_eq!(order.iter().filter(|p| p["formulation"] == "rcr" && p["failed"].is_null()).count(), 3);
    let compliant: Vec<f64> = order[..2].iter().map(|p| number(&p["measured"]["error"])).collect();
    assert!(compliant[1] < compliant[0], "{compliant:?}");
}

/// Joint coordinates are charted against themselves, integrated far more tightly, by their own method.
#[test]
fn joint_coordinates_converge() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let chart = bench.json(&format!("{CHART} --parts precision --formulations rcr --scheme es"));
    let points = part(&chart, "precision");
    assert_eq!(points.len(), 3);
    assert!(points.iter().all(|p| p["formulation"] == "rcr" && p["method"] == "rodas4"));
    let errors: Vec<f64> = points.iter().map(|p| number(&p["measured"]["error"])).collect();
    assert!(errors[2] < 0.1 * errors[0], "{errors:?}");
    assert!(number(&chart["reference_error"]) < errors[2]);
}

/// Where every direction is elastic, joint coordinates are charted by Rodas4 and by those of the requested methods that
/// they support: TR-BDF2 converges in them.
#[test]
fn implicit_methods_in_joint_coordinates() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let chart = CHART.replace("rodas4,radau5", "rodas4,tr-bdf2");
    let chart = bench.json(&format!("{chart} --parts precision --formulations rcr-elastic --scheme es"));
    let points = part(&chart, "precision");
    let methods: Vec<&str> = points.iter().filter_map(|p| p["method"].as_str()).collect();
    assert_eq!(methods, ["rodas4", "rodas4", "rodas4", "tr-bdf2", "tr-bdf2", "tr-bdf2"]);
    let errors: Vec<f64> = points[3..].iter().map(|p| number(&p["measured"]["error"])).collect();
    assert!(errors[2] < 0.2 * errors[0], "{errors:?}");
    assert!(points[3..].iter().all(|p| number(&p["measured"]["factorizations"]) > 0.0));
}

/// All solvers are measured on the same sizes, and the multiplications of the recursion grow linearly with the unknowns, those
/// of dense elimination with their cube.
#[test]
fn solver_work_grows_as_it_must() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let chart = bench.json("chart c.net --signals b.y --parts solvers --bands 100M,1600M --stop 8u --repeat 1");
    let points = part(&chart, "solvers");
    assert_eq!(points.len(), 8);
    for (small, large) in points[..4].iter().zip(&points[4..]) {
        assert_eq!(small["solver"], large["solver"]);
        let ratio = |key: &str| number(&large["measured"][key]) / number(&small["measured"][key]);
        let growth = number(&large["unknowns"]) / number(&small["unknowns"]);
        let exponent = ratio("multiplications").ln() / growth.ln();
        let wanted =
            if small["solver"].as_str().is_some_and(|s| s.starts_with("dense")) { 2.7..3.05 } else { 0.9..1.1 };
        assert!(wanted.contains(&exponent), "{}: {exponent}", small["solver"]);
    }
}

/// Everything but the times is the same on every run, and a picture of counts is the same to the byte.
#[test]
fn charts_repeat() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let run = || {
        let ran = bench.run(&format!("{CHART} --work counts --out a.svg --out a.csv --out a.html --out a.png"));
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        let csv = std::fs::read_to_string(bench.path("a.csv")).expect("the file");
        // the ninth column is the time
        let timeless: Vec<String> = csv
            .lines()
            .map(|line| line.split(',').enumerate().filter(|(k, _)| *k != 8).map(|(_, c)| c.to_owned() + ",").collect())
            .collect();
        let html = std::fs::read_to_string(bench.path("a.html")).expect("the file");
        assert!(html.starts_with("<!doctype html>") && html.contains("<table>") && !html.contains("http://localhost"));
        (std::fs::read(bench.path("a.svg")).expect("the file"), timeless)
    };
    assert!(run() == run());
    assert_eq!(bench.files(), ["a.csv", "a.html", "a.png", "a.svg", "c.net"]);
}

/// A run that cannot be made is a point with its reason and no numbers; the others stand.
#[test]
fn a_failure_is_a_point_with_its_reason() {
    // the middle node has no mass: an explicit method cannot compute its acceleration
    let text = "anchor * [f] [l=1u w=1u h=1u]\nspring2d * [f a] [kx=1]\nspring2d * [a m] [kx=1]\n\
                guide2d * [a] []\nguide2d * [m] []\nmass2d * [m] [m=1e-10]\nparam F=0\nf2d * [m] [F=F]\n";
    let bench = Bench::new(&[("m.net", text)]);
    let words = "chart m.net --set F=1u --release F --signals m.x --stop 200u --parts precision --repeat 1 \
                 --methods rodas4,rk45 --tols 1e-2 --out a.csv --json";
    let ran = bench.run(words);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let chart: Value = serde_json::from_str(&ran.stdout).expect("JSON");
    let points = part(&chart, "precision");
    assert!(points[0]["failed"].is_null() && number(&points[0]["measured"]["error"]) < 0.1);
    assert!(points[1]["measured"].is_null() && points[1]["failed"].as_str().is_some_and(|s| s.contains("inertia")));
    let csv = std::fs::read_to_string(bench.path("a.csv")).expect("the file");
    assert!(csv.lines().nth(2).is_some_and(|line| line.contains(",,,,,,,,") && line.contains("inertia")), "{csv}");
}

/// `tran` with any solver of the recursion's equations prints the same samples to nine digits; static and modes know the
/// frame; a wrong name is a usage error.
#[test]
fn solvers_on_the_command_line() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let run = |solver: &str| {
        bench.json(&format!(
            "tran c.net --set F=1u --release F --stop 8u --points 41 --signals b.y --undamped --band 2M --solver {solver}"
        ))
    };
    let samples = |found: &Value| -> Vec<f64> {
        found["signals"]["b.y"].as_array().expect("samples").iter().map(number).collect()
    };
    let want = samples(&run("recursion"));
    for solver in ["dense", "dense-unpivoted", "sparse"] {
        let found = run(solver);
        assert_eq!(found["solver"], solver);
        for (a, b) in samples(&found).iter().zip(&want) {
            assert!((a - b).abs() <= 1e-9 * want[0].abs(), "{solver}: {a:e} {b:e}");
        }
    }
    // small motion: the linear frame swings alike, within the tolerance of both
    for (a, b) in samples(&run("frame")).iter().zip(&want) {
        assert!((a - b).abs() <= 2e-2 * want[0].abs(), "frame: {a:e} {b:e}");
    }
    let exact = bench.json("static c.net --set F=1u --solver frame");
    let own = bench.json("static c.net --set F=1u --linear --junctions centreline");
    assert!((number(&exact["nodes"]["b"]["y"]) / number(&own["nodes"]["b"]["y"]) - 1.0).abs() < 1e-9);
    assert_eq!(bench.json("modes c.net --count 2 --solver frame")["solver"], "frame");
    assert_eq!(bench.run("tran c.net --stop 1u --solver lu").status, 2);
}

/// Ctrl-C ends a long chart with status 130 and leaves neither a result nor a temporary file.
#[cfg(unix)]
#[test]
fn an_interrupted_chart_leaves_nothing() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    bench.interrupt(
        "chart c.net --set F=1u --release F --undamped --stop 10 --signals b.y --out a.csv --out a.png",
        &["c.net"],
    );
}
