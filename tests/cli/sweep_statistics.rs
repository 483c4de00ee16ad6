//! `bimorph sweep --limits`, and what a sweep is written to: statistics on standard error, tables and pictures.

use crate::command::Bench;

/// A cantilever under a force, whose width varies.
const CANTILEVER: &str = "param F=1u, w=2u, l=100u
process p = [Youngsmodulus=165e9 density=2300 h=2u]
anchor p [a] []
beam2d p [a b] [l=l w=w oz=0]
f2d * [b] [F=F oz=deg(90)]
";
const SWEEP: &str = "sweep c.net --linear --junctions centreline --segments 1 --signals b.y";

/// F·l³/(3·E·I) for a width (m).
fn deflection(w: f64) -> f64 {
    1e-6 * 1e-12 / (3.0 * 165e9 * 2e-6 * w.powi(3) / 12.0)
}

/// The deflection is above that of the median width for half of a Latin hypercube; the mean is that of the table, and the limits of one sweep
/// are counted together.
#[test]
fn statistics_and_yield() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let median = deflection(2e-6);
    let words = format!(
        "{SWEEP} --vary w=normal:2u:0.02u --samples 400 --seed 7 --limits b.y>{median:e} --limits w<10u --limits b.y<=1"
    );
    let done = bench.run(&words);
    assert_eq!(done.status, 0, "{}", done.stderr);
    assert!(
        done.stderr.contains("yield: 50.00 % of 400 points, 95 % confidence 45.12 % to 54.88 %"),
        "{}",
        done.stderr
    );
    assert!(done.stderr.contains("w < 1e-5: 100.00 % of 400 points"), "{}", done.stderr);
    let y: Vec<f64> = done
        .stdout
        .lines()
        .skip(1)
        .map(|line| line.split(',').nth(2).expect("b.y").parse().expect("a number"))
        .collect();
    let mean = format!("{:.6e}", y.iter().sum::<f64>() / 400.0);
    let line = done.stderr.lines().find(|line| line.starts_with("b.y [m]")).expect("statistics");
    assert!(line.contains(&mean), "{line} {mean}");
    // the same rows without limits
    let plain = bench.run(&words[..words.find(" --limits").expect("limits")]);
    assert_eq!(plain.stdout, done.stdout);
    assert!(!plain.stderr.contains("yield"), "{}", plain.stderr);
}

/// One run fills a table of each kind and pictures: PNG of samples has a histogram, SVG of a grid a curve for each value of the other parameter.
#[test]
fn tables_and_pictures() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let words = "--vary w=normal:2u:0.02u --samples 50 --seed 7 --limits b.y>0 --out mc.csv --out mc.parquet --out mc.png --out mc.svg";
    let done = bench.run(&format!("{SWEEP} {words}"));
    assert_eq!((done.status, done.stdout.as_str()), (0, ""), "{}", done.stderr);
    let read = |name: &str| std::fs::read(bench.path(name)).expect("written");
    assert_eq!(String::from_utf8(read("mc.csv")).expect("text").lines().count(), 51);
    assert!(read("mc.parquet").starts_with(b"PAR1") && read("mc.parquet").ends_with(b"PAR1"));
    assert!(read("mc.png").starts_with(b"\x89PNG"));
    // bars and the limit
    let svg = String::from_utf8(read("mc.svg")).expect("text");
    assert!(svg.contains("c.net: b.y") && svg.contains(">points<") && svg.matches("<rect").count() > 6, "{svg}");
    let done = bench.run(&format!("{SWEEP} --param w=1.9u,2u,2.1u --param F=1u:3u:5 --out grid.svg"));
    assert_eq!((done.status, done.stdout.as_str()), (0, ""), "{}", done.stderr);
    let svg = String::from_utf8(read("grid.svg")).expect("text");
    assert!(svg.contains("w = 1.9e-6") && svg.contains("w = 2.1e-6"), "{svg}");
    assert!(!bench.path("grid.svg.journal").exists());
}

/// A limit may name a column as the table's header does, with its unit, and the column of the estimated errors. Where no point has a result, the
/// error is that of the points and not of the limit.
#[test]
fn columns_by_header() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let ran = |words: &str| {
        bench.command(SWEEP).args(["--param", "w=1.9u,2u", "--limits"]).arg(words).output().expect("the command starts")
    };
    for (limit, line) in [
        ("b.y [m]<1", "b.y < 1e0: 100.00 % of 2 points"),
        ("estimated_error<=1", "estimated_error <= 1e0: 100.00 % of 2 points"),
        ("estimated_error [1]<-1", "estimated_error < -1e0: 0.00 % of 2 points"),
    ] {
        let done = ran(limit);
        let stderr = String::from_utf8_lossy(&done.stderr);
        assert!(done.status.success() && stderr.contains(line), "{limit}: {stderr}");
    }
    let done = ran("b.y [mm]<1");
    let stderr = String::from_utf8_lossy(&done.stderr);
    assert!(!done.status.success() && stderr.contains("expected the unit of the column, [m], got [mm]"), "{stderr}");
    let done = bench.run(&format!("{SWEEP} --param E=1 --limits b.y<1"));
    assert_eq!(done.status, 1);
    let done = bench.run("sweep c.net --signals b.y --param l=-1u,-2u --limits b.y<1");
    assert!(done.status == 1 && !done.stderr.contains("a column of the table"), "{}", done.stderr);
}

/// A line that standard error does not take is no reason to fail.
#[test]
#[cfg(target_os = "linux")]
fn a_full_standard_error() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let full = || std::fs::File::options().write(true).open("/dev/full").expect("/dev/full");
    let sweep = bench.command(&format!("{SWEEP} --param w=1.9u,2u --limits b.y<1")).stderr(full()).output();
    let sweep = sweep.expect("the command starts");
    assert!(sweep.status.success() && !sweep.stdout.is_empty(), "{:?}", sweep.status);
    let missing = bench.command("static missing.net").stderr(full()).output().expect("the command starts");
    assert_eq!(missing.status.code(), Some(1));
}

/// An invalid limit, a limit on an unknown column, and a file of another kind are rejected before anything is computed.
#[test]
fn rejected() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    for (words, status, message) in [
        ("--limits b.y", 2, "NAME>NUMBER"),
        ("--limits b.y>x", 2, "a number behind the relation"),
        ("--limits c.y>0", 1, "one of w, b.y"),
        ("--out w.txt", 1, ".csv, .parquet, .svg, .png or .html"),
    ] {
        let done = bench.run(&format!("{SWEEP} --param w=1.9u,2u {words}"));
        assert_eq!((done.status, done.stdout.as_str()), (status, ""), "{words}: {}", done.stderr);
        assert!(done.stderr.contains(message), "{words}: {}", done.stderr);
    }
}
