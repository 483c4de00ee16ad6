//! Compiled models by the hash of their text.

use super::convert::model::{bundle_bytes, bundle_to_wire, diagnostics_to_wire, setting_to_wire};
use super::convert::options::options_to_wire;
use super::limits::Limits;
use super::server::MakeDevice;
use super::{proto, status};
use crate::analysis::mesh;
use crate::budget;
use crate::compile::{CompileOptions, Compiled, compile};
use crate::content::Fnv;
use crate::device::OpenRequest;
use crate::netlist::Bundle;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use tonic::Status;

/// A model that clients can name.
pub(super) struct Model {
    pub(super) compiled: Arc<Compiled>,
    /// The same on the mesh that it has in a circuit.
    pub(super) in_circuit: Arc<Compiled>,
    pub(super) description: proto::ModelDescription,
    bundle: Bundle,
    options: CompileOptions,
    /// What its compilation laid out, which is at least what it holds [byte].
    bytes: usize,
}

impl Model {
    pub(super) fn id(&self) -> &str {
        &self.description.id
    }

    /// What it was compiled from, as it travels.
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
pub(super) struct Models {
    kept: Mutex<Kept>,
}

#[derive(Default)]
struct Kept {
    /// By id: the model, and when it was last asked for (a count of requests).
    models: BTreeMap<String, (Arc<Model>, u64)>,
    requests: u64,
}

impl Models {
    /// The model of that id.
    pub(super) fn get(&self, id: &str) -> Result<Arc<Model>, Status> {
        self.find(id).ok_or_else(|| status::not_found("model", id))
    }

    /// Models kept.
    pub(super) fn len(&self) -> usize {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).models.len()
    }

    fn find(&self, id: &str) -> Option<Arc<Model>> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.requests += 1;
        let now = kept.requests;
        let (model, used) = kept.models.get_mut(id)?;
        *used = now;
        Some(Arc::clone(model))
    }

    /// The model of a bundle: the one kept, or a new one. Takes as long as a compilation.
    pub(super) fn compile(
        &self,
        bundle: Bundle,
        options: CompileOptions,
        limits: &Limits,
        make: MakeDevice,
    ) -> Result<Arc<Model>, Status> {
        let mut key = hash(&bundle, &options);
        // The hash is not cryptographic, so a hit is compared in full, and a collision takes the next free id.
        while let Some(model) = self.find(&format!("{key:032x}")) {
            if model.bundle == bundle && model.options == options {
                return Ok(model);
            }
            key = key.wrapping_add(1);
        }
        let compiled = compile(&bundle, &options).map_err(|error| status::compile(&error))?;
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
        // the meshes that were looked at are gone
        let larger = in_circuit.unknowns().div_ceil(compiled.unknowns().max(1));
        let bytes = bytes.saturating_mul(1 + larger);
        let model = Arc::new(Model { compiled, in_circuit, description, bundle, options, bytes });
        self.keep(Arc::clone(&model), limits);
        Ok(model)
    }

    fn keep(&self, model: Arc<Model>, limits: &Limits) {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.requests += 1;
        let now = kept.requests;
        kept.models.insert(model.id().to_owned(), (model, now));
        let bytes = |kept: &Kept| kept.models.values().map(|(model, _)| model.bytes).sum::<usize>();
        while kept.models.len() > 1 && (kept.models.len() > limits.models || bytes(&kept) > limits.model_memory) {
            let oldest = kept.models.iter().min_by_key(|(_, (_, used))| *used).map(|(id, _)| id.clone());
            if let Some(id) = oldest {
                kept.models.remove(&id);
            }
        }
    }
}

/// Refuses a netlist that is too large before anything looks at it.
pub(super) fn check_size(bundle: &Bundle, limits: &Limits) -> Result<(), Status> {
    let bytes = bundle_bytes(bundle);
    if bytes > limits.netlist_bytes {
        return Err(status::limit("netlist_bytes", limits.netlist_bytes, bytes));
    }
    if bundle.is_program() && bytes > limits.program_bytes {
        let got =
            format!("a SUGAR 3 netlist of {bytes}, which is a program: `serve --limit program_bytes=1M` allows it");
        return Err(status::limit("program_bytes", limits.program_bytes, got));
    }
    Ok(())
}

fn describe(id: String, compiled: &Arc<Compiled>, make: MakeDevice) -> Result<proto::ModelDescription, Status> {
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
    use crate::netlist::Setting;

    #[test]
    fn ids_are_content() {
        let bundle = Bundle::from_text("a.net", "anchor * [f] []");
        let options = CompileOptions::default();
        let id = hash(&bundle, &options);
        assert_eq!(id, hash(&bundle.clone(), &options.clone()));
        assert_ne!(id, hash(&Bundle::from_text("b.net", "anchor * [f] []"), &options));
        assert_ne!(id, hash(&Bundle::from_text("a.net", "anchor * [g] []"), &options));
        assert_ne!(id, hash(&bundle, &CompileOptions { tol: 1e-4, ..options.clone() }));
        let set = |value| CompileOptions { set: vec![("w".into(), Setting::Number(value))], ..options.clone() };
        assert_ne!(hash(&bundle, &set(1.0)), hash(&bundle, &set(2.0)));
    }
}
