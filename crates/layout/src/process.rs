//! The process file, which defines the layers of a drawing.
//!
//! TOML, all numbers SI; docs/reference/layouts.md describes it. Two processes travel inside the program ([`Process::builtin`]).

mod error;
mod file;
mod stack;

pub use error::ProcessError;
use file::ProcessFile;
use stack::is_name;
pub use stack::{Anchoring, FixedLayer, MetalLayer, Process, StructuralLayer};
use std::collections::BTreeMap;

/// Processes inside the program, by name.
const BUILTIN: [(&str, &str); 2] =
    [("polymumps", include_str!("processes/polymumps.toml")), ("soi", include_str!("processes/soi.toml"))];

/// Longest process file (bytes).
const LONGEST: usize = 1 << 20;
/// Most layers of one process.
const MAX_LAYERS: usize = 256;

impl Process {
    /// Names of the processes inside the program.
    pub fn builtin_names() -> impl Iterator<Item = &'static str> {
        BUILTIN.iter().map(|(name, _)| *name)
    }

    /// A process inside the program.
    ///
    /// # Errors
    /// No process has that name; the message lists the known ones.
    pub fn builtin(name: &str) -> Result<Self, ProcessError> {
        let found = BUILTIN.iter().find(|(known, _)| *known == name);
        let (_, text) = found.ok_or_else(|| ProcessError::Unknown {
            name: name.to_owned(),
            known: Self::builtin_names().collect::<Vec<_>>().join(", "),
        })?;
        Self::parse(text, name)
    }

    /// Reads a process file; `file` is its name in messages.
    ///
    /// # Errors
    /// It is not TOML, lacks something, has something unknown, or a number or name that cannot be.
    pub fn parse(text: &str, file: &str) -> Result<Self, ProcessError> {
        let malformed = |message: String| ProcessError::Malformed { file: file.to_owned(), message };
        if text.len() > LONGEST {
            return Err(malformed(format!("a process file has at most {LONGEST} bytes, this one {}", text.len())));
        }
        let read: ProcessFile = toml::from_str(text).map_err(|e| malformed(e.to_string().trim_end().to_owned()))?;
        if read.layer.is_empty() || read.layer.len() > MAX_LAYERS {
            return Err(malformed(format!("expected 1 to {MAX_LAYERS} [[layer]], found {}", read.layer.len())));
        }
        let materials = read.material;
        let layers = read.layer.into_iter().map(|layer| layer.complete(&materials, file));
        let process = Self {
            layers: layers.collect::<Result<_, _>>()?,
            name: read.name,
            about: read.about,
            fixed: read.fixed,
            metal: read.metal,
            ignored: read.ignored.layers,
        };
        process.check(file)?;
        Ok(process)
    }

    fn check(&self, file: &str) -> Result<(), ProcessError> {
        let inconsistent = |message: String| ProcessError::Inconsistent { file: file.to_owned(), message };
        let mut owners = BTreeMap::new();
        let drawn =
            self.layers.iter().map(|l| (&l.name, &l.drawn)).chain(self.fixed.iter().map(|f| (&f.name, &f.drawn)));
        for (owner, names) in drawn {
            if !is_name(owner) {
                return Err(inconsistent(format!(
                    "a layer is called `{owner}`: expected letters, digits and _, a letter first"
                )));
            }
            for name in names {
                if let Some(other) = owners.insert(canonical(name), owner) {
                    return Err(inconsistent(format!(
                        "the drawn layer `{name}` is both in `{other}` and in `{owner}`"
                    )));
                }
            }
        }
        let mut names: Vec<&String> = self.layers.iter().map(|l| &l.name).collect();
        names.sort();
        if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(inconsistent(format!("two layers are called `{}`", twice[0])));
        }
        Ok(())
    }

    /// The layer that moves and consists of the drawn layer of that name.
    pub fn layer_of(&self, drawn: &str) -> Option<&StructuralLayer> {
        self.layers.iter().find(|layer| names(&layer.drawn, drawn))
    }

    /// Function of a drawn layer, in words; `None` where the process does not define it.
    pub fn role_of(&self, drawn: &str) -> Option<&'static str> {
        let roles = self.layers.iter().flat_map(|l| {
            [
                (&l.drawn, "moves"),
                (&l.anchoring.drawn, "anchors"),
                (&l.anchoring.released, "releases"),
                (&l.holes, "holes"),
                (&l.metal, "metal"),
            ]
        });
        let fixed = self.fixed.iter().map(|f| (&f.drawn, "holds still"));
        let ignored = [(&self.ignored, "changes nothing")];
        roles.chain(fixed).chain(ignored).find(|(list, _)| names(list, drawn)).map(|(_, role)| role)
    }
}

/// True when a list of layer names has this one in any of its spellings ("L4D0" is "4/0"; CIF names have no case).
pub fn names(list: &[String], drawn: &str) -> bool {
    let wanted = canonical(drawn);
    list.iter().any(|name| canonical(name) == wanted)
}

/// One spelling for all of a layer's: "L4D0" (how KLayout writes a number as CIF name) and "4" are "4/0", letters are capitals.
pub fn canonical(layer: &str) -> String {
    let upper = layer.trim().to_uppercase();
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    if digits(&upper) {
        return format!("{upper}/0");
    }
    if let Some((number, datatype)) = upper.strip_prefix('L').and_then(|rest| rest.split_once('D'))
        && digits(number)
        && digits(datatype)
    {
        return format!("{number}/{datatype}");
    }
    upper
}

#[cfg(test)]
mod tests {
    //! Process files say what layers are, in every spelling of their names; a wrong one is one error with its place.
    use super::*;

    #[test]
    fn those_inside_are_right() {
        for name in Process::builtin_names() {
            assert_eq!(Process::builtin(name).unwrap().name, name);
        }
        let p = Process::builtin("polymumps").unwrap();
        for spelling in ["POLY1", "poly1", "45/0", "45", "L45D0", "CPS"] {
            assert_eq!(p.layer_of(spelling).unwrap().name, "p1", "{spelling}");
        }
        assert_eq!(p.role_of("L43D0"), Some("anchors"));
        assert_eq!(p.role_of("99/0"), None);
        let error = Process::builtin("mumps").unwrap_err().to_string();
        assert!(error.contains("polymumps, soi"), "{error}");
    }

    #[test]
    fn errors_say_what_and_where() {
        let text = BUILTIN[1].1;
        let cases = [
            (text.replace("thickness = 25e-6", "thickness = 25"), "2 um are 2e-6"),
            (text.replace("material = \"silicon\"", "material = \"poly\""), "there are: silicon"),
            (text.replace("undercut = 6e-6", "undercot = 6e-6"), "undercot"),
            (text.replace("\"DEVICE\"", "\"soi\""), "both in"),
            (text.replace("name = \"soi\"", "name = "), "line 3"),
        ];
        for (changed, expected) in cases {
            let error = Process::parse(&changed, "x.toml").unwrap_err().to_string();
            assert!(error.contains(expected) && error.starts_with("x.toml"), "{error}");
        }
    }
}
