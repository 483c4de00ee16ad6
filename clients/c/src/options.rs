//! Options of models.

use crate::fault::{CallFault, call, value};
use crate::memory::{output, release, text};
use bimorph::compile::CompileOptions;
use bimorph::netlist::{Setting, parse_setting};
use bimorph::options::{MODEL, OptionValue, Range};
use std::ffi::{c_char, c_int};

/// Options with the parameters of the netlist.
#[derive(Debug, Default)]
pub struct OptionsHandle {
    pub(crate) options: CompileOptions,
}

/// Options with their defaults.
// SAFETY: no other symbol of a program has this name.
#[unsafe(no_mangle)]
pub extern "C" fn bimorph_options_new() -> *mut OptionsHandle {
    value(std::ptr::null_mut(), || Ok(Box::into_raw(Box::default())))
}

/// The value of an option as a text has it.
fn option_value(range: &Range, text: &str) -> Option<OptionValue> {
    match range {
        Range::Flag => match text {
            "true" | "1" => Some(OptionValue::Flag(true)),
            "false" | "0" => Some(OptionValue::Flag(false)),
            _ => None,
        },
        Range::Count(..) => text.parse().ok().map(OptionValue::Count),
        Range::Names(_) | Range::Ranges => Some(OptionValue::Name(text.to_owned())),
        _ => match parse_setting(text) {
            Ok(Setting::Number(x)) => Some(OptionValue::Number(x)),
            _ => None,
        },
    }
}

/// Sets an option.
///
/// # Safety
/// As the header says: pointers are null or valid, and texts end with a zero byte.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_options_set(
    options: *mut OptionsHandle,
    name: *const c_char,
    value: *const c_char,
) -> c_int {
    call(|| {
        // SAFETY: by the contract of this function.
        let (handle, name, value) =
            unsafe { (output(options, "options")?, text(name, "name")?, text(value, "value")?) };
        let Some(option) = MODEL.iter().find(|option| option.about.name == name) else {
            let names: Vec<&str> = MODEL.iter().map(|option| option.about.name).collect();
            return Err(CallFault::argument(format!("no option `{name}`: there are {}", names.join(", "))));
        };
        let Some(chosen) = option_value(&option.about.range, value) else {
            let expected = option.about.expected();
            return Err(CallFault::argument(format!("{name}: expected {expected}, got \"{value}\"")));
        };
        handle.options.choose(option, chosen).map_err(|error| CallFault::argument(error.to_string()))
    })
}

/// Sets a parameter of the netlist.
///
/// # Safety
/// As the header says: pointers are null or valid, and texts end with a zero byte.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_options_set_parameter(
    options: *mut OptionsHandle,
    name: *const c_char,
    value: *const c_char,
) -> c_int {
    call(|| {
        // SAFETY: by the contract of this function.
        let (handle, name, value) =
            unsafe { (output(options, "options")?, text(name, "name")?, text(value, "value")?) };
        let setting = parse_setting(value).map_err(|e| CallFault::argument(e.to_string().trim_end()))?;
        handle.options.set.push((name.to_owned(), setting));
        Ok(())
    })
}

/// Releases options.
///
/// # Safety
/// `options` is null or a handle that is not used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_options_free(options: *mut OptionsHandle) {
    value((), || {
        // SAFETY: by the contract of this function.
        unsafe { release(options) };
        Ok(())
    });
}
