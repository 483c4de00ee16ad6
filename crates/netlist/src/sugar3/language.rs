//! Functions of Lua's and of numbers that netlists have: bounded, and in an order that is always the same.

use super::super::value::short;
use super::arguments::{called, number};
use super::build::abort;
use super::state::SharedState;
use bimorph_base::budget;
use mlua::{Lua, MultiValue, Table, Value as LuaValue};
use std::f64::consts::PI;
use std::rc::Rc;

/// Items of a table that is gone over by its keys.
const MAX_KEYS: usize = 10_000;

/// A function of one number.
type OfNumber = fn(f64) -> f64;

/// Functions of numbers. Angles are in degrees until `std2cvt.net` is used, then in radians.
pub(super) fn mathematics(lua: &Lua, shared: &SharedState, globals: &Table) -> mlua::Result<()> {
    let plain: [(&str, OfNumber); 8] = [
        ("sqrt", f64::sqrt),
        ("exp", f64::exp),
        ("log", f64::ln),
        ("log10", f64::log10),
        ("floor", f64::floor),
        ("ceil", f64::ceil),
        ("abs", f64::abs),
        ("rad", |x| x * PI / 180.0),
    ];
    for (name, f) in plain {
        globals.raw_set(name, lua.create_function(move |_, x: f64| Ok(whole(f(x))))?)?;
    }
    let of_angles: [(&str, OfNumber); 3] = [("sin", f64::sin), ("cos", f64::cos), ("tan", f64::tan)];
    for (name, f) in of_angles {
        let state = Rc::clone(shared);
        let degrees = move || if state.borrow().radians { 1.0 } else { PI / 180.0 };
        globals.raw_set(name, lua.create_function(move |_, x: f64| Ok(f(x * degrees())))?)?;
    }
    let to_angles: [(&str, OfNumber); 3] = [("asin", f64::asin), ("acos", f64::acos), ("atan", f64::atan)];
    for (name, f) in to_angles {
        let state = Rc::clone(shared);
        let degrees = move || if state.borrow().radians { 1.0 } else { 180.0 / PI };
        globals.raw_set(name, lua.create_function(move |_, x: f64| Ok(f(x) * degrees()))?)?;
    }
    let state = Rc::clone(shared);
    globals.raw_set(
        "atan2",
        lua.create_function(move |_, (y, x): (f64, f64)| {
            let degrees = if state.borrow().radians { 1.0 } else { 180.0 / PI };
            Ok(y.atan2(x) * degrees)
        })?,
    )?;
    // Lua 4's own goes from radians to degrees, that of converted netlists the other way
    let state = Rc::clone(shared);
    globals.raw_set(
        "deg",
        lua.create_function(move |_, x: f64| {
            Ok(if state.borrow().radians { PI * (x / 180.0) } else { x * 180.0 / PI })
        })?,
    )?;
    globals.raw_set("mod", lua.create_function(|_, (a, b): (f64, f64)| Ok(whole(a % b)))?)?;
    let least = |_: &Lua, (a, more): (f64, mlua::Variadic<f64>)| Ok(whole(more.iter().fold(a, |m, x| m.min(*x))));
    let most = |_: &Lua, (a, more): (f64, mlua::Variadic<f64>)| Ok(whole(more.iter().fold(a, |m, x| m.max(*x))));
    globals.raw_set("min", lua.create_function(least)?)?;
    globals.raw_set("max", lua.create_function(most)?)
}

/// A whole number as Lua's integer, so that it is spelled without a point.
fn whole(x: f64) -> LuaValue {
    if x.fract() == 0.0 && x.abs() < 1e15 { LuaValue::Integer(x as i64) } else { LuaValue::Number(x) }
}

/// Functions of the language itself that run in bounded steps and in an order that is always the same.
pub(super) fn language(lua: &Lua, shared: &SharedState, globals: &Table) -> mlua::Result<()> {
    globals.raw_set("isdef", lua.create_function(|_, x: LuaValue| Ok(!matches!(x, LuaValue::Nil)))?)?;
    globals.raw_set("tostring", lua.create_function(|_, x: LuaValue| Ok(shown(&x)))?)?;
    globals.raw_set("strlen", lua.create_function(|_, x: mlua::String| Ok(x.as_bytes().len()))?)?;
    globals.raw_set("getn", lua.create_function(|_, t: Table| Ok(t.raw_len()))?)?;
    globals.raw_set(
        "tinsert",
        lua.create_function(|_, (t, x): (Table, LuaValue)| {
            let next = t.raw_len() + 1;
            t.raw_set(next, x)
        })?,
    )?;
    let state = Rc::clone(shared);
    globals.raw_set(
        "print",
        lua.create_function(move |lua, values: MultiValue| {
            let mut state = state.borrow_mut();
            let span = state.here(lua);
            let line: Vec<String> = values.iter().map(shown).collect();
            state.sink.output("W002", span, format!("print: {}", line.join(" ")));
            Ok(())
        })?,
    )?;
    let state = Rc::clone(shared);
    globals.raw_set(
        "assert",
        lua.create_function(move |lua, (truth, text): (LuaValue, Option<mlua::String>)| {
            if !matches!(truth, LuaValue::Nil | LuaValue::Boolean(false)) {
                return Ok(truth);
            }
            Err(gives_up(lua, &state, text.map(|text| text.to_string_lossy()), "assert"))
        })?,
    )?;
    let state = Rc::clone(shared);
    globals.raw_set(
        "error",
        lua.create_function(move |lua, text: Option<mlua::String>| -> mlua::Result<()> {
            Err(gives_up(lua, &state, text.map(|text| text.to_string_lossy()), "error"))
        })?,
    )?;
    for name in ["pairs", "each", "ipairs"] {
        globals.raw_set(name, lua.create_function(each)?)?;
    }
    Ok(())
}

/// The netlist's own `assert` or `error`.
fn gives_up(lua: &Lua, shared: &SharedState, text: Option<String>, which: &str) -> mlua::Error {
    let mut state = shared.borrow_mut();
    let span = state.here(lua);
    let text = text.unwrap_or_else(|| format!("`{which}` without a text"));
    state.sink.error("E042", span, text, format!("the netlist's own `{which}` failed"));
    abort(&state)
}

/// Goes over a table by its keys in order: numbers first, then names. A function, as other iterators are, passes.
fn each(lua: &Lua, (value, rest): (LuaValue, MultiValue)) -> mlua::Result<MultiValue> {
    let LuaValue::Table(table) = value else {
        let mut all = rest;
        all.push_front(value);
        return Ok(all);
    };
    let mut keys = Vec::new();
    let long = || mlua::Error::runtime(format!("a table of more than {MAX_KEYS} items; go over it by numbers"));
    for pair in table.pairs::<LuaValue, LuaValue>() {
        budget::check();
        keys.push(pair?.0);
        if keys.len() > MAX_KEYS {
            return Err(long());
        }
    }
    let order = |key: &LuaValue| match key {
        LuaValue::String(name) => (1, 0.0, name.to_string_lossy()),
        other => (u8::from(number(other).is_none()) * 2, number(other).unwrap_or(0.0), String::new()),
    };
    keys.sort_by(|a, b| {
        let (a, b) = (order(a), order(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2))
    });
    let mut keys = keys.into_iter();
    let held = std::cell::RefCell::new(move || keys.next());
    let next = lua.create_function(move |_, _: MultiValue| {
        let Some(key) = (held.borrow_mut())() else { return Ok((LuaValue::Nil, LuaValue::Nil)) };
        let value: LuaValue = table.raw_get(key.clone())?;
        Ok((key, value))
    })?;
    Ok(MultiValue::from_iter([LuaValue::Function(next)]))
}

/// A value as text, the same in every run.
pub(super) fn shown(value: &LuaValue) -> String {
    match (number(value), value) {
        (Some(x), _) => short(x),
        (_, LuaValue::String(text)) => text.to_string_lossy(),
        (_, LuaValue::Boolean(truth)) => truth.to_string(),
        (_, LuaValue::Nil) => "nil".to_owned(),
        (_, other) => called(other).trim_start_matches("a ").to_owned(),
    }
}
