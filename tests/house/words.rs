//! Comments, messages and pages are in plain technical English: no words of a private dialect, no nominal "What …" sentences, and no sentence of
//! a comment above 40 words. A word of the list that has its technical meaning somewhere is allowed there, with the reason.

use crate::files;
use std::fs;
use std::path::Path;

/// Banned words and phrases, with the words to use instead.
const WORDS: &[(&str, &str)] = &[
    ("told", "reported, printed, warned"),
    ("tell", "report, print, warn"),
    ("tells", "reports, prints, warns"),
    ("let go", "released, opens, disconnected"),
    ("lets go", "releases, opens, disconnects"),
    ("nobody", "no client, no caller, unknown"),
    ("who", "the client, the caller, the program that"),
    ("whoever", "the client, the caller, any program that"),
    ("come out", "results, is obtained"),
    ("comes out", "results, is obtained"),
    ("came out", "resulted, was obtained"),
    ("what is asked for", "the request, requested"),
    ("asked for", "requested, given"),
    ("asks for", "requests, requires"),
    ("looked at", "checked, evaluated, queried"),
    ("hangs on", "its parent is, is supported by"),
    ("goes on", "continues"),
    ("gives way", "is compliant, is displaced"),
    ("nothing tells", "is unknown"),
    ("out of step", "phase error, out of phase"),
    ("side by side", "in a batch, in lanes, parallel, adjacent"),
    ("by chance", "at random, random"),
    ("that is none", "invalid, unknown, missing"),
    ("that are none", "invalid, unknown, missing"),
    ("for want of", "without, because of missing"),
    ("hand over", "pass, transfer"),
    ("hands over", "passes, transfers"),
    ("handed over", "passed, transferred"),
    ("purse", "quota"),
    ("solvent", "within its quota"),
    ("overseer", "monitoring"),
    ("swung", "large motion"),
    ("yielded", "permanent strain"),
    ("scene", "example, model"),
    ("scenes", "examples, models"),
    ("whisker", "slender beam"),
    ("whiskers", "slender beams"),
    ("front", "front end"),
    ("fronts", "front ends"),
];

/// Phrases that are taken out before the search: their words have other meanings there.
const IDIOMS: &[&str] = &["front end", "front ends", "in front", "front of"];

/// Places where a word has its technical meaning, with the reason.
const ALLOWED: &[(&str, &str, &str)] = &[
    ("crates/multibody/src/", "front", "the front of a frontal elimination"),
    ("crates/multibody/src/", "fronts", "the fronts of a frontal elimination"),
    ("tests/rcr/", "front", "the front of a frontal elimination"),
    ("tests/rcr/", "fronts", "the fronts of a frontal elimination"),
    ("tests/stability/", "front", "the front of a frontal elimination"),
    ("tests/scaling.rs", "front", "the front of a frontal elimination"),
    ("docs/", "front", "the front of a frontal elimination"),
    ("docs/", "fronts", "the fronts of a frontal elimination"),
    ("docs/explanation/recursion.md", "comes out", "a coordinate is eliminated"),
    ("docs/project/stability.md", "comes out", "a coordinate is eliminated"),
    ("tests/house/words.rs", "*", "this list"),
    ("src/cli/chart", "told", "the documented key and column of a chart"),
    ("crates/analysis/src/chart", "told", "the documented key of a chart"),
    ("docs/reference/analyses.md", "told", "the documented column of a chart"),
    ("crates/model/src/options/model.rs", "asks for", "the default of the band as the Python client has it, too"),
    ("docs/reference/cli.md", "asks for", "the default of the band as the Python client has it, too"),
    ("docs/reference/options.md", "asks for", "the default of the band as the Python client has it, too"),
    ("clients/python/src/bimorph/options.py", "asks for", "the default of the band, generated from the table"),
    ("clients/python/src/bimorph/layout.py", "front", "the name of an element in a netlist"),
    ("proto/bimorph/v1/model.proto", "asks for", "the default of the band as the Python client has it, too"),
];

/// Occurrences that are left in folders which were not rewritten yet: at most so many.
const REMAINING: &[(&str, usize)] = &[("clients/python/", 0), ("scripts/", 0)];

/// Longest sentence of a comment in words.
const MAX_WORDS: usize = 40;

/// Text without code in backticks and without targets of links.
fn prose(text: &str) -> String {
    let outside = text.split('`').enumerate().map(|(k, part)| if k % 2 == 0 { part } else { "x" });
    outside.collect::<Vec<_>>().join("`")
}

fn tokens(text: &str) -> Vec<String> {
    let words = text.split(|c: char| !(c.is_alphanumeric() || c == '\'' || c == '’' || c == '_'));
    words.filter(|word| !word.is_empty()).map(str::to_lowercase).collect()
}

/// The banned words in a text.
fn banned(text: &str) -> Vec<&'static str> {
    let mut words = tokens(&prose(text)).join(" ");
    words = format!(" {words} ");
    for idiom in IDIOMS {
        words = words.replace(&format!(" {idiom} "), " · ");
    }
    let found = WORDS.iter().filter(|(word, _)| words.contains(&format!(" {word} ")));
    found.map(|(word, _)| *word).collect()
}

/// Paragraphs of the comments of a Rust source: consecutive lines with one marker, list items and rows of tables each on their own.
fn comments(text: &str) -> Vec<(usize, String)> {
    let (mut found, mut code) = (Vec::<(usize, String)>::new(), false);
    let mut open = false;
    for (number, line) in text.lines().enumerate() {
        let line = line.trim_start();
        let Some(comment) = line.strip_prefix("//") else {
            (open, code) = (false, false);
            continue;
        };
        let comment = comment.trim_start_matches(['/', '!']).trim();
        if comment.starts_with("```") {
            code = !code;
        }
        let digits = comment.trim_start_matches(|c: char| c.is_ascii_digit());
        let numbered = digits.len() < comment.len() && digits.starts_with(". ");
        let item = numbered || ["* ", "- ", "|"].iter().any(|head| comment.starts_with(head));
        if code || comment.is_empty() || comment.starts_with('#') || comment.starts_with("```") {
            open = false;
            continue;
        }
        if open && !item {
            let last = found.last_mut().unwrap();
            last.1 += " ";
            last.1 += comment;
        } else {
            found.push((number + 1, comment.to_owned()));
        }
        open = !comment.starts_with('|');
    }
    found
}

/// String literals of the code before the tests of a file, roughly: what stands between quotes on a line.
fn literals(text: &str) -> Vec<(usize, String)> {
    let text = text.split("#[cfg(test)]").next().unwrap();
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with("//"));
    lines
        .filter(|(_, line)| line.contains('"'))
        .map(|(k, line)| (k + 1, line.split('"').skip(1).step_by(2).collect::<Vec<_>>().join(" · ")))
        .collect()
}

/// Sentences of a paragraph: they end at a full stop, a question mark or an exclamation mark before a space and no small Latin letter.
fn sentences(paragraph: &str) -> Vec<String> {
    let chars: Vec<char> = prose(paragraph).replace('|', " . ").chars().collect();
    let (mut found, mut from) = (Vec::new(), 0);
    for k in 0..chars.len() {
        let ends = matches!(chars[k], '.' | '?' | '!');
        let mut next = k + 1;
        while next < chars.len() && matches!(chars[next], ')' | '"') {
            next += 1;
        }
        let space = next < chars.len() && chars[next] == ' ';
        if ends && space && chars[next..].iter().find(|c| **c != ' ').is_some_and(|c| !c.is_ascii_lowercase()) {
            found.push(chars[from..next].iter().collect());
            from = next;
        }
    }
    found.push(chars[from..].iter().collect());
    found
}

fn length(sentence: &str) -> usize {
    sentence.split_whitespace().filter(|word| word.chars().any(char::is_alphanumeric)).count()
}

/// Comments of scripts and docstrings of Python.
fn scripted(text: &str) -> Vec<(usize, String)> {
    let docstrings = text.split("\"\"\"").skip(1).step_by(2).map(|text| (0, text.replace('\n', " ")));
    let lines = text.lines().enumerate().map(|(k, line)| (k + 1, line.trim_start()));
    let comments = lines.filter(|(_, line)| line.starts_with("# ")).map(|(k, line)| (k, line.to_owned()));
    docstrings.chain(comments).collect()
}

/// Prose of a file, with line numbers, and whether that consists of the comments of Rust.
fn texts(place: &str, text: &str) -> Vec<(usize, String)> {
    match place.rsplit('.').next() {
        Some("rs")
            if ["src/", "clients/c/src/", "clients/ngspice/src/"].iter().any(|folder| place.starts_with(folder)) =>
        {
            comments(text).into_iter().chain(literals(text)).collect()
        }
        Some("rs") => comments(text),
        Some("proto") => comments(text),
        Some("md") => {
            let outside = text.split("```").step_by(2).collect::<Vec<_>>().join("\n");
            outside.split("\n\n").map(|paragraph| (0, paragraph.replace('\n', " "))).collect()
        }
        Some("cir" | "net") => text.lines().enumerate().map(|(k, line)| (k + 1, line.to_owned())).collect(),
        _ => scripted(text),
    }
}

/// Files that are searched: those of the folders with prose, and the pages at the root.
fn searched(root: &Path) -> Vec<(String, String)> {
    let folders = [
        "src",
        "crates",
        "clients/c",
        "clients/ngspice",
        "clients/python/src",
        "clients/python/native/src",
        "tests",
        "benches",
        "docs",
        "proto",
        "examples",
        "scripts",
    ];
    let pages = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"];
    let all =
        folders.iter().flat_map(|folder| files(&root.join(folder))).chain(pages.iter().map(|page| root.join(page)));
    let known = |place: &str| {
        let name = place.rsplit('/').next().unwrap();
        ["rs", "md", "proto", "py", "cir", "net"].contains(&name.rsplit('.').next().unwrap()) || !name.contains('.')
    };
    all.filter_map(|path| {
        let place =
            path.strip_prefix(root).unwrap().iter().map(|part| part.to_str().unwrap()).collect::<Vec<_>>().join("/");
        let text = known(&place).then(|| fs::read_to_string(&path).ok()).flatten()?;
        (!place.contains("/target/")).then_some((place, text))
    })
    .collect()
}

#[test]
fn words_are_those_of_the_field() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut faults = Vec::new();
    let mut left = vec![0; REMAINING.len()];
    for (place, text) in searched(root) {
        let allowed = |word: &str| {
            ALLOWED.iter().any(|(at, allowed, _)| place.starts_with(at) && (*allowed == word || *allowed == "*"))
        };
        for (line, paragraph) in texts(&place, &text) {
            for word in banned(&paragraph).into_iter().filter(|word| !allowed(word)) {
                if let Some(folder) = REMAINING.iter().position(|(folder, _)| place.starts_with(folder)) {
                    left[folder] += 1;
                    continue;
                }
                let instead = WORDS.iter().find(|(banned, _)| *banned == word).unwrap().1;
                faults.push(format!("{place}:{line}: \"{word}\": use {instead}"));
            }
        }
    }
    let more = REMAINING.iter().zip(&left).filter(|((_, most), left)| **left > *most);
    faults.extend(more.map(|((folder, most), left)| format!("{folder}: {left} banned words, at most {most} before")));
    assert!(faults.is_empty(), "{} faults\n{}", faults.len(), faults.join("\n"));
}

#[test]
fn sentences_of_comments_are_short_and_name_their_subject() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut faults = Vec::new();
    for (place, text) in searched(root).iter().filter(|(place, _)| place.ends_with(".rs")) {
        for (line, paragraph) in comments(text) {
            for sentence in sentences(&paragraph) {
                let words = length(&sentence);
                if words > MAX_WORDS {
                    faults.push(format!("{place}:{line}: {words} words, at most {MAX_WORDS}: {}", sentence.trim()));
                }
                if sentence.trim_start().starts_with("What ") && !sentence.trim_end().ends_with('?') {
                    faults.push(format!("{place}:{line}: begin with the subject: {}", sentence.trim()));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{} faults\n{}", faults.len(), faults.join("\n"));
}

/// The scan itself: comments, code in backticks, idioms, sentences and their lengths.
#[test]
fn texts_are_recognized() {
    let source = "//! One\n//! two. Three\n//!\n//! four\nfn f() {} // five\n    /// * six\n    /// * seven\n";
    let found: Vec<String> = comments(source).into_iter().map(|(_, text)| text).collect();
    assert_eq!(found, ["One two. Three", "four", "* six", "* seven"]);
    assert_eq!(banned("It is Told by `told`, in every front end and in front of it."), ["told"]);
    assert_eq!(banned("variants side\nby side, `who`"), ["side by side"]);
    assert_eq!(sentences("One e.g. two. Three? Four! \"Five.\" (Six.) seven, 7.5 and ω. Ω").len(), 6);
    assert_eq!(length("a = b + `c`, e"), 4);
    assert_eq!(literals("let a = \"one\"; // \"two\"\n").len(), 1);
}
