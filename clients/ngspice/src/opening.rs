//! Setup of the instances: from ngspice's lists of models and instances to open devices.

use crate::abi::{Connection, Model};
use crate::call::{self, MONITORS, PORTS};
use crate::instance::Instance;
use crate::model_card::ModelCard;
use crate::registry::register;
use crate::table::LAYOUT;
use crate::{host, opener, trace};
use std::path::{Path, PathBuf};

/// Opens each instance of each model.
///
/// # Safety
/// `model` heads the host's list of models; each is set up.
pub(crate) unsafe fn open_all(mut model: *mut Model) -> Result<(), String> {
    let remote = std::env::var("BIMORPH_REMOTE").ok();
    // SAFETY: the lists end in null; names are strings of the host.
    unsafe {
        while let Some(this) = model.as_ref() {
            let mut instance = this.instances;
            while let Some(at) = instance.as_ref() {
                let name = call::text(at.name).unwrap_or_default();
                let card = ModelCard::new(&call::card(this.param, this.num_param), remote.clone());
                let (ports, monitors) = (call::size(at.conn, PORTS), call::size(at.conn, MONITORS));
                let directory = deck_directory(at.conn);
                let opened = card.map_err(|e| e.to_string()).and_then(|mut card| {
                    card.check_counts(ports, monitors).map_err(|e| e.to_string())?;
                    open(&name, &mut card, ports, directory.as_deref())
                });
                let model_name = call::text(this.name).unwrap_or_default();
                let opened = opened.map_err(|e| format!("instance {name} (model {model_name}): {e}"))?;
                register(at.conn as usize, opened);
                instance = at.next;
            }
            model = this.next;
        }
    }
    Ok(())
}

fn open(name: &str, card: &mut ModelCard, ports: usize, directory: Option<&Path>) -> Result<Instance, String> {
    let device = opener::open(card, directory).map_err(|e| e.to_string())?;
    trace::line(format_args!("{name}: {card:?}, deck in {directory:?}"));
    Instance::open(name, device, &card.ports, ports, &card.monitors).map_err(|e| format!("\"{}\": {e}", card.file))
}

/// The deck's directory: from whoever started ngspice, or from the host.
///
/// # Safety
/// `conn` points to the connections of an instance that the host has set up.
unsafe fn deck_directory(conn: *mut *mut Connection) -> Option<PathBuf> {
    if let Some(path) = std::env::var_os("BIMORPH_DECK_DIR") {
        return Some(path.into());
    }
    // SAFETY: by contract; the slot is that of this host.
    unsafe { LAYOUT.get()?.deck_path_slot(call::partial_at_80(conn)).and_then(|slot| host::deck_directory(slot)) }
}
