//! A `bimorph serve` that ends with its test.

use crate::command::Bench;
use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStderr, Command, Stdio};

/// A server that is stopped when the test ends.
pub(crate) struct Server {
    child: Child,
    words: BufReader<ChildStderr>,
    /// Where it listens first.
    pub(crate) address: String,
}

impl Server {
    /// Starts `bimorph serve` with these options and waits until it says that it listens.
    pub(crate) fn start(bench: &Bench, options: &str) -> Self {
        Self::spawn(bench.command(&format!("serve {options}")))
    }

    /// The same of a command with an environment of its own.
    pub(crate) fn spawn(mut command: Command) -> Self {
        let mut child = command.stderr(Stdio::piped()).spawn().expect("the server starts");
        let words = BufReader::new(child.stderr.take().expect("standard error"));
        let mut server = Self { child, words, address: String::new() };
        server.address = server.line("listening on ");
        server
    }

    /// The rest of the next output line that contains `head`.
    pub(crate) fn line(&mut self, head: &str) -> String {
        let mut all = String::new();
        loop {
            let before = all.len();
            let read = self.words.read_line(&mut all).expect("readable");
            assert_ne!(read, 0, "it ended before it said \"{head}\": {all}");
            if let Some((_, rest)) = all[before..].split_once(head) {
                return rest.trim_end().to_owned();
            }
        }
    }

    /// The next line that holds all of these.
    pub(crate) fn line_with(&mut self, parts: &[&str]) -> String {
        loop {
            let mut line = String::new();
            let read = self.words.read_line(&mut line).expect("readable");
            assert_ne!(read, 0, "it ended before it said {parts:?}");
            if parts.iter().all(|part| line.contains(part)) {
                return line;
            }
        }
    }

    /// Its process.
    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends it a signal.
    pub(crate) fn report(&mut self, signal: &str) {
        let id = self.id().to_string();
        assert!(Command::new("kill").args([signal, &id]).status().is_ok_and(|s| s.success()));
    }

    /// Ends it by a signal; its exit status, if it has one.
    pub(crate) fn signal(&mut self, signal: &str) -> Option<i32> {
        self.report(signal);
        self.child.wait().expect("it ends").code()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
