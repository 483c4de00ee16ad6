//! The JSON Schema of documents (draft 2020-12), from the tables of fields.

use crate::format::{FORMAT, UNITS, VERSION};
use crate::record::ObjectSchema;
use crate::tables;
use std::fmt::Write;

/// The schema as text: docs/reference/structure.schema.json holds it.
pub fn schema() -> String {
    let mut text = String::from("{\n  \"$schema\": \"https://json-schema.org/draft/2020-12/schema\",\n");
    let _ = writeln!(text, "  \"title\": \"{FORMAT}, version {VERSION}\",");
    text += "  \"description\": \"A planar mechanism with its circuit. All numbers are in SI units. A list that is left out is empty.\",\n";
    text += "  \"type\": \"object\",\n  \"additionalProperties\": false,\n";
    text += "  \"required\": [\"format\", \"version\", \"units\", \"nodes\"],\n  \"properties\": {\n";
    let _ = writeln!(text, "    \"format\": {{\"const\": \"{FORMAT}\"}},");
    let _ = writeln!(text, "    \"version\": {{\"const\": {VERSION}}},");
    let _ = writeln!(text, "    \"units\": {{\"const\": \"{UNITS}\"}},");
    text +=
        "    \"source\": {\"type\": \"string\", \"description\": \"File that the document was converted from.\"},\n";
    text += "    \"parameters\": {\"type\": \"object\", \"description\": \"Parameters of that file with the values they took (SI).\", \
             \"additionalProperties\": {\"type\": [\"number\", \"string\"]}}";
    let (name, about, value) = tables::ambient_schema();
    let value = value.strip_prefix('{').unwrap_or(&value);
    let _ = write!(text, ",\n    \"{name}\": {{\"description\": \"{about}.\", {value}");
    for (name, about, items) in tables::section_schemas() {
        let _ = write!(
            text,
            ",\n    \"{name}\": {{\"type\": \"array\", \"description\": \"{about}\", \"items\": {items}}}"
        );
    }
    text += "\n  },\n  \"$defs\": {\n";
    text += "    \"NodeName\": {\"type\": \"string\", \"description\": \"Name of a node of the list `nodes`.\"}";
    for object in tables::object_schemas() {
        text += ",\n";
        define(&mut text, &object);
    }
    text += "\n  }\n}\n";
    text
}

/// One object under `$defs`.
fn define(text: &mut String, object: &ObjectSchema) {
    let _ = writeln!(text, "    \"{}\": {{\n      \"description\": \"{}\",", object.name, object.about);
    text.push_str("      \"type\": \"object\",\n      \"additionalProperties\": false,\n");
    let required = object.fields.iter().filter(|f| f.required).map(|f| format!("\"{}\"", f.field.name));
    let _ = writeln!(text, "      \"required\": [{}],", required.collect::<Vec<_>>().join(", "));
    text.push_str("      \"properties\": {\n");
    let rows = object.fields.iter().map(|f| {
        let unit = if f.field.unit.is_empty() { String::new() } else { format!(" ({})", f.field.unit) };
        let rest = f.schema.strip_prefix('{').unwrap_or(&f.schema);
        format!("        \"{}\": {{\"description\": \"{}{unit}.\", {rest}", f.field.name, f.field.about)
    });
    text.push_str(&rows.collect::<Vec<_>>().join(",\n"));
    text.push_str("\n      }\n    }");
}
