//! The files that a deck includes. ngspice flattens them before a part is opened, and passes on neither where a `.model` line stands nor
//! the folders of its `sourcepath`.

use super::refined_deck::logical_lines;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Files that are read at most.
const MAX_FILES: usize = 1000;

/// A deck with what it includes.
#[derive(Debug, Default)]
pub(super) struct Included {
    /// Each file: its folder, and its lines with their continuations.
    files: Vec<(PathBuf, Vec<String>)>,
    /// Folders of `set sourcepath = ( … )`, in the deck and in the user's initialisation file.
    pub(super) sourcepath: Vec<PathBuf>,
}

impl Included {
    /// Reads what `deck`, which stands in `folder`, includes. `settings`: text of the user's initialisation file. Files that cannot be read
    /// are left out: ngspice reports them.
    pub(super) fn of(deck: &str, folder: &Path, settings: &str) -> Self {
        let lines = logical_lines(deck);
        let sourcepath = settings.lines().chain(lines.iter().map(String::as_str)).flat_map(sourcepath).collect();
        let mut included = Self { files: vec![(folder.to_owned(), lines)], sourcepath };
        let (mut next, mut seen) = (0, HashSet::new());
        while next < included.files.len() && included.files.len() < MAX_FILES {
            let (beside, lines) = &included.files[next];
            let mut found = Vec::new();
            for name in lines.iter().filter_map(|line| included_file(line)) {
                let places = [beside.as_path(), folder, Path::new("")].into_iter();
                let places = places.chain(included.sourcepath.iter().map(PathBuf::as_path));
                let Some(path) = places.filter_map(|place| place.join(name).canonicalize().ok()).next() else {
                    continue;
                };
                if seen.insert(path.clone())
                    && let Ok(bytes) = std::fs::read(&path)
                {
                    let own = path.parent().unwrap_or(folder).to_owned();
                    found.push((own, logical_lines(&format!("*\n{}", String::from_utf8_lossy(&bytes)))));
                }
            }
            included.files.extend(found);
            next += 1;
        }
        included
    }

    /// For each `.model` line of a part, in small letters as ngspice has them: the model's name, and the folder of the file that holds the line.
    pub(super) fn models(&self) -> impl Iterator<Item = (String, &Path)> {
        self.files
            .iter()
            .flat_map(|(folder, lines)| lines.iter().filter_map(|line| Some((model(line)?, folder.as_path()))))
    }

    /// Whether any line but comments holds one of these words, which are written in small letters.
    pub(super) fn mentions(&self, words: &[&str]) -> bool {
        let lines = self.files.iter().flat_map(|(_, lines)| lines).filter(|line| !line.trim_start().starts_with('*'));
        lines.map(|line| line.to_ascii_lowercase()).any(|line| words.iter().any(|word| line.contains(word)))
    }
}

/// The file that a line includes, as spelled.
fn included_file(line: &str) -> Option<&str> {
    let line = line.trim();
    let (word, rest) = line.split_at(line.find(char::is_whitespace)?);
    let rest = rest.trim_start();
    let (name, after) = match rest.chars().next().filter(|c| ['"', '\''].contains(c)) {
        Some(quote) => rest[1..].split_once(quote)?,
        None => rest.split_once(char::is_whitespace).unwrap_or((rest, "")),
    };
    let library = word.eq_ignore_ascii_case(".lib");
    let includes = [".include", ".inc"].iter().any(|w| word.eq_ignore_ascii_case(w));
    // `.lib NAME` begins a section of a library
    (!name.is_empty() && (includes || (library && !after.trim().is_empty()))).then_some(name)
}

/// The name of a part's model, where the line is its `.model` line.
fn model(line: &str) -> Option<String> {
    let line = line.to_ascii_lowercase();
    let mut words = line.split_whitespace();
    let (".model", name, kind) = (words.next()?, words.next()?, words.next()?) else { return None };
    (kind == "bimorph" || kind.starts_with("bimorph(")).then(|| name.to_owned())
}

/// Folders of a line `set sourcepath = ( A B )`.
fn sourcepath(line: &str) -> Vec<PathBuf> {
    let list = || {
        let rest = line.trim().strip_prefix("set")?.trim_start().strip_prefix("sourcepath")?;
        rest.trim_start().strip_prefix('=')?.trim().strip_prefix('(')?.split_once(')')
    };
    let Some((list, _)) = list() else { return Vec::new() };
    list.split_whitespace().filter(|word| !word.starts_with('$')).map(PathBuf::from).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Files are found beside the file that includes them, then beside the deck, then along `sourcepath`; sections of libraries, comments and files
    /// that are not there include nothing, and a file that includes itself is read once.
    #[test]
    fn models_stand_in_the_folder_of_their_file() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().canonicalize().unwrap();
        for name in ["lib/deep", "far"] {
            std::fs::create_dir_all(folder.join(name)).unwrap();
        }
        let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
        write(
            "lib/mems.lib",
            ".lib all\n.inc 'deep/a b.inc'\n.include mems.lib\n.MODEL Plate\n+ bimorph(file=\"p.net\")\n.endl\n",
        );
        write("lib/deep/a b.inc", ".model comb Bimorph (file=\"c.net\")\n.model d1 d(is=1)\n");
        write("far/other.inc", ".model far bimorph(file=\"f.net\")\n");
        let deck = format!(
            "title\n.lib \"lib/mems.lib\" all\n.include other.inc\n.include none.inc\n* .model no bimorph(x)\nset sourcepath = ( {} $sourcepath )\n",
            folder.join("far").display()
        );
        let found = Included::of(&deck, &folder, "");
        let models: Vec<(String, PathBuf)> = found.models().map(|(name, at)| (name, at.to_owned())).collect();
        let at = |name: &str, place: &str| (name.to_owned(), folder.join(place));
        assert_eq!(models, [at("plate", "lib"), at("far", "far"), at("comb", "lib/deep")]);
    }

    /// Words are found in any file, in any case, and not in comments.
    #[test]
    fn words_are_found() {
        let of = |deck: &str| Included::of(deck, Path::new("/nowhere"), "").mentions(&["convstep"]);
        assert!(of("t\n.options\n+ ConvStep=1\n") && !of("t\n* convstep\n.options reltol=1e-4\n"));
    }
}
