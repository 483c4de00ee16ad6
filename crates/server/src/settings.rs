//! Settings of a server: a table, and their sources in decreasing precedence: options of the command, the environment
//! (`BIMORPH_SERVE_NAME`), a file, and defaults.

pub mod syntax;

use super::limits::{LIMITS, Limits};
use bimorph_wire::address::Address;
use bimorph_wire::credentials::read;
use bimorph_wire::proto;
use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use syntax::{AddressList, AddressOrNone, PathOrNone, ValueSyntax, YesOrNo};
use thiserror::Error;

/// Head of the names of environment variables.
pub const ENVIRONMENT: &str = "BIMORPH_SERVE_";

/// A setting beside the limits: what it is, and its field.
pub struct ServerOption {
    /// Name in files; with `-` for `_` an option of the command; in capitals after [`ENVIRONMENT`] a variable.
    pub name: &'static str,
    /// Placeholder for its value in help: `FILE`, `ADDRESS`; empty: yes or no.
    pub place: &'static str,
    /// Meaning, in one sentence or two.
    pub help: &'static str,
    read: fn(&mut Settings, &str) -> Result<(), &'static str>,
    write: fn(&Settings) -> String,
}

macro_rules! settings {
    ($($(#[doc = $help:literal])+ $field:ident: $kind:ident = $default:expr;)+) => {
        /// All settings of a server. `Default` is the only place where the values stand.
        #[derive(Debug, Clone, PartialEq)]
        pub struct Settings {
            $($(#[doc = $help])+ pub $field: <$kind as ValueSyntax>::Held,)+
            /// The limits.
            pub limits: Limits,
            /// Source of each non-default setting.
            sources: BTreeMap<&'static str, SettingSource>,
        }

        impl Default for Settings {
            fn default() -> Self {
                Self { $($field: $default,)+ limits: Limits::default(), sources: BTreeMap::new() }
            }
        }

        /// Every setting beside the limits, in the order of the documentation.
        pub static SETTINGS: LazyLock<Vec<ServerOption>> = LazyLock::new(|| vec![$(ServerOption {
            name: stringify!($field),
            place: $kind::METAVAR,
            help: concat!($($help, "\n"),+),
            read: |settings, text| $kind::read(text).map(|value| settings.$field = value),
            write: |settings| $kind::write(&settings.$field),
        }),+]);
    };
}

settings! {
    /// Where to listen: unix:///path or host:port. Repeated, or with commas between.
    listen: AddressList = vec![Address::Tcp(SocketAddr::from((Ipv4Addr::LOCALHOST, 50051)))];

    /// Certificate of this server and those up to its authority, PEM: every TCP address speaks TLS 1.3.
    tls_cert: PathOrNone = None;

    /// Key of the certificate, PEM.
    tls_key: PathOrNone = None;

    /// Authorities of clients, PEM: each client must have a certificate of one of them.
    tls_client_ca: PathOrNone = None;

    /// Tokens, a line for each client, TOKEN or NAME TOKEN: every call over TCP must show one.
    token_file: PathOrNone = None;

    /// Address of metrics and readiness by plain HTTP: /metrics (Prometheus), /ready, /live. It requires no token.
    metrics: AddressOrNone = None;

    /// Log as JSON, an object a line, with the id, the name and the client of each request.
    log_json: YesOrNo = false;

    /// Folder for accepted states of sessions and for jobs, which then outlive the server: a client continues where it
    /// was.
    state_dir: PathOrNone = None;

    /// Do not wait for the disk when a state is kept: it outlives the end of the server, not that of the machine.
    state_unsynced: YesOrNo = false;

    /// Allow addresses that other machines can reach without TLS and authentication.
    insecure: YesOrNo = false;
}

/// Source of a setting's value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum SettingSource {
    /// A file.
    File,
    /// A variable of the environment.
    Environment,
    /// An option of the command.
    Option,
}

/// An invalid setting.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SettingError {
    /// There is no such setting.
    #[error("{place}: there is no such setting; expected one of {known}")]
    Unknown {
        /// Its place.
        place: String,
        /// Those there are.
        known: String,
    },
    /// It cannot have that value.
    #[error("{place}: expected {expected}, got \"{got}\"")]
    Value {
        /// Its place.
        place: String,
        /// The expected value.
        expected: String,
        /// The given value.
        got: String,
    },
    /// A file that cannot be read, or is no TOML.
    #[error("configuration {path}: {reason}", path = path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The fault.
        reason: String,
    },
}

impl ServerOption {
    /// The name as an option of the command.
    pub fn flag(&self) -> String {
        self.name.replace('_', "-")
    }
}

/// The variable of a setting or a limit.
pub fn variable(name: &str) -> String {
    format!("{ENVIRONMENT}{}", name.to_uppercase())
}

impl Settings {
    /// Sets one by its name. A value from a source of higher precedence stays; the given value must be valid all the
    /// same.
    ///
    /// # Errors
    /// [`SettingError`], which names `place`.
    pub fn set(&mut self, name: &str, text: &str, source: SettingSource, place: String) -> Result<(), SettingError> {
        let value =
            |place, expected: &str| SettingError::Value { place, expected: expected.to_owned(), got: text.to_owned() };
        let mut unheard = Self::default();
        if let Some(setting) = SETTINGS.iter().find(|setting| setting.name == name) {
            let settings = if self.yields(setting.name, source) { self } else { &mut unheard };
            return (setting.read)(settings, text).map_err(|expected| value(place, expected));
        }
        let Some(limit) = LIMITS.iter().find(|limit| limit.name == name) else {
            let known = SETTINGS.iter().map(|setting| setting.name).chain(LIMITS.iter().map(|limit| limit.name));
            return Err(SettingError::Unknown { place, known: known.collect::<Vec<_>>().join(", ") });
        };
        let settings = if self.yields(limit.name, source) { self } else { &mut unheard };
        (limit.read)(&mut settings.limits, text).map_err(|expected| value(place, expected))
    }

    /// Whether a value from `source` takes effect; then the source is stored.
    fn yields(&mut self, name: &'static str, source: SettingSource) -> bool {
        let strongest = self.sources.entry(name).or_insert(source);
        if source < *strongest {
            return false;
        }
        *strongest = source;
        true
    }

    /// Whether any source gives a value.
    pub(super) fn is_set(&self, name: &str) -> bool {
        self.sources.contains_key(name)
    }

    /// Takes what variables say, those whose names begin with [`ENVIRONMENT`]. Kubernetes sets variables with this
    /// prefix in containers of a service called `bimorph-serve`: those are skipped.
    ///
    /// # Errors
    /// [`SettingError`].
    pub fn read_environment(&mut self, variables: impl Iterator<Item = (String, String)>) -> Result<(), SettingError> {
        for (variable, text) in variables {
            let Some(name) = variable.strip_prefix(ENVIRONMENT).map(str::to_lowercase) else { continue };
            if !text.is_empty() && name != "config" && !is_of_a_service(&name, &text) {
                self.set(&name, &text, SettingSource::Environment, variable)?;
            }
        }
        Ok(())
    }

    /// Takes what a TOML file says: settings by name, limits in the table `limits`. Paths in it start from its folder.
    ///
    /// # Errors
    /// [`SettingError`].
    pub fn read_file(&mut self, path: &Path) -> Result<(), SettingError> {
        let wrong = |reason: String| SettingError::File { path: path.to_owned(), reason };
        let text = read(path).map_err(|error| wrong(error.to_string()))?;
        let table: toml::Table = text.parse().map_err(|error: toml::de::Error| wrong(error.to_string()))?;
        for (name, value) in &table {
            match value {
                toml::Value::Table(limits) if name == "limits" => {
                    for (name, value) in limits.iter().filter(|(name, _)| is_limit(name)) {
                        self.set_from_file(path, name, value)?;
                    }
                    if let Some((name, _)) = limits.iter().find(|(name, _)| !is_limit(name)) {
                        let known = LIMITS.iter().map(|limit| limit.name).collect::<Vec<_>>().join(", ");
                        return Err(SettingError::Unknown {
                            place: format!("{}: limits.{name}", path.display()),
                            known,
                        });
                    }
                }
                value if !is_limit(name) => self.set_from_file(path, name, value)?,
                _ => return Err(wrong(format!("{name} is a limit: it belongs under [limits]"))),
            }
        }
        Ok(())
    }

    fn set_from_file(&mut self, path: &Path, name: &str, value: &toml::Value) -> Result<(), SettingError> {
        let place = format!("{}: {name}", path.display());
        let word = |value: &toml::Value| match value {
            toml::Value::String(text) => Some(text.clone()),
            toml::Value::Integer(number) => Some(number.to_string()),
            toml::Value::Float(number) => Some(number.to_string()),
            toml::Value::Boolean(flag) => Some(flag.to_string()),
            _ => None,
        };
        let text = match value {
            toml::Value::Array(values) => {
                values.iter().map(word).collect::<Option<Vec<_>>>().map(|words| words.join(","))
            }
            other => word(other),
        };
        let Some(text) = text else {
            let expected = "a text, a number, true, false, or a list of texts".to_owned();
            return Err(SettingError::Value { place, expected, got: value.type_str().to_owned() });
        };
        let is_path = SETTINGS.iter().any(|setting| setting.name == name && setting.place == PathOrNone::METAVAR);
        let text = match path.parent() {
            // nothing is no path, and not the folder of the file
            Some(folder) if is_path && !text.is_empty() => folder.join(text).display().to_string(),
            _ => text,
        };
        self.set(name, &text, SettingSource::File, place)
    }

    /// The value of a setting as it is written; empty: none.
    pub fn get(&self, setting: &ServerOption) -> String {
        (setting.write)(self)
    }

    /// Every setting as text, and its source. Paths are reported only as given or not.
    pub(super) fn reported(&self) -> Vec<proto::ServerSetting> {
        let settings = SETTINGS.iter().map(|setting| {
            let value = (setting.write)(self);
            let hidden = setting.place == PathOrNone::METAVAR && !value.is_empty();
            (setting.name, if hidden { "given".to_owned() } else { value })
        });
        let own = self.limits_of_clients();
        let limits = LIMITS.iter().map(|limit| (limit.name, own.get(limit)));
        let source = |name| match self.sources.get(name) {
            None => "default",
            Some(SettingSource::File) => "file",
            Some(SettingSource::Environment) => "environment",
            Some(SettingSource::Option) => "option",
        };
        let reported = settings.chain(limits).map(|(name, value)| proto::ServerSetting {
            name: name.to_owned(),
            value,
            source: source(name).to_owned(),
        });
        reported.collect()
    }
}

/// Whether Kubernetes sets the variable for the address of a service: `…_SERVICE_HOST`, `…_SERVICE_PORT` and those of
/// its ports, `…_PORT` and those of a container link.
fn is_of_a_service(name: &str, text: &str) -> bool {
    name == "service_host"
        || name == "service_port"
        || name.starts_with("service_port_")
        || name == "port" && text.contains("://")
        || name.strip_prefix("port_").is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
}

fn is_limit(name: &str) -> bool {
    LIMITS.iter().any(|limit| limit.name == name)
}
