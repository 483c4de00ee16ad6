//! The device on the bench: its netlist, options, layout and decks.

use crate::answer::Answer;
use crate::answers;
use crate::question::{Ask, BenchState, Question};
use crate::refusal::Refusal;
use bimorph_base::Bundle;
use bimorph_model::compile::{CompileOptions, CompiledModel, draw};
use bimorph_netlist::NetlistSource;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Longest edited netlist (bytes).
pub(crate) const MAX_TEXT: usize = 1 << 20;

/// Polygons below the mechanism (m), by layer.
#[derive(Debug, Clone, Default)]
pub struct LayoutGround {
    /// Name of each layer with its contours.
    pub layers: Vec<(String, Vec<Vec<[f64; 2]>>)>,
}

/// A device with its file, options and port voltages.
#[derive(Debug, Clone)]
pub struct BenchOptions {
    /// The file as it was named.
    pub file: PathBuf,
    /// The netlist with everything it uses; of a layout the converted one.
    pub bundle: Bundle,
    /// Options of every model, settings of parameters among them.
    pub options: CompileOptions,
    /// Port voltages to begin with (V).
    pub voltages: Vec<(String, f64)>,
    /// Polygons of the layout, where the file is one.
    pub layout: Option<LayoutGround>,
}

/// A device on the bench.
#[derive(Debug)]
pub struct Bench {
    pub(crate) options: BenchOptions,
    /// The last netlist that was read, with its edited text.
    read: Mutex<Option<(Option<String>, Arc<NetlistSource>)>>,
    /// Text of the file when it was last read or written here.
    pub(crate) on_disk: Mutex<String>,
}

impl Bench {
    /// A device.
    pub fn new(options: BenchOptions) -> Self {
        let text = options.bundle.files.get(&options.bundle.root).cloned().unwrap_or_default();
        Self { options, read: Mutex::default(), on_disk: Mutex::new(text) }
    }

    /// Name of the file, for titles.
    pub fn title(&self) -> String {
        let file = &self.options.file;
        file.file_name().map_or_else(|| file.display().to_string(), |name| name.to_string_lossy().into_owned())
    }

    /// Whether the file is a netlist, which can be edited.
    pub(crate) fn editable(&self) -> bool {
        self.options.layout.is_none()
    }

    /// Text of the netlist when the bench was made.
    pub(crate) fn text(&self) -> &str {
        self.options.bundle.files.get(&self.options.bundle.root).map_or("", String::as_str)
    }

    /// Decks beside the file that name it.
    pub(crate) fn decks(&self) -> Vec<PathBuf> {
        let file = &self.options.file;
        let Some(name) = file.file_name().and_then(|name| name.to_str()) else { return Vec::new() };
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
        let names = |path: &PathBuf| std::fs::read_to_string(path).is_ok_and(|text| text.contains(name));
        let is_deck = |path: &PathBuf| path.extension().is_some_and(|end| end == "cir");
        let mut decks: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_deck).collect();
        decks.retain(names);
        decks.sort();
        decks
    }

    /// The netlist in a state of the bench.
    pub(crate) fn bundle(&self, state: &BenchState) -> Result<Cow<'_, Bundle>, Refusal> {
        let Some(text) = &state.text else { return Ok(Cow::Borrowed(&self.options.bundle)) };
        if !self.editable() {
            return Err(Refusal::of("the netlist of a layout cannot be edited; `bimorph convert` writes it to a file"));
        }
        if text.len() > MAX_TEXT {
            return Err(Refusal::of(format!("the netlist has {} bytes, more than {MAX_TEXT}", text.len())));
        }
        let mut bundle = self.options.bundle.clone();
        bundle.files.insert(bundle.root.clone(), text.clone());
        Ok(Cow::Owned(bundle))
    }

    /// The netlist in a state of the bench, read.
    pub(crate) fn source(&self, state: &BenchState) -> Result<Arc<NetlistSource>, Refusal> {
        let known = self.read.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if let Some((_, source)) = known.filter(|(text, _)| *text == state.text) {
            return Ok(source);
        }
        let source = Arc::new(NetlistSource::new(&*self.bundle(state)?));
        let read = (state.text.clone(), Arc::clone(&source));
        *self.read.lock().unwrap_or_else(PoisonError::into_inner) = Some(read);
        Ok(source)
    }

    /// Options of a model in a state of the bench.
    pub(crate) fn compile_options(&self, state: &BenchState) -> CompileOptions {
        self.options.options.with_settings(&state.settings())
    }

    /// The model in a state of the bench, on the mesh that the options specify.
    pub(crate) fn compiled(&self, state: &BenchState) -> Result<CompiledModel, Refusal> {
        let source = self.source(state)?;
        Ok(draw(&*source, &self.compile_options(state))?.compile()?)
    }

    /// The same with one parameter at another value.
    pub(crate) fn compiled_with(&self, state: &BenchState, name: &str, value: f64) -> Result<CompiledModel, Refusal> {
        let source = self.source(state)?;
        Ok(draw(&*source, &self.compile_options(state).with_parameter(name, value))?.compile()?)
    }

    /// Answers a request; `progress` receives the completed fraction and returns whether to continue.
    pub(crate) fn answer(
        &self,
        question: &Question,
        progress: &(dyn Fn(f64) -> bool + Sync),
    ) -> Result<Answer, Refusal> {
        let state = &question.state;
        match &question.ask {
            Ask::Describe {} => answers::describe::describe(self, state),
            Ask::Layout {} => Ok(answers::describe::layout(self)),
            Ask::Static {} => answers::equilibrium::equilibrium(self, state),
            Ask::Modes { count, shapes } => answers::modes::modes(self, state, *count, *shapes),
            Ask::Pullin { port, max } => answers::path::pull_in(self, state, port.as_deref(), *max),
            Ask::Path(asked) => answers::path::path(self, state, asked, progress),
            Ask::Transient(asked) => answers::motion::motion(self, state, asked, progress),
            Ask::Response(asked) => answers::response::response(self, state, asked, progress),
            Ask::Circuit { deck } => answers::circuit::circuit(self, state, deck, progress),
            Ask::Yield(asked) => answers::samples::samples(self, state, asked, progress),
            Ask::Save { force } => answers::save::save(self, state, *force),
            Ask::Export { .. } => Err(Refusal::of("an export is no part of another request")),
        }
    }
}
