//! Lines on standard error. One that cannot be written (a full disk, a closed pipe) is dropped: it is never the reason why a command fails.

/// As `eprintln!`, without its panic.
macro_rules! stderr_line {
    ($($argument:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($argument)*);
    }};
}

/// As `eprint!`, without its panic.
macro_rules! stderr_text {
    ($($argument:tt)*) => {{
        use std::io::Write as _;
        let _ = write!(std::io::stderr(), $($argument)*);
    }};
}
