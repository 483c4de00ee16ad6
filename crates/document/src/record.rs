//! Objects: the macro that turns a table of fields into a writer, a reader and a schema, and what these share.

use crate::error::{DocumentError, FIELDS, UnwritableStructure, VALUE};
use crate::json::{JsonKind, JsonNode};
use crate::place::ValuePath;
use crate::value::{DocumentField, DocumentValue, DocumentWriter, NodeNames};
use bimorph_base::budget;
use bimorph_base::suggest::did_you_mean;

/// Of an element without its name, about (byte).
const ELEMENT_BYTES: usize = 400;

/// An object of the schema.
#[derive(Debug)]
pub(crate) struct ObjectSchema {
    pub(crate) name: &'static str,
    pub(crate) about: &'static str,
    pub(crate) fields: Vec<FieldSchema>,
}

/// A field of the schema.
#[derive(Debug)]
pub(crate) struct FieldSchema {
    pub(crate) field: DocumentField,
    pub(crate) schema: String,
    pub(crate) required: bool,
}

/// A type that a table of fields describes.
pub(crate) trait DocumentRecord: DocumentValue {
    fn object_schema() -> ObjectSchema;
}

/// The schema of the field that `of` reads.
pub(crate) fn field_schema<R, T: DocumentValue>(_: fn(&R) -> &T, field: DocumentField) -> FieldSchema {
    FieldSchema { field, schema: T::schema(&field), required: T::left_out().is_none() }
}

/// An object being read.
pub(crate) struct ObjectReader<'n, 't> {
    node: &'n JsonNode<'t>,
    at: &'n ValuePath<'n>,
}

impl<'n, 't> ObjectReader<'n, 't> {
    /// Takes an object without other fields than those of `names`.
    pub(crate) fn new(node: &'n JsonNode<'t>, at: &'n ValuePath<'n>, names: &[&str]) -> Result<Self, DocumentError> {
        budget::lay_out(ELEMENT_BYTES);
        let JsonKind::Object(fields) = &node.kind else {
            return Err(at.fault(VALUE, node, format!("expected an object, got {}", node.called()), ""));
        };
        if let Some((name, value)) = fields.iter().find(|(name, _)| !names.contains(&&**name)) {
            let help = did_you_mean(name, names.iter().copied(), &format!("it has {}", names.join(", ")));
            return Err(ValuePath::Field(at, name).fault(FIELDS, value, "unknown field", help));
        }
        Ok(Self { node, at })
    }

    /// The value of a field.
    pub(crate) fn field<T: DocumentValue>(
        &self,
        field: &DocumentField,
        nodes: &NodeNames<'_>,
    ) -> Result<T, DocumentError> {
        match self.node.get(field.name) {
            Some(value) => T::read(value, &ValuePath::Field(self.at, field.name), field, nodes),
            None => T::left_out().ok_or_else(|| {
                let unit = if field.unit.is_empty() { String::new() } else { format!(" ({})", field.unit) };
                let message = format!("the field \"{}\"{unit} is missing: {}", field.name, field.about);
                self.at.fault(FIELDS, self.node, message, "")
            }),
        }
    }
}

impl DocumentWriter<'_> {
    /// A field of an object, unless it is left out.
    pub(crate) fn field<T: DocumentValue>(
        &mut self,
        field: &DocumentField,
        value: &T,
    ) -> Result<(), UnwritableStructure> {
        if value.is_left_out() {
            return Ok(());
        }
        self.comma();
        self.text.push('"');
        self.text.push_str(field.name);
        self.text.push_str("\": ");
        value.write(self, field)
    }
}

/// An object with its fields, in the order in which they are written: `name: "unit", range, "what it is";`. One whose fields can all be left out can be
/// left out itself.
macro_rules! record {
    ($type:ident: $about:literal { $($name:ident: $unit:literal, $range:expr, $what:literal;)+ }) => {
        impl DocumentValue for $type {
            fn write(&self, to: &mut DocumentWriter<'_>, _: &DocumentField) -> Result<(), UnwritableStructure> {
                let Self { $($name),+ } = self;
                to.text.push('{');
                $(to.field(
                    &DocumentField { name: stringify!($name), unit: $unit, range: $range, about: $what },
                    $name,
                )?;)+
                to.text.push('}');
                Ok(())
            }

            fn read(
                node: &JsonNode<'_>,
                at: &ValuePath<'_>,
                _: &DocumentField,
                nodes: &NodeNames<'_>,
            ) -> Result<Self, DocumentError> {
                let object = ObjectReader::new(node, at, &[$(stringify!($name)),+])?;
                Ok(Self { $($name: object.field(
                    &DocumentField { name: stringify!($name), unit: $unit, range: $range, about: $what },
                    nodes,
                )?),+ })
            }

            fn schema(_: &DocumentField) -> String {
                concat!("{\"$ref\": \"#/$defs/", stringify!($type), "\"}").to_owned()
            }

            fn left_out() -> Option<Self> {
                Some(Self { $($name: DocumentValue::left_out()?),+ })
            }

            fn is_left_out(&self) -> bool {
                $(self.$name.is_left_out())&&+
            }
        }

        impl DocumentRecord for $type {
            fn object_schema() -> ObjectSchema {
                let fields = vec![$(field_schema(
                    |record: &$type| &record.$name,
                    DocumentField { name: stringify!($name), unit: $unit, range: $range, about: $what },
                )),+];
                ObjectSchema { name: stringify!($type), about: $about, fields }
            }
        }
    };
}

pub(crate) use record;
