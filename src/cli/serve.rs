//! `bimorph serve`: the same models for other programs.

use super::failure::Failure;
use bimorph::service::address::Address;
use bimorph::service::log;
use bimorph::service::settings::{ENVIRONMENT, SETTINGS, ServerOption, SettingSource, Settings};
use bimorph::service::until_signal::run_until_signal;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, Error, FromArgMatches};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// Serve models over gRPC (bimorph.v1), until interrupted.
///
/// Prints one line "listening on ADDRESS" for each address on standard error once it accepts connections. Health and
/// reflection services are always on. An address that other machines can reach takes TLS, and tokens or certificates of
/// clients. Missing options are taken from the environment (BIMORPH_SERVE_NAME), then from the file of --config.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph serve --listen unix:///tmp/bimorph.sock\n  \
    bimorph serve --listen 127.0.0.1:50051 --listen unix:///tmp/second.sock\n  \
    bimorph serve --listen 127.0.0.1:0         # any free port; the line printed says which\n  \
    printf 'listen = [\"unix:///tmp/third.sock\"]\\n' > serve.toml\n  \
    bimorph serve --config serve.toml          # examples/serve/serve.toml has more settings")]
pub(crate) struct ServeCommand {
    #[command(flatten)]
    reported: SettingSources,

    /// Stop when standard input ends, as it does when the program that started this server ends
    #[arg(long)]
    while_stdin: bool,
}

impl ServeCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        let options = self.reported.settings()?.options();
        let calls = options.listen.len();
        let ready = move |addresses: &[Address]| {
            for (k, address) in addresses.iter().enumerate() {
                match k < calls {
                    true => log::line(&format!("listening on {address}")),
                    false => log::line(&format!("metrics on http://{address}/metrics")),
                }
            }
        };
        Ok(run_until_signal(options.with_process(self.while_stdin, Box::new(ready)))?)
    }
}

/// Settings of a server by source, in the order file, environment, options.
#[derive(Debug, Clone, Default)]
pub(crate) struct SettingSources {
    config: Option<PathBuf>,
    /// Name of the setting, its value, and the option that says so.
    given: Vec<(String, String, String)>,
}

/// The arguments' names, static for the program.
static FLAGS: LazyLock<Vec<String>> = LazyLock::new(|| SETTINGS.iter().map(ServerOption::flag).collect());

/// Options for limits that are often changed.
const SHORT: [(&str, &str, &str); 2] = [
    ("max-sessions", "sessions", "Most sessions open at once; as --limit sessions=N"),
    ("max-connections", "connections", "Most connections at once; as --limit connections=N"),
];

impl SettingSources {
    /// Settings from a file and the environment, without options.
    pub(crate) fn of(config: Option<PathBuf>) -> Self {
        Self { config, given: Vec::new() }
    }

    /// All settings, in order of precedence.
    pub(crate) fn settings(&self) -> Result<Settings, Failure> {
        let mut settings = Settings::default();
        for (name, text, place) in &self.given {
            settings.set(name, text, SettingSource::Option, place.clone())?;
        }
        settings.read_environment(
            std::env::vars_os()
                .filter_map(|(name, text)| Some((name.into_string().ok()?, text.to_string_lossy().into_owned()))),
        )?;
        if let Some(path) = self.config() {
            settings.read_file(&path)?;
        }
        Ok(settings)
    }

    /// The file, as the option or the environment names it.
    fn config(&self) -> Option<PathBuf> {
        let named = std::env::var_os(format!("{ENVIRONMENT}CONFIG")).filter(|path| !path.is_empty());
        self.config.clone().or_else(|| named.map(PathBuf::from))
    }

    fn take(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        self.config = matches.get_one::<String>("config").map(Path::new).map(Path::to_owned);
        for (setting, flag) in SETTINGS.iter().zip(FLAGS.iter()) {
            let place = format!("--{flag}");
            let text = if setting.place.is_empty() {
                matches.get_flag(flag).then(|| "true".to_owned())
            } else {
                matches.get_many::<String>(flag).map(|words| words.cloned().collect::<Vec<_>>().join(","))
            };
            self.given.extend(text.map(|text| (setting.name.to_owned(), text, place)));
        }
        for (flag, limit, _) in SHORT {
            let text = matches.get_one::<String>(flag).cloned();
            self.given.extend(text.map(|text| (limit.to_owned(), text, format!("--{flag}"))));
        }
        for text in matches.get_many::<String>("limit").into_iter().flatten() {
            let (name, value) = text.split_once('=').ok_or_else(|| {
                Error::raw(
                    clap::error::ErrorKind::ValueValidation,
                    format!("--limit: expected NAME=VALUE, as sessions=1000, got {text}\n"),
                )
            })?;
            self.given.push((name.to_owned(), value.to_owned(), format!("--limit {name}")));
        }
        Ok(())
    }
}

impl FromArgMatches for SettingSources {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let mut reported = Self::default();
        reported.take(matches)?;
        Ok(reported)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        self.take(matches)
    }
}

impl Args for SettingSources {
    fn augment_args(command: Command) -> Command {
        let value = |name: &'static str, place: &'static str| Arg::new(name).long(name).value_name(place);
        let settings = SETTINGS.iter().zip(FLAGS.iter()).map(|(setting, flag)| {
            let help = setting.help.split_whitespace().collect::<Vec<_>>().join(" ");
            let help = help.trim_end_matches('.').to_owned();
            let arg = Arg::new(flag.as_str()).long(flag.as_str());
            let value = Settings::default().get(setting);
            let shown = if value.is_empty() || value == "false" { help } else { format!("{help} [default: {value}]") };
            match setting.place {
                "" => arg.action(ArgAction::SetTrue).help(shown),
                "ADDRESS" => arg.value_name("ADDRESS").action(ArgAction::Append).help(shown),
                place => arg.value_name(place).help(shown),
            }
        });
        let short = SHORT.map(|(flag, _, help)| value(flag, "N").help(help));
        let limits = "Set a limit of docs/reference/server.md: bytes as 64M or 2G, times in seconds. Repeatable";
        command
            .arg(value("config", "FILE").help("File of settings, TOML; docs/reference/server.md has their names"))
            .args(settings)
            .args(short)
            .arg(value("limit", "NAME=VALUE").action(ArgAction::Append).help(limits))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}
