//! The functions of SUGAR 3 netlists: nodes, materials, elements, subnets, and mathematics.

use super::super::elements::{self, Argument, Arguments, Instance, MODELS};
use super::super::sink::Reported;
use super::super::source::Span;
use super::super::sugar2;
use super::super::value::{Value, short};
use super::arguments::{Call, Fault, LuaNode, called, number, plain};
use super::files::use_file;
use super::state::{Scope, Shared, State};
use crate::budget;
use crate::structure::{Load, NodeId};
use mlua::{Function, Lua, MultiValue, Table, Value as LuaValue};
use std::collections::HashMap;
use std::f64::consts::PI;
use std::rc::Rc;
use std::sync::Arc;

/// Subnet instances may nest this deep.
const DEEPEST_INSTANCE: usize = 100;
/// Elements and nodes that one netlist may build.
const MOST_ELEMENTS: usize = 300_000;
/// Items of a table that is gone over by its keys.
const MOST_KEYS: usize = 10_000;
/// Elements whose short names hide common names of variables: they are there after `use "stdlib.net"`.
const SHORT: [&str; 3] = ["R", "L", "C"];
/// Elements that SUGAR 3 alone has, built by `element` only: their names are common names of variables.
pub(super) const OWN: [&str; 3] = ["force", "constraint", "constraint2d"];

/// A message was put into the sink, and the netlist cannot go on.
fn told(state: &State) -> mlua::Error {
    state.told.set(true);
    mlua::Error::runtime("told")
}

/// Puts all functions into a sandbox.
pub(super) fn install(lua: &Lua, shared: &Shared) -> mlua::Result<()> {
    let globals = lua.globals();
    globals.raw_set("pi", PI)?;
    globals.raw_set("PI", PI)?;
    globals.raw_set("_currnodes", lua.create_table()?)?;
    drawing(lua, shared, &globals)?;
    for model in MODELS {
        let build = model_function(lua, shared, model.name)?;
        globals.raw_set(format!("mf{}", model.name), &build)?;
        if !SHORT.contains(&model.name) {
            globals.raw_set(model.name, build)?;
        }
    }
    mathematics(lua, shared, &globals)?;
    language(lua, shared, &globals)?;
    // globals without a value are asked from outside, and remembered
    let watch = lua.create_table()?;
    let state = Rc::clone(shared);
    watch.raw_set(
        "__index",
        lua.create_function(move |lua, (_, key): (Table, LuaValue)| {
            let LuaValue::String(key) = key else { return Ok(LuaValue::Nil) };
            let setting = state.borrow_mut().ask(&key.to_string_lossy());
            Ok(match setting {
                Some(super::super::Setting::Number(x)) => LuaValue::Number(x),
                Some(super::super::Setting::Text(text)) => LuaValue::String(lua.create_string(text)?),
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
pub(super) fn install_short(lua: &Lua, _: &Shared) -> mlua::Result<()> {
    let globals = lua.globals();
    for name in SHORT {
        let build: LuaValue = globals.raw_get(format!("mf{name}"))?;
        globals.raw_set(name, build)?;
    }
    Ok(())
}

fn drawing(lua: &Lua, shared: &Shared, globals: &Table) -> mlua::Result<()> {
    let state = Rc::clone(shared);
    globals
        .raw_set("use", lua.create_function(move |lua, name: String| use_file(lua, &state, &name, install_short))?)?;
    let state = Rc::clone(shared);
    globals.raw_set("node", lua.create_function(move |lua, value: LuaValue| node(lua, &state, &value))?)?;
    let state = Rc::clone(shared);
    globals.raw_set("_n", lua.create_function(move |lua, name: LuaValue| named_node(lua, &state, &name))?)?;
    globals.raw_set("material", lua.create_function(material)?)?;
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
fn node(lua: &Lua, shared: &Shared, value: &LuaValue) -> mlua::Result<LuaNode> {
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
            return Err(told(&state));
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
    let (id, fresh) = state.node(&name, span);
    if let (Some(at), true) = (at, fresh) {
        let (first, origin) = *state.first_placed.get_or_insert((id, at));
        if first != id {
            let way = [at[0] - origin[0], at[1] - origin[1]];
            state.drawing.lay(span, &[first, id], &[[0.0; 2], way]);
        }
    }
    Ok(state.lua_node(id))
}

/// `_n("c_3")` of converted netlists: what `_currnodes` has under that name, else the node.
fn named_node(lua: &Lua, shared: &Shared, name: &LuaValue) -> mlua::Result<LuaValue> {
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
fn material(_: &Lua, table: Table) -> mlua::Result<Table> {
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

fn model_function(lua: &Lua, shared: &Shared, name: &'static str) -> mlua::Result<Function> {
    let state = Rc::clone(shared);
    lua.create_function(move |lua, table: Table| element(lua, &state, Some(name), &table))
}

/// Counts what is drawn, and ends it where it is too much.
fn bounded(state: &mut State) -> mlua::Result<()> {
    let drawn = state.elements.max(state.drawing.structure.nodes.len());
    if drawn > MOST_ELEMENTS {
        let message = format!("the netlist builds more than {MOST_ELEMENTS} elements or nodes");
        state.sink.error("E046", Span::NOWHERE, message, "look for a loop without end");
        return Err(told(state));
    }
    Ok(())
}

/// Builds an element. What is wrong with it is reported, and the netlist goes on.
fn element(lua: &Lua, shared: &Shared, model: Option<&str>, table: &Table) -> mlua::Result<()> {
    budget::check();
    let call = Call::read(table)?;
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

fn build(state: &mut State, model: &str, call: &Call, span: Span) -> Result<(), Reported> {
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
    let layer = call.material.iter().map(|(entry, value)| (entry.as_str(), value.clone())).collect();
    let given = call.given.iter().map(|(name, value)| Argument { name, value: value.clone(), span }).collect();
    let instance = Instance {
        name,
        anonymous: call.name.is_none(),
        model,
        span,
        nodes: call.nodes.clone(),
        nodes_span: span,
        rotation,
        arguments: Arguments { given, layer: Arc::new(layer), layer_name: None },
    };
    elements::build(&instance, &mut state.drawing, &mut state.sink, sugar2::read)
}

/// SUGAR 3's own `force`: x, y [N] and rz [N·m] on a node, global axes.
fn force(state: &mut State, name: String, call: &Call, span: Span) -> Result<(), Reported> {
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

impl State {
    /// Notes an element's or instance's name, and warns of a second one.
    fn name(&mut self, full: &str, given: bool, span: Span) {
        use super::super::drawing::{ELEMENT_BYTES, NAME_COPIES};
        budget::lay_out(ELEMENT_BYTES + NAME_COPIES * full.len());
        if given && !self.names.insert(full.to_owned()) {
            let message = format!("there is an element `{full}` already");
            self.sink.warning("W007", span, message, "give each its own name, so that results can be told apart");
        }
    }
}

/// An instance of a subnet: named arguments, a scope of its own for nodes, its angles.
fn subnet(
    lua: &Lua,
    shared: &Shared,
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
            return Err(told(&state));
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
                return Err(told(&state));
            }
        }
        let full = format!("{}{local}", state.scope().prefix);
        state.name(&full, given, span);
        let rotation = state.scope().rotation.turned(angles[0], angles[1], angles[2]);
        state.sink.instances.push(full.clone());
        state.scopes.push(Scope { nodes: HashMap::new(), prefix: format!("{full}."), rotation });
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

/// A function of one number.
type OfNumber = fn(f64) -> f64;

/// Functions of numbers. Angles are in degrees until `std2cvt.net` is used, then in radians.
fn mathematics(lua: &Lua, shared: &Shared, globals: &Table) -> mlua::Result<()> {
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
fn language(lua: &Lua, shared: &Shared, globals: &Table) -> mlua::Result<()> {
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
fn gives_up(lua: &Lua, shared: &Shared, text: Option<String>, which: &str) -> mlua::Error {
    let mut state = shared.borrow_mut();
    let span = state.here(lua);
    let text = text.unwrap_or_else(|| format!("`{which}` without a text"));
    state.sink.error("E042", span, text, format!("the netlist's own `{which}` failed"));
    told(&state)
}

/// Goes over a table by its keys in order: numbers first, then names. A function, as other iterators are, passes.
fn each(lua: &Lua, (value, rest): (LuaValue, MultiValue)) -> mlua::Result<MultiValue> {
    let LuaValue::Table(table) = value else {
        let mut all = rest;
        all.push_front(value);
        return Ok(all);
    };
    let mut keys = Vec::new();
    let long = || mlua::Error::runtime(format!("a table of more than {MOST_KEYS} items; go over it by numbers"));
    for pair in table.pairs::<LuaValue, LuaValue>() {
        budget::check();
        keys.push(pair?.0);
        if keys.len() > MOST_KEYS {
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
fn shown(value: &LuaValue) -> String {
    match (number(value), value) {
        (Some(x), _) => short(x),
        (_, LuaValue::String(text)) => text.to_string_lossy(),
        (_, LuaValue::Boolean(truth)) => truth.to_string(),
        (_, LuaValue::Nil) => "nil".to_owned(),
        (_, other) => called(other).trim_start_matches("a ").to_owned(),
    }
}
