//! One file divides a tolerance, `ErrorBudget`; few read it, and options are copied with changes in their own methods alone. A program that
//! multiplies tolerances in many places has margins that work against each other, and none that a reader can find.

use crate::files;
use std::fs;
use std::path::Path;

/// The file that divides tolerances.
const BUDGET: &str = "crates/base/src/error_budget.rs";

/// Files that read the field `tol` of options, of a run or of a point of a chart, with the reason.
const READERS: &[(&str, &str)] = &[
    ("crates/analysis/src/transient/options.rs", "makes the budget of a run"),
    ("crates/jobs/src/sweep/transient.rs", "groups runs whose steps have one tolerance"),
    ("crates/model/src/options/changed.rs", "makes the budget of a model"),
    ("crates/server/src/analyses.rs", "reads a message"),
    ("crates/wire/src/client/analyses.rs", "writes a message"),
    ("src/cli/chart/picture.rs", "draws over the tolerance"),
    ("src/cli/chart/table.rs", "prints the tolerance"),
];

/// Lines of a text with their numbers, without its tests, comments and strings.
fn code(text: &str) -> impl Iterator<Item = (usize, String)> {
    let text = text.split("#[cfg(test)]").next().unwrap();
    text.lines().enumerate().map(|(number, line)| {
        let plain: String = line.split('"').step_by(2).collect();
        (number + 1, plain.split("//").next().unwrap().to_owned())
    })
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Byte after the parenthesis that closes the one at the head of a text; none where it stays open.
fn closed(text: &str) -> Option<usize> {
    let mut depth = 0;
    text.char_indices().find_map(|(at, c)| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        (depth == 0).then_some(at + 1)
    })
}

/// Where tolerances stand in a line: names of them, and calls of a budget, which begin after its own name.
fn tolerances(line: &str) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut rest = 0;
    while let Some(from) = line[rest..].find(is_word).map(|at| rest + at) {
        let end = line[from..].find(|c| !is_word(c)).map_or(line.len(), |at| from + at);
        let (word, after) = (&line[from..end], &line[end..]);
        let named = ["tol", "tolerance"].iter().any(|name| word == *name || word.ends_with(&format!("_{name}")));
        if (named || ["rtol", "atol"].contains(&word)) && !after.starts_with('(') {
            found.push((from, end));
        }
        let budget = match word {
            "ErrorBudget" if after.starts_with("::of(") => closed(&after[4..]).map(|length| end + 4 + length),
            "errors" if after.starts_with("()") => Some(end + 2),
            "errors" | "budget" => Some(end),
            _ => None,
        };
        // the number that a method of the budget gives
        let call = budget.and_then(|at| {
            let name = line[at..].strip_prefix('.')?;
            let length = name.find(|c| !is_word(c)).filter(|length| name[*length..].starts_with('('))?;
            let own = !["len", "iter", "first", "last"].contains(&&name[..length]);
            own.then(|| closed(&name[length..]).map(|more| at + 1 + length + more)).flatten()
        });
        found.extend(call.map(|end| (from, end)));
        rest = end;
    }
    found
}

/// Whether a line multiplies or divides a tolerance, or takes a power of it: such operators have spaces around them, references have none.
fn divides(line: &str) -> bool {
    tolerances(line).into_iter().any(|(from, end)| {
        let path = |c: char| is_word(c) || ".:&)*".contains(c);
        let before = line[..from].trim_end_matches(path);
        let after = line[end..].trim_start_matches([')', '?']);
        let is_power = !line[from..end].ends_with(')') && after.starts_with(".powf(") || after.starts_with(".sqrt()");
        is_power || [" * ", " / "].iter().any(|sign| before.ends_with(sign) || after.starts_with(sign))
    })
}

/// Whether a line reads a field `tol`; in `option.tol=` of a command it is a name.
fn reads(line: &str) -> bool {
    line.match_indices(".tol")
        .any(|(at, word)| !line[at + word.len()..].starts_with(|c| is_word(c) || c == '(' || c == '='))
}

/// Whether a line copies options to change some, or sets one of a copy.
fn changes(line: &str) -> bool {
    let path = |text: &str| text.chars().take_while(|c| is_word(*c) || *c == '.').collect::<String>();
    let begins = |before: &str| before.trim_end().is_empty() || before.trim_end().ends_with(['{', ',']);
    let is_copy = |at: usize| begins(&line[..at]) && path(&line[at + 2..]).contains("options");
    let copied = line.match_indices("..").any(|(at, _)| is_copy(at));
    let set = line.match_indices("options.").any(|(at, _)| {
        let after = &line[at + path(&line[at..]).len()..];
        after.starts_with(" = ") || after.starts_with(") = ")
    });
    copied || set
}

/// Places of the sources whose line is so.
fn places(is_so: fn(&str) -> bool) -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = ["crates", "src", "clients/c/src", "clients/ngspice/src", "clients/python/native/src"];
    let mut found = Vec::new();
    let mut read = 0;
    for path in folders.iter().flat_map(|folder| files(&root.join(folder))) {
        let place = path.strip_prefix(root).unwrap().display().to_string();
        if !place.ends_with(".rs") || place.contains("/tests/") {
            continue;
        }
        read += 1;
        let text = fs::read_to_string(&path).unwrap();
        found.extend(code(&text).filter(|(_, line)| is_so(line)).map(|(number, _)| format!("{place}:{number}")));
    }
    assert!(read > 500, "the scan finds the sources: {read}");
    found
}

fn file(place: &str) -> &str {
    place.rsplit_once(':').unwrap().0
}

#[test]
fn one_file_divides_tolerances() {
    let own = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(BUDGET)).unwrap();
    assert!(own.matches("self.requested").count() > 30, "the budget is there");
    let others: Vec<_> = places(divides).into_iter().filter(|place| file(place) != BUDGET).collect();
    assert!(others.is_empty(), "a part of a tolerance is a method of ErrorBudget, with its reason: {others:#?}");
}

#[test]
fn few_files_read_a_tolerance() {
    let found = places(reads);
    let new: Vec<_> = found.iter().filter(|place| READERS.iter().all(|(known, _)| *known != file(place))).collect();
    assert!(new.is_empty(), "take `errors()` of the options, or list the file with its reason: {new:#?}");
    let old: Vec<_> = READERS.iter().filter(|(known, _)| found.iter().all(|place| file(place) != *known)).collect();
    assert!(old.is_empty(), "no longer read it: {old:?}");
}

#[test]
fn options_change_in_named_methods() {
    let found = places(changes);
    assert!(found.is_empty(), "a copy with a change is a `with_…` method beside the options: {found:#?}");
}

/// The scan itself: each kind of arithmetic and of copies, and what resembles them.
#[test]
fn arithmetic_and_copies_are_recognized() {
    for line in [
        "0.1 * tol",
        "h * self.tol)",
        "options.tol / 3.0",
        "x / (run.tol * reach)",
        "2.0 * options.errors().requested()",
        "budget.step() * FLOOR",
        "ErrorBudget::of(tol).modes() / 2.0",
        "tol.sqrt()",
        "(1440.0 * tol).powf(0.25)",
        "error / self.tolerance",
    ] {
        assert!(divides(line), "{line}");
    }
    for line in [
        "f(&tol, *tol)",
        "budget.within(size)",
        "errors.len() / 4",
        "|tol| g(*tol)",
        "a * b",
        "with_tolerance(2.0 * x)",
    ] {
        assert!(!divides(line), "{line}");
    }
    assert!(reads("point.tol == x") && reads("(a.tol)") && !reads("a.tolerance") && !reads("a.tol()"));
    for line in
        ["T { a, ..options.clone() }", "T { a, ..self.options }", "options.a = 1;", "(options.a, options.b) = c;"]
    {
        assert!(changes(line), "{line}");
    }
    for line in ["0..options.points", "let options = a;", "options.a == 1", "..Options::default()"] {
        assert!(!changes(line), "{line}");
    }
}
