//! Sandbox of a SUGAR 3 netlist: no files, no system, no string patterns with unbounded run time, and bounded
//! instructions, memory and time.
//!
//! The library of Lua is left out but for what runs in bounded steps: a function of Lua's written in C is not interrupted. So there
//! is no `string`, `table`, `coroutine`, `debug`, `os`, `io` and no `load`; `setmetatable` goes too (finalizers run without any
//! limit), and `pcall` (a limit must not be caught).

use bimorph_base::budget;
use mlua::{HookTriggers, Lua, LuaOptions, StdLib, Value, VmState};
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::time::{Duration, Instant};

/// Instructions between two checks.
const EVERY: u32 = 100;
/// Instructions without anything drawn, and more for each byte of text and each element.
const INSTRUCTIONS: usize = 2_000_000;
const INSTRUCTIONS_PER_BYTE: usize = 2;
const INSTRUCTIONS_PER_ELEMENT: usize = 2_000;
/// Memory (byte), the same.
const MEMORY: usize = 8 << 20;
const MEMORY_PER_BYTE: usize = 16;
const MEMORY_PER_ELEMENT: usize = 4 << 10;
/// Time without new elements after which processor time is checked, and the time allowed then. One instruction may copy
/// a string as long as the memory, so that instructions alone do not bound time.
const PATIENCE: Duration = Duration::from_millis(25);
/// Interval between reads of the processor time, which the system provides in a file.
const CLOCK_INTERVAL: Duration = Duration::from_millis(5);
/// Where processor time is not available: the limit on wall-clock time, as a multiple.
const WALL: u32 = 20;

/// Lua functions that remain available.
const LUA_FUNCTIONS: [&str; 3] = ["tonumber", "type", "select"];

/// Why a netlist was stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SandboxLimit {
    Instructions,
    Time,
}

/// Counts of elements and nodes so far, for the limits.
#[derive(Debug, Default)]
pub(super) struct SandboxProgress {
    /// Elements and nodes.
    pub(super) drawn: Cell<usize>,
    /// The limit that was met.
    pub(super) met: Cell<Option<SandboxLimit>>,
    /// Where: chunk and line.
    pub(super) at: RefCell<Option<(String, usize)>>,
}

/// A fresh Lua for a netlist of so many bytes.
pub(super) fn sandbox(bytes: usize, progress: &Rc<SandboxProgress>) -> mlua::Result<Lua> {
    let lua = Lua::new_with(StdLib::NONE, LuaOptions::new().catch_rust_panics(false))?;
    let globals = lua.globals();
    let mut names = Vec::new();
    for pair in globals.pairs::<String, Value>() {
        names.push(pair?.0);
    }
    for name in names.into_iter().filter(|name| !LUA_FUNCTIONS.contains(&name.as_str())) {
        globals.raw_set(name, Value::Nil)?;
    }
    let memory = MEMORY + MEMORY_PER_BYTE * bytes;
    lua.set_memory_limit(memory)?;
    let progress = Rc::clone(progress);
    let run = Cell::new(0);
    let clock = RefCell::new(Clock::at(0));
    lua.set_hook(HookTriggers::new().every_nth_instruction(EVERY), move |lua, debug| {
        budget::check();
        let drawn = progress.drawn.get();
        run.set(run.get() + EVERY as usize);
        let mut clock = clock.borrow_mut();
        let allowed = INSTRUCTIONS + INSTRUCTIONS_PER_BYTE * bytes + INSTRUCTIONS_PER_ELEMENT * drawn;
        let limit = if run.get() > allowed {
            Some(SandboxLimit::Instructions)
        } else if drawn == clock.drawn && clock.is_stalled() {
            Some(SandboxLimit::Time)
        } else {
            None
        };
        if limit.is_some() {
            progress.met.set(limit);
            let chunk = debug.source().source.map(|name| name.into_owned());
            *progress.at.borrow_mut() = chunk.zip(debug.current_line());
            return Err(mlua::Error::runtime("stopped"));
        }
        if drawn != clock.drawn {
            if drawn / 1024 != clock.drawn / 1024 {
                lua.set_memory_limit(memory + MEMORY_PER_ELEMENT * drawn)?;
            }
            *clock = Clock::at(drawn);
        }
        Ok(VmState::Continue)
    })?;
    Ok(lua)
}

/// Since when nothing was drawn.
#[derive(Debug)]
struct Clock {
    drawn: usize,
    /// When to look next.
    next: Instant,
    /// Processor time of this thread at the first look.
    cpu: Option<Duration>,
    looks: u32,
}

impl Clock {
    fn at(drawn: usize) -> Self {
        Self { drawn, next: Instant::now() + PATIENCE, cpu: None, looks: 0 }
    }

    /// True when nothing was drawn for too long, in processor time: the machine may have other things to do.
    fn is_stalled(&mut self) -> bool {
        let now = Instant::now();
        if now < self.next {
            return false;
        }
        self.looks += 1;
        self.next = now + CLOCK_INTERVAL;
        match (self.cpu, budget::thread_cpu()) {
            (Some(start), Some(cpu)) => cpu.saturating_sub(start) > PATIENCE,
            (None, Some(cpu)) => {
                self.cpu = Some(cpu);
                false
            }
            (_, None) => CLOCK_INTERVAL * self.looks > PATIENCE * WALL,
        }
    }
}
