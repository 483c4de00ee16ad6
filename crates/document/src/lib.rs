//! A structure as a typed, versioned JSON document: the form in which drawings and models are exchanged with other programs.
//!
//! [`StructureDocument::write`] gives the one canonical text of a structure, [`StructureDocument::read`] the structure of a text, and writing again
//! gives the same bytes. `tables` list every field with its unit and range: the writer, the reader and the JSON [`schema`] all follow
//! these tables, and a field that is missing there does not compile. `json` reads the text with the place of every value, `value` holds the types of
//! fields, and `relations` the checks between fields.
//!
//! **Architecture invariant.** Below are [`bimorph_base`] and [`bimorph_structure`]. Numbers are SI on both sides. A document that is read holds a
//! structure whose indices and ranges are valid.

mod document;
mod error;
mod format;
mod json;
mod place;
mod record;
mod relations;
mod schema;
mod tables;
mod value;

pub use document::StructureDocument;
pub use error::{DocumentError, UnwritableStructure};
pub use format::{FORMAT, VERSION, is_document};
pub use schema::schema;
