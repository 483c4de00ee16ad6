//! Runs the `bimorph` command in a folder of its own.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// A folder with netlists in it, in which the command runs.
pub(crate) struct Bench {
    folder: TempDir,
}

/// Output of a run.
pub(crate) struct Ran {
    pub(crate) status: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Bench {
    pub(crate) fn new(files: &[(&str, &str)]) -> Self {
        let folder = TempDir::new().expect("a folder");
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).expect("a file");
        }
        Self { folder }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn command(&self, words: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bimorph"));
        command.args(words.split_whitespace()).current_dir(self.folder.path()).stdin(Stdio::null());
        command
    }

    /// Runs the command with arguments separated by blanks.
    pub(crate) fn run(&self, words: &str) -> Ran {
        let output = self.command(words).output().expect("the command starts");
        Ran {
            status: output.status.code().expect("an exit status"),
            stdout: String::from_utf8(output.stdout).expect("text"),
            stderr: String::from_utf8(output.stderr).expect("text"),
        }
    }

    /// Sends an interrupt to a run that would take long, once it listens: it ends with status 130 and without output, and leaves these
    /// files alone.
    #[cfg(unix)]
    pub(crate) fn interrupt(&self, long: &str, files: &[&str]) {
        use std::os::unix::process::ExitStatusExt;
        // a process that is not listening yet dies of the signal itself: then it gets more time to start
        for patience in [300, 1000, 3000, 9000] {
            let mut command = self.command(long);
            let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the command starts");
            std::thread::sleep(std::time::Duration::from_millis(patience));
            let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
            assert!(sent.is_ok_and(|status| status.success()));
            let output = child.wait_with_output().expect("it ends");
            assert_eq!(self.files(), files);
            if output.status.signal().is_none() {
                assert_eq!(output.status.code(), Some(130), "{}", String::from_utf8_lossy(&output.stderr));
                assert!(output.stdout.is_empty());
                return;
            }
        }
        panic!("it never listened");
    }

    /// Runs the command, which must succeed, and reads its JSON.
    pub(crate) fn json(&self, words: &str) -> serde_json::Value {
        let ran = self.run(&format!("{words} --json"));
        assert_eq!(ran.status, 0, "{words}: {}", ran.stderr);
        serde_json::from_str(&ran.stdout).unwrap_or_else(|e| panic!("{words}: {e}: {}", ran.stdout))
    }

    /// Names of the files in the folder.
    pub(crate) fn files(&self) -> Vec<String> {
        let name = |path: &Path| path.file_name().expect("a name").to_string_lossy().into_owned();
        let mut names: Vec<String> = std::fs::read_dir(self.folder.path())
            .expect("a folder")
            .map(|e| name(&e.expect("an entry").path()))
            .collect();
        names.sort();
        names
    }
}

/// A number in a JSON document.
pub(crate) fn number(value: &serde_json::Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// A cantilever of 100 x 2 x 2 µm with a force F at its tip [b]; E = 165 GPa.
pub(crate) const CANTILEVER: &str =
    "process p = [Youngsmodulus=165e9 Poisson=0.3 density=2300 viscosity=1.78e-5 fluid=2u h=2u]
param F=1u
anchor p [a] [l=5u w=5u]
beam2d p [a b] [l=100u w=2u]
f2d * [b] [F=F oz=pi/2]
";

/// A plate on a spring of 1 N/m above an electrode: A = 1e-8 m², gap 2 µm, m = 1e-10 kg.
pub(crate) const PLATE: &str = "param gap=2u
anchor  * [f] [l=1u w=1u h=1u]
mass2d  * [m] [m=1e-10]
guide2d * [m] []
spring2d * [f m] [kx=1]
anchor  * [e] [l=1u w=1u h=1u]
plategap2d * [m e] [A=1e-8 gap=gap]
eground * [e] []
drive port * [m] []
";
