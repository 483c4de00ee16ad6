//! A structure with its origin, as text and from text.

use crate::error::{DocumentError, UnwritableStructure};
use crate::{json, relations, tables};
use bimorph_base::Setting;
use bimorph_structure::Structure;

/// A structure with its origin.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureDocument {
    /// File that it was converted from; empty: unknown.
    pub source: String,
    /// Parameters of that file with the values they took (SI).
    pub parameters: Vec<(String, Setting)>,
    /// The structure.
    pub structure: Structure,
}

impl StructureDocument {
    /// The canonical text, one element a line.
    ///
    /// # Errors
    /// The structure has two nodes of one name, or a number that is not finite.
    pub fn write(&self) -> Result<String, UnwritableStructure> {
        tables::write(&self.source, &self.parameters, &self.structure)
    }

    /// Reads a text.
    ///
    /// # Errors
    /// The first fault, with its path and place in the text.
    pub fn read(text: &str) -> Result<Self, DocumentError> {
        Self::read_with_places(text).map(|(document, _)| document)
    }

    /// As above, with the byte range of each node in the text.
    ///
    /// # Errors
    /// The first fault, with its path and place in the text.
    pub fn read_with_places(text: &str) -> Result<(Self, Vec<[usize; 2]>), DocumentError> {
        let root = json::parse(text)?;
        let (source, parameters, structure) = tables::read(&root)?;
        relations::check(&structure, &root)?;
        let document = Self { source, parameters, structure };
        let nodes = root.get("nodes");
        let place = |k: usize| nodes.and_then(|list| list.item(k)).map_or([0; 2], |node| node.span);
        let places = (0..document.structure.nodes.len()).map(place).collect();
        Ok((document, places))
    }
}
