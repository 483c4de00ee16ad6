//! The options of a model, one table: a line here is all that an option needs to be accepted everywhere.
//!
//! The struct and its defaults, the parsing and `--help` of the command, and the fields of the protocol come from it.
//! So do the parameters of an ngspice `.model` line, the keywords of the Python client, the keys of JSON documents, and
//! the table in docs/reference/options.md. After a change, `BIMORPH_WRITE=1 cargo test --test options` writes what is generated
//! from it.

use super::choices::{Anchors, Formulation, FringeFields, Junctions, Scheme};
use super::port_ranges::PortRanges;
use super::table::{Field, OptionDescription, OptionError, OptionValue, Range};
use bimorph_base::Setting;
use std::sync::LazyLock;

/// An option of a model: what it is, and its field.
pub struct ModelOption {
    /// Name, unit, default, range, meaning.
    pub about: OptionDescription,
    /// Number of its field on the wire.
    pub number: u32,
    get: fn(&CompileOptions) -> OptionValue,
    set: fn(&mut CompileOptions, OptionValue),
}

macro_rules! options {
    ($($(#[doc = $help:literal])+
       $field:ident: $kind:ty = $default:expr, $wire:literal = $number:literal, [$unit:literal], $range:expr, $unset:literal;)+
    ) => {
        /// Options of a compilation. `Default` is the only place where the numbers stand.
        #[derive(Debug, Clone, PartialEq)]
        pub struct CompileOptions {
            /// Netlist parameters set from outside.
            pub set: Vec<(String, Setting)>,
            $($(#[doc = $help])+ pub $field: $kind,)+
        }

        impl Default for CompileOptions {
            fn default() -> Self {
                Self { set: Vec::new(), $($field: $default,)+ }
            }
        }

        /// Every option of a model, in the order of the documentation.
        pub static MODEL: LazyLock<Vec<ModelOption>> = LazyLock::new(|| vec![$(ModelOption {
            about: OptionDescription {
                name: stringify!($field),
                wire: $wire,
                unit: $unit,
                range: $range,
                default: <$kind as Field>::value(&$default),
                unset: $unset,
                help: concat!($($help, "\n"),+),
            },
            number: $number,
            get: |options| options.$field.value(),
            set: |options, value| {
                if let Some(value) = Field::from_value(value) {
                    options.$field = value;
                }
            },
        }),+]);
    };
}

// field: type = default, name on the wire = its number there, [unit], range, what decides where it is left out
options! {
    /// Relative error aimed at. Smaller: more unknowns and shorter steps.
    tol: f64 = 1e-3, "tol" = 3, ["1"], Range::Above(0.0, 1.0), "";

    /// Highest frequency the model must resolve: as many segments as the estimated error of every mode below it needs to stay
    /// within tol.
    band: Option<f64> = None, "band_hz" = 2, ["Hz"], Range::Above(0.0, 1e12), "by what the analysis asks for";

    /// How beams meet. centreline: in points, as in SUGAR; offset: at the edges of rigid junctions; calibrated: with springs
    /// there, from two-dimensional elasticity (docs/explanation/junctions.md).
    junctions: Junctions = Junctions::Calibrated, "junctions" = 6, [""], Range::Names(&Junctions::NAMES), "";

    /// How anchors hold beams. rigid: without any motion; elastic: a beam ends in the compliance of its root, a pad on a base
    /// of like stiffness; auto: elastic where the layer has an undercut, else rigid (docs/explanation/junctions.md).
    anchors: Anchors = Anchors::Auto, "anchors" = 16, [""], Range::Names(&Anchors::NAMES), "";

    /// Law of the fringe fields of all gaps, plates and combs, in place of those that the netlist names. none, parallel, exact or sugar
    /// (docs/reference/elements.md#fringe-fields-of-gaps); auto: as the netlist says, by default exact.
    fringe: FringeFields = FringeFields::Auto, "fringe" = 17, [""], Range::Names(&FringeFields::NAMES), "";

    /// Small displacements about the drawn geometry, as SUGAR.
    linear: bool = false, "linear" = 4, [""], Range::Flag, "";

    /// Leave out gas damping.
    undamped: bool = false, "undamped" = 5, [""], Range::Flag, "";

    /// How beams are cut into bodies and joints (docs/explanation/beams.md has their errors). auto: e4; es in joint coordinates, where every
    /// body needs rotary inertia.
    scheme: Scheme = Scheme::Auto, "scheme" = 7, [""], Range::Names(&Scheme::NAMES), "";

    /// Segments of every beam, whatever band and tol say.
    segments: Option<usize> = None, "segments" = 8, [""], Range::Count(1, 100_000), "by band and tol";

    /// Shear flexibility of beams (Timoshenko, shear coefficient 5/6); SUGAR leaves it out.
    shear: bool = false, "shear" = 9, [""], Range::Flag, "";

    /// Rotary inertia of the sections of beams; SUGAR leaves it out.
    rotary_inertia: bool = false, "rotary_inertia" = 10, [""], Range::Flag, "";

    /// Imperfection: the structure is made in the shape of its lowest mode, the largest displacement being this share of the
    /// drawing's size; negative: to the other side. Lets what is compressed beyond buckling take a branch.
    imperfection: Option<f64> = None, "imperfection" = 12, ["1"], Range::Within(-0.1, 0.1), "none: as drawn";

    /// At a bifurcation, where two sides are alike, take the other one: of the beams that bend most, the first of the netlist goes to the right of its
    /// drawn direction instead of the left.
    other_branch: bool = false, "other_branch" = 15, [""], Range::Flag, "";

    /// As SUGAR 2 computes, in one switch: linear, beams that meet in points (junctions=centreline), gaps between facing beams along
    /// the straight lines between their ends, beams in modes as stiff as drawn whatever they bear. `bimorph modes` takes one cubic
    /// element for each beam then.
    as_sugar: bool = false, "as_sugar" = 13, [""], Range::Flag, "";

    /// The mechanism without the circuit that is drawn around it (R, C, L, sources, amplifiers): its electrical nodes are ports by
    /// their names, for a deck that has the circuit.
    without_circuit: bool = false, "without_circuit" = 14, [""], Range::Flag, "";

    /// How bodies become equations. compliant: each body's own coordinates; rcr: joint coordinates on a tree, loops closed
    /// inside the recursion; rcr-elastic: the same, and beams' joints stay elastic with every method; reduced: few coordinates
    /// (static, tran, circuits); auto: what suits.
    formulation: Formulation = Formulation::Auto, "formulation" = 11, [""], Range::Names(&Formulation::NAMES), "";

    /// Ranges of what is given to ports (V, N, W), for which a reduced model is trained
    /// (docs/explanation/reduction.md). Without them tran trains for its own values, and circuits have the full model.
    /// In circuits auto takes the reduced model for them from a tol of 5e-3 on.
    ranges: Option<PortRanges> = None, "ranges" = 18, [""], Range::Ranges, "none";
}

impl CompileOptions {
    /// The value of an option.
    pub fn value(&self, option: &ModelOption) -> OptionValue {
        (option.get)(self)
    }

    /// Gives an option a value, if it can have it.
    ///
    /// # Errors
    /// [`OptionError`]: the option is as before.
    pub fn choose(&mut self, option: &ModelOption, value: OptionValue) -> Result<(), OptionError> {
        let value = match value {
            // the American spelling means the same, wherever it is written
            OptionValue::Name(name) if name == "centerline" => {
                OptionValue::Name(Junctions::Centreline.name().to_owned())
            }
            other => other,
        };
        option.about.check(&value)?;
        (option.set)(self, value);
        Ok(())
    }

    /// Whether every option is within its range: asked before anything is laid out.
    ///
    /// # Errors
    /// [`OptionError`]: the first that is not.
    pub fn check(&self) -> Result<(), OptionError> {
        MODEL.iter().try_for_each(|option| option.about.check(&self.value(option)))?;
        match (self.scheme, self.formulation) {
            (Scheme::E4, Formulation::Rcr | Formulation::RcrElastic) => Err(OptionError {
                option: "scheme",
                expected: format!(
                    "es, which is taken where none is given, beside formulation {}, or formulation compliant (bodies inside an \
                     e4 beam have no rotary inertia, which joint coordinates need)",
                    self.formulation.name()
                ),
                got: self.scheme.name().to_owned(),
            }),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    //! The table's description of an option agrees with the type and range of its field.
    use super::*;

    #[test]
    fn defaults_are_within_their_ranges() {
        let defaults = CompileOptions::default();
        assert_eq!(defaults.check(), Ok(()));
        for option in MODEL.iter() {
            assert_eq!(defaults.value(option), option.about.default, "{}", option.about.name);
            assert_eq!(
                option.about.default == OptionValue::Unset,
                !option.about.unset.is_empty(),
                "{}",
                option.about.name
            );
        }
    }

    #[test]
    fn a_value_beyond_its_range_is_refused_and_changes_nothing() {
        for option in MODEL.iter() {
            let (good, bad) = match option.about.range {
                Range::Flag => (OptionValue::Flag(true), OptionValue::Number(1.0)),
                Range::Count(low, high) => {
                    (OptionValue::Count(high), OptionValue::Count(if low > 0 { low - 1 } else { high + 1 }))
                }
                Range::Above(low, high) => (OptionValue::Number(0.5 * high), OptionValue::Number(low)),
                Range::Within(low, high) => (OptionValue::Number(high), OptionValue::Number(low - high)),
                Range::Names(names) => (OptionValue::Name(names[0].to_owned()), OptionValue::Name("nosuch".to_owned())),
                Range::Ranges => (OptionValue::Name("a:0:1".to_owned()), OptionValue::Name("a:1:0".to_owned())),
            };
            let mut options = CompileOptions::default();
            let refused = options.choose(option, bad).expect_err(option.about.name);
            assert_eq!((refused.option, &options), (option.about.name, &CompileOptions::default()));
            assert!(options.choose(option, OptionValue::Number(f64::NAN)).is_err(), "{}", option.about.name);
            options.choose(option, good.clone()).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(options.value(option), good);
        }
    }
}
