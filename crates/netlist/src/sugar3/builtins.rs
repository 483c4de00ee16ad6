//! The functions of SUGAR 3 netlists: nodes, materials, elements, subnets, and mathematics.

use super::super::diagnostic_sink::Reported;
use super::super::elements::{self, Argument, Arguments, ElementInstance};
use super::super::source::TextSpan;
use super::super::sugar2;
use super::super::value::{Value, short};
use super::arguments::{ElementCall, Fault, LuaNode, called, plain};
use super::build::{abort, bounded};
use super::files::use_file;
use super::instance::subnet;
use super::language::{language, mathematics, shown};
use super::state::{LuaState, SharedState};
use bimorph_base::budget;
use bimorph_structure::{Load, NodeId};
use mlua::{Function, Lua, Table, Value as LuaValue};
use std::collections::hash_map::Entry;
use std::f64::consts::PI;
use std::rc::Rc;
use std::sync::Arc;

/// Elements whose short names hide common names of variables: they are there after `use "stdlib.net"`.
const SHORT: [&str; 3] = ["R", "L", "C"];
/// Elements that SUGAR 3 alone has, built by `element` only: their names are common names of variables.
pub(super) const OWN: [&str; 3] = ["force", "constraint", "constraint2d"];

/// Puts all functions into a sandbox.
pub(super) fn install(lua: &Lua, shared: &SharedState) -> mlua::Result<()> {
    let globals = lua.globals();
    globals.raw_set("pi", PI)?;
    globals.raw_set("PI", PI)?;
    globals.raw_set("_currnodes", lua.create_table()?)?;
    drawing(lua, shared, &globals)?;
    for model in elements::models() {
        let build = model_function(lua, shared, model.name)?;
        globals.raw_set(format!("mf{}", model.name), &build)?;
        if !SHORT.contains(&model.name) {
            globals.raw_set(model.name, build)?;
        }
    }
    mathematics(lua, shared, &globals)?;
    language(lua, shared, &globals)?;
    // globals without a value are taken from the settings, and cached
    let watch = lua.create_table()?;
    let state = Rc::clone(shared);
    watch.raw_set(
        "__index",
        lua.create_function(move |lua, (_, key): (Table, LuaValue)| {
            let LuaValue::String(key) = key else { return Ok(LuaValue::Nil) };
            let setting = state.borrow_mut().ask(&key.to_string_lossy());
            Ok(match setting {
                Some(bimorph_base::Setting::Number(x)) => LuaValue::Number(x),
                Some(bimorph_base::Setting::Text(text)) => LuaValue::String(lua.create_string(text)?),
                None => LuaValue::Nil,
            })
        })?,
    )?;
    let state = Rc::clone(shared);
    watch.raw_set(
        "__newindex",
        lua.create_function(move |_, (globals, key, value): (Table, LuaValue, LuaValue)| {
            if let LuaValue::String(name) = &key {
                state.borrow_mut().assign(&name.to_string_lossy(), &value);
            }
            globals.raw_set(key, value)
        })?,
    )?;
    globals.set_metatable(Some(watch))
}

/// The short names of circuit elements.
pub(super) fn install_short(lua: &Lua, _: &SharedState) -> mlua::Result<()> {
    let globals = lua.globals();
    for name in SHORT {
        let build: LuaValue = globals.raw_get(format!("mf{name}"))?;
        globals.raw_set(name, build)?;
    }
    Ok(())
}

fn drawing(lua: &Lua, shared: &SharedState, globals: &Table) -> mlua::Result<()> {
    let state = Rc::clone(shared);
    globals
        .raw_set("use", lua.create_function(move |lua, name: String| use_file(lua, &state, &name, install_short))?)?;
    let state = Rc::clone(shared);
    globals.raw_set("node", lua.create_function(move |lua, value: LuaValue| node(lua, &state, &value))?)?;
    let state = Rc::clone(shared);
    globals.raw_set("_n", lua.create_function(move |lua, name: LuaValue| named_node(lua, &state, &name))?)?;
    let state = Rc::clone(shared);
    globals.raw_set("material", lua.create_function(move |lua, table: Table| material(lua, &state, table))?)?;
    let state = Rc::clone(shared);
    globals.raw_set("element", lua.create_function(move |lua, table: Table| element(lua, &state, None, &table))?)?;
    let state = Rc::clone(shared);
    globals.raw_set(
        "subnetize",
        lua.create_function(move |lua, (name, formals, body): (String, String, Function)| {
            let formals: Vec<String> = formals.split(',').filter(|f| !f.is_empty()).map(str::to_owned).collect();
            let state = Rc::clone(&state);
            lua.create_function(move |lua, table: Table| subnet(lua, &state, &name, &formals, &body, &table))
        })?,
    )?;
    let state = Rc::clone(shared);
    globals.raw_set(
        "relpos_add",
        lua.create_function(move |lua, (a, b, way): (LuaValue, LuaValue, Table)| {
            let (Some(a), Some(b)) = (node_of(&a), node_of(&b)) else { return Ok(()) };
            let way = [way.raw_get::<f64>(1).unwrap_or(0.0), way.raw_get::<f64>(2).unwrap_or(0.0)];
            let mut state = state.borrow_mut();
            let span = state.here(lua);
            state.drawing.lay(span, &[a, b], &[[0.0; 2], way]);
            Ok(())
        })?,
    )?;
    // positions are found when all is drawn
    globals.raw_set("relpos_treewalk", lua.create_function(|_, ()| Ok(()))?)
}

fn node_of(value: &LuaValue) -> Option<NodeId> {
    let LuaValue::UserData(data) = value else { return None };
    data.borrow::<LuaNode>().ok().map(|node| node.id)
}

/// `node "A"`, `node {name="A"}`, `node {x, y, z; name="A"}`.
fn node(lua: &Lua, shared: &SharedState, value: &LuaValue) -> mlua::Result<LuaNode> {
    let mut state = shared.borrow_mut();
    let span = state.here(lua);
    let (name, at) = match value {
        LuaValue::String(name) => (Some(name.to_string_lossy()), None),
        LuaValue::Table(table) => {
            let name = table.raw_get::<Option<mlua::String>>("name")?.map(|name| name.to_string_lossy());
            let coordinate = |k: i64| table.raw_get::<Option<f64>>(k);
            (name, coordinate(1)?.map(|x| coordinate(2).map(|y| [x, y.unwrap_or(0.0)])).transpose()?)
        }
        other => {
            let message = format!("a node takes a name, this is {}", called(other));
            state.sink.error("E050", span, message, "write `node \"A\"` or `node {0, 0, 0; name=\"A\"}`");
            return Err(abort(&state));
        }
    };
    let name = match name {
        Some(name) => plain(&name),
        None => {
            state.anonymous += 1;
            format!("anon{}", state.anonymous)
        }
    };
    bounded(&mut state)?;
    let id = state.node(&name, span);
    if let Some(at) = at {
        lie(&mut state, id, at, span);
    }
    Ok(state.lua_node(id))
}

/// Notes the coordinates of a node (m); the first ones hold.
fn lie(state: &mut LuaState, id: NodeId, at: [f64; 2], span: TextSpan) {
    match state.coordinates.entry(id) {
        Entry::Occupied(known) if *known.get() != at => {
            let name = &state.drawing.structure.nodes[id.0].name;
            let [x, y] = known.get().map(short);
            let message = format!("the node `{name}` lies at ({x}, {y}) already: these coordinates are left out");
            state.sink.warning("W011", span, message, "give it another name, or no coordinates here");
        }
        Entry::Occupied(_) => {}
        Entry::Vacant(place) => {
            place.insert(at);
            let (first, origin) = *state.first_placed.get_or_insert((id, at));
            if first != id {
                let way = [at[0] - origin[0], at[1] - origin[1]];
                state.drawing.lay(span, &[first, id], &[[0.0; 2], way]);
            }
        }
    }
}

/// `_n("c_3")` of converted netlists: the entry of `_currnodes` with that name, else the node.
fn named_node(lua: &Lua, shared: &SharedState, name: &LuaValue) -> mlua::Result<LuaValue> {
    let nodes: LuaValue = lua.globals().raw_get("_currnodes")?;
    if let LuaValue::Table(nodes) = nodes {
        let found: LuaValue = nodes.raw_get(name.clone())?;
        if !matches!(found, LuaValue::Nil) {
            return Ok(found);
        }
    }
    let name = match name {
        LuaValue::Integer(_) | LuaValue::Number(_) => LuaValue::String(lua.create_string(shown(name))?),
        other => other.clone(),
    };
    Ok(LuaValue::UserData(lua.create_userdata(node(lua, shared, &name)?)?))
}

/// `material {parent=p, h=2u}`: its own entries before those of its parent.
fn material(lua: &Lua, shared: &SharedState, table: Table) -> mlua::Result<Table> {
    let mut slips = Vec::new();
    for pair in table.pairs::<LuaValue, LuaValue>().take(1000) {
        if let (LuaValue::String(key), LuaValue::Integer(_) | LuaValue::Number(_)) = pair? {
            let name = key.to_string_lossy();
            slips.extend(elements::meant_entry(&name).map(|meant| (name, meant)));
        }
    }
    slips.sort();
    if let Some((name, meant)) = slips.first() {
        let mut state = shared.borrow_mut();
        let span = state.here(lua);
        let message = format!("no element reads `{name}` of this material");
        state.sink.warning("W004", span, message, format!("did you mean `{meant}`?"));
    }
    if let LuaValue::Table(parent) = table.raw_get::<LuaValue>("parent")? {
        for (count, pair) in parent.pairs::<LuaValue, LuaValue>().enumerate() {
            let (key, value) = pair?;
            if count > 1000 {
                return Err(mlua::Error::runtime("a material of more than 1000 entries"));
            }
            if matches!(table.raw_get::<LuaValue>(key.clone())?, LuaValue::Nil) {
                table.raw_set(key, value)?;
            }
        }
    }
    Ok(table)
}

fn model_function(lua: &Lua, shared: &SharedState, name: &'static str) -> mlua::Result<Function> {
    let state = Rc::clone(shared);
    lua.create_function(move |lua, table: Table| element(lua, &state, Some(name), &table))
}

/// Builds an element. Errors are reported, and the netlist continues.
fn element(lua: &Lua, shared: &SharedState, model: Option<&str>, table: &Table) -> mlua::Result<()> {
    budget::check();
    let call = ElementCall::read(table)?;
    let mut state = shared.borrow_mut();
    let span = state.here(lua);
    state.elements += 1;
    state.progress.drawn.set(state.progress.drawn.get() + 1);
    bounded(&mut state)?;
    let call = match call {
        Ok(call) => call,
        Err(Fault { code, message, help }) => {
            state.sink.error(code, span, message, help);
            return Ok(());
        }
    };
    let wrapped = table.raw_get::<Option<mlua::String>>("wrapmf")?.map(|name| name.to_string_lossy());
    let named = wrapped.or_else(|| model.map(str::to_owned)).or_else(|| call.model.clone());
    let Some(named) = named else {
        state.sink.error(
            "E015",
            span,
            "an element without `model`".into(),
            "write `element {A, B; model=\"beam2d\", …}`",
        );
        return Ok(());
    };
    let model = named.strip_prefix("MF_").unwrap_or(&named);
    if elements::model(model).is_none() && !OWN.contains(&model) {
        elements::unknown(&mut state.sink, model, span, []);
        return Ok(());
    }
    let _ = build(&mut state, model, &call, span);
    Ok(())
}

fn build(state: &mut LuaState, model: &str, call: &ElementCall, span: TextSpan) -> Result<(), Reported> {
    let degree = if state.radians { 1.0 } else { PI / 180.0 };
    let [ox, oy, oz] = call.angles.map(|angle| angle * degree);
    let rotation = state.scope().rotation.turned(ox, oy, oz);
    let local = match &call.name {
        Some(name) => name.clone(),
        None => {
            state.anonymous += 1;
            format!("anon{}", state.anonymous)
        }
    };
    let name = format!("{}{local}", state.scope().prefix);
    state.name(&name, call.name.is_some(), span);
    if model == "force" {
        return force(state, name, call, span);
    }
    // SUGAR 3's rigid link between nodes that lie where others place them
    let model = if OWN.contains(&model) { "link2d" } else { model };
    let layer: Vec<_> = call.material.iter().map(|(entry, value)| (entry.as_str(), value.clone())).collect();
    let value = |name: &str, value: &Value| match value {
        Value::Number(angle) if elements::turns(name) => Value::Number(angle * degree),
        value => value.clone(),
    };
    let given = call.given.iter().map(|(name, given)| Argument { name, value: value(name, given), span }).collect();
    let instance = ElementInstance {
        name,
        anonymous: call.name.is_none(),
        model,
        span,
        nodes: call.nodes.clone(),
        nodes_span: span,
        rotation,
        arguments: Arguments { given, layer: Arc::new(layer.into()), layer_name: None },
    };
    elements::build(&instance, &mut state.drawing, &mut state.sink, sugar2::read)
}

/// SUGAR 3's own `force`: x, y (N) and rz (N·m) on a node, global axes.
fn force(state: &mut LuaState, name: String, call: &ElementCall, span: TextSpan) -> Result<(), Reported> {
    let [node] = call.nodes[..] else {
        let message = format!("`force` takes 1 node, {} given", call.nodes.len());
        return Err(state.sink.error("E054", span, message, "write `force {A; x=1u}`"));
    };
    let mut parts = [0.0; 3];
    for (name, value) in &call.given {
        match (["x", "y", "rz"].iter().position(|part| part == name), value) {
            (Some(part), Value::Number(x)) => parts[part] = *x,
            _ => {
                let message = format!("`force` keeps x, y and rz: `{name}` is left out");
                state.sink.warning("W020", span, message, "models are planar (x, y, rotation about z)");
            }
        }
    }
    state.drawing.mechanical(&[node]);
    let [x, y, moment] = parts;
    state.drawing.structure.loads.push(Load { name, node, force: [x, y], moment });
    Ok(())
}
