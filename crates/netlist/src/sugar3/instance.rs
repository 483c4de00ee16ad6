//! Instances of subnets.

use super::arguments::plain;
use super::build::{abort, bounded};
use super::state::{NameScope, SharedState};
use bimorph_base::budget;
use mlua::{Function, Lua, MultiValue, Table, Value as LuaValue};
use std::collections::HashMap;
use std::f64::consts::PI;

/// Subnet instances may nest this deep.
const DEEPEST_INSTANCE: usize = 100;

/// An instance of a subnet: named arguments, a scope of its own for nodes, its angles.
pub(super) fn subnet(
    lua: &Lua,
    shared: &SharedState,
    model: &str,
    formals: &[String],
    body: &Function,
    table: &Table,
) -> mlua::Result<()> {
    budget::check();
    {
        let mut state = shared.borrow_mut();
        let span = state.here(lua);
        if state.scopes.len() > DEEPEST_INSTANCE {
            let message =
                format!("subnet instances nest more than {DEEPEST_INSTANCE} deep: `{model}` calls itself without end");
            state.sink.error("E052", span, message, "end the recursion with an `if`");
            return Err(abort(&state));
        }
        state.elements += 1;
        state.progress.drawn.set(state.progress.drawn.get() + 1);
        bounded(&mut state)?;
        let name = table.raw_get::<Option<mlua::String>>("name")?.map(|name| plain(&name.to_string_lossy()));
        let given = name.is_some();
        let local = name.unwrap_or_else(|| {
            state.anonymous += 1;
            format!("anon{}", state.anonymous)
        });
        let degree = if state.radians { 1.0 } else { PI / 180.0 };
        let mut angles = [0.0; 3];
        for (angle, axis) in angles.iter_mut().zip(["ox", "oy", "oz"]) {
            *angle = table.raw_get::<Option<f64>>(axis)?.unwrap_or(0.0) * degree;
            if !angle.is_finite() {
                let message = format!("`{axis}` must be a finite number, this is {angle}");
                state.sink.error("E050", span, message, "");
                return Err(abort(&state));
            }
        }
        let full = format!("{}{local}", state.scope().prefix);
        state.name(&full, given, span);
        let rotation = state.scope().rotation.turned(angles[0], angles[1], angles[2]);
        state.sink.instances.push(full.clone());
        state.scopes.push(NameScope { nodes: HashMap::new(), prefix: format!("{full}."), rotation });
    }
    let globals = lua.globals();
    let outer: LuaValue = globals.raw_get("_currnodes")?;
    globals.raw_set("_currnodes", lua.create_table()?)?;
    let mut arguments = MultiValue::with_capacity(formals.len() + 1);
    for (k, formal) in formals.iter().enumerate() {
        let named: LuaValue = table.raw_get(formal.as_str())?;
        arguments.push_back(if matches!(named, LuaValue::Nil) { table.raw_get(k + 1)? } else { named });
    }
    arguments.push_back(LuaValue::Table(table.clone()));
    body.call::<()>(arguments)?;
    globals.raw_set("_currnodes", outer)?;
    let mut state = shared.borrow_mut();
    state.scopes.pop();
    state.sink.instances.pop();
    Ok(())
}
