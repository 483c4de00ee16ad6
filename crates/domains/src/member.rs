//! The register of domains: a mechanism's members of them stand in one list, and each call goes to the member's own law.

use super::approach::{Approach, MaterialPoint};
use super::contact_loss::Loss;
use super::domain::{Chord, Configuration, Domain, SideContact, SideRoom, SkewCoupling};
use super::from_structure::{FromStructure, PlacedMember, StructureView};
use super::loss_tangent::LossTangent;
use super::point_law::{Law, PointLaw};
use super::squeeze_film::SqueezeFilm;
use super::stick_point::StickPoint;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix, Damper, Pattern};
use nalgebra::Vector2;

/// Makes [`Member`] of the types listed, in the order in which a drawing's members stand.
macro_rules! domains {
    ($($kind:ident: $law:path, $what:literal;)+) => {
        /// One of the registered domains; what drives it is a voltage (V).
        #[derive(Debug, Clone, PartialEq)]
        pub enum Member {
            $(#[doc = $what] $kind($law),)+
        }

        $(impl From<$law> for Member {
            fn from(law: $law) -> Self {
                Self::$kind(law)
            }
        })+

        /// The same call of whatever member it is.
        macro_rules! each {
            ($member:expr, $name:ident => $call:expr) => {
                match $member { $(Member::$kind($name) => $call,)+ }
            };
        }

        impl Member {
            /// The members of a drawing, domain by domain: those that are gaps first.
            #[inline]
            pub fn lay<'a>(drawing: &StructureView<'a, '_>) -> Vec<PlacedMember<'a, Self>> {
                let mut all: Vec<PlacedMember<'a, Self>> = Vec::new();
                $(<$law>::lay(drawing, |name, voltage, law| all.push(PlacedMember { name, voltage, member: law.into() }));)+
                all.sort_by_key(|laid| !laid.member.is_gap());
                all
            }

            /// Calls `put` for its dampers, before [`Member::moved`].
            #[inline]
            pub fn dampers(&self, put: impl FnMut(Damper)) {
                match self { $(Self::$kind(law) => law.dampers(put),)+ }
            }

            /// The same with its points where `to` takes them.
            #[must_use]
            #[inline]
            pub fn moved(self, to: &dyn Fn(MaterialPoint) -> MaterialPoint) -> Self {
                match self { $(Self::$kind(law) => law.moved(to).into(),)+ }
            }
        }
    };
}

domains! {
    CombDrive: super::comb_drive::CombDrive, "A comb.";
    Electrodes: super::electrodes::Electrodes, "Lumped plates.";
    FacingBeams: super::facing_beams::FacingBeams, "Two beams that face each other.";
    StopPair: super::stop_pair::StopPair, "A stop.";
    Dashpot: super::dashpot::Dashpot, "A damper to the ground.";
    PlateFilm: super::plate_film::PlateFilm, "Gas between lumped plates.";
    CombFilm: super::comb_film::CombFilm, "Gas between the fingers of a comb.";
    FacingFilm: super::facing_film::FacingFilm, "Gas between two beams that face each other.";
    PolynomialSpring: super::polynomial_spring::PolynomialSpring, "Quadratic and cubic terms of a spring.";
}

impl Domain for Member {
    type Given = f64;

    fn is_gap(&self) -> bool {
        each!(self, m => m.is_gap())
    }

    fn bodies(&self, see: impl FnMut(BodyId)) {
        each!(self, m => m.bodies(see));
    }

    fn pairs(&self, see: impl FnMut(BodyId, BodyId)) {
        each!(self, m => m.pairs(see));
    }

    #[inline]
    fn add_force(&self, at: Configuration<'_>, given: f64, r: &mut [Pose]) {
        each!(self, m => m.add_force(at, given, r));
    }

    #[inline]
    fn add_force_change(&self, at: Configuration<'_>, given: f64, change: f64, r: &mut [Pose]) {
        each!(self, m => m.add_force_change(at, given, change, r));
    }

    #[inline]
    fn add_tangent(&self, at: Configuration<'_>, given: f64, pattern: &Pattern, tangent: &mut BodyMatrix) {
        each!(self, m => m.add_tangent(at, given, pattern, tangent));
    }

    #[inline]
    fn add_force_and_tangent(
        &self,
        at: Configuration<'_>,
        given: f64,
        pattern: &Pattern,
        sums: (&mut [Pose], &mut BodyMatrix),
    ) {
        each!(self, m => m.add_force_and_tangent(at, given, pattern, sums));
    }

    #[inline]
    fn add_force_finding_apart(&self, at: Configuration<'_>, given: f64, r: &mut [Pose]) -> bool {
        each!(self, m => m.add_force_finding_apart(at, given, r))
    }

    #[inline]
    fn add_force_and_tangent_finding_apart(
        &self,
        at: Configuration<'_>,
        given: f64,
        pattern: &Pattern,
        sums: (&mut [Pose], &mut BodyMatrix),
    ) -> bool {
        each!(self, m => m.add_force_and_tangent_finding_apart(at, given, pattern, sums))
    }

    #[inline]
    fn is_active(&self, given: f64) -> bool {
        each!(self, m => m.is_active(given))
    }

    fn is_active_as_drawn(&self, given: f64) -> bool {
        each!(self, m => m.is_active_as_drawn(given))
    }

    fn load_points(&self, at: Configuration<'_>, given: f64, lever: impl FnMut(MaterialPoint, Vector2<f64>)) {
        each!(self, m => m.load_points(at, given, lever));
    }

    fn energy(&self, at: Configuration<'_>, given: f64) -> f64 {
        each!(self, m => m.energy(at, given))
    }

    fn capacitance(&self, at: Configuration<'_>) -> f64 {
        each!(self, m => m.capacitance(at))
    }

    fn capacitance_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        each!(self, m => m.capacitance_change(at, dq))
    }

    fn pull(&self, at: Configuration<'_>) -> f64 {
        each!(self, m => m.pull(at))
    }

    fn pull_and_change(&self, at: Configuration<'_>, dq: &[Pose]) -> (f64, f64) {
        each!(self, m => m.pull_and_change(at, dq))
    }

    fn is_electrostatic(&self) -> bool {
        each!(self, m => m.is_electrostatic())
    }

    fn add_shape_force(&self, at: Configuration<'_>, given: f64, r: &mut [Pose]) -> f64 {
        each!(self, m => m.add_shape_force(at, given, r))
    }

    fn distance(&self, at: Configuration<'_>) -> f64 {
        each!(self, m => m.distance(at))
    }

    fn distance_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        each!(self, m => m.distance_change(at, dq))
    }

    fn touching(&self) -> Option<[f64; 2]> {
        each!(self, m => m.touching())
    }

    fn closing_bound(&self, q: &[Pose]) -> f64 {
        each!(self, m => m.closing_bound(q))
    }

    fn surely_apart(&self, at: Configuration<'_>) -> bool {
        each!(self, m => m.surely_apart(at))
    }

    fn clearance(&self, at: Configuration<'_>) -> f64 {
        each!(self, m => m.clearance(at))
    }

    fn side_room(&self) -> Option<(&Approach, SideRoom)> {
        each!(self, m => m.side_room())
    }

    fn side_contact(&self, at: Configuration<'_>) -> Option<SideContact> {
        each!(self, m => m.side_contact(at))
    }

    fn side_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        each!(self, m => m.side_change(at, dq))
    }

    fn bearing(&self, at: Configuration<'_>) -> f64 {
        each!(self, m => m.bearing(at))
    }

    fn bearing_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        each!(self, m => m.bearing_change(at, dq))
    }

    fn contact_energy(&self, at: Configuration<'_>) -> f64 {
        each!(self, m => m.contact_energy(at))
    }

    fn contact_work(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        each!(self, m => m.contact_work(at, dq))
    }

    fn loss(&self) -> Option<Loss> {
        each!(self, m => m.loss())
    }

    fn slides(&self) -> bool {
        each!(self, m => m.slides())
    }

    fn sticks(&self) -> bool {
        each!(self, m => m.sticks())
    }

    fn stick_point(&self, at: Configuration<'_>) -> Option<StickPoint> {
        each!(self, m => m.stick_point(at))
    }

    fn is_gas(&self) -> bool {
        each!(self, m => m.is_gas())
    }

    fn film_pressure(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose) -> f64 {
        each!(self, m => m.film_pressure(at, rate))
    }

    fn gas_damping(&self, at: Configuration<'_>, dq: &[Pose], omega: f64) -> f64 {
        each!(self, m => m.gas_damping(at, dq, omega))
    }

    fn film(&self) -> Option<(&Approach, f64, SqueezeFilm)> {
        each!(self, m => m.film())
    }

    #[inline]
    fn damps(&self) -> bool {
        each!(self, m => m.damps())
    }

    fn set_loss(&mut self, loss: Loss) {
        each!(self, m => m.set_loss(loss));
    }

    fn add_closing(&self, at: Configuration<'_>, r: &mut [Pose]) -> f64 {
        each!(self, m => m.add_closing(at, r))
    }

    #[inline]
    fn add_loss(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, r: &mut [Pose]) {
        each!(self, m => m.add_loss(at, rate, r));
    }

    #[inline]
    fn add_loss_tangent(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, to: &mut LossTangent<'_>) -> bool {
        each!(self, m => m.add_loss_tangent(at, rate, to))
    }

    #[inline]
    fn skew_couplings(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, see: impl FnMut(SkewCoupling)) {
        each!(self, m => m.skew_couplings(at, rate, see));
    }

    fn add_quotient(&self, chord: &Chord<'_>, given: f64, pattern: &Pattern, r: &mut [Pose], tangent: &mut BodyMatrix) {
        each!(self, m => m.add_quotient(chord, given, pattern, r, tangent));
    }

    fn law(&self) -> Option<(&Approach, Law)> {
        each!(self, m => m.law())
    }

    fn laws(&self) -> Vec<(Approach, Law)> {
        each!(self, m => m.laws())
    }

    fn point_laws(&self) -> Vec<PointLaw> {
        each!(self, m => m.point_laws())
    }

    fn point_approaches(&self, at: Configuration<'_>, put: impl FnMut(f64)) {
        each!(self, m => m.point_approaches(at, put));
    }
}
