//! Netlists, options and diagnostics.

use super::{Violation, number, required};
use crate::compile::{CompileOptions, Junctions};
use crate::discretize::Scheme;
use crate::netlist::{Bundle, Diagnostic, Diagnostics, Setting, Severity};
use crate::service::proto;
use serde::Deserialize;
use serde::de::IntoDeserializer;
use serde::de::value::{Error as NameError, StrDeserializer};

/// A bundle as it travels.
pub fn bundle_to_wire(bundle: &Bundle) -> proto::Bundle {
    proto::Bundle { root: bundle.root.clone(), files: bundle.files.clone() }
}

/// A bundle whose root is among its files.
///
/// # Errors
/// A missing bundle or root.
pub fn bundle_from_wire(bundle: Option<proto::Bundle>) -> Result<Bundle, Violation> {
    let proto::Bundle { root, files } = required("bundle", bundle)?;
    if !files.contains_key(&root) {
        let names: Vec<&str> = files.keys().take(8).map(String::as_str).collect();
        return Err(Violation::new("bundle.root", format!("\"{root}\" is not among the files {names:?}")));
    }
    Ok(Bundle { root, files })
}

/// Bytes of a bundle, as limits count them.
pub fn bundle_bytes(bundle: &Bundle) -> usize {
    bundle.files.iter().map(|(name, text)| name.len() + text.len()).sum()
}

/// A named setting as it travels.
pub fn setting_to_wire(name: &str, value: &Setting) -> proto::Setting {
    let value = match value {
        Setting::Number(x) => proto::setting::Value::Number(*x),
        Setting::Text(text) => proto::setting::Value::Text(text.clone()),
    };
    proto::Setting { name: name.to_owned(), value: Some(value) }
}

/// The value of a setting.
///
/// # Errors
/// No value, or a number that is not finite.
pub fn setting_from_wire(field: &str, setting: proto::Setting) -> Result<Setting, Violation> {
    match required(field, setting.value)? {
        proto::setting::Value::Number(x) => Ok(Setting::Number(number(field, x, false)?)),
        proto::setting::Value::Text(text) => Ok(Setting::Text(text)),
    }
}

/// Options as they travel.
pub fn options_to_wire(options: &CompileOptions) -> proto::CompileOptions {
    proto::CompileOptions {
        set: options.set.iter().map(|(name, value)| setting_to_wire(name, value)).collect(),
        band_hz: options.band,
        tol: Some(options.tol),
        linear: options.linear,
        undamped: options.undamped,
        junctions: options.junctions.name().to_owned(),
        scheme: options.scheme.name().to_owned(),
        segments: options.segments.map(|n| u32::try_from(n).unwrap_or(u32::MAX)),
        shear: options.shear,
        rotary_inertia: options.rotary_inertia,
    }
}

/// Checked options; what is absent takes its default.
///
/// # Errors
/// A number that is not positive, an unknown name.
pub fn options_from_wire(options: Option<proto::CompileOptions>) -> Result<CompileOptions, Violation> {
    let Some(options) = options else { return Ok(CompileOptions::default()) };
    let mut set = Vec::with_capacity(options.set.len());
    for (i, setting) in options.set.into_iter().enumerate() {
        let field = format!("options.set[{i}]");
        if setting.name.is_empty() {
            return Err(Violation::new(field, "the parameter has no name"));
        }
        let name = setting.name.clone();
        set.push((name, setting_from_wire(&field, setting)?));
    }
    let junctions = match options.junctions.as_str() {
        "" => Junctions::default(),
        name => junctions_from_name(name)?,
    };
    Ok(CompileOptions {
        set,
        band: options.band_hz.map(|band| number("options.band_hz", band, true)).transpose()?,
        tol: options.tol.map_or(Ok(CompileOptions::default().tol), |tol| number("options.tol", tol, true))?,
        linear: options.linear,
        undamped: options.undamped,
        junctions,
        scheme: match options.scheme.as_str() {
            "" => Scheme::default(),
            name => Scheme::named(name).ok_or_else(|| {
                Violation::new("options.scheme", format!("\"{name}\" is none of {}", Scheme::NAMES.join(", ")))
            })?,
        },
        segments: match options.segments {
            Some(0) => return Err(Violation::new("options.segments", "0, expected at least one")),
            n => n.map(|n| n as usize),
        },
        shear: options.shear,
        rotary_inertia: options.rotary_inertia,
    })
}

/// The variant that serde, and so the command's flag, calls so.
fn junctions_from_name(name: &str) -> Result<Junctions, Violation> {
    let deserializer: StrDeserializer<'_, NameError> = name.into_deserializer();
    Junctions::deserialize(deserializer).map_err(|error| Violation::new("options.junctions", error.to_string()))
}

/// A diagnostic as it travels.
pub fn diagnostic_to_wire(diagnostic: &Diagnostic) -> proto::Diagnostic {
    let severity = match diagnostic.severity {
        Severity::Error => proto::diagnostic::Severity::Error,
        Severity::Warning => proto::diagnostic::Severity::Warning,
    };
    let number = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    proto::Diagnostic {
        code: diagnostic.code.clone(),
        severity: severity.into(),
        file: diagnostic.file.clone(),
        line: number(diagnostic.line),
        column: number(diagnostic.column),
        width: number(diagnostic.width),
        message: diagnostic.message.clone(),
        help: diagnostic.help.clone(),
    }
}

/// All diagnostics as they travel.
pub fn diagnostics_to_wire(diagnostics: &Diagnostics) -> Vec<proto::Diagnostic> {
    diagnostics.items.iter().map(diagnostic_to_wire).collect()
}

#[cfg(test)]
mod tests {
    //! What a client sends arrives as the same options; what means nothing is refused by field.
    use super::*;

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
            shear: true,
            rotary_inertia: true,
        };
        assert_eq!(options_from_wire(Some(options_to_wire(&options))), Ok(options));
        assert_eq!(options_from_wire(None), Ok(CompileOptions::default()));
        assert_eq!(options_from_wire(Some(proto::CompileOptions::default())), Ok(CompileOptions::default()));
    }

    #[test]
    fn nonsense_is_refused_by_field() {
        let field = |options: proto::CompileOptions| options_from_wire(Some(options)).map_err(|v| v.field);
        let bad_tol = proto::CompileOptions { tol: Some(0.0), ..Default::default() };
        assert_eq!(field(bad_tol), Err("options.tol".into()));
        let bad_band = proto::CompileOptions { band_hz: Some(f64::NAN), ..Default::default() };
        assert_eq!(field(bad_band), Err("options.band_hz".into()));
        let bad_name = proto::CompileOptions { junctions: "welded".into(), ..Default::default() };
        assert_eq!(field(bad_name), Err("options.junctions".into()));
        let bad_scheme = proto::CompileOptions { scheme: "e5".into(), ..Default::default() };
        assert_eq!(field(bad_scheme), Err("options.scheme".into()));
        let no_segments = proto::CompileOptions { segments: Some(0), ..Default::default() };
        assert_eq!(field(no_segments), Err("options.segments".into()));
        let no_root = proto::Bundle { root: "a.net".into(), files: Default::default() };
        assert_eq!(bundle_from_wire(Some(no_root)).map_err(|v| v.field), Err("bundle.root".into()));
    }
}
