//! Writes the edited netlist to its file, on request.

use crate::answer::Answer;
use crate::bench::Bench;
use crate::question::BenchState;
use crate::refusal::Refusal;
use bimorph_results::atomic;
use std::sync::PoisonError;

/// Writes the text whole or not at all. A file that another program has changed since it was read is kept, unless `force`.
pub(crate) fn save(bench: &Bench, state: &BenchState, force: bool) -> Result<Answer, Refusal> {
    let Some(text) = &state.text else { return Err(Refusal::of("the netlist has no changes to save")) };
    bench.bundle(state)?;
    let file = &bench.options.file;
    let mut on_disk = bench.on_disk.lock().unwrap_or_else(PoisonError::into_inner);
    let present = std::fs::read_to_string(file)
        .map_err(|error| Refusal::of(format!("cannot read {}: {error}", file.display())))?;
    if present != *on_disk && !force {
        let error = format!("{} has changed since it was read; save again to replace it", file.display());
        return Err(Refusal::of(error));
    }
    let written = atomic::write(file, |out| out.write_all(text.as_bytes()));
    written.map_err(|error| Refusal::of(format!("cannot write {}: {error}", file.display())))?;
    on_disk.clone_from(text);
    let mut answer = Answer::default();
    answer.put("saved", file.display().to_string());
    Ok(answer)
}
