//! Settings of a server: options before the environment before a file; `Info` reports them, and docs/reference/server.md has
//! every setting.

use crate::command::Bench;
use crate::serve_process::Server;
use bimorph::service::limits::{LIMITS, Limits};
use bimorph::service::proto;
use bimorph::service::settings::{SETTINGS, Settings, variable};
use proto::bimorph_client::BimorphClient;
use std::collections::BTreeMap;
use tonic::transport::Endpoint;

const FILE: &str = "listen = [\"127.0.0.1:0\"]\ntoken_file = \"keys/tokens\"\n\n[limits]\nsessions = 3\nmodels = 4\nmemory = \"64M\"\nidle = 1.5\n";

/// The settings of a server from `Info`: value and source by name.
fn reported(address: &str) -> BTreeMap<String, (String, String)> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    let info = runtime.block_on(async {
        let endpoint = Endpoint::from_shared(address.to_owned()).expect("a uri");
        let mut client = BimorphClient::new(endpoint.connect().await.expect("connects"));
        client.info(proto::InfoRequest {}).await.expect("an answer").into_inner()
    });
    info.settings.into_iter().map(|setting| (setting.name, (setting.value, setting.source))).collect()
}

/// A source applies where those of higher precedence are silent. Paths of a file start from its folder. `Info` shows
/// every setting of the table with its source.
#[test]
fn options_before_the_environment_before_a_file() {
    let bench = Bench::new(&[]);
    let folder = bench.path("etc/keys");
    std::fs::create_dir_all(&folder).expect("made");
    std::fs::write(folder.join("tokens"), "0123456789abcdef\n").expect("written");
    std::fs::write(bench.path("etc/serve.toml"), FILE).expect("written");
    let socket = format!("unix://{}", bench.path("s").display());
    let mut command = bench.command(&format!("serve --listen {socket} --limit models=6"));
    command.env("BIMORPH_SERVE_CONFIG", "etc/serve.toml").env("BIMORPH_SERVE_MODELS", "5");
    command.env("BIMORPH_SERVE_SESSIONS", "7").env("BIMORPH_SERVE_LISTEN", "127.0.0.1:1").env("BIMORPH_SERVE_IDLE", "");
    let server = Server::spawn(command);
    let reported = reported(&server.address);
    let names: Vec<&str> = SETTINGS.iter().map(|s| s.name).chain(LIMITS.iter().map(|l| l.name)).collect();
    assert_eq!(reported.len(), names.len());
    for (name, value, source) in [
        ("listen", socket.as_str(), "option"),
        ("models", "6", "option"),
        ("sessions", "7", "environment"),
        ("memory", "64M", "file"),
        ("idle", "1.5", "file"),
        ("token_file", "given", "file"),
        ("tls_cert", "", "default"),
        ("message_bytes", "64M", "default"),
    ] {
        assert_eq!(reported[name], (value.to_owned(), source.to_owned()), "{name}");
    }
}

/// Every default can also be given explicitly, for example by a server that runs no programs. Variables that Kubernetes
/// sets in containers of a service called `bimorph-serve` are no settings, but `BIMORPH_SERVE_PORT=1` is an error.
#[test]
fn defaults_and_variables_of_kubernetes_are_taken() {
    let bench = Bench::new(&[]);
    let command = || bench.command("serve --listen 127.0.0.1:0 --limit program_bytes=0");
    let mut inside = command();
    for (name, text) in [
        ("SERVICE_HOST", "10.0.0.11"),
        ("SERVICE_PORT", "50051"),
        ("SERVICE_PORT_GRPC", "50051"),
        ("PORT", "tcp://10.0.0.11:50051"),
        ("PORT_50051_TCP_ADDR", "10.0.0.11"),
    ] {
        inside.env(format!("BIMORPH_SERVE_{name}"), text);
    }
    let server = Server::spawn(inside);
    assert_eq!(reported(&format!("http://{}", server.address))["program_bytes"], ("0".to_owned(), "option".to_owned()));
    let ran = command().env("BIMORPH_SERVE_PORT", "1").output().expect("it runs");
    let stderr = String::from_utf8_lossy(&ran.stderr);
    assert!(stderr.contains("BIMORPH_SERVE_PORT: there is no such setting"), "{stderr}");
}

/// The example's settings are settings.
#[test]
fn the_example_is_read() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/serve/serve.toml");
    let mut settings = Settings::default();
    settings.read_file(std::path::Path::new(path)).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(settings.limits.sessions, 1000);
    assert!(settings.tls_cert.is_some_and(|path| path.ends_with("examples/serve/server.pem")));
}

/// Invalid settings are rejected with their place and the expected value, before the server listens.
#[test]
fn mistakes_are_named_by_place() {
    let bench = Bench::new(&[
        ("unknown.toml", "listens = \"127.0.0.1:0\"\n"),
        ("limit.toml", "[limits]\nsession = 3\n"),
        ("misplaced.toml", "sessions = 3\n"),
        ("value.toml", "[limits]\nmemory = \"much\"\n"),
        ("kind.toml", "listen = { a = 1 }\n"),
        ("empty.toml", "state_dir = \"\"\n"),
        ("weaker.toml", "[limits]\nsessions = \"many\"\n"),
        ("broken.toml", "listen = [\n"),
    ]);
    for (options, variable, said) in [
        (
            "--config unknown.toml",
            None,
            "unknown.toml: listens: there is no such setting; expected one of listen, tls_cert",
        ),
        ("--config limit.toml", None, "limit.toml: limits.session: there is no such setting"),
        ("--config misplaced.toml", None, "belongs under [limits]"),
        (
            "--config value.toml",
            None,
            "value.toml: memory: expected bytes above 0, as 1000000, 64M or 2G, got \"much\"",
        ),
        ("--config kind.toml", None, "kind.toml: listen: expected a text"),
        ("--config empty.toml", None, "empty.toml: state_dir: expected a path, got \"\""),
        ("--config weaker.toml --max-sessions 3", None, "weaker.toml: sessions: expected a whole number above 0"),
        ("--max-connections 2305843009213693952", None, "expected a whole number above 0, at most 1e15"),
        ("--config broken.toml", None, "configuration broken.toml: "),
        ("--config nosuch.toml", None, "configuration nosuch.toml: "),
        ("", Some(("BIMORPH_SERVE_SESION", "3")), "BIMORPH_SERVE_SESION: there is no such setting"),
        ("", Some(("BIMORPH_SERVE_INSECURE", "yes")), "BIMORPH_SERVE_INSECURE: expected true or false, got \"yes\""),
        (
            "--limit sessions=none",
            None,
            "--limit sessions: expected a whole number above 0, at most 1e15, got \"none\"",
        ),
        ("--max-sessions 0", None, "--max-sessions: expected a whole number above 0"),
        ("--listen nowhere", None, "--listen: expected unix:///path, host:port"),
    ] {
        let mut command = bench.command(&format!("serve {options}"));
        command.envs(variable);
        let ran = command.output().expect("it runs");
        let stderr = String::from_utf8_lossy(&ran.stderr);
        assert_eq!(ran.status.code(), Some(1), "{options}: {stderr}");
        assert!(stderr.contains(said), "{options}: expected \"{said}\", got \"{stderr}\"");
    }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn settings_rows() -> String {
    let defaults = Settings::default();
    let mut text = String::from("| in files | option | environment | default | meaning |\n|---|---|---|---|---|\n");
    for setting in SETTINGS.iter() {
        let (name, place) = (setting.name, setting.place);
        let option = format!("--{} {place}", setting.flag());
        let default = defaults.get(setting);
        let default = if default.is_empty() { "–".to_owned() } else { format!("`{default}`") };
        let row = format!("| `{name}` | `{}` | `{}` | {default} |", option.trim_end(), variable(name));
        text += &format!("{row} {} |\n", one_line(setting.help));
    }
    text
}

fn limits_rows() -> String {
    let defaults = Limits::default();
    let mut text = String::from("| limit | default | written as | meaning |\n|---|---|---|---|\n");
    for limit in LIMITS.iter() {
        // what depends on the machine is said in words
        let default = if limit.name == "analyses" { "cores".to_owned() } else { defaults.get(limit) };
        text += &format!("| `{}` | {default} | {} | {} |\n", limit.name, limit.place, one_line(limit.help));
    }
    text
}

/// The tables of docs/reference/server.md are written from those of the program: `BIMORPH_WRITE=1 cargo test --test cli documented` does so.
#[test]
fn documented() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/reference/server.md");
    let mut text = std::fs::read_to_string(path).expect("the page");
    for (first, last, want) in [
        ("<!-- settings -->\n", "<!-- end of settings -->", settings_rows()),
        ("<!-- limits -->\n", "<!-- end of limits -->", limits_rows()),
    ] {
        let start = text.find(first).unwrap_or_else(|| panic!("no {first}")) + first.len();
        let end = start + text[start..].find(last).unwrap_or_else(|| panic!("no {last}"));
        if std::env::var_os("BIMORPH_WRITE").is_some() {
            text.replace_range(start..end, &want);
        } else {
            assert_eq!(&text[start..end], want, "run BIMORPH_WRITE=1 cargo test --test cli documented");
        }
    }
    if std::env::var_os("BIMORPH_WRITE").is_some() {
        std::fs::write(path, text).expect("written");
    }
}
