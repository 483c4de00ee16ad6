//! Arguments of a call in a SUGAR 3 netlist: `{A, B, material; l=100u, oz=90}`.

use super::super::elements;
use super::super::value::Value;
use bimorph_structure::{NodeId, PropertyCurve};
use mlua::{Table, UserData, UserDataFields, Value as LuaValue};
use std::sync::Arc;

/// A node as Lua holds it.
#[derive(Debug, Clone)]
pub(super) struct LuaNode {
    pub(super) id: NodeId,
    /// Full name.
    pub(super) name: String,
}

impl UserData for LuaNode {
    fn add_fields<F: UserDataFields<Self>>(fields: &mut F) {
        fields.add_field_method_get("name", |_, node| Ok(node.name.clone()));
    }
}

/// The arguments of an element.
#[derive(Debug, Default)]
pub(super) struct ElementCall {
    pub(super) name: Option<String>,
    pub(super) model: Option<String>,
    pub(super) nodes: Vec<NodeId>,
    /// Angles ox, oy, oz as given.
    pub(super) angles: [f64; 3],
    /// Parameters by name, in the order of names.
    pub(super) given: Vec<(String, Value)>,
    /// Entries of the material, in the order of names.
    pub(super) material: Vec<(String, Value)>,
}

/// Why a call cannot be understood.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Fault {
    pub(super) code: &'static str,
    pub(super) message: String,
    pub(super) help: &'static str,
}

/// Items of one call or material, since each element searches them.
const MAX_ITEMS: usize = 1000;

/// Words of a call that are no parameters.
const APART: [&str; 4] = ["rot", "parent", "wrapmf", "material"];

impl ElementCall {
    /// Reads a table: nodes (and the material) by position, parameters by name.
    pub(super) fn read(table: &Table) -> mlua::Result<Result<Self, Fault>> {
        let mut call = Self::default();
        let long = || {
            let message = format!("a table of more than {MAX_ITEMS} items");
            Err(Fault { code: "E018", message, help: "split the element, or name what it takes" })
        };
        if table.raw_len() > MAX_ITEMS {
            return Ok(long());
        }
        let mut material = table.raw_get::<LuaValue>("material")?;
        for position in 1..=table.raw_len() {
            match table.raw_get::<LuaValue>(position)? {
                LuaValue::UserData(data) if data.is::<LuaNode>() => call.nodes.push(data.borrow::<LuaNode>()?.id),
                LuaValue::Table(found) if matches!(material, LuaValue::Nil) => material = LuaValue::Table(found),
                other => {
                    let message = format!("item {position} is {}, not a node or a material", called(&other));
                    let help = "write `node \"NAME\"`, or give the value a name: `l=100u`";
                    return Ok(Err(Fault { code: "E050", message, help }));
                }
            }
        }
        for pair in table.pairs::<LuaValue, LuaValue>() {
            let (LuaValue::String(key), value) = pair? else { continue };
            let key = key.to_string_lossy();
            if APART.contains(&key.as_str()) {
                continue;
            }
            let value = match value {
                LuaValue::Integer(x) => Value::Number(x as f64),
                LuaValue::Number(x) => Value::Number(x),
                LuaValue::Boolean(truth) => truth.into(),
                LuaValue::String(text) => Value::Text(text.to_string_lossy().into()),
                other => {
                    let message = format!("`{key}` is {}, not a number", called(&other));
                    return Ok(Err(Fault { code: "E050", message, help: "" }));
                }
            };
            let axis = ["ox", "oy", "oz"].iter().position(|axis| *axis == key);
            match (key.as_str(), axis, &value) {
                ("name", _, Value::Text(name)) => call.name = Some(plain(name)),
                ("model", _, Value::Text(model)) => call.model = Some(model.to_string()),
                (_, Some(_), Value::Number(angle)) if !angle.is_finite() => {
                    let message = format!("`{key}` must be a finite number, this is {angle}");
                    return Ok(Err(Fault { code: "E050", message, help: "" }));
                }
                (_, Some(axis), Value::Number(angle)) => call.angles[axis] = *angle,
                _ => call.given.push((key, value)),
            }
            if call.given.len() > MAX_ITEMS {
                return Ok(long());
            }
        }
        call.given.sort_by(|a, b| a.0.cmp(&b.0));
        match material {
            LuaValue::Nil => {}
            LuaValue::Table(entries) => call.material = numbers(&entries)?,
            other => {
                let message = format!("`material` is {}, not a material", called(&other));
                return Ok(Err(Fault { code: "E031", message, help: "define it: `p1 = material {h=2u, …}`" }));
            }
        }
        Ok(Ok(call))
    }
}

/// The numbers of a table by name, and strings under names of entries, in the order of names.
fn numbers(table: &Table) -> mlua::Result<Vec<(String, Value)>> {
    let mut entries = Vec::new();
    for pair in table.pairs::<LuaValue, LuaValue>() {
        let (LuaValue::String(key), value) = pair? else { continue };
        match (number(&value), value) {
            (Some(x), _) => entries.push((key.to_string_lossy(), Value::Number(x))),
            (None, LuaValue::Table(points)) if elements::CURVES.contains(&key.to_string_lossy().as_str()) => {
                if let Some(table) = pairs(&points)? {
                    let curve = PropertyCurve { table, ..PropertyCurve::default() };
                    entries.push((key.to_string_lossy(), Value::Curve(Arc::new(curve))));
                }
            }
            // an element that reads it says that it is no number
            (None, LuaValue::String(text)) if elements::is_entry(&key.to_string_lossy()) => {
                entries.push((key.to_string_lossy(), Value::Text(text.to_string_lossy().into())));
            }
            _ => {}
        }
        if entries.len() > MAX_ITEMS {
            break;
        }
    }
    entries.sort_by(|a, b| a.0.cmp(&b.0));
    Ok(entries)
}

/// The pairs of numbers in a table of tables; none of any other.
fn pairs(points: &Table) -> mlua::Result<Option<Vec<[f64; 2]>>> {
    let mut found = Vec::new();
    for k in 1..=points.raw_len().min(MAX_ITEMS) {
        let LuaValue::Table(pair) = points.raw_get::<LuaValue>(k)? else { return Ok(None) };
        let [x, y] = [pair.raw_get::<LuaValue>(1)?, pair.raw_get::<LuaValue>(2)?];
        let (Some(x), Some(y)) = (number(&x), number(&y)) else { return Ok(None) };
        found.push([x, y]);
    }
    Ok(Some(found))
}

/// A number, whole or not.
pub(super) fn number(value: &LuaValue) -> Option<f64> {
    match value {
        LuaValue::Integer(x) => Some(*x as f64),
        LuaValue::Number(x) => Some(*x),
        _ => None,
    }
}

/// A name as Lua 4 spells it: whole numbers in it have no decimal point (`"c_" .. 10/2` is `c_5`).
pub(super) fn plain(name: &str) -> String {
    let mut out = String::with_capacity(name.len());
    let mut rest = name;
    while let Some(at) = rest.find(".0") {
        let digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
        let whole = digit(rest[..at].chars().last()) && !digit(rest[at + 2..].chars().next());
        out.push_str(&rest[..at]);
        if !whole {
            out.push_str(".0");
        }
        rest = &rest[at + 2..];
    }
    out + rest
}

/// How messages call a value.
pub(super) fn called(value: &LuaValue) -> &'static str {
    match value {
        LuaValue::Nil => "nothing",
        LuaValue::Boolean(_) => "a truth value",
        LuaValue::Integer(_) | LuaValue::Number(_) => "a number",
        LuaValue::String(_) => "a string",
        LuaValue::Table(_) => "a table",
        LuaValue::Function(_) => "a function",
        LuaValue::UserData(data) if data.is::<LuaNode>() => "a node",
        _ => "no value of a netlist",
    }
}

#[cfg(test)]
mod tests {
    use super::plain;

    /// Whole numbers in names lose their point; other points stay.
    #[test]
    fn names_are_those_of_lua_4() {
        assert_eq!(plain("c_5.0"), "c_5");
        assert_eq!(plain("c_5.0_12.0"), "c_5_12");
        assert_eq!(plain("v1.05 a.0 3.0x"), "v1.05 a.0 3x");
    }
}
