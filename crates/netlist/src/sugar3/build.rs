//! Elements and nodes built so far: counted, named, and limited.

use super::super::source::TextSpan;
use super::state::LuaState;
use bimorph_base::budget;

/// Elements and nodes that one netlist may build.
const MAX_ELEMENTS: usize = 300_000;

/// A message was put into the sink, and the netlist cannot continue.
pub(super) fn abort(state: &LuaState) -> mlua::Error {
    state.reported.set(true);
    mlua::Error::runtime("reported")
}

/// Counts what is drawn, and ends it where it is too much.
pub(super) fn bounded(state: &mut LuaState) -> mlua::Result<()> {
    let drawn = state.elements.max(state.drawing.structure.nodes.len());
    if drawn > MAX_ELEMENTS {
        let message = format!("the netlist builds more than {MAX_ELEMENTS} elements or nodes");
        state.sink.error("E046", TextSpan::NOWHERE, message, "look for a loop without end");
        return Err(abort(state));
    }
    Ok(())
}

impl LuaState {
    /// Notes an element's or instance's name, and warns of a second one.
    pub(super) fn name(&mut self, full: &str, given: bool, span: TextSpan) {
        use super::super::drawing::{ELEMENT_BYTES, NAME_COPIES};
        budget::lay_out(ELEMENT_BYTES + NAME_COPIES * full.len());
        if given && !self.names.insert(full.to_owned()) {
            let message = format!("there is an element `{full}` already");
            self.sink.warning("W007", span, message, "give each its own name, so that results can be distinguished");
        }
    }
}
