//! Frequencies of the six layouts in plane stress. Written by `scripts/junctions/validate`: do not edit.

/// Netlist and frequencies 1–7 (Hz): CalculiX 2.20, CPS8, thin, 6 elements across the narrowest beam.
#[rustfmt::skip]
pub(super) const LAYOUTS: [(&str, [f64; 7]); 6] = [
    ("heatuator", [147135.7, 464822.9, 733001.1, 1272674.0, 2467137.0, 3984528.0, 4222652.0]),
    ("bank", [86845.1, 429732.7, 430198.3, 439839.2, 658286.8, 676031.9, 823805.1]),
    ("folded_flexure", [106030.7, 231929.0, 280931.0, 914756.3, 1260538.0, 1298472.0, 1357134.0]),
    ("serpentine", [91822.3, 241997.5, 461428.1, 681608.8, 792339.5, 2358773.0, 3430541.0]),
    ("chevron", [881928.5, 1584493.0, 1587373.0, 1606944.0, 1619883.0, 1620150.0, 1889698.0]),
    ("paddle", [16365.9, 232673.2, 770913.9, 2756238.0, 4642370.0, 4716089.0, 12798150.0]),
];
