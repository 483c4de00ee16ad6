//! The schema in the manual.

use bimorph_document::schema;
use std::path::Path;

/// docs/reference/structure.schema.json is the schema of the reader; `BIMORPH_WRITE=1` writes it.
#[test]
fn schema_is_current() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/structure.schema.json");
    if std::env::var_os("BIMORPH_WRITE").is_some() {
        std::fs::write(&path, schema()).expect("written");
    }
    let found = std::fs::read_to_string(&path).expect("docs/reference/structure.schema.json");
    assert_eq!(found, schema(), "BIMORPH_WRITE=1 cargo test -p bimorph-document --test schema");
}
