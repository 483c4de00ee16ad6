//! Statics and modes.

use crate::fault::{CallFault, call};
use crate::memory::{fill, place, reference, texts};
use crate::model::ModelHandle;
use bimorph::analysis::mesh::{modes_fitted, static_fitted};
use bimorph::readout::expression::Expression;
use std::ffi::{c_char, c_int};

/// Static equilibrium.
///
/// # Safety
/// As the header says: pointers are null or valid for the stated lengths.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_statics(
    model: *const ModelHandle,
    volts: *const f64,
    names: *const *const c_char,
    count: usize,
    values: *mut f64,
    jumped: *mut c_int,
) -> c_int {
    call(|| {
        // SAFETY: by the contract of this function.
        let (model, names) = unsafe { (reference(model, "model")?, texts(names, count, "names")?) };
        if count > 0 {
            place(values, "values")?;
        }
        // SAFETY: by the contract of this function.
        let voltages = unsafe { model.voltages(volts) }?;
        let (_, result, _) = static_fitted(&model.drawn, &voltages)?;
        let found = names.iter().map(|name| Ok(Expression::of_static(&result, name)?.value()));
        let found = found.collect::<Result<Vec<f64>, CallFault>>()?;
        // SAFETY: by the contract of this function.
        unsafe { fill(values, &found) };
        // SAFETY: by the contract of this function.
        unsafe { fill(jumped, &[c_int::from(result.jumped)]) };
        Ok(())
    })
}

/// Lowest natural frequencies.
///
/// # Safety
/// As the header says: pointers are null or valid for the stated lengths.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn bimorph_modes(
    model: *const ModelHandle,
    volts: *const f64,
    count: usize,
    frequencies_hz: *mut f64,
    errors: *mut f64,
) -> c_int {
    call(|| {
        // SAFETY: by the contract of this function.
        let (model, _) = unsafe { (reference(model, "model")?, place(frequencies_hz, "frequencies_hz")?) };
        // SAFETY: by the contract of this function.
        let voltages = unsafe { model.voltages(volts) }?;
        if count == 0 {
            return Err(CallFault::argument("count: expected at least 1, got 0"));
        }
        let (_, result, _) = modes_fitted(&model.drawn, count, &voltages)?;
        if result.frequencies_hz.len() != count {
            let found = result.frequencies_hz.len();
            return Err(CallFault::argument(format!("count: the model has {found} modes, expected at most as many")));
        }
        let relative: Vec<f64> = result.errors.iter().map(|error| error.unwrap_or(f64::NAN)).collect();
        // SAFETY: by the contract of this function; both have `count` values.
        unsafe { fill(frequencies_hz, &result.frequencies_hz) };
        // SAFETY: by the contract of this function; both have `count` values.
        unsafe { fill(errors, &relative[..count.min(relative.len())]) };
        Ok(())
    })
}
