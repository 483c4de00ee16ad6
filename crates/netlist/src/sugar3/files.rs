//! Files of a SUGAR 3 netlist, and those that they use.

use super::super::includes::MAX_INCLUDES;
use super::super::source::TextSpan;
use super::state::{IndexedText, SharedState};
use super::translate::translate;
use mlua::{ChunkMode, Lua};
use std::rc::Rc;

/// Libraries of SUGAR 3 that are built in.
const BUILT_IN: [&str; 7] =
    ["std.net", "std2.net", "stdlib.net", "std2cvt.net", "xformstack.lua", "relpos.lua", "subnetize.lua"];

/// Makes functions known to a netlist.
pub(super) type Install = fn(&Lua, &SharedState) -> mlua::Result<()>;

/// Runs a file of the bundle.
pub(super) fn run(lua: &Lua, shared: &SharedState, name: &str) -> mlua::Result<()> {
    let (number, text) = {
        let state = shared.borrow();
        (state.texts.len(), state.bundle.files.get(name).cloned().unwrap_or_default())
    };
    let starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
    let translated = translate(&text);
    {
        let mut state = shared.borrow_mut();
        if number > 0 {
            state.sink.files.push(name.to_owned());
        }
        state.texts.push(Rc::new(IndexedText { starts, text }));
        if let Err(found) = &translated {
            let at = |offset: usize| u32::try_from(offset).unwrap_or(u32::MAX);
            let file = u16::try_from(number).unwrap_or(u16::MAX);
            let span = TextSpan { file, start: at(found.start), end: at(found.end) };
            state.sink.error("E071", span, found.message.clone(), found.help);
            state.reported.set(true);
        }
    }
    let Ok(code) = translated else { return Err(mlua::Error::runtime("reported")) };
    lua.load(code).set_name(format!("=file {number}")).set_mode(ChunkMode::Text).exec()
}

/// `use("FILE")`: a library of SUGAR 3's, which `short` makes known, or a file of the bundle, once.
pub(super) fn use_file(lua: &Lua, shared: &SharedState, name: &str, short: Install) -> mlua::Result<()> {
    let span = shared.borrow().here(lua);
    let stopped = || Err(mlua::Error::runtime("reported"));
    {
        let mut state = shared.borrow_mut();
        if BUILT_IN.contains(&name) {
            state.radians |= name == "std2cvt.net";
            drop(state);
            return if name == "stdlib.net" { short(lua, shared) } else { Ok(()) };
        }
        if state.used.contains(name) {
            if name == state.bundle.root {
                state.sink.error("E022", span, format!("`{name}` includes itself"), "remove this line");
                state.reported.set(true);
                return stopped();
            }
            return Ok(());
        }
        if !state.bundle.files.contains_key(name) {
            let help = "it is looked for in this file's folder, the working directory and the include folders";
            state.sink.error("E021", span, format!("cannot find the file `{name}`"), help);
            state.reported.set(true);
            return stopped();
        }
        if state.used.len() > MAX_INCLUDES {
            state.sink.error("E024", span, format!("more than {MAX_INCLUDES} included files"), "");
            state.reported.set(true);
            return stopped();
        }
        state.used.insert(name.to_owned());
    }
    let sugar2 = |line: &str| ["process ", "uses ", "param "].iter().any(|word| line.trim_start().starts_with(word));
    if shared.borrow().bundle.files[name].lines().any(sugar2) {
        let mut state = shared.borrow_mut();
        let message = format!("`{name}` is a SUGAR 2 file, this is a SUGAR 3 netlist");
        state.sink.error("E071", span, message, "use the process file of SUGAR 3: `p1 = material {h=2u, …}`");
        state.reported.set(true);
        return stopped();
    }
    run(lua, shared, name)
}
