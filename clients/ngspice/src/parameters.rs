//! The parameters of a `.model` line as ngspice holds them.

use crate::abi::{Parameter, ParameterValue};
use crate::call::text;
use crate::deck_options::{DeckValue, declared};
use crate::model_card::RawCard;
use crate::table::OWN_COUNT;
use std::ffi::c_int;

/// Reads a `.model` line's parameters, in the order in which [`crate::table`] declares them.
///
/// # Safety
/// `param` points to the model's `count` parameters, as set up by the host.
pub(crate) unsafe fn card(param: *mut *mut Parameter, count: c_int) -> RawCard {
    // SAFETY: by contract each slot below `count` points to a parameter.
    let slot = |n: usize| unsafe {
        (n < count as usize).then(|| &**param.add(n)).filter(|p| p.is_null == 0 && !p.element.is_null() && p.size > 0)
    };
    let value = |n: usize, i: usize| -> Option<&ParameterValue> {
        // SAFETY: a given parameter has `size` elements.
        slot(n).filter(|p| i < p.size as usize).map(|p| unsafe { &*p.element.add(i) })
    };
    // SAFETY: these parameters are strings, and the host keeps strings ended by a zero byte.
    let string = |n, i| value(n, i).and_then(|v| unsafe { text(v.string) });
    let strings = |n| (0..slot(n).map_or(0, |p| p.size as usize)).filter_map(|i| string(n, i)).collect();
    // SAFETY: these parameters are reals.
    let real = |n| value(n, 0).map(|v| unsafe { v.real });
    // SAFETY: these parameters are booleans.
    let flag = |n| value(n, 0).map(|v| unsafe { v.flag } != 0);
    RawCard {
        file: string(0, 0),
        ports: strings(1),
        monitors: strings(2),
        set: strings(3),
        remote: string(4, 0),
        deadline: real(5),
        noise: flag(6),
        seed: real(7),
        noise_band: real(8),
        options: (declared().iter().zip(OWN_COUNT..))
            .map(|(declared, n)| match declared.default {
                DeckValue::Flag(_) => flag(n).map(DeckValue::Flag),
                DeckValue::Number(_) => real(n).map(DeckValue::Number),
                DeckValue::Text(_) => string(n, 0).map(DeckValue::Text),
            })
            .collect(),
    }
}
