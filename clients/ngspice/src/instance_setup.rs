//! Setup of the instances: from ngspice's lists of models and instances to open devices.

use crate::abi::{ConnectionData, ModelHead};
use crate::call::{self, MONITORS, Reserved};
use crate::instance::Instance;
use crate::model_card::ModelCard;
use crate::registry::register;
use crate::table::LAYOUT;
use crate::{history, host, opener, parameters, trace};
use bimorph::device::Agitation;
use std::ffi::{c_int, c_void};
use std::path::{Path, PathBuf};

/// Opens each instance of each model, and reserves its state memory as the host's own devices do: by its count of
/// states. One vector lacks the memory that `cm_analog_alloc` would add later under `.options maxord=1`, and the host
/// then overruns it.
///
/// # Safety
/// `model` heads the host's list of models; each is set up. `circuit` is the host's, and `states` its count of states so far.
pub(crate) unsafe fn open_all(model: *mut ModelHead, circuit: *mut c_void, states: &mut c_int) -> Result<(), String> {
    let remote = std::env::var("BIMORPH_REMOTE").ok();
    let share = match std::env::var("BIMORPH_TOL_SHARE") {
        Ok(text) => match text.parse() {
            Ok(share) if share > 0.0 && share <= 1.0 => share,
            _ => return Err(format!("BIMORPH_TOL_SHARE: expected a number above 0 and up to 1, got {text}")),
        },
        Err(_) => 1.0,
    };
    // SAFETY: the host's lists and strings, by contract.
    for (model, instance) in unsafe { call::instances(model) } {
        // SAFETY: as above; the host has set up the connections.
        let (name, model_name, raw, ports, monitors, directory) = unsafe {
            (
                call::text(instance.name).unwrap_or_default(),
                call::text(model.name).unwrap_or_default(),
                parameters::card(model.param, model.num_param),
                call::branches(instance.conn),
                call::size(instance.conn, MONITORS),
                deck_directory(instance.conn, circuit),
            )
        };
        let card = ModelCard::new(&raw, remote.clone())
            .map(|card| ModelCard { folders: folders_of(&model_name), ..card.with_share(share) })
            .and_then(|c| c.check_counts(ports.len(), monitors).map(|()| c));
        let opened = card
            .map_err(|e| e.to_string())
            .and_then(|mut card| open(&name, &mut card, &ports, directory.as_deref()))
            .map_err(|e| format!("instance {name} (model {model_name}): {e}"))?;
        let memory = Reserved { first: usize::try_from(*states).unwrap_or(0), doubles: history::len(ports.len()) };
        *states += memory.doubles as c_int;
        register(instance.conn as usize, opened, memory);
    }
    Ok(())
}

fn open(name: &str, card: &mut ModelCard, ports: &[bool], directory: Option<&Path>) -> Result<Instance, String> {
    let device = opener::open(card, directory).map_err(|e| e.to_string())?;
    trace::line(format_args!("{name}: {card:?}, deck in {directory:?}"));
    let noise = card.noise.map(|noise| Agitation { seed: seed_of(noise.seed, name), ..noise });
    Instance::open(name, device, (&card.ports, ports), &card.monitors, noise)
        .map_err(|e| format!("\"{}\": {e}", card.file))
}

/// Folders of the files with the `.model` line of a model, as found by the program that started ngspice. Models of a
/// subcircuit's instance are called `INSTANCE:MODEL`.
fn folders_of(model: &str) -> Vec<PathBuf> {
    let own = model.rsplit(':').next().unwrap_or(model);
    let known = std::env::var("BIMORPH_MODEL_FOLDERS").unwrap_or_default();
    let pairs = known.lines().filter_map(|line| line.split_once('\t'));
    pairs.filter(|(name, _)| name.eq_ignore_ascii_case(own)).map(|(_, folder)| folder.into()).collect()
}

/// The seed of one instance, by FNV-1a over its name: parts of one model are shaken independently.
fn seed_of(seed: u64, name: &str) -> u64 {
    let mix = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
    seed.to_le_bytes().into_iter().chain(name.bytes()).fold(0xcbf2_9ce4_8422_2325, mix)
}

/// The deck's directory: from the program that started ngspice, or from the host.
///
/// # Safety
/// `conn` points to the connections of an instance that the host has set up in `circuit`.
unsafe fn deck_directory(conn: *mut *mut ConnectionData, circuit: *mut c_void) -> Option<PathBuf> {
    if let Some(path) = std::env::var_os("BIMORPH_DECK_DIR") {
        return Some(path.into());
    }
    let layout = LAYOUT.get()?;
    // SAFETY: by contract; the slot is that of this host.
    unsafe {
        let slot = layout.deck_path_slot(call::partial_at_80(conn), host::until_44(layout, circuit));
        host::deck_directory(slot)
    }
}
