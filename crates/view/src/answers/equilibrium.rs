//! Static equilibrium with its picture.

use super::{rows, sentences};
use crate::answer::Answer;
use crate::bench::Bench;
use crate::figure;
use crate::question::BenchState;
use crate::refusal::{LineMessage, Refusal};
use bimorph_analysis::mesh::{StaticWithBeams, static_with_beams};
use bimorph_netlist::beam_places;

/// The equilibrium at the state's port voltages, its geometry, and the state of every beam.
pub(crate) fn equilibrium(bench: &Bench, state: &BenchState) -> Result<Answer, Refusal> {
    let drawn = bench.compiled(state)?;
    let StaticWithBeams { fitted, result, curves, beams } = static_with_beams(&drawn, &state.voltages())?;
    let structure = &fitted.structure;
    let mut answer = Answer::default();
    let lines = beam_places(&*bench.bundle(state)?, &bench.compile_options(state).set);
    figure::put(&mut answer, structure, &curves, &lines);
    answer.array("motion", figure::motion(structure, &result.nodes, &curves));
    answer.put("nodes", result.nodes.iter().map(|(name, m)| (name, [m.x, m.y, m.rz])).collect::<Vec<_>>());
    let all: f64 = beams.iter().flatten().map(|beam| beam.energy_j).sum();
    let state_of = |beam: &Option<_>| {
        beam.as_ref().map(|b: &bimorph_analysis::beam_states::BeamState| {
            let fraction = if all > 0.0 { b.energy_j / all } else { 0.0 };
            [b.normal_n, b.shear_n, b.moment_nm, b.stress_pa, fraction]
        })
    };
    answer.put("beams", beams.iter().map(state_of).collect::<Vec<_>>());
    answer.put("energy_j", all);
    answer.put("temperatures_k", rows(&result.temperatures_k));
    answer.put("peaks_k", rows(&result.peak_temperatures_k));
    answer.put("currents_a", rows(&result.currents_a));
    answer.put("charges_c", rows(&result.charges_c));
    answer.put("pulled_in", result.pulled_in);
    answer.put("jumped", result.jumped);
    answer.put("notes", result.notes());
    answer.put("warnings", sentences(&fitted.warnings.items));
    answer.put("diagnostics", drawn.warnings.items.iter().map(LineMessage::from).collect::<Vec<_>>());
    answer.put("unknowns", result.unknowns);
    answer.put("estimated_error", result.estimated_error);
    Ok(answer)
}
