//! Netlists, settings and diagnostics.

use super::{Violation, number, required};
use crate::proto;
use bimorph_base::{Bundle, Diagnostic, Diagnostics, Setting, Severity};

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
    Ok(Bundle { root, files, places: Default::default() })
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
    //! Invalid values are rejected by field.
    use super::*;

    #[test]
    fn a_bundle_without_its_root_is_refused() {
        let no_root = proto::Bundle { root: "a.net".into(), files: Default::default() };
        assert_eq!(bundle_from_wire(Some(no_root)).map_err(|v| v.field), Err("bundle.root".into()));
    }
}
