//! Sweeps as jobs: samples of what varies, points that outlive the process, shards put together.

use crate::command::Bench;
use std::time::{Duration, Instant};

/// A cantilever under a force, with parameters to vary.
const CANTILEVER: &str = "param F=1u, w=2u, l=100u
process p = [Youngsmodulus=165e9 density=2300 h=2u]
anchor p [a] []
beam2d p [a b] [l=l w=w oz=0]
f2d * [b] [F=F oz=deg(90)]
";

fn column(csv: &str, name: &str) -> Vec<f64> {
    let mut lines = csv.lines();
    let head: Vec<&str> = lines.next().expect("a head").split(',').collect();
    let at = head.iter().position(|column| *column == name).unwrap_or_else(|| panic!("{name} in {head:?}"));
    lines.map(|line| line.split(',').nth(at).expect("a cell").parse().expect("a number")).collect()
}

/// The scatter of the deflection is that of its formula, F·l³/(3·E·I): of w³ alone. The mean of w and its deviation are
/// the specified ones to a Latin hypercube's precision, and the same seed gives the same bytes, in shards too.
#[test]
fn monte_carlo() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let words = "sweep c.net --linear --junctions centreline --segments 1 --vary w=normal:2u:0.02u --samples 400 --seed 7 --signals b.y";
    let whole = bench.run(words);
    assert_eq!(whole.status, 0, "{}", whole.stderr);
    let (w, y) = (column(&whole.stdout, "w"), column(&whole.stdout, "b.y [m]"));
    for (w, y) in w.iter().zip(&y) {
        let formula = 1e-6 * 1e-12 / (3.0 * 165e9 * 2e-6 * w.powi(3) / 12.0);
        assert!((y / formula - 1.0).abs() < 1e-9, "{w} {y} {formula}");
    }
    let mean = w.iter().sum::<f64>() / 400.0;
    let deviation = (w.iter().map(|w| (w - mean).powi(2)).sum::<f64>() / 400.0).sqrt();
    assert!((mean / 2e-6 - 1.0).abs() < 1e-4 && (deviation / 2e-8 - 1.0).abs() < 0.01, "{mean} {deviation}");
    assert_eq!(bench.run(&format!("{words} --threads 1")).stdout, whole.stdout);
    assert_ne!(bench.run(&words.replace("--seed 7", "--seed 8")).stdout, whole.stdout);

    for k in 0..3 {
        assert_eq!(bench.run(&format!("{words} --shard {k}/3 --out part{k}.csv")).status, 0);
    }
    let merged = bench.run("merge part2.csv part0.csv part1.csv");
    assert_eq!((merged.status, merged.stdout.as_str()), (0, whole.stdout.as_str()), "{}", merged.stderr);
    let corners = bench.run(&format!("{words} --param F=1u,2u --samples 3").replace("--samples 400 ", ""));
    let (force, w) = (column(&corners.stdout, "F"), column(&corners.stdout, "w"));
    assert_eq!(force, [1e-6, 1e-6, 1e-6, 2e-6, 2e-6, 2e-6]);
    assert_eq!(w[..3], w[3..]);
}

/// Invalid samples are rejected with a remedy.
#[test]
fn slips() {
    let bench = Bench::new(&[("c.net", CANTILEVER), ("x.csv", "a,b\n1,2\n"), ("cut.csv", "point,w,\"b.y [m]\n")]);
    for (words, said) in [
        ("sweep c.net --vary w=gauss:1:1 --samples 3", "normal"),
        ("sweep c.net --vary w=normal:1u:1u --samples 0", "at least one"),
        ("sweep c.net --vary w=normal:1u:1u --samples 100000 --design sobol", "65536"),
        ("sweep c.net --vary w=normal:1u:1u --vary w=normal:1u:1u --samples 3", "twice"),
        ("sweep c.net --vary w=normal:1u:1u --param w=1u,2u --samples 3", "twice"),
        ("sweep c.net --vary w=normal:1u:1u --samples 3 --correlate w,l=0.5", "vary"),
        ("sweep c.net --vary nosuch=normal:1u:1u --samples 3", "nosuch"),
        (
            "sweep c.net --vary w=normal:1u:1n --vary l=normal:1u:1n --samples 3 --correlate w,l=0.5 --correlate l,w=0.2",
            "each pair once",
        ),
        ("sweep c.net --param w=1u,2u --seed 3", "--vary"),
        ("sweep c.net --param w=1u,2u --analysis tran --stop 1e300 --signals b.y", "1e9"),
        ("sweep c.net --param w=1u,2u --design sobol", "--vary"),
        ("merge x.csv", "no table of `bimorph sweep`"),
        ("merge cut.csv", "no table of `bimorph sweep`"),
        ("merge nosuch.csv", "nosuch.csv"),
    ] {
        let ran = bench.run(words);
        assert!((1..=2).contains(&ran.status), "{words}: {} {}", ran.status, ran.stderr);
        assert!(ran.stderr.contains(said) && ran.stdout.is_empty(), "{words}: {}", ran.stderr);
    }
}

/// Tables that are not the shards of one sweep are refused, with the point.
#[test]
fn shards_that_do_not_fit() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let words = "sweep c.net --segments 1 --param F=1u:2u:6 --signals b.y";
    for k in 0..3 {
        assert_eq!(bench.run(&format!("{words} --shard {k}/3 --out part{k}.csv")).status, 0);
    }
    assert_eq!(bench.run("sweep c.net --segments 1 --param w=1u,2u --signals b.y --out w.csv").status, 0);
    for (name, other) in [
        ("w1", words.replace("F=1u:2u:6", "w=1u:2u:6")),
        ("tol1", format!("{words} --tol 1e-4")),
        ("l1", format!("{words} --set l=101u")),
        ("seven1", words.replace(":6", ":7")),
    ] {
        assert_eq!(bench.run(&format!("{other} --shard 1/3 --out {name}.csv")).status, 0);
    }
    for (parts, said) in [
        ("part0.csv part2.csv", "2 points are in none of the tables, the first of them point 1"),
        // the last points
        ("part0.csv part1.csv", "2 points are in none of the tables, the first of them point 2"),
        ("part0.csv", "4 points are in none"),
        ("part0.csv part1.csv part1.csv part2.csv", "point 1 is in part1.csv and in part1.csv"),
        ("part0.csv w.csv part1.csv part2.csv", "w.csv does not say of which sweep it is a part"),
        ("part0.csv w1.csv part2.csv", "w1.csv is of another sweep than part0.csv"),
        ("part0.csv tol1.csv part2.csv", "tol1.csv is of another sweep than part0.csv"),
        ("part0.csv l1.csv part2.csv", "l1.csv is of another sweep than part0.csv"),
        ("part0.csv seven1.csv part2.csv", "seven1.csv is of another sweep than part0.csv"),
    ] {
        let ran = bench.run(&format!("merge {parts} --out whole.csv"));
        assert_eq!(ran.status, 1, "{parts}");
        assert!(ran.stderr.contains(said), "{parts}: {}", ran.stderr);
        assert!(!bench.path("whole.csv").exists());
    }
}

/// A shard in which no point has a result has a table all the same, in the place of an older one, and the status of a failure; put together
/// it gives the reasons. A whole sweep without a result has none, and its points stay in the journal.
#[test]
fn a_shard_without_a_result() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let words = "sweep c.net --segments 1 --param w=1u,-1u,2u,-2u --signals b.y";
    let whole = bench.run(words);
    assert_eq!(whole.status, 0, "{}", whole.stderr);
    std::fs::write(bench.path("part1.csv"), "older").expect("written");
    for (k, status) in [0, 1].into_iter().enumerate() {
        let ran = bench.run(&format!("{words} --shard {k}/2 --out part{k}.csv"));
        assert_eq!(ran.status, status, "{}", ran.stderr);
        assert!(!bench.path(&format!("part{k}.csv.journal")).exists());
    }
    let merged = bench.run("merge part1.csv part0.csv");
    assert_eq!((merged.status, merged.stdout.as_str()), (0, whole.stdout.as_str()), "{}", merged.stderr);
    let none = bench.run("sweep c.net --segments 1 --param w=-1u,-2u --signals b.y --out none.csv");
    assert_eq!(none.status, 1);
    assert!(!bench.path("none.csv").exists() && bench.path("none.csv.journal").exists(), "{}", none.stderr);
}

/// A sweep that is killed in the middle, or interrupted, keeps its finished points: the same command with --resume
/// continues, computes at most the points in flight again, and its table has the bytes of one run. Without --resume, or
/// for another sweep, the points are not touched.
#[test]
fn killed_and_resumed() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let words = "sweep c.net --segments 40 --param F=1u:2u:2000 --signals b.y --threads 2";
    let whole = bench.run(words);
    assert_eq!(whole.status, 0, "{}", whole.stderr);
    let lines =
        || std::fs::read(bench.path("w.csv.journal")).map_or(0, |bytes| bytes.iter().filter(|b| **b == b'\n').count());
    let mut before = 0;
    for signal in ["-KILL", "-INT", "-KILL"] {
        let mut child = bench.command(&format!("{words} --out w.csv --resume")).spawn().expect("the command starts");
        let begun = Instant::now();
        while lines() < before + 100 {
            assert!(begun.elapsed() < Duration::from_secs(60), "no points after a minute");
            assert!(child.try_wait().expect("a child").is_none(), "it ended before it was stopped");
            std::thread::sleep(Duration::from_millis(2));
        }
        let sent = std::process::Command::new("kill").args([signal, &child.id().to_string()]).status();
        assert!(sent.is_ok_and(|s| s.success()));
        let status = child.wait().expect("an end");
        assert_eq!(status.code(), if signal == "-INT" { Some(130) } else { None });
        assert!(lines() >= before + 100, "points were lost");
        assert!(!bench.path("w.csv").exists());
        before = lines();
    }
    let refused = bench.run(&format!("{words} --out w.csv"));
    assert!(refused.status == 1 && refused.stderr.contains("--resume"), "{}", refused.stderr);
    let other = bench.run(&format!("{words} --out w.csv --resume --tol 1e-4"));
    assert!(other.status == 1 && other.stderr.contains("another sweep"), "{}", other.stderr);
    assert_eq!(lines(), before);
    let ended = bench.run(&format!("{words} --out w.csv --resume"));
    assert_eq!(ended.status, 0, "{}", ended.stderr);
    assert!(ended.stderr.contains(&format!("{} points are there from before", before - 1)), "{}", ended.stderr);
    assert_eq!(std::fs::read_to_string(bench.path("w.csv")).expect("the table"), whole.stdout);
    assert!(!bench.path("w.csv.journal").exists());
}
