//! The options of a model on the wire: the field of an option has the number that the table gives it.
//!
//! Messages are split into numbered fields and assembled from them, so that an option needs only its line in the table
//! and its field in the `.proto` file.

use super::Violation;
use super::model::{setting_from_wire, setting_to_wire};
use crate::proto;
use bimorph_model::compile::CompileOptions;
use bimorph_model::options::{MODEL, ModelOption, OptionDescription, OptionError, OptionValue, Range};
use prost::Message;
use prost::encoding::{DecodeContext, WireType, decode_key, decode_varint, encode_key, encode_varint, skip_field};

/// Options as they travel.
pub fn options_to_wire(options: &CompileOptions) -> proto::CompileOptions {
    let mut bytes = Vec::new();
    for option in MODEL.iter() {
        put(option.number, &options.value(option), &mut bytes);
    }
    let set = options.set.iter().map(|(name, value)| setting_to_wire(name, value)).collect();
    proto::CompileOptions { set, ..proto::CompileOptions::decode(bytes.as_slice()).unwrap_or_default() }
}

/// Checked options; what is absent takes its default.
///
/// # Errors
/// A value that its option cannot have.
pub fn options_from_wire(options: Option<proto::CompileOptions>) -> Result<CompileOptions, Violation> {
    let Some(mut sent) = options else { return Ok(CompileOptions::default()) };
    let mut options = CompileOptions::default();
    for (i, setting) in std::mem::take(&mut sent.set).into_iter().enumerate() {
        let name = setting.name.clone();
        options.set.push((name, setting_from_wire(&format!("options.set[{i}]"), setting)?));
    }
    let bytes = sent.encode_to_vec();
    for option in MODEL.iter() {
        let value = take(option, &bytes).map_err(|_| Violation::new(field(option), "cannot be read"))?;
        // an empty name says nothing, as an absent one
        if let Some(value) = value.filter(|value| *value != OptionValue::Name(String::new())) {
            options.choose(option, value).map_err(refused)?;
        }
    }
    Ok(options)
}

/// The field that an option out of its range came in.
pub fn refused(refused: OptionError) -> Violation {
    let option = MODEL.iter().find(|option| option.about.name == refused.option);
    let field = option.map_or_else(|| format!("options.{}", refused.option), field);
    Violation::new(field, format!("expected {}, got {}", refused.expected, refused.got))
}

/// Refuses a value that an option of an analysis cannot have.
///
/// # Errors
/// A violation of its field.
pub fn analysis(about: &OptionDescription, value: OptionValue) -> Result<(), Violation> {
    about.check(&value).map_err(|r| Violation::new(about.wire, format!("expected {}, got {}", r.expected, r.got)))
}

fn field(option: &ModelOption) -> String {
    format!("options.{}", option.about.wire)
}

fn put(number: u32, value: &OptionValue, bytes: &mut Vec<u8>) {
    match value {
        OptionValue::Unset => {}
        OptionValue::Flag(flag) => {
            encode_key(number, WireType::Varint, bytes);
            encode_varint(u64::from(*flag), bytes);
        }
        OptionValue::Count(count) => {
            encode_key(number, WireType::Varint, bytes);
            encode_varint(u64::from(u32::try_from(*count).unwrap_or(u32::MAX)), bytes);
        }
        OptionValue::Number(x) => {
            encode_key(number, WireType::SixtyFourBit, bytes);
            bytes.extend(x.to_le_bytes());
        }
        OptionValue::Name(name) => {
            encode_key(number, WireType::LengthDelimited, bytes);
            encode_varint(name.len() as u64, bytes);
            bytes.extend(name.as_bytes());
        }
    }
}

/// The value of an option's field in a message; none: the field is absent.
fn take(option: &ModelOption, mut bytes: &[u8]) -> Result<Option<OptionValue>, prost::DecodeError> {
    while !bytes.is_empty() {
        let (number, kind) = decode_key(&mut bytes)?;
        if number != option.number {
            skip_field(kind, number, &mut bytes, DecodeContext::default())?;
            continue;
        }
        let length = match kind {
            WireType::SixtyFourBit => 8,
            _ => decode_varint(&mut bytes)?,
        };
        return Ok(Some(match (option.about.range, kind) {
            (Range::Flag, WireType::Varint) => OptionValue::Flag(length != 0),
            (_, WireType::Varint) => OptionValue::Count(usize::try_from(length).unwrap_or(usize::MAX)),
            (_, WireType::SixtyFourBit) => {
                OptionValue::Number(bytes.first_chunk().map_or(f64::NAN, |chunk| f64::from_le_bytes(*chunk)))
            }
            _ => {
                let text = bytes.get(..usize::try_from(length).unwrap_or(usize::MAX)).unwrap_or_default();
                OptionValue::Name(String::from_utf8_lossy(text).into_owned())
            }
        }));
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    //! Options arrive as they were sent; invalid values are rejected by field.
    use super::*;
    use bimorph_base::Setting;
    use bimorph_model::options::{Formulation, Junctions, Scheme};

    #[test]
    fn options_survive_the_wire() {
        for junctions in Junctions::ALL {
            let named = proto::CompileOptions { junctions: junctions.name().into(), ..Default::default() };
            assert_eq!(options_from_wire(Some(named)).map(|options| options.junctions), Ok(junctions));
        }
        let options = CompileOptions {
            set: vec![("w".into(), Setting::Number(2e-6)), ("layer".into(), Setting::Text("p1".into()))],
            band: Some(1e6),
            tol: 1e-4,
            linear: true,
            undamped: true,
            junctions: Junctions::Centreline,
            scheme: Scheme::D1,
            segments: Some(6),
            formulation: Formulation::RcrElastic,
            ..CompileOptions::default()
        };
        let sent = options_to_wire(&options);
        assert_eq!((sent.band_hz, sent.tol, sent.segments), (Some(1e6), Some(1e-4), Some(6)));
        assert_eq!(options_from_wire(Some(sent)), Ok(options));
        assert_eq!(options_from_wire(None), Ok(CompileOptions::default()));
        assert_eq!(options_from_wire(Some(proto::CompileOptions::default())), Ok(CompileOptions::default()));
    }

    /// Each option alone, at a value that is not its default, is the field of its name and comes back.
    #[test]
    fn every_option_travels() {
        for option in MODEL.iter() {
            let value = match option.about.range {
                Range::Flag => OptionValue::Flag(option.about.default != OptionValue::Flag(true)),
                Range::Count(low, _) => OptionValue::Count(low + 1),
                Range::Above(low, high) | Range::Within(low, high) => OptionValue::Number(low + 0.25 * (high - low)),
                Range::Names(names) => OptionValue::Name(names[0].to_owned()),
                Range::Ranges => OptionValue::Name("a:0:1".to_owned()),
            };
            let mut options = CompileOptions::default();
            options.choose(option, value).unwrap_or_else(|e| panic!("{e}"));
            let sent = options_to_wire(&options);
            assert!(format!("{sent:?}").contains(&format!("{}: ", option.about.wire)), "{}", option.about.wire);
            assert_eq!(options_from_wire(Some(sent)), Ok(options));
        }
    }

    #[test]
    fn nonsense_is_refused_by_field() {
        let field = |options: proto::CompileOptions| options_from_wire(Some(options)).map_err(|v| v.field);
        for bad in [0.0, -1.0, 1.0, f64::NAN] {
            let bad_tol = proto::CompileOptions { tol: Some(bad), ..Default::default() };
            assert_eq!(field(bad_tol), Err("options.tol".into()));
        }
        let bad_band = proto::CompileOptions { band_hz: Some(f64::NAN), ..Default::default() };
        assert_eq!(field(bad_band), Err("options.band_hz".into()));
        let bad_name = proto::CompileOptions { junctions: "welded".into(), ..Default::default() };
        assert_eq!(field(bad_name), Err("options.junctions".into()));
        let bad_scheme = proto::CompileOptions { scheme: "e5".into(), ..Default::default() };
        assert_eq!(field(bad_scheme), Err("options.scheme".into()));
        for bad in [0, 100_001, u32::MAX] {
            let bad_segments = proto::CompileOptions { segments: Some(bad), ..Default::default() };
            assert_eq!(field(bad_segments), Err("options.segments".into()));
        }
    }
}
