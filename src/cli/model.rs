//! Options that choose the model: the netlist, its parameters, and how fine the model is.

use super::failure::Failure;
use super::{interrupt, value};
use bimorph::compile::{CompileOptions, Compiled, Junctions, compile};
use bimorph::discretize::Scheme;
use bimorph::netlist::{Bundle, Setting};
use clap::Args;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use std::io::{self, IsTerminal};
use std::path::PathBuf;

/// Options of every command that reads a netlist.
#[derive(Debug, Args)]
pub(crate) struct ModelArgs {
    /// SUGAR netlist
    file: PathBuf,

    /// Set a netlist parameter: a number with suffix (2.1u) or text. Repeatable
    #[arg(long = "set", short = 's', value_name = "NAME=VALUE", value_parser = value::setting)]
    set: Vec<(String, Setting)>,

    /// Folder to search for files that the netlist uses. Repeatable
    #[arg(long, value_name = "DIR")]
    include: Vec<PathBuf>,

    /// Relative error aimed at; smaller means more unknowns and shorter steps [default: 1e-3]
    #[arg(long, value_parser = value::number, allow_negative_numbers = true)]
    tol: Option<f64>,

    /// Highest frequency the model must resolve [Hz]: as many segments as the estimated error of every mode below it needs
    /// to stay within --tol [default: by slenderness]
    #[arg(long, value_name = "HZ", value_parser = value::number, allow_negative_numbers = true)]
    band: Option<f64>,

    /// How beams meet. centreline: in points, as in SUGAR; offset: at the edges of rigid junctions; calibrated: with springs
    /// there, from two-dimensional elasticity [default: calibrated]
    #[arg(long, value_name = "KIND")]
    junctions: Option<String>,

    /// Small displacements about the drawn geometry, as SUGAR
    #[arg(long)]
    linear: bool,

    /// Leave out gas damping
    #[arg(long)]
    undamped: bool,

    /// How beams are cut into bodies and joints: a0, a2, c1, d1, b, e4 or es (docs/theory.md has their errors)
    #[arg(long, default_value = "e4", value_name = "NAME")]
    scheme: String,

    /// Segments of every beam [default: by --band and --tol]
    #[arg(long, value_name = "N")]
    segments: Option<usize>,

    /// Shear flexibility of beams (Timoshenko, shear coefficient 5/6); SUGAR leaves it out
    #[arg(long)]
    shear: bool,

    /// Rotary inertia of the sections of beams; SUGAR leaves it out
    #[arg(long)]
    rotary_inertia: bool,
}

/// Most segments of a beam that may be asked for.
const MOST_SEGMENTS: usize = 100_000;

impl ModelArgs {
    /// The netlist with everything it uses.
    pub(crate) fn bundle(&self) -> Result<Bundle, Failure> {
        interrupt::listen();
        Bundle::read(&self.file, &self.include).map_err(|source| Failure::Read { path: self.file.clone(), source })
    }

    /// The options of the compilation, checked.
    pub(crate) fn options(&self) -> Result<CompileOptions, Failure> {
        let defaults = CompileOptions::default();
        let tol = self.tol.unwrap_or(defaults.tol);
        if !(tol > 0.0 && tol < 1.0) {
            return Err(Failure::bad("--tol", "a relative error between 0 and 1", tol.to_string()));
        }
        if let Some(band) = self.band.filter(|band| *band <= 0.0) {
            return Err(Failure::bad("--band", "a frequency above 0 Hz", band.to_string()));
        }
        let junctions = self.junctions.as_deref().map_or(Ok(defaults.junctions), junctions)?;
        let scheme = Scheme::named(&self.scheme).ok_or_else(|| {
            Failure::bad("--scheme", format!("one of {}", Scheme::NAMES.join(", ")), format!("\"{}\"", self.scheme))
        })?;
        if let Some(n) = self.segments.filter(|n| !(1..=MOST_SEGMENTS).contains(n)) {
            return Err(Failure::bad("--segments", "1 to 100000", n.to_string()));
        }
        Ok(CompileOptions {
            set: self.set.clone(),
            band: self.band,
            tol,
            linear: self.linear,
            undamped: self.undamped,
            junctions,
            scheme,
            segments: self.segments,
            shear: self.shear,
            rotary_inertia: self.rotary_inertia,
        })
    }

    /// Compiles the netlist and shows its warnings on standard error.
    pub(crate) fn compile(&self) -> Result<Compiled, Failure> {
        self.compiled(&self.options()?)
    }

    /// The same for a frame of cubic beams, whose centrelines meet in points.
    pub(crate) fn compile_frame(&self) -> Result<Compiled, Failure> {
        let mut options = self.options()?;
        if self.junctions.is_some() && options.junctions != Junctions::Centreline {
            let got = format!("\"{}\" with --solver frame, which has no other", options.junctions.name());
            return Err(Failure::bad("--junctions", "centreline", got));
        }
        options.junctions = Junctions::Centreline;
        self.compiled(&options)
    }

    fn compiled(&self, options: &CompileOptions) -> Result<Compiled, Failure> {
        let compiled = compile(&self.bundle()?, options)?;
        warn(&compiled);
        Ok(compiled)
    }

    /// What the model was made from, for JSON.
    pub(crate) fn context<'a>(&'a self, compiled: &'a Compiled) -> Context<'a> {
        let options = &compiled.options;
        Context {
            file: self.file.display().to_string(),
            parameters: Map(&compiled.parameters),
            tol: options.tol,
            band_hz: options.band,
            junctions: options.junctions,
            linear: options.linear,
            undamped: options.undamped,
            scheme: options.scheme,
            shear: options.shear,
            rotary_inertia: options.rotary_inertia,
            estimated_error: compiled.order.estimated_error,
            warnings: compiled.warnings.items.iter().map(|d| d.message.as_str()).collect(),
        }
    }

    /// The netlist's file name, for titles.
    pub(crate) fn title(&self) -> String {
        self.file.file_name().map_or_else(|| self.file.display().to_string(), |n| n.to_string_lossy().into_owned())
    }
}

/// The kind of junctions of that name.
fn junctions(name: &str) -> Result<Junctions, Failure> {
    let name = if name == "centerline" { "centreline" } else { name };
    Junctions::named(name)
        .ok_or_else(|| Failure::bad("--junctions", "centreline, offset or calibrated", format!("\"{name}\"")))
}

/// Shows the warnings of a netlist on standard error.
pub(crate) fn warn(compiled: &Compiled) {
    if !compiled.warnings.items.is_empty() {
        eprint!("{}", compiled.warnings.render(io::stderr().is_terminal()));
    }
}

/// The part of every JSON document that says what the model was.
#[derive(Debug, Serialize)]
pub(crate) struct Context<'a> {
    /// Netlist as named on the command line.
    file: String,
    /// Netlist parameters with the values they took, SI.
    parameters: Map<'a, Setting>,
    /// Relative error aimed at.
    tol: f64,
    /// Highest frequency resolved [Hz]; null: by slenderness.
    band_hz: Option<f64>,
    /// How beams meet.
    junctions: Junctions,
    /// Small displacements.
    linear: bool,
    /// Without gas damping.
    undamped: bool,
    /// How beams are cut.
    scheme: Scheme,
    /// With shear flexibility.
    shear: bool,
    /// With rotary inertia of the sections.
    rotary_inertia: bool,
    /// Largest estimated relative error of a frequency within the band; null without one.
    estimated_error: Option<f64>,
    /// Warnings of the netlist.
    warnings: Vec<&'a str>,
}

/// Named values as a JSON object in their own order.
#[derive(Debug)]
pub(crate) struct Map<'a, T>(pub(crate) &'a [(String, T)]);

impl Serialize for Map<'_, Setting> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, value) in self.0 {
            match value {
                Setting::Number(x) => map.serialize_entry(name, x)?,
                Setting::Text(text) => map.serialize_entry(name, text)?,
            }
        }
        map.end()
    }
}

/// The same for values that JSON knows.
#[derive(Debug)]
pub(crate) struct Named<'a, T>(pub(crate) &'a [(String, T)]);

impl<T: Serialize> Serialize for Named<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}
