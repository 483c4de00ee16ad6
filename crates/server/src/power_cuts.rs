//! A machine may lose its power at any moment: whatever of the files was not waited for may then be there, be gone, or be torn. In
//! each such case a state whose keeping was answered is found again, with its model.

use super::store::SessionStore;
use super::store::writer::SessionWriter;
use bimorph_jobs::durable::disk::{Disk, DiskOperation};
use bimorph_wire::proto;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const ID: &str = "0123456789abcdef0123456789abcdef";
const MODEL: &str = "00000000000000000000000000000001";

/// State of bytes that were not synced before the failure.
#[derive(Debug, Clone, Copy)]
pub(super) enum UnsyncedBytes {
    Gone,
    /// The first half is there.
    Torn,
    /// The file has its length, but blank content.
    Blank,
    /// The second half came first.
    Holed,
    Whole,
}

impl UnsyncedBytes {
    pub(super) const ALL: [Self; 5] = [Self::Gone, Self::Torn, Self::Blank, Self::Holed, Self::Whole];
}

/// A file: its synced content, and the writes since.
#[derive(Debug, Clone, Default)]
struct Inode {
    sure: Vec<u8>,
    written: Option<Vec<u8>>,
}

impl Inode {
    fn after(&self, bytes: UnsyncedBytes) -> Vec<u8> {
        let Some(written) = &self.written else { return self.sure.clone() };
        let same = self.sure.iter().zip(written).take_while(|(a, b)| a == b).count();
        let half = same + (written.len() - same) / 2;
        let rest = |from: usize| self.sure.get(from..).unwrap_or_default();
        match bytes {
            UnsyncedBytes::Gone => self.sure.clone(),
            UnsyncedBytes::Torn => [&written[..half], rest(half)].concat(),
            UnsyncedBytes::Blank => [&self.sure[..same], &vec![0; written.len() - same], rest(written.len())].concat(),
            UnsyncedBytes::Holed => {
                let hole = half.min(self.sure.len()).max(same);
                [&self.sure[..hole], &vec![0; half - hole], &written[half..]].concat()
            }
            UnsyncedBytes::Whole => written.clone(),
        }
    }
}

/// The disk as a machine knows it: files, and their names for sure and since.
#[derive(Debug, Default)]
pub(super) struct Machine {
    files: Vec<Inode>,
    sure: BTreeMap<PathBuf, usize>,
    names: BTreeMap<PathBuf, usize>,
}

impl Machine {
    /// Operations up to the power failure.
    pub(super) fn after(done: &[DiskOperation]) -> Self {
        let mut machine = Self::default();
        done.iter().for_each(|one| machine.run(one));
        machine
    }

    fn run(&mut self, done: &DiskOperation) {
        match done {
            DiskOperation::Written(path, bytes) => {
                let next = self.files.len();
                let file = *self.names.entry(path.clone()).or_insert(next);
                if file == next {
                    self.files.push(Inode::default());
                }
                self.files[file].written = Some(bytes.clone());
            }
            DiskOperation::Added(path, bytes) => {
                let file = &mut self.files[self.names[path]];
                file.written.get_or_insert_with(|| file.sure.clone()).extend(bytes);
            }
            DiskOperation::Synced(path) => {
                let file = &mut self.files[self.names[path]];
                file.sure = file.written.take().expect("written before");
            }
            DiskOperation::Renamed(from, to) => {
                let file = self.names.remove(from).expect("there");
                self.names.insert(to.clone(), file);
            }
            DiskOperation::FolderSynced(folder) => {
                let inside = |path: &PathBuf| path.parent() == Some(folder);
                self.sure.retain(|path, _| !inside(path));
                self.sure.extend(self.names.iter().filter(|(path, _)| inside(path)).map(|(p, f)| (p.clone(), *f)));
            }
        }
    }

    /// Content of the disk after the power failure, in a folder of its own.
    pub(super) fn found(&self, from: &Path, bytes: UnsyncedBytes, new_names: bool) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        for (path, file) in if new_names { &self.names } else { &self.sure } {
            let path = folder.path().join(path.strip_prefix(from).expect("inside"));
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(path, self.files[*file].after(bytes)).expect("written");
        }
        folder
    }
}

/// Whenever the power goes, and whatever becomes of what was not waited for, the last state whose keeping was answered is there, or
/// the one that was being kept.
#[test]
fn no_answered_state_is_lost_with_the_power() {
    let folder = tempfile::tempdir().expect("a folder");
    let store = Arc::new(SessionStore::open_on(Disk::recording(), folder.path(), 1 << 20).expect("opens"));
    let source = proto::CompileRequest {
        bundle: Some(proto::Bundle {
            root: "a.net".into(),
            files: [("a.net".into(), "anchor * [a] []\n".into())].into(),
        }),
        options: None,
    };
    let mut keeper = SessionWriter::new(&store, ID, MODEL, &source).expect("there is room");
    let done = || store.disk().operations();
    let mut answered = vec![(0, done().len())];
    for state in 1..=5_u64 {
        // longer and shorter ones in turn
        keeper.keep(state, &vec![u8::try_from(state).expect("small"); 100 * (1 + state as usize % 3)]).expect("kept");
        answered.push((state, done().len()));
    }
    let done = done();
    for power in 0..=done.len() {
        let machine = Machine::after(&done[..power]);
        let kept = answered.iter().filter(|(_, when)| *when <= power).map(|(state, _)| *state).max().unwrap_or(0);
        for bytes in UnsyncedBytes::ALL {
            for new_names in [false, true] {
                let found = machine.found(folder.path(), bytes, new_names);
                let store = SessionStore::open(found.path(), false, 1 << 20).expect("opens");
                let state = store.load(ID, MODEL).map_or(0, |kept| kept.accepted);
                let case = format!("{bytes:?}, {new_names}, after {power} of {}", done.len());
                assert!(state == kept || state == kept + 1, "{state} where {kept} was answered: {case}");
                assert!(kept == 0 || store.model(MODEL).as_ref() == Ok(&source), "{case}");
            }
        }
    }
    // 2 files of states, each new once; and every state is waited for
    assert!(done.iter().filter(|one| matches!(one, DiskOperation::Synced(_))).count() >= 5);
}
