//! From a `.model` line to a device: find the netlist, compile it once, step it here or on a server.

use crate::model_card::ModelCard;
use crate::{names, reported};
use bimorph::analysis::{AnalysisError, mesh};
use bimorph::compile::{CompileError, CompileOptions, CompiledModel, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, DeviceError};
use bimorph::input::{self, FrontError, LayoutChoice};
use bimorph::layout::LayoutError;
use bimorph::layout::convert::ConvertError;
use bimorph::netlist::{self, Bundle};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use thiserror::Error;

/// Errors of opening the device of a `.model` line.
#[derive(Debug, Error)]
pub enum OpenError {
    /// The netlist cannot be read.
    #[error("cannot read the netlist \"{file}\": {source} (looked for {tried})")]
    File {
        /// As spelled on the line.
        file: String,
        /// Every path that was tried.
        tried: String,
        /// The system's error.
        source: std::io::Error,
    },
    /// There are several in the folders where the line may stand.
    #[error("the netlist \"{file}\" may be \"{}\" or \"{}\": two files hold a .model line of this name; name one of the models otherwise, or the netlist with its folder", .pair[0].display(), .pair[1].display())]
    Twice {
        /// As spelled on the line.
        file: String,
        /// The first two.
        pair: [PathBuf; 2],
    },
    /// The layout makes no netlist.
    #[error("layout \"{file}\": {source}")]
    Layout {
        /// As spelled on the line.
        file: String,
        /// Why not.
        source: Box<FrontError>,
    },
    /// The netlist does not compile.
    #[error("netlist \"{file}\":\n{source}")]
    Compile {
        /// As spelled on the line.
        file: String,
        /// Diagnostics with file, line and column.
        source: CompileError,
    },
    /// There is no model on twice the segments.
    #[error("netlist \"{file}\" on twice the segments: {source}")]
    Finer {
        /// As spelled on the line.
        file: String,
        /// Why not.
        source: AnalysisError,
    },
    /// A name that may stand for two of the netlist's.
    #[error("\"{name}\" may be `{}` or `{}` of netlist \"{file}\": ngspice passes lines on in small letters; rename one of the two", .pair[0], .pair[1])]
    Ambiguous {
        /// As on the line.
        name: String,
        /// Names of the netlist.
        pair: [String; 2],
        /// The netlist, as spelled on the line.
        file: String,
    },
    /// The device refuses the ports or monitors, or its server cannot be reached.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// `remote` is given in a build without a client.
    #[cfg(not(feature = "remote"))]
    #[error("remote=\"{0}\": this build of the plug-in steps models in process only (it was built without \"remote\")")]
    NoRemote(String),
}

/// Makes a device from a line; `directory` is the deck's, where it is known. Names on the line are put into the spelling
/// of the netlist.
pub type Opener = fn(&mut ModelCard, Option<&Path>) -> Result<Box<dyn Device>, OpenError>;

static OPENER: OnceLock<Opener> = OnceLock::new();

/// Puts another kind of device behind the plug-in, for code that links this crate into a `.cm` of its own. To be
/// called before ngspice loads a deck; only the first call counts.
pub fn set_opener(opener: Opener) {
    let _ = OPENER.set(opener);
}

/// Makes the device of a line.
///
/// # Errors
/// [`OpenError`]
pub(crate) fn open(card: &mut ModelCard, directory: Option<&Path>) -> Result<Box<dyn Device>, OpenError> {
    OPENER.get().copied().unwrap_or(open_model)(card, directory)
}

/// A netlist's model, in process or on the server the line names.
///
/// # Errors
/// [`OpenError`]
pub fn open_model(card: &mut ModelCard, directory: Option<&Path>) -> Result<Box<dyn Device>, OpenError> {
    let bundle = read(&card.file, &card.folders, directory)?;
    if !card.options.set.is_empty()
        && let Ok(plain) = netlist::load(&bundle, &[])
    {
        names::respell_settings(card, plain.parameters.iter().map(|(name, _)| name.as_str()));
    }
    // Also where a server compiles the model: a netlist with errors is refused here, with file and line.
    let loaded = netlist::load(&bundle, &card.options.set)
        .map_err(|e| OpenError::Compile { file: card.file.clone(), source: CompileError::Netlist(e) })?;
    let structure = match card.options.without_circuit {
        true => loaded.structure.without_circuit(),
        false => loaded.structure,
    };
    let parameters: Vec<&str> = loaded.parameters.iter().map(|(name, _)| name.as_str()).collect();
    if let Some((name, pair)) = names::ambiguous(card, &structure, &parameters) {
        return Err(OpenError::Ambiguous { name, pair, file: card.file.clone() });
    }
    names::respell(card, &structure);
    reported::of_netlist(&card.file, card.options.without_circuit, &loaded.warnings.items);
    let own = match (&card.remote, card.share < 1.0) {
        (Some(address), false) => return connect(address, &bundle, card),
        _ => compiled(&card.file, bundle.clone(), &card.options)?,
    };
    if card.share == 1.0 {
        reported::of_netlist(&card.file, card.options.without_circuit, &own.warnings.items);
        return Ok(Box::new(LocalDevice::new(own)));
    }
    let tol = card.options.errors().scaled(card.share).requested();
    let Some(address) = &card.remote else {
        let finer = mesh::twice(&own, tol).map_err(|source| OpenError::Finer { file: card.file.clone(), source })?;
        return Ok(Box::new(LocalDevice::new(Arc::new(finer))));
    };
    // a server takes one number for all beams
    card.options = card.options.with_tolerance(tol);
    if let Some(most) = own.order.segments.iter().max().filter(|most| **most > 0) {
        card.options = card.options.with_segments(2 * most);
    }
    connect(address, &bundle, card)
}

#[cfg(feature = "remote")]
fn connect(address: &str, bundle: &Bundle, card: &ModelCard) -> Result<Box<dyn Device>, OpenError> {
    use bimorph::service::client::RemoteDevice;
    let socket = address.strip_prefix("unix:").and_then(|p| names::existing(Path::new(p.trim_start_matches("//"))));
    let respelled = socket.map(|path| format!("unix://{}", path.display()));
    let address = respelled.as_deref().unwrap_or(address);
    let device = RemoteDevice::connect(address, bundle, &card.options, card.deadline)?.resuming();
    reported::of_netlist(&card.file, card.options.without_circuit, device.warnings());
    Ok(Box::new(device))
}

#[cfg(not(feature = "remote"))]
fn connect(address: &str, _: &Bundle, _: &ModelCard) -> Result<Box<dyn Device>, OpenError> {
    Err(OpenError::NoRemote(address.to_owned()))
}

/// Reads the netlist: absolute, or beside the file that holds the `.model` line (`folders`), beside the deck, in a folder of `BIMORPH_PATH` or of
/// ngspice's `sourcepath`, or in the working directory.
fn read(file: &str, folders: &[PathBuf], directory: Option<&Path>) -> Result<Bundle, OpenError> {
    let mut own: Vec<PathBuf> = folders.iter().filter_map(|d| names::existing(&d.join(file))).collect();
    own.dedup();
    if let [first, second, ..] = own.as_slice() {
        return Err(OpenError::Twice { file: file.to_owned(), pair: [first.clone(), second.clone()] });
    }
    let listed =
        |name: &str| std::env::var_os(name).map_or_else(Vec::new, |list| std::env::split_paths(&list).collect());
    let listed = ["BIMORPH_PATH", "BIMORPH_SOURCEPATH", "NGSPICE_INPUT_DIR"].into_iter().flat_map(listed);
    let places = folders.iter().cloned().chain(directory.map(Path::to_owned)).chain(listed).chain([PathBuf::new()]);
    let mut candidates: Vec<PathBuf> = Vec::new();
    for candidate in places.map(|place: PathBuf| place.join(file)) {
        if !candidates.contains(&candidate) {
            candidates.push(candidate);
        }
    }
    let path = candidates.iter().find_map(|p| names::existing(p)).unwrap_or_else(|| candidates[0].clone());
    let unread = |source| OpenError::File {
        file: file.to_owned(),
        tried: candidates.iter().map(|p| format!("\"{}\"", p.display())).collect::<Vec<_>>().join(", "),
        source,
    };
    match input::read(&path, &[], &LayoutChoice::default(), &mut |_| (), &mut |_| true) {
        Ok(source) => Ok(source.bundle),
        Err(FrontError::Read { source, .. }) => Err(unread(source)),
        Err(FrontError::Convert(ConvertError::Layout(LayoutError::Read { reason, .. }))) => {
            Err(unread(std::io::Error::other(reason)))
        }
        Err(source) => Err(OpenError::Layout { file: file.to_owned(), source: Box::new(source) }),
    }
}

/// Models cached for instances and analyses to share; the least recently used one is evicted.
const MAX_MODELS: usize = 16;

struct SharedModel {
    bundle: Bundle,
    options: CompileOptions,
    model: Arc<CompiledModel>,
}

static MODELS: Mutex<Vec<SharedModel>> = Mutex::new(Vec::new());

/// The model of a netlist text under these options, compiled once, with what is known of its mesh among its warnings.
fn compiled(file: &str, bundle: Bundle, options: &CompileOptions) -> Result<Arc<CompiledModel>, OpenError> {
    let mut models = MODELS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(k) = models.iter().position(|k| k.bundle == bundle && k.options == *options) {
        let kept = models.remove(k);
        let model = Arc::clone(&kept.model);
        models.push(kept);
        return Ok(model);
    }
    let drawn = compile(&bundle, options).map_err(|source| OpenError::Compile { file: file.to_owned(), source })?;
    // once for all instances of it
    let model = Arc::new(mesh::in_circuit(&drawn));
    if models.len() == MAX_MODELS {
        models.remove(0);
    }
    models.push(SharedModel { bundle, options: options.clone(), model: Arc::clone(&model) });
    Ok(model)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A missing netlist is named as spelled, with every searched place.
    #[test]
    fn missing_file_names_every_place() {
        let message = read("none.net", &[], Some(Path::new("/nowhere"))).unwrap_err().to_string();
        assert!(message.contains("\"none.net\"") && message.contains("\"/nowhere/none.net\""), "{message}");
    }
}
