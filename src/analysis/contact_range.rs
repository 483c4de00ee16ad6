//! No result from beyond the law of contact: a part pressed further into another than the law knows is refused by name.

use super::AnalysisError;
use crate::compile::Compiled;
use crate::multibody::planar::Pose;

/// Refuses a configuration in which a gap is closed beyond the range of its law, see [`crate::gaps::contact`].
///
/// # Errors
/// [`AnalysisError::ContactRange`] with the gap.
pub(crate) fn within_contact_range(compiled: &Compiled, q: &[Pose]) -> Result<(), AnalysisError> {
    let system = &compiled.parts.system;
    match system.overrun(q) {
        None => Ok(()),
        Some((gap, left)) => Err(AnalysisError::ContactRange {
            gap: compiled.parts.gap_names[gap].clone(),
            left,
            least: system.touching(gap).map_or(0.0, |[_, least]| least),
        }),
    }
}
