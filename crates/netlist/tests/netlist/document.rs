//! Structures as JSON documents: the way there and back, the checks of foreign documents, and the schema.

use bimorph_base::{Bundle, Setting, Severity};
use bimorph_document::{StructureDocument, schema};
use bimorph_netlist::{document, load, read_bundle};
use std::path::{Path, PathBuf};

/// Every netlist of the examples, the tests and the library of validation decks that loads.
fn netlists() -> Vec<PathBuf> {
    let root = Path::new(crate::ROOT);
    let mut folders = vec![root.join("tests/netlists"), root.join("tests/decks"), root.join("examples")];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder").map(|entry| entry.expect("an entry").path()) {
            if entry.is_dir() {
                folders.push(entry);
            } else if entry.extension().is_some_and(|end| end == "net") {
                found.push(entry);
            }
        }
    }
    found.sort();
    found
}

fn document_of(path: &Path) -> Option<StructureDocument> {
    let bundle = read_bundle(path, &[]).expect("readable");
    document(&bundle, &[]).ok().map(|(document, _)| document)
}

/// Structure → document → structure gives an equal structure (equal bits, since every number is written in full), and writing again gives equal bytes.
/// Front ends report no fault of the document and no warning that the netlist has not.
#[test]
fn documents_come_back() {
    let mut count = 0;
    for path in netlists() {
        let bundle = read_bundle(&path, &[]).expect("readable");
        let Ok((document, warned)) = document(&bundle, &[]) else { continue };
        let text = document.write().unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let read = StructureDocument::read(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        assert_eq!(read, document, "{}", path.display());
        assert_eq!(read.write().expect("written"), text, "{}", path.display());
        let again = Bundle::from_text("model.json", &text);
        let loaded = load(&again, &[]).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        assert_eq!(loaded.structure, document.structure, "{}", path.display());
        assert_eq!(loaded.parameters, document.parameters);
        let codes = |items: &[bimorph_base::Diagnostic]| items.iter().map(|d| d.code.clone()).collect::<Vec<_>>();
        let known = codes(&warned.items);
        let new: Vec<_> = codes(&loaded.warnings.items).into_iter().filter(|code| !known.contains(code)).collect();
        assert!(new.is_empty(), "{}: {new:?}", path.display());
        count += 1;
    }
    assert!(count > 30, "{count} netlists of the examples and tests load");
}

/// Numbers keep their bits, signed zeros and subnormal numbers included.
#[test]
fn numbers_keep_their_bits() {
    let mut document = document_of(&Path::new(crate::ROOT).join("tests/netlists/switch.net")).expect("a structure");
    for angle in [-0.0, 5e-324, 1.0 / 3.0, -1.797_693_134_862_315_7e308, 123_456.789_012_345_67] {
        document.structure.beams[0].angle = angle;
        let read = StructureDocument::read(&document.write().expect("written")).expect("read");
        assert_eq!(read.structure.beams[0].angle.to_bits(), angle.to_bits());
    }
    document.structure.beams[0].angle = f64::NAN;
    let refused = document.write().expect_err("JSON has no such number").to_string();
    assert!(refused.contains("`angle`") && refused.contains(&document.structure.beams[0].name), "{refused}");
}

/// A small document as another program would write it: a cantilever of SI numbers, with lists and options left out.
const CANTILEVER: &str = r#"{
  "format": "bimorph-structure", "version": 1, "units": "SI",
  "nodes": [
    {"name": "root", "position": [0, 0], "mechanical": true, "electrical": false},
    {"name": "tip", "position": [200e-6, 0], "mechanical": true, "electrical": false}
  ],
  "beams": [
    {"name": "arm", "a": "root", "b": "tip", "length": 200e-6, "angle": 0, "width": 2e-6, "thickness": 2e-6,
     "material": {"youngs_modulus": 165e9, "poisson": 0.3, "density": 2300, "viscosity": 0, "fluid": 1,
                  "thermal_expansion": 0, "ambient_temperature": 0, "stress": 0}}
  ],
  "supports": [{"name": "wall", "node": "root", "held": [true, true, true], "angle": 0}]
}"#;

fn refused(text: &str) -> String {
    let Err(faults) = load(&Bundle::from_text("model.json", text), &[]) else { panic!("it loads: {text}") };
    assert_eq!(faults.items.len(), 1, "one fault, one message: {faults}");
    let fault = &faults.items[0];
    assert_eq!(fault.severity, Severity::Error);
    format!("{} {}:{} {} | {}", fault.code, fault.file, fault.line, fault.message, fault.help)
}

/// Each fault of a document gives one error with its code, line and JSON path.
#[test]
fn faults_have_a_path() {
    load(&Bundle::from_text("model.json", CANTILEVER), &[]).expect("a structure");
    let other = |old: &str, new: &str| {
        assert!(CANTILEVER.contains(old), "{old}");
        refused(&CANTILEVER.replacen(old, new, 1))
    };
    for (old, new, expected) in [
        ("\"version\": 1", "\"version\": 2", "E081 model.json:2 $.version: expected a version from 1 to 1"),
        ("\"version\": 1", "\"version\": 2, \"later\": []", "E081 model.json:2 $.version"),
        ("\"SI\"", "\"um\"", "E081 model.json:2 $.units: expected \"SI\", got the text \"um\""),
        ("bimorph-structure", "gltf", "E081 model.json:2 $.format"),
        (
            "\"length\": 200e-6",
            "\"length\": \"200u\"",
            "E083 model.json:8 $.beams[0].length: expected a number above 0 in m",
        ),
        ("\"length\": 200e-6", "\"length\": 0", "E083 model.json:8 $.beams[0].length: expected a number above 0 in m"),
        (
            "\"length\": 200e-6",
            "\"length_um\": 200",
            "E082 model.json:8 $.beams[0].length_um: unknown field | did you mean `length`",
        ),
        ("\"width\": 2e-6, ", "", "E082 model.json:8 $.beams[0]: the field \"width\" (m) is missing"),
        (
            "\"b\": \"tip\"",
            "\"b\": \"tap\"",
            "E083 model.json:8 $.beams[0].b: no node has the name \"tap\" | did you mean `tip`?",
        ),
        ("\"poisson\": 0.3", "\"poisson\": -1", "E083 model.json:9 $.beams[0].material.poisson"),
        ("\"supports\"", "\"anchors\"", "E082 model.json:12 $.anchors: unknown field"),
        ("[true, true, true]", "[true, true]", "E083 model.json:12 $.supports[0].held: expected a list of 3"),
        ("\"name\": \"tip\"", "\"name\": \"root\"", "E084 model.json:5 $.nodes[1]: two nodes have the name \"root\""),
        ("\"mechanical\": true", "\"mechanical\": false", "E084 model.json:8 $.beams[0]: the node \"root\""),
        ("\"angle\": 0}]", "\"angle\": 0}", "E080 model.json:13 $: not JSON"),
        ("2300", "1e999", "E080 model.json:9 $: not JSON: the number is beyond"),
        (
            "\"supports\"",
            "\"yields\": [{\"beam\": 0, \"stress\": 1, \"softening\": 1, \"strain\": 0}], \"supports\"",
            "E084 model.json:12 $.yields[0].beam",
        ),
        ("{\"name\": \"wall\", \"node\": \"root\", \"held\": [true, true, true], \"angle\": 0}", "", "E070"),
    ] {
        if expected == "E070" {
            // without a support the part is free, which is a warning as in netlists
            let loaded = load(&Bundle::from_text("model.json", &CANTILEVER.replacen(old, new, 1)), &[]).expect("free");
            assert_eq!(loaded.warnings.items[0].code, "W012");
            continue;
        }
        let found = other(old, new);
        assert!(found.starts_with(expected), "{old} → {new}:\n{found}\n{expected}");
    }
    let far = CANTILEVER.replace("200e-6", "200");
    let loaded = load(&Bundle::from_text("model.json", &far), &[]).expect("a structure");
    assert!(loaded.warnings.items.iter().any(|d| d.code == "W005" && d.line == 4), "{}", loaded.warnings);
    let set = [("N".to_owned(), Setting::Number(2.0))];
    let fixed = load(&Bundle::from_text("model.json", CANTILEVER), &set).expect_err("no parameters");
    assert_eq!(fixed.items[0].code, "E048");
}

/// Checks a value against the part of JSON Schema that the schema uses.
fn valid(schema: &serde_json::Value, root: &serde_json::Value, value: &serde_json::Value) -> bool {
    use serde_json::Value;
    let Value::Object(rules) = schema else { return false };
    rules.iter().all(|(rule, wanted)| match rule.as_str() {
        "$schema" | "title" | "description" | "$defs" => true,
        "$ref" => {
            let name = wanted.as_str().and_then(|r| r.strip_prefix("#/$defs/")).expect("a definition");
            valid(&root["$defs"][name], root, value)
        }
        "anyOf" => wanted.as_array().expect("a list").iter().any(|one| valid(one, root, value)),
        "enum" => wanted.as_array().expect("a list").contains(value),
        "const" => wanted == value,
        "type" => {
            let is = |name: &Value| match name.as_str().expect("a name") {
                "object" => value.is_object(),
                "array" => value.is_array(),
                "string" => value.is_string(),
                "number" => value.is_number(),
                "integer" => value.as_f64().is_some_and(|x| x.fract() == 0.0),
                "boolean" => value.is_boolean(),
                "null" => value.is_null(),
                other => panic!("unknown type {other}"),
            };
            wanted.as_array().map_or_else(|| is(wanted), |names| names.iter().any(is))
        }
        "minimum" => value.as_f64().is_none_or(|x| x >= wanted.as_f64().expect("a number")),
        "exclusiveMinimum" => value.as_f64().is_none_or(|x| x > wanted.as_f64().expect("a number")),
        "maximum" => value.as_f64().is_none_or(|x| x <= wanted.as_f64().expect("a number")),
        "minLength" => value.as_str().is_none_or(|s| s.len() as u64 >= wanted.as_u64().expect("a number")),
        "maxLength" => value.as_str().is_none_or(|s| s.len() as u64 <= wanted.as_u64().expect("a number")),
        "pattern" => value.as_str().is_none_or(|s| !s.chars().any(char::is_whitespace)),
        "items" => value.as_array().is_none_or(|items| items.iter().all(|item| valid(wanted, root, item))),
        "minItems" => value.as_array().is_none_or(|items| items.len() as u64 >= wanted.as_u64().expect("a number")),
        "maxItems" => value.as_array().is_none_or(|items| items.len() as u64 <= wanted.as_u64().expect("a number")),
        "required" => {
            let names = wanted.as_array().expect("a list");
            names.iter().all(|name| value.get(name.as_str().expect("a name")).is_some())
        }
        "properties" => value.as_object().is_none_or(|fields| {
            fields.iter().all(|(name, field)| wanted.get(name).is_none_or(|rule| valid(rule, root, field)))
        }),
        "additionalProperties" if wanted.is_boolean() => {
            value.as_object().is_none_or(|fields| fields.keys().all(|name| rules["properties"].get(name).is_some()))
        }
        "additionalProperties" => {
            value.as_object().is_none_or(|fields| fields.values().all(|field| valid(wanted, root, field)))
        }
        other => panic!("unknown rule {other}"),
    })
}

/// The schema accepts the documents of all examples and refuses documents with one wrong field.
#[test]
fn schema_describes_documents() {
    let schema: serde_json::Value = serde_json::from_str(&schema()).expect("JSON");
    for path in netlists() {
        let Some(document) = document_of(&path) else { continue };
        let value = serde_json::from_str(&document.write().expect("written")).expect("JSON");
        assert!(valid(&schema, &schema, &value), "{}", path.display());
    }
    let good: serde_json::Value = serde_json::from_str(CANTILEVER).expect("JSON");
    assert!(valid(&schema, &schema, &good));
    for (pointer, wrong) in [
        ("/version", serde_json::json!(2)),
        ("/units", serde_json::json!("um")),
        ("/beams/0/length", serde_json::json!("200u")),
        ("/beams/0/width", serde_json::json!(-1)),
        ("/beams/0/material", serde_json::json!({})),
        ("/supports/0/held", serde_json::json!([true, true])),
        ("/nodes/0", serde_json::json!({"name": "root"})),
        ("/nodes/0/name", serde_json::json!("a b")),
    ] {
        let mut value = good.clone();
        *value.pointer_mut(pointer).expect("a field") = wrong;
        assert!(!valid(&schema, &schema, &value), "{pointer}");
    }
    let mut value = good.clone();
    value["anchors"] = serde_json::json!([]);
    assert!(!valid(&schema, &schema, &value));
}

/// A document with one byte changed, removed or doubled, or cut, is read or refused with one message, and never stops the program. Every structure
/// that is read can be written.
#[test]
fn damaged_documents_are_read_or_refused() {
    let document = document_of(&Path::new(crate::ROOT).join("tests/netlists/switch.net")).expect("a structure");
    let text = document.write().expect("written");
    let (mut read, mut refused) = (0, 0);
    for at in (0..text.len()).step_by(7).filter(|at| text.is_char_boundary(*at) && text.is_char_boundary(at + 1)) {
        let (before, rest) = text.split_at(at);
        let (one, after) = rest.split_at(1);
        let damaged = [
            format!("{before}{after}"),
            format!("{before}{one}{one}{after}"),
            format!("{before}9{after}"),
            format!("{before}-{after}"),
            format!("{before}\"{after}"),
            before.to_owned(),
        ];
        for text in damaged {
            match load(&Bundle::from_text("model.json", &text), &[]) {
                Ok(loaded) => {
                    let document = StructureDocument {
                        source: String::new(),
                        parameters: loaded.parameters,
                        structure: loaded.structure,
                    };
                    document.write().expect("a structure that was read is written");
                    read += 1;
                }
                Err(faults) => {
                    assert!(faults.has_errors());
                    refused += 1;
                }
            }
        }
    }
    assert!(read > 100 && refused > 1000, "{read} read, {refused} refused");
}
