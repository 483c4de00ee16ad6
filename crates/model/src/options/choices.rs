//! Options that take one of a few names: how beams are cut, how they meet, the field at their edges, and what becomes of bodies and joints.

use bimorph_structure::Fringe;
use serde::{Deserialize, Serialize};

/// An enum whose variants have names: the same in files, on the command line, on the wire, in decks and in Python.
macro_rules! choice {
    ($(#[$about:meta])* $kind:ident { $($(#[$one:meta])* $variant:ident = $name:literal,)+ }) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
        pub enum $kind {
            $($(#[$one])* #[serde(rename = $name)] $variant,)+
        }

        impl $kind {
            /// All of them.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$variant),+];
            /// Their names.
            pub const NAMES: [&str; [$($name),+].len()] = [$($name),+];

            /// The name that stands for it in options, files and outputs.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)+
                }
            }

            /// The one of that name.
            pub fn named(name: &str) -> Option<Self> {
                Self::ALL.into_iter().find(|one| one.name() == name)
            }
        }
    };
}

choice! {
    /// How a beam is cut; [`discretize::scheme`](crate::discretize::scheme) has the table.
    Scheme {
        /// The paper's first rule.
        A0 = "a0",
        /// Rotation at the middle of the segments.
        A2 = "a2",
        /// A2 with coupled joints at the ends.
        C1 = "c1",
        /// Rotation at Gauss points.
        D1 = "d1",
        /// Exact joints, natural rods.
        B = "b",
        /// Exact joints, masses of fourth order.
        E4 = "e4",
        /// Tuned pair of shear flexibility and rotary inertia.
        Es = "es",
        /// The scheme that suits the formulation: E4, or Es in joint coordinates, where every body needs rotary
        /// inertia.
        #[default]
        Auto = "auto",
    }
}

impl Scheme {
    /// The scheme that stands for this one in a formulation.
    pub fn in_formulation(self, formulation: Formulation) -> Self {
        match (self, formulation) {
            (Self::Auto, Formulation::Rcr | Formulation::RcrElastic) => Self::Es,
            (Self::Auto, _) => Self::E4,
            (given, _) => given,
        }
    }
}

choice! {
    /// How beams meet.
    Junctions {
        /// Centrelines meet in points, as in SUGAR.
        Centreline = "centreline",
        /// Beams end at the edge of the junction, which is rigid, and mass that is drawn twice counts once.
        Offset = "offset",
        /// The same with springs at the edge, calibrated on plane stress; beams also give way to shear, and next to junctions
        /// their sections have rotary inertia.
        #[default]
        Calibrated = "calibrated",
    }
}

choice! {
    /// How anchors hold beams.
    Anchors {
        /// Elastic where the layer of the anchor has an `undercut`, else rigid.
        #[default]
        Auto = "auto",
        /// A node at an anchor does not move.
        Rigid = "rigid",
        /// A beam ends in the compliance of its root: a pad of its layer on a base of like stiffness.
        Elastic = "elastic",
    }
}

choice! {
    /// Law of the fringe fields of all gaps.
    FringeFields {
        /// The law that each gap or its layer names, else the default of its element.
        #[default]
        Auto = "auto",
        /// No field outside the facing areas.
        None = "none",
        /// 1 + 0.65·g/h on the pressure.
        Parallel = "parallel",
        /// The exact plane field.
        Exact = "exact",
        /// SUGAR's factor of the drawn gap.
        Sugar = "sugar",
    }
}

impl FringeFields {
    /// The law that it prescribes.
    pub fn law(self) -> Option<Fringe> {
        match self {
            Self::Auto => None,
            Self::None => Some(Fringe::None),
            Self::Parallel => Some(Fringe::Parallel),
            Self::Exact => Some(Fringe::Exact),
            Self::Sugar => Some(Fringe::Sugar),
        }
    }
}

choice! {
    /// How bodies and joints become equations of motion.
    Formulation {
        /// The one that suits the model and the analysis.
        #[default]
        Auto = "auto",
        /// Every body has its own coordinates, joints are springs in all directions; implicit steps.
        Compliant = "compliant",
        /// Relative joint coordinates, loops closed inside the recursion: by springs, or with the methods that reduce
        /// constraints as in the paper, where joints of beams only turn.
        Rcr = "rcr",
        /// The same with every direction as a coordinate that the discretization leaves elastic, whatever the method.
        RcrElastic = "rcr-elastic",
        /// A few directions of the strains of a tree's joints, trained for what acts in the analysis.
        Reduced = "reduced",
    }
}

#[cfg(test)]
mod tests {
    //! A name stands for one variant, here and in JSON.
    use super::*;

    #[test]
    fn names_go_both_ways() {
        for (one, name) in Formulation::ALL.into_iter().zip(Formulation::NAMES) {
            assert_eq!((one.name(), Formulation::named(name)), (name, Some(one)));
            assert_eq!(serde_json::to_value(one).ok(), Some(name.into()));
        }
        assert_eq!(Scheme::named("e5"), None);
        assert_eq!((Scheme::ALL.len(), Junctions::ALL.len()), (8, 3));
    }
}
