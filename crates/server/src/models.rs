//! Compiled models by the hash of their text.

use super::fair_semaphore::client;
use super::limits::Limits;
use super::server::MakeDevice;
use super::status;
use bimorph_analysis::mesh;
use bimorph_base::Bundle;
use bimorph_base::budget;
use bimorph_device::OpenRequest;
use bimorph_jobs::content::Fnv;
use bimorph_model::compile::{CompileOptions, CompiledModel, ParsedStructure, draw};
use bimorph_netlist::{NetlistSource, is_program};
use bimorph_wire::convert::model::{bundle_bytes, bundle_to_wire, diagnostics_to_wire, setting_to_wire};
use bimorph_wire::convert::options::options_to_wire;
use bimorph_wire::proto;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError};
use tonic::Status;

/// A model that clients can name.
pub(super) struct NamedModel {
    pub(super) compiled: Arc<CompiledModel>,
    /// The same on the mesh that it has in a circuit.
    pub(super) in_circuit: Arc<CompiledModel>,
    pub(super) description: proto::ModelDescription,
    pub(super) bundle: Bundle,
    options: CompileOptions,
    /// Memory allocated during its compilation, an upper bound of its size (byte).
    bytes: usize,
}

impl NamedModel {
    pub(super) fn id(&self) -> &str {
        &self.description.id
    }

    /// File name of the netlist, for titles.
    pub(super) fn title(&self) -> &str {
        self.bundle.root.rsplit(['/', '\\']).next().unwrap_or_default()
    }

    /// The request that it was compiled from, as a message.
    pub(super) fn source(&self) -> proto::CompileRequest {
        proto::CompileRequest {
            bundle: Some(bundle_to_wire(&self.bundle)),
            options: Some(options_to_wire(&self.options)),
        }
    }

    pub(super) fn unknowns(&self) -> usize {
        usize::try_from(self.description.unknowns).unwrap_or(usize::MAX)
    }
}

/// The models kept, at most [`Limits::models`].
#[derive(Default)]
pub(super) struct ModelCache {
    kept: Mutex<ModelTable>,
}

#[derive(Default)]
struct ModelTable {
    models: BTreeMap<String, CachedModel>,
    requests: u64,
}

/// A model that is kept.
struct CachedModel {
    model: Arc<NamedModel>,
    /// Time of its last request, as a count of requests.
    used: u64,
    /// Clients that requested it.
    clients: BTreeSet<Arc<str>>,
}

impl CachedModel {
    /// Whether an open session or a computation has it.
    fn is_in_use(&self) -> bool {
        Arc::strong_count(&self.model) > 1
    }
}

impl ModelTable {
    fn bytes(&self) -> usize {
        self.models.values().map(|entry| entry.model.bytes).sum()
    }

    /// The least recently used model among those that may be evicted.
    fn oldest(&self, may: impl Fn(&CachedModel) -> bool) -> Option<String> {
        let found = self.models.iter().filter(|(_, entry)| may(entry));
        found.min_by_key(|(_, entry)| entry.used).map(|(id, _)| id.clone())
    }

    /// Makes room for one more model of a client: first of its own, where it has as many as one may have; then of the one unused for longest.
    fn make_room(&mut self, client: &str, bytes: usize, limits: &Limits) -> Result<(), Status> {
        let own = |kept: &Self| {
            let own = kept.models.values().filter(|entry| entry.clients.contains(client));
            own.fold((0, 0_usize), |(count, bytes), entry| (count + 1, bytes.saturating_add(entry.model.bytes)))
        };
        loop {
            let (count, used) = own(self);
            let many = limits.client_models > 0 && count >= limits.client_models;
            let large = limits.client_model_memory > 0 && used.saturating_add(bytes) > limits.client_model_memory;
            if count == 0 || !(many || large) {
                break;
            }
            let own = |entry: &CachedModel| entry.clients.contains(client);
            let free = self.oldest(|entry| own(entry) && !entry.is_in_use());
            let Some(id) = free.or_else(|| self.oldest(own)) else { break };
            // it stays for others that requested it
            let left = self.models.get_mut(&id).is_none_or(|entry| {
                entry.clients.remove(client);
                entry.clients.is_empty()
            });
            if left {
                self.models.remove(&id);
            }
        }
        while !self.models.is_empty()
            && (self.models.len() >= limits.models || self.bytes().saturating_add(bytes) > limits.model_memory)
        {
            // a session continues without the name of its model, but only its own client may remove that
            let own = |entry: &CachedModel| entry.clients.iter().all(|other| **other == *client);
            let free = self.oldest(|entry| !entry.is_in_use());
            let Some(id) = free.or_else(|| self.oldest(own)) else {
                let many = self.models.len() >= limits.models;
                let (name, most) = if many { ("models", limits.models) } else { ("model_memory", limits.model_memory) };
                let got = "one more, and sessions or computations of other clients have all that are kept";
                return Err(status::limit(name, most, got));
            };
            self.models.remove(&id);
        }
        Ok(())
    }
}

impl ModelCache {
    /// The model of that id.
    pub(super) fn get(&self, id: &str) -> Result<Arc<NamedModel>, Status> {
        self.find(id).ok_or_else(|| status::not_found("model", id))
    }

    /// Models kept.
    pub(super) fn len(&self) -> usize {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).models.len()
    }

    fn find(&self, id: &str) -> Option<Arc<NamedModel>> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.requests += 1;
        let now = kept.requests;
        let entry = kept.models.get_mut(id)?;
        entry.used = now;
        let client = client().name;
        if !entry.clients.contains(&client) {
            entry.clients.insert(client);
        }
        Some(Arc::clone(&entry.model))
    }

    /// The model of a bundle: the one kept, or a new one. Takes as long as a compilation.
    pub(super) fn compile(
        &self,
        bundle: Bundle,
        options: CompileOptions,
        limits: &Limits,
        make: MakeDevice,
    ) -> Result<Arc<NamedModel>, Status> {
        let mut key = hash(&bundle, &options);
        // The hash is not cryptographic, so a hit is compared in full, and a collision takes the next free id.
        while let Some(model) = self.find(&format!("{key:032x}")) {
            if model.bundle == bundle && model.options == options {
                return Ok(model);
            }
            key = key.wrapping_add(1);
        }
        let compiled = draw(&NetlistSource::new(&bundle), &options)
            .and_then(ParsedStructure::compile)
            .map_err(|error| status::compile(&error))?;
        if compiled.unknowns() > limits.unknowns {
            return Err(status::limit("unknowns", limits.unknowns, compiled.unknowns()));
        }
        let bytes = budget::current().map_or(0, |budget| budget.used());
        let in_circuit = Arc::new(mesh::in_circuit(&compiled));
        let compiled = Arc::new(compiled);
        let description = describe(format!("{key:032x}"), &in_circuit, make)?;
        let unknowns = usize::try_from(description.unknowns).unwrap_or(usize::MAX);
        if unknowns > limits.unknowns {
            return Err(status::limit("unknowns", limits.unknowns, unknowns));
        }
        // intermediate meshes are gone
        let larger = in_circuit.unknowns().div_ceil(compiled.unknowns().max(1));
        let bytes = bytes.saturating_mul(1 + larger);
        let model = Arc::new(NamedModel { compiled, in_circuit, description, bundle, options, bytes });
        self.keep(Arc::clone(&model), limits)?;
        Ok(model)
    }

    fn keep(&self, model: Arc<NamedModel>, limits: &Limits) -> Result<(), Status> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.requests += 1;
        let (used, client) = (kept.requests, client().name);
        kept.models.remove(model.id());
        kept.make_room(&client, model.bytes, limits)?;
        let id = model.id().to_owned();
        kept.models.insert(id, CachedModel { model, used, clients: BTreeSet::from([client]) });
        Ok(())
    }
}

/// Rejects a netlist that is too large before it is parsed.
pub(super) fn check_size(bundle: &Bundle, limits: &Limits) -> Result<(), Status> {
    let bytes = bundle_bytes(bundle);
    if bytes > limits.netlist_bytes {
        return Err(status::limit("netlist_bytes", limits.netlist_bytes, bytes));
    }
    if is_program(bundle) && bytes > limits.program_bytes {
        let got =
            format!("a SUGAR 3 netlist of {bytes}, which is a program: `serve --limit program_bytes=1M` allows it");
        return Err(status::limit("program_bytes", limits.program_bytes, got));
    }
    Ok(())
}

fn describe(id: String, compiled: &Arc<CompiledModel>, make: MakeDevice) -> Result<proto::ModelDescription, Status> {
    let opened = make(Arc::clone(compiled)).open(&OpenRequest::default()).map_err(|error| status::device(&error))?;
    let nodes = compiled.structure.nodes.iter().filter(|node| node.mechanical);
    Ok(proto::ModelDescription {
        id,
        ports: opened.ports.into_iter().map(|port| port.name).collect(),
        nodes: nodes.map(|node| node.name.clone()).collect(),
        unknowns: opened.unknowns as u64,
        estimated_error: compiled.order.estimated_error,
        parameters: compiled.parameters.iter().map(|(name, value)| setting_to_wire(name, value)).collect(),
        warnings: diagnostics_to_wire(&compiled.warnings),
        rendered_warnings: compiled.warnings.render(false),
    })
}

/// The name of what a bundle and options compile to.
fn hash(bundle: &Bundle, options: &CompileOptions) -> u128 {
    let mut state = Fnv::default();
    state.model(bundle, options);
    state.value()
}

#[cfg(test)]
mod tests {
    //! Ids depend on every part of what is compiled, and on nothing else.
    use super::*;

    #[test]
    fn ids_are_content() {
        let bundle = Bundle::from_text("a.net", "anchor * [f] []");
        let options = CompileOptions::default();
        let id = hash(&bundle, &options);
        assert_eq!(id, hash(&bundle.clone(), &options.clone()));
        assert_ne!(id, hash(&Bundle::from_text("b.net", "anchor * [f] []"), &options));
        assert_ne!(id, hash(&Bundle::from_text("a.net", "anchor * [g] []"), &options));
        assert_ne!(id, hash(&bundle, &options.with_tolerance(1e-4)));
        let set = |value| options.with_parameter("w", value);
        assert_ne!(hash(&bundle, &set(1.0)), hash(&bundle, &set(2.0)));
    }
}
