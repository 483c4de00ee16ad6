//! The model of rigid parts that slide: coordinates, springs and dampers, gaps, and what is read.

use super::super::linear::{ReducedPort, SignalShown};
pub use bimorph_domains::Law;
use bimorph_domains::squeeze_film::SqueezeFilm;
use bimorph_structure::OhmicContact;
use nalgebra::{DMatrix, DVector, Vector2};

/// Way of one part along one direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinate {
    /// Name of the part.
    pub name: String,
    /// Its body.
    pub(super) body: usize,
    /// Direction as drawn.
    pub direction: Vector2<f64>,
    /// Mass (kg).
    pub mass: f64,
    /// Scale of its rate (rad/s): that many micrometres per second are 1 V.
    pub omega: f64,
}

/// A gap with what it depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct LumpedGap {
    /// Its name.
    pub name: String,
    /// n: approach per coordinate (1).
    pub along: DVector<f64>,
    /// Force law of the gap.
    pub law: Law,
    /// χ of its contact (s/m); 0: elastic, or none.
    pub loss: f64,
    /// Distance as drawn (m) and damping of the gas in it.
    pub film: Option<(f64, SqueezeFilm)>,
    /// Voltage per voltage of each port (1).
    pub by_port: DVector<f64>,
    /// Voltage by the netlist's own sources (V).
    pub constant: f64,
}

/// Output of a port or signal.
#[derive(Debug, Clone, PartialEq)]
pub enum LumpedOutput {
    /// Current of an electrical port: conductance to each port (S), and what the netlist's own sources drive (A).
    Current(DVector<f64>, f64),
    /// A displacement, per coordinate.
    Place(DVector<f64>),
    /// A rate, per coordinate.
    Rate(DVector<f64>),
    /// Charge of a gap.
    Charge(usize),
    /// Capacitance of a gap.
    Capacitance(usize),
    /// Force of a gap's voltage.
    Pull(usize),
    /// Distance left in a gap: at rest (m), and its sign with the approach.
    Distance(usize, f64, f64),
    /// Way that is left before a stop.
    Way(usize),
    /// Contact force of a gap or stop.
    Bearing(usize),
    /// Conductance of a contact of these metals.
    Conductance(usize, OhmicContact),
    /// A constant.
    Constant(f64),
    /// Nothing.
    Nothing,
}

/// The model.
#[derive(Debug, Clone, PartialEq)]
pub struct LumpedModel {
    /// Ports; they have no operating point.
    pub ports: Vec<ReducedPort>,
    /// Signals.
    pub signals: Vec<SignalShown>,
    /// Coordinates.
    pub coordinates: Vec<Coordinate>,
    /// C (N·s/m).
    pub damping: DMatrix<f64>,
    /// K (N/m).
    pub stiffness: DMatrix<f64>,
    /// f₀: dead loads and built-in strain (N).
    pub load: DVector<f64>,
    /// Force per unit of what is given to each port, coordinates × ports (N per N, kg).
    pub push: DMatrix<f64>,
    /// Gaps.
    pub gaps: Vec<LumpedGap>,
    /// The output of each port, then of each signal, in SI.
    pub rows: Vec<LumpedOutput>,
    /// Volts or amperes of the circuit per unit of each row.
    pub scales: Vec<f64>,
    /// Temperature of what surrounds it (K).
    pub temperature: f64,
    /// Unit of what is given per volt or ampere of the circuit, of each port.
    pub given: Vec<f64>,
}
