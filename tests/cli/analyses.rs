//! Each analysis prints the JSON that is documented, in SI, against closed forms.

use crate::command::{Bench, CANTILEVER, PLATE, number};
use approx::assert_relative_eq;

/// `check` counts what is there and fails nowhere.
#[test]
fn check() {
    let bench = Bench::new(&[("c.net", CANTILEVER), ("p.net", PLATE)]);
    let found = bench.json("check c.net --set F=2u");
    assert_eq!((&found["nodes"], &found["beams"]), (&2.into(), &1.into()));
    assert_eq!(number(&found["parameters"]["F"]), 2e-6);
    assert_eq!(bench.json("check p.net")["ports"], serde_json::json!(["drive"]));
    assert!(bench.run("check p.net").stdout.contains("no errors, 0 warnings"));
}

/// `auto`, the default, says what it takes and why: joint coordinates with explicit steps for plates on pivots that only turn, with the default method
/// where plates outweigh elastic flexures, and the bodies' own otherwise. `check` says it without a run.
#[test]
fn auto_says_what_it_takes() {
    let bench = Bench::new(&[
        ("poly.net", include_str!("../../examples/poly.net")),
        ("pivots.net", &include_str!("../../examples/pivots/pivots.net").replace("../poly", "poly")),
    ]);
    let words = "tran pivots.net --stop 50u --undamped --segments 1 --formulation auto --points 3 --signals plate(8).y";
    let turning = bench.json(&format!("{words} --scheme a2"));
    let taken = |found: &serde_json::Value| found["formulation_taken"].as_str().unwrap_or_default().to_owned();
    assert!(taken(&turning).starts_with("rcr: joints only turn"), "{}", taken(&turning));
    assert_eq!((&turning["method"], &turning["joint_coordinates"]["coordinates"]), (&"rk45".into(), &8.into()));
    let elastic = bench.json(&words.replace(" --segments 1", ""));
    assert!(taken(&elastic).starts_with("rcr: rigid parts of"), "{}", taken(&elastic));
    assert_eq!((&elastic["method"], &elastic["joint_coordinates"]["coordinates"]), (&"rodas4".into(), &48.into()));
    for other in ["--scheme e4", "--scheme a2 --release F", "--scheme a2 --method tr-bdf2"] {
        let found = bench.json(&format!("{words} {other}"));
        assert!(
            !taken(&found).starts_with("rcr") && found["joint_coordinates"].is_null(),
            "{other}: {}",
            taken(&found)
        );
    }
    assert!(bench.run(&format!("{words} --scheme a2")).stdout.contains("formulation auto took rcr"));
    let reported = bench.run("check pivots.net --formulation auto").stdout;
    assert!(reported.contains("formulation auto takes compliant: joints are elastic in every direction"), "{reported}");
    let reported = bench.run("check pivots.net --formulation rcr --segments 1").stdout;
    assert!(reported.contains("formulation rcr: 24 coordinates, 0 loops closed by springs, scheme es"), "{reported}");
}

/// In an open chain of plates on flexures, runs of `auto` after a release take a fifth of the steps of bodies or less, and end within the tolerance of them. A
/// flexure that holds the last plate closes a loop: bodies.
#[test]
fn auto_takes_joint_coordinates_of_heavy_chains() {
    let chain = |last: &str| {
        format!(
            "process p1 = [ Youngsmodulus=165e9 density=2300 h=2u ]\nparam F=1u\nanchor p1 [q(0)] []\nfor i=1:6 [\n beam2d p1 [q(i-1) r(i)] \
             [l=10u w=1u]\n link2d * [r(i) c(i)] [l=20u]\n plate2d p1 [c(i)] [l=40u w=30u]\n link2d * [c(i) q(i)] [l=20u]\n]\nf2d * [c(6)] \
             [F=F oz=pi/2]\n{last}"
        )
    };
    let held = "beam2d p1 [q(6) e] [l=10u w=1u]\nanchor p1 [e] []\n";
    let bench = Bench::new(&[("open.net", &chain("")), ("held.net", &chain(held))]);
    let run = |file: &str, formulation: &str| {
        bench.json(&format!(
            "tran {file} --release F --undamped --stop 100u --points 3 --signals c(6).y --formulation {formulation}"
        ))
    };
    let steps = |found: &serde_json::Value| number(&found["counters"]["steps"]);
    let end = |found: &serde_json::Value| number(&found["signals"]["c(6).y"][2]);
    let [bodies, chosen] = ["compliant", "auto"].map(|f| run("open.net", f));
    let default = bench.json("tran open.net --release F --undamped --stop 100u --points 3 --signals c(6).y");
    assert_eq!(default, chosen);
    // what is of the bodies is not refused
    for other in ["--shock 10,1u", "--solver dense", "--step 0.1u --method tr-bdf2", "--scheme e4"] {
        let found = bench.json(&format!("tran open.net --undamped --stop 5u --points 3 --signals c(6).y {other}"));
        assert!(found["formulation_taken"].as_str().unwrap_or_default().starts_with("compliant"), "{other}");
    }
    assert!(chosen["formulation_taken"].as_str().unwrap_or_default().starts_with("rcr: rigid parts of"));
    assert!(5.0 * steps(&chosen) < steps(&bodies), "{} and {} steps", steps(&chosen), steps(&bodies));
    assert_relative_eq!(end(&chosen), end(&bodies), epsilon = 2e-3 * 62e-6);
    assert!(run("held.net", "auto")["formulation_taken"].as_str().unwrap_or_default().starts_with("compliant"));
}

/// Default runs take the bodies, to the same bits as `compliant` and without an error, where a plate on a cantilever closes its gap under 12 V, and where
/// flexures fold under 500 µN. From there on there is no step in joint coordinates.
#[test]
fn auto_gives_way_to_bodies() {
    let plate = "process s=[Youngsmodulus=165e9 density=2330 h=20u viscosity=1.83e-5 pressure=101325]\nanchor s [a] [oz=pi]\narm beam2d s [a b] [l=200u \
                 w=2u]\nm mass2d * [b] [m=5e-9 J=1e-18]\ng plategap2d s [b c] [l=100u w=100u gap=3u oz=-pi/2]\nanchor s [c] []\neground * [c] []\ndrive port * [b c] []\n";
    let chain = "process p1 = [ Youngsmodulus=165e9 density=2300 h=2u ]\nanchor p1 [q(0)] []\nfor i=1:3 [\n beam2d p1 [q(i-1) r(i)] [l=10u w=1u]\n link2d * \
                 [r(i) c(i)] [l=20u]\n plate2d p1 [c(i)] [l=40u w=30u]\n link2d * [c(i) q(i)] [l=20u]\n]\nf2d * [c(3)] [F=500u oz=pi/2]\n";
    let bench = Bench::new(&[("plate.net", plate), ("chain.net", chain)]);
    let contact = "tran plate.net --stop 400u --points 3 --port drive=12 --signals b.y,g.gap --tol 1e-2";
    let folded = "tran chain.net --undamped --segments 2 --stop 20u --points 3 --signals c(3).y";
    for (words, why) in [
        (contact, "compliant: joints are elastic in every direction"),
        (folded, "compliant: a run in joint coordinates was given up (its steps fell below 5e-8 of the run)"),
    ] {
        let mut chosen = bench.json(words);
        let mut bodies = bench.json(&format!("{words} --formulation compliant"));
        let taken = chosen["formulation_taken"].take();
        assert!(taken.as_str().unwrap_or_default().starts_with(why), "{taken}");
        (chosen["formulation"], bodies["formulation"]) = Default::default();
        assert_eq!(chosen, bodies);
    }
    assert!(bench.run(folded).stderr.lines().all(|line| !line.starts_with("error")));
    let refused = bench.run(&format!("{folded} --formulation rcr"));
    assert!(refused.status == 1 && refused.stderr.contains("step size fell to"), "{}", refused.stderr);
}

/// The tip of a cantilever moves by F·l³/(3·E·I) and turns by F·l²/(2·E·I); every option is in the document.
#[test]
fn static_equilibrium() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let found = bench.json("static c.net --linear --set F=2u --junctions centreline --tol 1e-4");
    let ei = 165e9 * 2e-6 * 8e-18 / 12.0;
    assert_relative_eq!(number(&found["nodes"]["b"]["y"]), 2e-6 * 1e-12 / (3.0 * ei), max_relative = 1e-9);
    assert_relative_eq!(number(&found["nodes"]["b"]["rz"]), 2e-6 * 1e-8 / (2.0 * ei), max_relative = 1e-9);
    assert_eq!(number(&found["nodes"]["a"]["y"]), 0.0);
    assert_eq!((&found["junctions"], &found["linear"]), (&"centreline".into(), &true.into()));
    assert_eq!(number(&found["tol"]), 1e-4);
    assert!(found["unknowns"].as_u64() > Some(0) && found["iterations"].as_u64() > Some(0));

    // by default a beam has shear compliance, 3.1e-4 of the deflection, and its clamped edge cannot contract
    let stout = number(&bench.json("static c.net --linear --set F=2u")["nodes"]["b"]["y"]);
    let slender = number(&found["nodes"]["b"]["y"]);
    assert!(stout > slender * (1.0 - 1e-3) && stout < slender * (1.0 + 1e-3), "{stout:e} {slender:e}");
    assert_eq!(bench.json("modes c.net")["junctions"], "calibrated");
    assert_eq!(bench.json("modes c.net --solver frame")["junctions"], "centreline");
    // modes as SUGAR has them are those of its elements, unless asked otherwise
    assert_eq!(bench.json("modes c.net --as-sugar")["solver"], "frame");
    assert_eq!(bench.json("modes c.net --as-sugar --solver recursion")["solver"], "recursion");

    let report = bench.run("static c.net --linear");
    assert!(report.stdout.contains("1.515 µm"), "{}", report.stdout);
}

/// The clamped-free beam rings at (β₁l)²/2π·√(E·I/(ρ·A·l⁴)), β₁l = 1.8751041 (Blevins, table 8-1).
#[test]
fn modes() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let found = bench.json("modes c.net --count 2 --tol 1e-4 --band 2M");
    let root = (165e9 * 2e-6 * 8e-18 / 12.0 / (2300.0 * 4e-12 * 1e-16_f64)).sqrt();
    let f1 = 1.8751041_f64.powi(2) * root / std::f64::consts::TAU;
    assert_relative_eq!(number(&found["frequencies_hz"][0]), f1, max_relative = 1e-3);
    assert_eq!(found["frequencies_hz"].as_array().map(Vec::len), Some(2));
    assert_eq!(found["shapes"].as_array().map(Vec::len), Some(2));
    assert!(number(&found["residuals"][0]) < 1e-6);
    assert!(number(&found["estimated_errors"][0]).abs() < 1e-4 && number(&found["estimated_error"]) < 1e-4);

    let checked = bench.json("check c.net --tol 1e-4 --band 2M");
    assert!(checked["unknowns"].as_u64() > Some(3) && checked["modes_in_band"].as_u64() > Some(0));
    let forced = bench.json("modes c.net --count 1 --scheme d1 --segments 8 --shear --rotary-inertia");
    assert_eq!((&forced["scheme"], &forced["shear"]), (&"d1".into(), &true.into()));
    assert_relative_eq!(number(&forced["frequencies_hz"][0]), f1, max_relative = 5e-3);
}

/// A plate on a spring pulls in at √(8·k·g³/(27·ε·A)) (Nathanson et al., 1967).
#[test]
fn pull_in() {
    let bench = Bench::new(&[("p.net", PLATE)]);
    let found = bench.json("pullin p.net --max 20");
    let theory = (8.0 * 8e-18 / (27.0 * 8.854e-12 * 1e-8_f64)).sqrt();
    assert_relative_eq!(number(&found["pull_in_v"]), theory, max_relative = 1e-3);
    assert!(found["release_v"].is_null() || number(&found["release_v"]) < theory);
    assert_eq!(found["port"], "drive");
}

/// A released cantilever starts at its equilibrium under load and swings through it with the other sign.
#[test]
fn transient() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let words = "tran c.net --set F=1u --release F --stop 8u --points 161 --undamped --linear --junctions centreline \
                 --signals b.y,b.rz";
    let found = bench.json(words);
    let y: Vec<f64> = found["signals"]["b.y"].as_array().expect("samples").iter().map(number).collect();
    let t: Vec<f64> = found["t"].as_array().expect("times").iter().map(number).collect();
    assert_eq!((t.len(), y.len()), (161, 161));
    assert_eq!((t[0], t[160]), (0.0, 8e-6));
    assert_relative_eq!(y[0], 1e-18 / (3.0 * 165e9 * 2e-6 * 8e-18 / 12.0), max_relative = 1e-6);
    assert!(y.iter().copied().fold(f64::INFINITY, f64::min) < -0.8 * y[0]);
    assert_eq!((&found["units"]["b.y"], &found["units"]["b.rz"]), (&"m".into(), &"rad".into()));
    assert_eq!(found["release"], "F");
    assert!(found["counters"]["steps"].as_u64() > Some(10));
}

/// Every implicit method finds the same passages of a released cantilever through its middle, with times and directions, and
/// says in the JSON which method it was and what it did.
#[test]
fn transient_methods() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let words = "tran c.net --set F=1u --release F --stop 8u --points 3 --undamped --linear --band 2M --event b.y=0";
    let times = |found: &serde_json::Value| -> Vec<f64> {
        found["events"].as_array().expect("events").iter().map(|e| number(&e["t"])).collect()
    };
    let first = times(&bench.json(words));
    assert!(!first.is_empty());
    for method in ["avf", "midpoint", "tr-bdf2", "generalized-alpha", "newmark", "radau5"] {
        let found = bench.json(&format!("{words} --method {method} --step 5n"));
        assert_eq!((found["method"].as_str(), found["counters"]["steps"].as_u64()), (Some(method), Some(1600)));
        assert_eq!((&found["events"][0]["signal"], &found["events"][0]["direction"]), (&"b.y".into(), &"down".into()));
        assert_relative_eq!(times(&found)[0], first[0], max_relative = 1e-2);
    }
}

/// Sums of signals stand in columns beside their terms in `static`, `tran` and both kinds of sweep; others are rejected before anything is computed.
#[test]
fn sums_of_signals() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    for words in [
        "static c.net --set F=1u",
        "sweep c.net --param F=1u",
        "sweep c.net --param F=1u --analysis tran --stop 1u",
        "tran c.net --set F=1u --stop 1u --points 2",
    ] {
        let file = bench.path("found.csv");
        let ran = bench.run(&format!("{words} --signals b.y,b.x,3*b.y-0.5*b.x --out found.csv"));
        assert_eq!(ran.status, 0, "{words}: {}", ran.stderr);
        let table = std::fs::read_to_string(&file).expect("a table");
        let mut lines = table.lines().filter(|line| !line.starts_with('#'));
        let place = |head: &str, name: &str| head.split(',').position(|column| column == format!("{name} [m]"));
        let head = lines.next().expect("a head");
        let cells: Vec<&str> = lines.next_back().expect("a row").split(',').collect();
        let [y, x, sum] = ["b.y", "b.x", "3*b.y-0.5*b.x"].map(|name| {
            let at = place(head, name).unwrap_or_else(|| panic!("{words}: no {name} in {head}"));
            cells[at].parse::<f64>().expect("a number")
        });
        assert!(y != 0.0);
        assert_relative_eq!(sum, 3.0 * y - 0.5 * x, max_relative = 1e-12);
        let ran = bench.run(&format!("{words} --signals b.y-b.rz --out other.csv"));
        assert!(ran.status != 0 && ran.stderr.contains("b.y [m] and b.rz [rad]"), "{words}: {}", ran.stderr);
        let ran = bench.run(&format!("{words} --signals b.y-c.y --out other.csv"));
        assert!(ran.status != 0 && ran.stderr.contains("c.y"), "{words}: {}", ran.stderr);
    }
}

/// Shards of a sweep put together are the whole sweep, to the byte, on any number of threads.
#[test]
fn sweep() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let words = "sweep c.net --linear --junctions centreline --param F=1u:2u:5 --signals b.y";
    let whole = bench.run(words);
    assert_eq!(whole.status, 0, "{}", whole.stderr);
    assert!(whole.stderr.contains("5 points"), "{}", whole.stderr);
    let lines: Vec<&str> = whole.stdout.lines().collect();
    assert_eq!(lines[0], "point,F,b.y [m],estimated_error [1],warning,error");
    let cells: Vec<&str> = lines[5].split(',').collect();
    let tip: f64 = cells[2].parse().expect("a number");
    assert_relative_eq!(tip, 2e-18 / (3.0 * 165e9 * 2e-6 * 8e-18 / 12.0), max_relative = 1e-9);

    let mut merged: Vec<String> = Vec::new();
    for shard in ["0/2", "1/2"] {
        let ran = bench.run(&format!("{words} --threads 1 --shard {shard}"));
        // the last column says of which sweep the row is a part
        let row = |line: &str| line.rsplit_once(',').map(|(row, part)| (row.to_owned(), part.to_owned()));
        let rows: Vec<_> = ran.stdout.lines().skip(1).filter_map(row).collect();
        assert!(rows.iter().all(|(_, part)| part.starts_with(&format!("{shard} of 5 points of "))), "{rows:?}");
        merged.extend(rows.into_iter().map(|(row, _)| row));
    }
    merged.sort();
    assert_eq!(merged, lines[1..]);
}

/// A point that cannot be computed has its reason in the table; the others keep their results.
#[test]
fn a_sweep_goes_on_past_a_bad_point() {
    let bench = Bench::new(&[("c.net", &CANTILEVER.replace("l=100u", "l=L").replace("param F", "param L=1u, F"))]);
    let ran = bench.run("sweep c.net --param L=-1u,100u --signals b.y");
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    assert!(ran.stderr.contains("1 without a result"), "{}", ran.stderr);
    assert!(ran.stdout.lines().last().is_some_and(|line| line.starts_with("1,1e-4,")), "{}", ran.stdout);
}

/// `ac` of a force on a mass on a spring: 1/(k − mω²) in the document, with its unit and its static value, the undamped
/// pole, and no zero, exact and by modes alike. The report names the resonance, and the current into the port of a
/// plate is that of its capacitance.
#[test]
fn frequency_response() {
    let bench = Bench::new(&[("p.net", PLATE)]);
    let words = "ac p.net --drive m.fx --signals m.x --from 1k --to 100k --points 51";
    let found = bench.json(words);
    let grid: Vec<f64> = found["frequencies_hz"].as_array().unwrap().iter().map(number).collect();
    assert_eq!(grid.len() as u64, 51 + found["points_added"].as_u64().unwrap());
    let own = number(&bench.json("modes p.net --count 1")["frequencies_hz"][0]);
    let rest = number(&found["at_rest"]["m.x"]);
    for (f, re) in grid.iter().zip(found["signals"]["m.x"]["re"].as_array().unwrap()) {
        let exact = rest / (1.0 - (f / own).powi(2));
        assert!((number(re) / exact - 1.0).abs() < 1e-6, "{f}");
    }
    assert_eq!((&found["units"]["m.x"], &found["drive_unit"]), (&"m/N".into(), &"N".into()));
    assert_relative_eq!(number(&found["poles"][0]["frequency_hz"]), own, max_relative = 1e-9);
    assert!(found["poles"][0]["quality"].is_null() && found["zeros"]["m.x"] == serde_json::json!([]));
    assert!(found["modal_error"].is_null() && found["modes"].is_null());
    let modal = bench.json(&format!("{words} --by-modes"));
    assert!(modal["modes"] == 1 && number(&modal["modal_error"]) < 1e-9);
    assert_eq!(bench.json(&format!("{words} --even"))["frequencies_hz"].as_array().unwrap().len(), 51);
    let even = bench.json(&format!("{words} --even --linear-scale"));
    assert_relative_eq!(number(&even["frequencies_hz"][1]), 1e3 + 99e3 / 50.0, max_relative = 1e-12);
    let report = bench.run(words).stdout;
    assert!(report.contains("undamped") && report.contains("no bound") && report.contains("added about"), "{report}");
    // far below its resonance the current leads by a quarter turn
    let port = bench.json("ac p.net --drive drive --port drive=1 --from 1 --to 10 --points 2");
    let (re, im) = (&port["signals"]["drive.i"]["re"][1], &port["signals"]["drive.i"]["im"][1]);
    assert!(number(re).abs() < 1e-9 * number(im) && number(im) > 0.0);
}

/// Requests beyond `ac` are reported in one line, and leave no files.
#[test]
fn frequency_responses_that_are_refused() {
    let bench = Bench::new(&[("p.net", PLATE)]);
    for (words, expected) in [
        ("--drive m.fx --from 0 --to 1k", "--from: expected a number above 0"),
        ("--drive m.fx --from=-1 --to 1k", "--from: expected"),
        ("--drive m.fx --from 1 --to 1e300", "--to: expected"),
        ("--drive m.fx --from 2k --to 1k", "above from"),
        ("--drive m.fx --from 1 --to 1k --points 1", "--points: expected a whole number from 2"),
        ("--drive m.fx --from 1 --to 1k --points 2000000", "--points: expected"),
        ("--drive m.fx --from 1 --to 1k --points 1000000 --per-decade", "points: expected at most 1000000 in all"),
        ("--drive m --from 1 --to 1k", "NODE.fx"),
        ("--drive m.fx --signals drive.j --from 1 --to 1k", "drive"),
        ("--drive m.fx --from 1 --to 1k --by-modes --modes 0", "--modes: expected"),
    ] {
        let run = bench.run(&format!("ac p.net {words} --out r.csv"));
        assert!(run.status == 1 && run.stdout.is_empty(), "{words}");
        assert!(run.stderr.contains(expected) && run.stderr.lines().count() <= 2, "{words}: {}", run.stderr);
        assert!(!bench.path("r.csv").exists());
    }
}

/// A resonance that a signal does not contain has no peak there, and is not reported as unbounded. The tip of one of
/// two cantilevers on one anchor has no response to a force on the other. Its response to a force on itself is
/// unbounded where nothing damps it.
#[test]
fn resonances_behind_an_anchor_are_not_seen() {
    let text = "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] []\nbig beam2d p [a b] [l=200u w=2u]\n\
                small beam2d p [a d] [l=100u w=2u oz=pi]\n";
    let bench = Bench::new(&[("two.net", text)]);
    let reported = bench.run("ac two.net --drive d.fy --signals d.y --from 1k --to 400k --junctions centreline").stdout;
    let rows: Vec<&str> = reported.lines().filter(|line| line.contains("undamped")).collect();
    assert_eq!(rows.len(), 2, "{reported}");
    assert!(rows[0].contains("not seen") && rows[1].contains("no bound"), "{reported}");
}
