//! Open files: how many the system allows this process, and what that leaves for connections.

use super::limits::Limits;

/// Files beside those of connections, jobs and sessions: listeners, timers, standard streams, the log, the folder of states.
const OWN: usize = 48;

/// Files that this process may have open at once (RLIMIT_NOFILE, its soft limit), where the system provides it (Linux).
pub fn most_open() -> Option<usize> {
    let text = std::fs::read_to_string("/proc/self/limits").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("Max open files"))?;
    let soft = line.split_whitespace().next()?;
    if soft == "unlimited" { Some(usize::MAX) } else { soft.parse().ok() }
}

/// Connections that fit beside the other files of a server with these limits, at least one.
fn fitting(limits: &Limits, most: usize) -> usize {
    most.saturating_sub(OWN + limits.sweeps.min(most / 4)).max(1)
}

/// Whether `connections` fit into what the system allows; the text says what was found.
///
/// # Errors
/// How many fit, and what to do.
pub fn check(limits: &Limits) -> Result<String, String> {
    let Some(most) = most_open() else { return Ok("the system does not report how many files may be open".to_owned()) };
    let (asked, fit) = (limits.connections, fitting(limits, most));
    if asked <= fit {
        return Ok(format!("{asked} connections fit into {most} open files"));
    }
    Err(format!(
        "connections: {asked} do not fit into {most} open files, {fit} do; allow more (ulimit -n {}, or LimitNOFILE of systemd), or \
         set connections to {fit}",
        asked + OWN + limits.sweeps
    ))
}

/// The limits with as many connections as the system allows: with more, clients that say nothing would lock others out, as none could be
/// accepted to take the place of one. Fewer than `connections` are warned of.
pub(super) fn within(limits: Limits) -> Limits {
    let Err(text) = check(&limits) else { return limits };
    tracing::warn!("{text}");
    let fit = most_open().map_or(limits.connections, |most| fitting(&limits, most));
    Limits { connections: limits.connections.min(fit), ..limits }
}

#[cfg(test)]
mod tests {
    //! Connections, jobs and the server's own files are no more than may be open.
    use super::*;

    #[test]
    fn all_files_fit() {
        for most in [1, 64, 128, 256, 1024, 1 << 20] {
            let limits = Limits::default();
            let fit = fitting(&limits, most);
            assert!(fit >= 1 && (fit == 1 || fit + OWN < most), "{most}: {fit}");
        }
        assert_eq!(fitting(&Limits::default(), 1024), 1024 - OWN - 16);
        #[cfg(target_os = "linux")]
        assert!(most_open().is_some());
    }
}
