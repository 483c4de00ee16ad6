//! Bad input gives one clear message on standard error, exit status 1, nothing on standard output and no file.

use crate::command::{Bench, CANTILEVER, PLATE};

/// Runs a command that must fail and returns its message.
fn fails(bench: &Bench, words: &str) -> String {
    let before = bench.files();
    let ran = bench.run(words);
    assert_eq!(ran.status, 1, "{words}: {}{}", ran.stdout, ran.stderr);
    assert_eq!(ran.stdout, "", "{words}");
    assert_eq!(bench.files(), before, "{words} left a file");
    assert!(!ran.stderr.contains("panicked"), "{words}: {}", ran.stderr);
    let errors = ran.stderr.lines().filter(|line| line.starts_with("error")).count();
    assert_eq!(errors, 1, "{words}: not one error: {}", ran.stderr);
    ran.stderr
}

fn with(change: impl Fn(&str) -> String) -> Bench {
    Bench::new(&[("bad.net", &change(CANTILEVER))])
}

/// Place, what is wrong, and a way out, for slips in a netlist; every analysis says the same.
#[test]
fn a_netlist_with_a_slip() {
    let unknown = with(|net| net.replace("beam2d p", "baem2d p"));
    for verb in
        ["check", "static", "modes", "pullin", "tran --stop 1u", "static --out a.svg", "tran --stop 1u --out a.raw"]
    {
        let message = fails(&unknown, &format!("{verb} bad.net"));
        assert!(message.contains("bad.net:4") && message.contains("baem2d") && message.contains("beam2d"), "{message}");
        assert!(message.contains("^^^^"), "{message}");
    }
    let include = with(|net| format!("uses gone.net\n{net}"));
    let message = fails(&include, "static bad.net --out a.csv");
    assert!(message.contains("gone.net") && message.contains("bad.net:1"), "{message}");

    let unit = with(|net| net.replace("l=100u", "l=100um"));
    let message = fails(&unit, "check bad.net");
    assert!(message.contains("bad.net:4"), "{message}");

    let negative = with(|net| net.replace("l=100u", "l=-100u"));
    let message = fails(&negative, "check bad.net");
    assert!(message.contains("bad.net:4") && message.contains("positive"), "{message}");
}

/// Options that an analysis would ignore are rejected.
#[test]
fn options_of_another_analysis() {
    let bench = Bench::new(&[("plate.net", PLATE), ("beam.net", CANTILEVER)]);
    for (words, option) in [
        ("sweep plate.net --param gap=1u,2u --analysis pullin --port drive=5", "--port"),
        ("sweep plate.net --param gap=1u,2u --analysis modes --signals m.x", "--signals"),
        ("sweep plate.net --param gap=1u,2u --count 3", "--count"),
        ("sweep plate.net --param gap=1u,2u --max 9", "--max"),
        ("sweep plate.net --param gap=1u,2u --threads 1 --to unix:///nowhere", "--threads"),
        ("tran beam.net --stop 1u --solver frame --method tr-bdf2", "--method"),
        ("tran beam.net --stop 1u --solver frame --step 1n", "--step"),
    ] {
        let message = fails(&bench, words);
        assert!(message.contains(option), "{words}: {message}");
    }
}

/// A part that nothing holds has no equilibrium: the message names it.
#[test]
fn a_structure_that_can_move_freely() {
    let floating = with(|net| net.replace("anchor p [a] [l=5u w=5u]\n", ""));
    let message = fails(&floating, "static bad.net --out a.svg");
    assert!(message.contains('a') && message.contains("anchor"), "{message}");

    let disconnected = with(|net| format!("{net}beam2d p [x y] [l=50u w=2u]\nf2d * [y] [F=1u]\n"));
    let message = fails(&disconnected, "static bad.net");
    assert!(message.contains('x') || message.contains('y'), "{message}");
}

/// Options that mean nothing are refused before any work, each naming itself and what it takes.
#[test]
fn options_that_mean_nothing() {
    let bench = Bench::new(&[("c.net", CANTILEVER), ("p.net", PLATE)]);
    for (words, expected) in [
        ("static c.net --out a.xyz", ".raw, .csv, .svg, .png, .html"),
        ("static c.net --out a.parquet", ".raw, .csv, .svg, .png, .html"),
        ("static c.net --out gone/a.svg", "gone"),
        ("static c.net --tol 0", "--tol"),
        ("static c.net --tol -1", "--tol"),
        ("modes c.net --count 0", "--count"),
        ("modes c.net --band 0", "--band"),
        ("modes c.net --scheme e5", "a0, a2, c1, d1, b, e4, es"),
        ("modes c.net --segments 0", "--segments"),
        ("tran c.net --stop 1u --method rk45 --formulation rcr --scheme c1", "coupling"),
        ("static c.net --junctions round", "centreline, offset or calibrated"),
        ("modes c.net --junctions offset --solver frame", "--solver frame"),
        ("tran c.net --stop 0", "--stop"),
        ("tran c.net --stop 1u --points 1", "--points"),
        ("tran c.net --stop 1u --step 0", "step"),
        ("tran c.net --stop 1u --rho 0.5", "--rho"),
        ("tran c.net --stop 1u --method generalized-alpha --rho 2", "--rho"),
        ("tran c.net --stop 1u --method rk45 --junctions centreline", "rotary_inertia"),
        ("tran c.net --stop 1u --event tip.x=0", "tip.x"),
        ("tran c.net --stop 1u --release G", "\"G\""),
        ("tran c.net --stop 1u --signals tip.x", "tip.x"),
        ("static c.net --set G=1", "G"),
        ("static p.net --port heat=1", "drive"),
        ("pullin p.net --source heat", "drive"),
        ("pullin p.net --max 0", "--max"),
        ("pullin p.net --out a.svg", "no picture"),
        ("sweep c.net --param F", "NAME="),
        ("sweep c.net --param F=1:2:3 --shard 3/3", "shard"),
        ("sweep c.net --param F=1:2:3 --out a.raw", ".csv"),
        ("static gone.net", "gone.net"),
        ("plot gone.raw --out a.svg", "gone.raw"),
        ("plot c.net --out a.svg", "Title:"),
        ("serve --listen ftp://x", "unix:///path"),
        ("serve --listen 0.0.0.0:0", "--insecure"),
        ("cosim gone.cir", "gone.cir"),
        ("cosim gone.cir --op", "a netlist (.net)"),
        ("cosim gone.net --op", "gone.net"),
        ("cosim c.net", "nothing drives the mechanism"),
        ("cosim p.net --port heat=1", "drive"),
        ("cosim p.net --drive heat=SIN(0,1,1k)", "drive"),
        ("cosim p.net --emit there/p.cir", "there"),
    ] {
        let message = fails(&bench, words);
        assert!(message.contains(expected), "{words}: {message}");
    }
}

/// A server that is not there is named with its address, within the deadline.
#[test]
fn an_unreachable_server() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let uri = format!("unix://{}", bench.path("nobody.sock").display());
    let message = fails(&bench, &format!("sweep c.net --param F=1u:2u:3 --to {uri} --deadline 2 --out a.csv"));
    assert!(message.contains(&uri), "{message}");
}

/// Wrong usage is clap's to report, with status 2 and nothing on standard output.
#[test]
fn wrong_usage() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    for words in
        ["", "fly", "static", "tran c.net", "static c.net --set w", "tran c.net --stop soon", "modes c.net -n x"]
    {
        let ran = bench.run(words);
        assert_eq!((ran.status, ran.stdout.as_str()), (2, ""), "{words}: {}", ran.stderr);
    }
}
