//! Domains: the effects of heat, voltage, contact and loads on a mechanism.
//!
//! Two kinds (Popa et al., "Computationally efficient dynamic modeling of MEMS", Q4): a *rest offset* of a joint (thermal
//! expansion ∝ V², residual stress) and a *force law* between two bodies (comb, plates, contact). Force laws come from a
//! potential, so that forces, stiffness, charges and the small-signal response of one element always agree:
//! ```text
//! Π(q, V) = U(q) − ½ Σ C_k(q) V_k² + Σ contact(q),     r = ∂Π/∂q,     Q_k = C_k V_k
//! ```
//!
//! | file | what it holds |
//! |---|---|
//! | [`approach`] | the scalar a gap measures between two material points, and its derivatives |
//! | [`attraction`], [`friction`] | adhesion and friction of stops |
//! | [`backbending`] | the strength of a hot arm, beyond which it is shortened for good |
//! | [`beam_line`] | the centreline of a beam: how it bends in a motion, and how far its segments are turned |
//! | [`capacitor`] | C(u) of a comb and of parallel plates |
//! | [`comb_field`], [`comb_sides`] | engagement, tips and fringe field of combs; the same over how far fingers lie aside, with a substrate |
//! | [`jet`] | a value with its derivatives over two variables |
//! | [`contact`] | pressure between surfaces that touch |
//! | [`contact_resistance`] | the conductance of metals that are pressed on each other |
//! | [`contact_loss`] | impact losses |
//! | [`contact_speed`] | at which speed, from statics |
//! | [`contact_ways`] | whether parts may touch within a step |
//! | [`loss_derivatives`], [`loss_tangent`] | derivatives of the forces of that over the bodies |
//! | [`domain`] | the trait of all that acts; [`member`]: which there are, and how each call finds its own |
//! | [`dashpot`] | a damper to the ground |
//! | [`from_structure`] | from a drawing to them |
//! | [`comb_drive`], [`electrodes`], [`facing_beams`], [`stop_pair`] | combs; plates; beams that face each other; stops |
//! | [`point_law`] | laws of single scalars, of which gaps are sums |
//! | [`polynomial_spring`] | quadratic and cubic terms of lumped springs |
//! | [`load`], [`moving_frame`] | dead loads, and forces that sources give; the motion of the frame |
//! | [`comb_film`] | gas between the fingers of a comb |
//! | [`squeeze_film`] | damping of gas that flows out of a gap; [`perforation`]: holes; [`film_series`]: states of one that compresses; [`plate_film`], [`facing_film`]: between plates, between beams |
//! | [`facing`] | a stretch of two facing beams: pressure along a gap that varies over their length |
//! | `facing_side`, `facing_stretches`, `facing_tiles` | where facing beams measure; how the segments of both sides cut a gap; stretches in lanes |
//! | `facing_field`, `facing_lanes`, `facing_tangent` | forces and tangent along facing beams, a stretch in each lane |
//! | [`quadrature`] | rules of integration along it |
//! | [`network`] | potentials of a resistive network driven by ports and sources |
//! | `laplacian` | potentials in a network of conductors |
//! | [`thermal`] | mean temperature rise of beams that carry current |
//! | `fin` | a conductor of heat that also leaves to its sides |
//! | [`hot`] | beams whose resistance depends on their temperature |
//! | [`lag`] | how a rise lags behind its steady value |
//! | [`drive`] | ports → gap voltages and free strains, at a time within a step |
//! | [`driven_anchor`], [`anchor_force`] | anchors whose displacement and rotation are inputs; their force |
//! | [`inputs`] | effects of forces at points, heat into beams and frame motion; `input`: their kinds |
//! | [`edge_field`] | laws of the fringe field beside a gap |
//! | [`floating`], `gap_voltage` | conductors that keep their charge; voltages and charges of gaps with them |
//! | [`energy`] | the potential of it all, and the energy that an undamped motion keeps |
//! | `side` | the side to which a part buckles |
//! | [`stop`] | how a stop bears |
//! | [`sticking`], `stick_point` | friction of parts at rest, and its history |
//! | [`quotient`] | discrete gradients of members over a step |
//! | `reading` | quantities of gaps: capacitance, distance, pull, contact |
//! | [`system`] | a multibody model with its gaps, loads and network: the input of `solve` |
//!
//! **Architecture invariant.** Below are [`bimorph_multibody`] and [`bimorph_structure`]. A domain never solves: it gives
//! forces, tangents, charges and energies at a state.

pub mod anchor_force;
pub mod approach;
pub mod attraction;
pub mod backbending;
pub mod beam_line;
pub mod capacitor;
pub mod comb_drive;
pub mod comb_field;
pub mod comb_film;
pub mod comb_sides;
mod conduction;
pub mod contact;
pub mod contact_loss;
pub mod contact_resistance;
pub mod contact_speed;
pub mod contact_ways;
pub mod dashpot;
pub mod domain;
pub mod drive;
pub mod driven_anchor;
pub mod edge_field;
pub mod electrodes;
pub mod energy;
pub mod facing;
pub mod facing_beams;
mod facing_field;
pub mod facing_film;
mod facing_lanes;
pub mod facing_local;
mod facing_loss;
mod facing_side;
mod facing_stretches;
mod facing_tangent;
mod facing_tiles;
pub mod film_series;
mod fin;
pub mod floating;
pub mod friction;
pub mod from_structure;
mod gap_voltage;
mod heat_curves;
pub mod hot;
mod input;
pub mod inputs;
pub mod jet;
pub mod lag;
mod laplacian;
pub mod load;
pub mod loss_derivatives;
pub mod loss_tangent;
pub mod member;
pub mod moving_frame;
pub mod network;
pub mod perforation;
pub mod plate_film;
pub mod point_law;
pub mod polynomial_spring;
pub mod quadrature;
pub mod quotient;
mod reading;
mod side;
pub mod squeeze_film;
mod stick_point;
pub mod sticking;
pub mod stop;
pub mod stop_pair;
pub mod system;
pub mod thermal;

pub use approach::MaterialPoint;
pub use beam_line::BeamLine;
pub use domain::{Configuration, Domain};
pub use drive::{Drive, InputWaveform, Ramp, Shock};
pub use from_structure::{PlacedMember, Station, StructureView};
pub use input::Input;
pub use lag::Lags;
pub use load::DeadLoad;
pub use member::Member;
pub use point_law::{Law, PointLaw};
pub use system::System;
