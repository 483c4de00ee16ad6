//! A process as its file has it.

use super::error::ProcessError;
use super::stack::{Anchoring, FixedLayer, LARGEST_HOLE, MetalLayer, StructuralLayer, THICKEST, is_name};
use serde::Deserialize;
use std::collections::BTreeMap;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ProcessFile {
    pub(super) name: String,
    #[serde(default)]
    pub(super) about: String,
    pub(super) material: BTreeMap<String, BTreeMap<String, f64>>,
    pub(super) layer: Vec<FileLayer>,
    #[serde(default)]
    pub(super) fixed: Vec<FixedLayer>,
    pub(super) metal: Option<MetalLayer>,
    #[serde(default)]
    pub(super) ignored: Ignored,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct Ignored {
    #[serde(default)]
    pub(super) layers: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileLayer {
    pub(super) name: String,
    pub(super) drawn: Vec<String>,
    pub(super) thickness: f64,
    pub(super) material: String,
    pub(super) fluid: Option<f64>,
    #[serde(default)]
    pub(super) anchors: Vec<String>,
    #[serde(default)]
    pub(super) released: Vec<String>,
    pub(super) undercut: Option<f64>,
    #[serde(default)]
    pub(super) holes: Vec<String>,
    #[serde(default)]
    pub(super) metal: Vec<String>,
    pub(super) largest_hole: Option<f64>,
}

impl FileLayer {
    pub(super) fn complete(
        self,
        materials: &BTreeMap<String, BTreeMap<String, f64>>,
        file: &str,
    ) -> Result<StructuralLayer, ProcessError> {
        let Some(material) = materials.get(&self.material) else {
            let known: Vec<&str> = materials.keys().map(String::as_str).collect();
            let message = format!(
                "layer `{}` is of `{}`, which is no [material.NAME] of this file; there are: {}",
                self.name,
                self.material,
                known.join(", ")
            );
            return Err(ProcessError::Inconsistent { file: file.to_owned(), message });
        };
        let length = |what: &str, value: Option<f64>| match value {
            Some(v) if !(v > 0.0 && v <= THICKEST) => Err(ProcessError::OutOfRange {
                file: file.to_owned(),
                what: format!("{what} of layer `{}`", self.name),
                value: v,
                expected: "expected metres, above 0 and at most 1e-2 (2 um are 2e-6)",
            }),
            other => Ok(other),
        };
        let finite = |(name, value): (&String, &f64)| match value.is_finite() {
            true if is_name(name) => Ok(()),
            true => Err(ProcessError::Inconsistent {
                file: file.to_owned(),
                message: format!("material `{}` has an entry `{name}`: expected a name as in netlists", self.material),
            }),
            false => Err(ProcessError::OutOfRange {
                file: file.to_owned(),
                what: format!("{name} of material `{}`", self.material),
                value: *value,
                expected: "expected a finite number",
            }),
        };
        material.iter().try_for_each(finite)?;
        length("thickness", Some(self.thickness))?;
        let (fluid, undercut) = (length("fluid", self.fluid)?, length("undercut", self.undercut)?);
        let largest_hole = length("largest_hole", self.largest_hole)?.unwrap_or(LARGEST_HOLE);
        Ok(StructuralLayer {
            name: self.name,
            drawn: self.drawn,
            thickness: self.thickness,
            material: material.clone(),
            fluid,
            anchoring: Anchoring { drawn: self.anchors, released: self.released, undercut },
            holes: self.holes,
            metal: self.metal,
            largest_hole,
        })
    }
}
