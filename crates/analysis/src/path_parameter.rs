//! Parameter of a path by name: a port, a numeric parameter of the netlist, or `loads`, the factor on all dead loads.

use super::continuation::{ContinuationRequest, PathInput};
use bimorph_base::Setting;
use bimorph_model::compile::{CompileError, CompiledModel, draw};
use bimorph_model::options::analysis::PATH_POINTS;
use bimorph_solve::continuation::Branch;
use bimorph_structure::{FrontEnd, is_anchor_motion};
use thiserror::Error;

/// Name of the factor on all dead loads.
const LOADS: &str = "loads";

/// Options of a path along a named parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct PathOptions {
    /// Parameter of the path.
    pub along: String,
    /// Its first value [V, the parameter's unit, or 1]. The path starts at the equilibrium there.
    pub from: f64,
    /// Its last value.
    pub to: f64,
    /// Voltages held on the other ports, by name (V).
    pub voltages: Vec<(String, f64)>,
    /// Signals wanted along the path; none: x and y of the node that moves most.
    pub signals: Vec<String>,
    /// Treatment of a bifurcation at which the path loses its stability.
    pub branch: Branch,
    /// Most points.
    pub points: usize,
}

impl Default for PathOptions {
    /// All dead loads from 0 to their values.
    fn default() -> Self {
        Self {
            along: LOADS.to_owned(),
            from: 0.0,
            to: 1.0,
            voltages: Vec::new(),
            signals: Vec::new(),
            branch: Branch::default(),
            points: PATH_POINTS.count(),
        }
    }
}

impl PathOptions {
    /// The request with its input.
    pub fn request<'a>(&self, input: PathInput<'a>) -> ContinuationRequest<'a> {
        ContinuationRequest {
            input,
            from: self.from,
            to: self.to,
            voltages: self.voltages.clone(),
            signals: self.signals.clone(),
            branch: self.branch,
            points: self.points,
        }
    }
}

/// Kind of the parameter of a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PathParameter {
    /// Voltage of a port.
    Port,
    /// A numeric parameter of the netlist.
    Netlist,
    /// The factor on all dead loads.
    Loads,
}

/// No parameter of a path has that name.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("expected {}, got {}", Self::EXPECTED, self.got())]
pub struct UnknownPathParameter {
    /// The given name.
    pub name: String,
    /// Names of the ports and parameters of the netlist, and `loads`.
    pub known: Vec<String>,
}

impl UnknownPathParameter {
    /// Kinds of parameters.
    pub const EXPECTED: &'static str = "a port, a numeric parameter, or loads";

    /// The given name, and the known ones.
    pub fn got(&self) -> String {
        format!("\"{}\"; there is {}", self.name, self.known.join(", "))
    }
}

impl PathParameter {
    /// Kind of the parameter of that name. A port comes before a parameter of the netlist, and both before `loads`.
    ///
    /// # Errors
    /// [`UnknownPathParameter`].
    pub fn find(compiled: &CompiledModel, name: &str) -> Result<Self, UnknownPathParameter> {
        if compiled.structure.port(name).is_some() || compiled.parts.system.anchor_source(name).is_some() {
            return Ok(Self::Port);
        }
        if compiled.parameters.iter().any(|(p, v)| p == name && matches!(v, Setting::Number(_))) {
            return Ok(Self::Netlist);
        }
        if name == LOADS {
            return Ok(Self::Loads);
        }
        let ports = compiled.structure.ports.iter().map(|p| p.name.clone());
        let electrics = &compiled.parts.system.electrics;
        let ports = ports.chain(electrics.names.iter().skip(electrics.voltages()).cloned());
        let known = ports.chain(compiled.parameters.iter().map(|(p, _)| p.clone())).chain([LOADS.to_owned()]);
        Err(UnknownPathParameter { name: name.to_owned(), known: known.collect() })
    }
}

/// Models of a path.
#[derive(Debug, Clone)]
pub enum PathModels {
    /// The voltage of a port or the motion of an anchor varies, with this unit.
    Port(&'static str),
    /// The factor on all dead loads varies.
    Loads,
    /// The netlist with the first and with the last value of one of its parameters.
    Netlist(Box<[CompiledModel; 2]>),
}

impl PathModels {
    /// The models of a path. A path along a parameter of the netlist compiles what `source` gives with its first and with its last value.
    ///
    /// # Errors
    /// Those of `source`; see [`CompileError`].
    pub fn new<S: FrontEnd, E: From<CompileError>>(
        parameter: PathParameter,
        compiled: &CompiledModel,
        options: &PathOptions,
        source: impl FnOnce() -> Result<S, E>,
    ) -> Result<Self, E> {
        match parameter {
            PathParameter::Port => {
                return Ok(Self::Port(match options.along.rsplit_once('.') {
                    Some((_, "urz")) => "rad",
                    Some(_) if is_anchor_motion(&options.along) => "m",
                    _ => "V",
                }));
            }
            PathParameter::Loads => return Ok(Self::Loads),
            PathParameter::Netlist => {}
        }
        let source = source()?;
        let at = |value: f64| draw(&source, &compiled.options.with_parameter(&options.along, value))?.compile();
        Ok(Self::Netlist(Box::new([at(options.from)?, at(options.to)?])))
    }

    /// The model at the start of the path, and the input along it.
    pub fn input<'a>(&'a self, compiled: &'a CompiledModel, along: &'a str) -> (&'a CompiledModel, PathInput<'a>) {
        match self {
            Self::Port(_) => (compiled, PathInput::Port(along)),
            Self::Loads => (compiled, PathInput::Loads),
            Self::Netlist(ends) => (&ends[0], PathInput::Parameter(&ends[1])),
        }
    }

    /// Unit of the parameter, where its effects determine it; otherwise empty.
    pub fn unit(&self) -> &'static str {
        let [first, last] = match self {
            Self::Port(unit) => return unit,
            Self::Loads => return "",
            Self::Netlist(ends) => &**ends,
        };
        let (a, b) = (&first.structure, &last.structure);
        let loads = || a.loads.iter().zip(&b.loads);
        let beams = || a.beams.iter().zip(&b.beams);
        let changes = [
            ("N", loads().any(|(x, y)| x.force != y.force)),
            ("N·m", loads().any(|(x, y)| x.moment != y.moment)),
            ("K", beams().any(|(x, y)| x.temperature != y.temperature)),
            ("Pa", beams().any(|(x, y)| x.material.stress != y.material.stress)),
        ];
        let mut found = changes.iter().filter(|(_, changes)| *changes);
        match (found.next(), found.next()) {
            (Some((unit, _)), None) => unit,
            _ => "",
        }
    }
}
