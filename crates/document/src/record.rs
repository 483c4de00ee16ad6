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

/// The schema of the field that a function reads; `left_out` is its value where it is not given.
pub(crate) fn field_schema<R, T: DocumentValue>(
    _: fn(&R) -> &T,
    field: DocumentField,
    left_out: Option<T>,
) -> FieldSchema {
    FieldSchema { field, schema: T::schema(&field), required: left_out.is_none() }
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

    /// The value of a field, or that of one that is left out.
    pub(crate) fn field<T: DocumentValue>(
        &self,
        field: &DocumentField,
        left_out: Option<T>,
        nodes: &NodeNames<'_>,
    ) -> Result<T, DocumentError> {
        match self.node.get(field.name) {
            Some(value) => T::read(value, &ValuePath::Field(self.at, field.name), field, nodes),
            None => left_out.ok_or_else(|| {
                let unit = if field.unit.is_empty() { String::new() } else { format!(" ({})", field.unit) };
                let message = format!("the field \"{}\"{unit} is missing: {}", field.name, field.about);
                self.at.fault(FIELDS, self.node, message, "")
            }),
        }
    }
}

impl DocumentWriter<'_> {
    /// A field of an object.
    pub(crate) fn field<T: DocumentValue>(
        &mut self,
        field: &DocumentField,
        value: &T,
    ) -> Result<(), UnwritableStructure> {
        self.comma();
        self.text.push('"');
        self.text.push_str(field.name);
        self.text.push_str("\": ");
        value.write(self, field)
    }
}

/// An object with its fields, in the order in which they are written: `name: "unit", range, "what it is";`, or `name = default: …` for a number that is left out
/// where it has this value, or `name = false: …`. An object whose fields can all be left out can be left out itself.
macro_rules! record {
    ($type:ident: $about:literal { $($name:ident $(= $default:tt)?: $unit:literal, $range:expr, $what:literal;)+ }) => {
        impl DocumentValue for $type {
            fn write(&self, to: &mut DocumentWriter<'_>, _: &DocumentField) -> Result<(), UnwritableStructure> {
                let Self { $($name),+ } = self;
                to.text.push('{');
                $(if !record!(@is_left_out $name $(, $default)?) {
                    let field = DocumentField { name: stringify!($name), unit: $unit, range: $range, about: $what };
                    to.field(&field, $name)?;
                })+
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
                    record!(@left_out $($default)?),
                    nodes,
                )?),+ })
            }

            fn schema(_: &DocumentField) -> String {
                concat!("{\"$ref\": \"#/$defs/", stringify!($type), "\"}").to_owned()
            }

            fn left_out() -> Option<Self> {
                Some(Self { $($name: record!(@left_out $($default)?)?),+ })
            }

            fn is_left_out(&self) -> bool {
                let Self { $($name),+ } = self;
                $(record!(@is_left_out $name $(, $default)?))&&+
            }
        }

        impl DocumentRecord for $type {
            fn object_schema() -> ObjectSchema {
                let fields = vec![$(field_schema(
                    |record: &$type| &record.$name,
                    DocumentField { name: stringify!($name), unit: $unit, range: $range, about: $what },
                    record!(@left_out $($default)?),
                )),+];
                ObjectSchema { name: stringify!($type), about: $about, fields }
            }
        }
    };
    (@left_out) => { DocumentValue::left_out() };
    (@left_out $default:tt) => { Some($default) };
    (@is_left_out $name:ident) => { $name.is_left_out() };
    (@is_left_out $name:ident, false) => { !*$name };
    (@is_left_out $name:ident, $default:tt) => { $name.to_bits() == f64::to_bits($default) };
}

pub(crate) use record;
