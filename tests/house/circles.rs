//! Files do not name each other in circles: code that two of them need belongs to a third. A file names another by
//! `use` and by paths in its code; a re-export counts as the file that it comes from. Tests inside a file may look
//! anywhere.

use crate::{files, sources};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// A module, as the parts of its path from the crate's root.
type Module = Vec<String>;

/// Source of every module: its text, and its re-exports by name.
struct Source {
    texts: BTreeMap<Module, String>,
    passed_on: BTreeMap<(Module, String), Module>,
}

/// Without comments and without tests.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]").next().unwrap();
    text.lines().map(|line| line.split("//").next().unwrap()).collect::<Vec<_>>().join(" ")
}

/// `a::{b, c::{d, e}}` as `a::b`, `a::c::d`, `a::c::e`.
fn leaves(tree: &str) -> Vec<String> {
    let Some((before, rest)) = tree.split_once('{') else {
        return vec![tree.split(" as ").next().unwrap().trim().to_owned()];
    };
    let body = rest.trim_end().trim_end_matches('}');
    let (mut depth, mut parts) = (0, vec![String::new()]);
    for c in body.chars() {
        depth += i32::from(c == '{') - i32::from(c == '}');
        match c {
            ',' if depth == 0 => parts.push(String::new()),
            c => parts.last_mut().unwrap().push(c),
        }
    }
    let parts = parts.iter().filter(|part| !part.trim().is_empty());
    parts.flat_map(|part| leaves(&format!("{}{}", before.trim(), part.trim()))).collect()
}

/// `use` statements of a text, each with whether it is passed on; and the rest of the text.
fn statements(text: &str) -> (Vec<(bool, String)>, String) {
    let (mut uses, mut rest) = (Vec::new(), String::new());
    let mut left = text;
    while let Some(at) = left.find("use ") {
        let (before, after) = left.split_at(at);
        let whole = before.is_empty() || before.ends_with([' ', ';', '}', '{']);
        let Some((statement, more)) = after[4..].split_once(';').filter(|_| whole) else {
            rest += &left[..at + 4];
            left = &left[at + 4..];
            continue;
        };
        let word = before.trim_end().rsplit([';', '}', ']']).next().unwrap();
        let passed_on = word.contains("pub");
        uses.extend(leaves(statement).into_iter().map(|leaf| (passed_on, leaf)));
        rest += before;
        left = more;
    }
    (uses, rest + left)
}

impl Source {
    fn read(root: &Path) -> Self {
        let mut source = Self { texts: BTreeMap::new(), passed_on: BTreeMap::new() };
        for path in files(root) {
            let place = path.strip_prefix(root).unwrap().with_extension("");
            let mut module: Module = place.iter().map(|part| part.to_str().unwrap().to_owned()).collect();
            if module.last().is_some_and(|last| last == "mod") {
                module.pop();
            }
            source.texts.insert(module, code(&fs::read_to_string(&path).unwrap()));
        }
        let modules: Vec<Module> = source.texts.keys().cloned().collect();
        for module in modules {
            for (passed_on, leaf) in statements(&source.texts[&module]).0 {
                if let Some(path) = source.absolute(&module, &leaf).filter(|_| passed_on) {
                    let name = path.last().unwrap().clone();
                    source.passed_on.insert((module.clone(), name), path);
                }
            }
        }
        source
    }

    /// A path from the crate's root; none for other crates.
    fn absolute(&self, module: &Module, path: &str) -> Option<Module> {
        let mut parts: Vec<&str> = path.split("::").map(str::trim).collect();
        let mut base = if ["lib", "main"].contains(&module[0].as_str()) { Vec::new() } else { module.clone() };
        match parts[0] {
            "crate" => base.clear(),
            "self" => {}
            "super" => {
                while parts.get(1) == Some(&"super") {
                    parts.remove(0);
                    base.pop();
                }
                base.pop();
            }
            child => {
                base.push(child.to_owned());
                if !self.texts.contains_key(&base) {
                    return None;
                }
            }
        }
        base.extend(parts[1..].iter().map(|part| (*part).to_owned()));
        Some(base)
    }

    /// The module in which what a path names is written.
    fn home(&self, path: &[String], depth: usize) -> Option<Module> {
        let at = (1..=path.len()).rev().find(|n| self.texts.contains_key(&path[..*n]))?;
        let module = path[..at].to_vec();
        let further = path.get(at).and_then(|name| self.passed_on.get(&(module.clone(), name.clone())));
        match further.filter(|further| further.as_slice() != path && depth < 8) {
            Some(further) => self.home(&[further.as_slice(), &path[at + 1..]].concat(), depth + 1),
            None => Some(module),
        }
    }

    /// The modules that a module names.
    fn named(&self, module: &Module) -> BTreeSet<Module> {
        let (uses, rest) = statements(&self.texts[module]);
        let mut paths: Vec<(bool, String)> = uses;
        let path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
        let inline = rest.split(|c: char| !path(c)).filter(|word| word.contains("::"));
        paths.extend(inline.map(|word| (false, word.trim_end_matches(':').to_owned())));
        let homes = paths.iter().filter_map(|(passed_on, path)| {
            let home = self.home(&self.absolute(module, path)?, 0)?;
            (home != *module && !(*passed_on && home.starts_with(module))).then_some(home)
        });
        homes.collect()
    }
}

/// Everything that is reached from `from`.
fn reached(edges: &BTreeMap<Module, BTreeSet<Module>>, from: &Module) -> BTreeSet<Module> {
    let (mut seen, mut open) = (BTreeSet::new(), vec![from.clone()]);
    while let Some(module) = open.pop() {
        let next = edges.get(&module).into_iter().flatten().filter(|next| seen.insert((*next).clone()));
        open.extend(next.cloned());
    }
    seen
}

#[test]
fn files_do_not_name_each_other_in_circles() {
    let mut circles: BTreeSet<Vec<String>> = BTreeSet::new();
    let (mut modules, mut names) = (0, 0);
    let plug_in = Path::new(env!("CARGO_MANIFEST_DIR")).join("clients/ngspice/src");
    let c = Path::new(env!("CARGO_MANIFEST_DIR")).join("clients/c/src");
    for root in sources().into_iter().chain([plug_in, c]) {
        let source = Source::read(&root);
        let edges: BTreeMap<Module, BTreeSet<Module>> =
            source.texts.keys().map(|module| (module.clone(), source.named(module))).collect();
        let reach: BTreeMap<&Module, BTreeSet<Module>> =
            edges.keys().map(|module| (module, reached(&edges, module))).collect();
        for (module, of) in reach.iter().filter(|(module, of)| of.contains(**module)) {
            let both = of.iter().filter(|other| reach[other].contains(*module));
            let place = |other: &Module| format!("{}: {}", root.display(), other.join("/"));
            circles.insert(both.map(place).collect());
        }
        modules += edges.len();
        names += edges.values().map(BTreeSet::len).sum::<usize>();
    }
    assert!(circles.is_empty(), "{circles:#?}");
    assert!(modules > 500 && names > 1000, "{modules} files are read, and name {names} files");
}
