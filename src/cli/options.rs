//! The options of a model as arguments: each line of the table is one.

use super::failure::Failure;
use super::value;
use bimorph::options::{CompileOptions, MODEL, OptionDescription, OptionValue, Range};
use clap::{Arg, ArgAction, ArgMatches, Args, Command, Error, FromArgMatches};
use std::sync::LazyLock;

/// Options that research and comparisons need: under a heading of their own, and only in the long help.
const RESEARCH: [&str; 6] = ["scheme", "formulation", "imperfection", "other_branch", "as_sugar", "without_circuit"];

/// The options that were given, as they were written.
#[derive(Debug, Clone, Default)]
pub(crate) struct Chosen(Vec<(usize, OptionValue)>);

impl Chosen {
    /// The options of a compilation, each within its range.
    pub(crate) fn options(&self) -> Result<CompileOptions, Failure> {
        let mut options = CompileOptions::default();
        for (k, value) in &self.0 {
            options.choose(&MODEL[*k], value.clone())?;
        }
        Ok(options)
    }

    /// The options that were given, and each as a word of a deck's `.model` line.
    pub(crate) fn written(&self) -> impl Iterator<Item = (&'static str, String)> {
        self.0.iter().map(|(k, value)| {
            let name = MODEL[*k].about.name;
            let value = match value {
                OptionValue::Flag(flag) => flag.to_string(),
                OptionValue::Count(count) => count.to_string(),
                OptionValue::Number(x) => format!("{x:e}"),
                OptionValue::Name(name) => format!("\"{name}\""),
                OptionValue::Unset => "0".to_owned(),
            };
            (FLAGS[*k].as_str(), format!("{name}={value}"))
        })
    }

    /// Whether an option was given.
    pub(crate) fn given(&self, name: &str) -> bool {
        self.0.iter().any(|(k, _)| MODEL[*k].about.name == name)
    }
}

/// The arguments' names, static for the program.
static FLAGS: LazyLock<Vec<String>> = LazyLock::new(|| MODEL.iter().map(|option| option.about.flag()).collect());

/// Help of an option, with other options named as on the command line.
fn help(about: &OptionDescription) -> String {
    let mut text = about.about();
    if let Range::Names(names) = about.range
        && names.iter().any(|name| !text.contains(name))
    {
        text += &format!(": {}", about.range);
    }
    if !matches!(about.unit, "" | "1") {
        text += &format!(" [{}]", about.unit);
    }
    if about.range != Range::Flag {
        text += &format!(" [default: {}]", about.by_default());
    }
    text
}

fn arg(about: &OptionDescription, flag: &'static str) -> Arg {
    let arg = Arg::new(about.name).long(flag).help(help(about));
    let arg = if RESEARCH.contains(&about.name) {
        arg.help_heading("Research and comparison").hide_short_help(true)
    } else {
        arg.help_heading("Model")
    };
    match about.range {
        Range::Flag => arg.action(ArgAction::SetTrue),
        Range::Count(..) => arg.value_name("N").value_parser(clap::value_parser!(usize)),
        Range::Above(..) | Range::Within(..) => {
            let arg = arg.value_name(if about.unit == "Hz" { "HZ" } else { "NUMBER" });
            arg.value_parser(value::number).allow_negative_numbers(true)
        }
        Range::Names(_) => arg.value_name("NAME"),
        Range::Ranges => arg.value_name("NAME:LOW:HIGH,…"),
    }
}

fn found(matches: &ArgMatches, about: &OptionDescription) -> Option<OptionValue> {
    match about.range {
        Range::Flag => matches.get_flag(about.name).then_some(OptionValue::Flag(true)),
        Range::Count(..) => matches.get_one(about.name).copied().map(OptionValue::Count),
        Range::Above(..) | Range::Within(..) => matches.get_one(about.name).copied().map(OptionValue::Number),
        Range::Names(_) | Range::Ranges => matches.get_one(about.name).cloned().map(OptionValue::Name),
    }
}

impl FromArgMatches for Chosen {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let mut chosen = Self::default();
        chosen.update_from_arg_matches(matches)?;
        Ok(chosen)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        let given = MODEL.iter().enumerate().filter_map(|(k, option)| Some((k, found(matches, &option.about)?)));
        self.0.extend(given);
        Ok(())
    }
}

impl Args for Chosen {
    fn augment_args(command: Command) -> Command {
        command.args(MODEL.iter().zip(FLAGS.iter()).map(|(option, flag)| arg(&option.about, flag)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}
