//! Storage of the motion that all trials of a point lie about, see [`crate::trial`].

use crate::Token;
use bimorph_solve::time::method::Motion;

/// The motion of one point.
#[derive(Debug, Clone)]
pub(crate) struct HeldMotion {
    /// The parent and the length (s) that it is of.
    pub(crate) of: Option<(Token, u64)>,
    /// It reached the end.
    pub(crate) found: bool,
    /// The internal step that would come next (s).
    pub(crate) next: f64,
    /// Where its internal steps end (s), if parts touch in it.
    pub(crate) ends: Vec<f64>,
    pub(crate) motion: Motion,
    /// State of the method at the end, with the sensitivities.
    pub(crate) carried: Vec<Motion>,
    /// Sensitivities of the bodies at the end, one for each port.
    pub(crate) sensitivities: Vec<Motion>,
    /// Rises at the end (K), and their change with the source of each port.
    pub(crate) rise: Vec<f64>,
    pub(crate) rise_slope: Vec<Vec<f64>>,
    /// Changes of the sources, port by port, and what they make.
    pub(crate) changes: Vec<f64>,
    pub(crate) change: Motion,
}

impl HeldMotion {
    /// Storage for some bodies, ports, and states of heat with their means.
    pub(crate) fn new(bodies: usize, ports: usize, (rises, means): (usize, usize)) -> Self {
        let zeros = || Motion::zeros(bodies);
        Self {
            of: None,
            found: false,
            next: 0.0,
            ends: Vec::new(),
            motion: zeros(),
            carried: Vec::new(),
            sensitivities: Vec::new(),
            rise: vec![0.0; rises],
            rise_slope: vec![vec![0.0; means]; ports],
            changes: vec![0.0; ports],
            change: zeros(),
        }
    }

    /// Another point begins.
    pub(crate) fn forget(&mut self) {
        (self.of, self.found) = (None, false);
        self.ends.clear();
    }
}
