//! Default quotas of one client. Where clients are identified by tokens or certificates, each gets a fraction of the
//! server's limits, so that one client cannot use up the total.

use super::limits::Limits;
use super::settings::Settings;

/// Clients that may each use all that one may have.
const CLIENTS: usize = 4;
/// The same of jobs, of which there are few.
const SUBMITTERS: usize = 2;

/// A limit of one client: its name, its field, and its value beside those of all.
type Share = (&'static str, fn(&mut Limits) -> &mut usize, fn(&Limits) -> usize);

const SHARES: [Share; 9] = [
    ("client_sessions", |limits| &mut limits.client_sessions, |limits| limits.sessions.div_ceil(CLIENTS)),
    (
        "client_session_memory",
        |limits| &mut limits.client_session_memory,
        |limits| limits.session_memory.div_ceil(CLIENTS),
    ),
    ("client_models", |limits| &mut limits.client_models, |limits| limits.models.div_ceil(CLIENTS)),
    ("client_model_memory", |limits| &mut limits.client_model_memory, |limits| limits.model_memory.div_ceil(CLIENTS)),
    ("client_sweeps", |limits| &mut limits.client_sweeps, |limits| limits.sweeps.div_ceil(SUBMITTERS)),
    ("client_calls", |limits| &mut limits.client_calls, |limits| limits.calls.div_ceil(CLIENTS)),
    (
        "client_result_streams",
        |limits| &mut limits.client_result_streams,
        |limits| limits.result_streams.div_ceil(CLIENTS),
    ),
    ("client_connections", |limits| &mut limits.client_connections, |limits| limits.connections.div_ceil(CLIENTS)),
    // a message of the largest size passes
    (
        "client_held_bytes",
        |limits| &mut limits.client_held_bytes,
        |limits| limits.held_bytes.div_ceil(CLIENTS).max(limits.message_bytes),
    ),
];

impl Settings {
    /// The limits that a server has by these settings.
    pub(super) fn limits_of_clients(&self) -> Limits {
        let mut limits = self.limits.clone();
        if self.token_file.is_none() && self.tls_client_ca.is_none() {
            return limits;
        }
        for (name, field, value) in SHARES {
            if !self.is_set(name) {
                *field(&mut limits) = value(&limits);
            }
        }
        limits
    }
}

#[cfg(test)]
mod tests {
    //! Identified clients have fractions, unless a setting differs; others have the whole.
    use super::super::settings::SettingSource;
    use super::*;

    #[test]
    fn known_clients_have_fractions() {
        assert_eq!(Settings::default().limits_of_clients(), Limits::default());
        let mut settings = Settings::default();
        for (name, text) in [("token_file", "tokens"), ("sessions", "10"), ("client_sweeps", "0")] {
            settings.set(name, text, SettingSource::Option, name.to_owned()).expect("a setting");
        }
        let limits = settings.limits_of_clients();
        assert_eq!((limits.client_sessions, limits.client_sweeps, limits.client_models), (3, 0, 16));
        assert!(limits.client_held_bytes >= limits.message_bytes);
    }
}
