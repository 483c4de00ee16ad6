//! One call of the model: read the request of ngspice, evaluate the device, write the result and the history.

use crate::call::{MONITORS, ModelCall, PORTS};
use crate::circuit::HostCircuit;
use crate::evaluation::{EvaluationOutcome, EvaluationRequest};
use crate::history;
use crate::instance::Instance;
use crate::registry::{RegisteredInstance, Registry};
use crate::{host, trace};
use bimorph::device::Status;

/// Answers a call.
pub(crate) fn respond(call: &ModelCall<'_>, registry: &mut Registry) -> EvaluationOutcome {
    let Some(entry) = registry.find(call.key()) else {
        return EvaluationOutcome::Stop("an instance was not set up".into());
    };
    let question = match call.question() {
        Ok(question) => question,
        Err(why) => return EvaluationOutcome::Stop(why.into()),
    };
    let ports = call.size(PORTS);
    let from = usize::from(!matches!(question, EvaluationRequest::SmallSignal { .. }));
    let (Some(recalled), Some(now)) = (call.memory(from, entry.memory), call.memory(0, entry.memory)) else {
        return EvaluationOutcome::Stop("ngspice gave no state memory".into());
    };
    // SAFETY: this is within a load; the memory has the size that was reserved.
    let recalled = unsafe { std::slice::from_raw_parts(recalled, entry.memory.doubles) };
    history::read(recalled, entry.epoch, &mut entry.previous);
    if question == EvaluationRequest::Static && call.sweep() {
        if !entry.sweeping || entry.job != call.job() {
            // the host's memory still holds a point of the analysis or the sweep before, which is no point of this sweep
            entry.stale = entry.previous.token;
        }
        entry.job = call.job();
        if entry.stale.is_some() && entry.previous.token == entry.stale {
            entry.previous.token = None;
        } else {
            entry.stale = None;
        }
    } else if question == EvaluationRequest::Static {
        // from rest
        entry.previous.token = None;
    }
    entry.sweeping = question == EvaluationRequest::Static && call.sweep();
    if matches!(question, EvaluationRequest::SmallSignal { .. }) {
        // A host that takes this for a transient has copied another point's record over this one's.
        entry.previous.token = entry.balanced.or(entry.previous.token);
    }
    if matches!(question, EvaluationRequest::Transient { .. }) && !entry.integrals {
        // SAFETY: this is within a load of a transient, and the charges lie within this point's memory.
        entry.integrals = unsafe { (0..ports).all(|n| host::integral(now.add(history::HEAD + n))) };
    }
    call.voltages(&mut entry.voltages);
    let outcome = entry.instance.ask(question, &entry.voltages, &entry.previous);
    if outcome == EvaluationOutcome::Solved {
        if question == EvaluationRequest::Static {
            entry.balanced = entry.instance.answer().token;
        }
        match question {
            EvaluationRequest::SmallSignal { .. } => write_gains(call, &entry.instance),
            _ => write_answer(call, entry, now),
        }
    }
    if trace::on() {
        trace_call(entry, question, &outcome);
    }
    outcome
}

fn write_answer(call: &ModelCall<'_>, entry: &mut RegisteredInstance, memory: *mut f64) {
    let (answer, ports) = (entry.instance.answer(), call.size(PORTS));
    entry.nodes.clear();
    entry.nodes.extend((0..ports).map(|n| call.given(n)));
    for n in 0..ports {
        call.set(PORTS, n, answer.currents[n], &answer.conductances[n * ports..(n + 1) * ports]);
    }
    for n in 0..call.size(MONITORS) {
        call.set(MONITORS, n, answer.monitors[n], &answer.monitor_gains[n * ports..(n + 1) * ports]);
    }
    entry.shown.clear();
    entry.shown.extend((0..call.size(MONITORS)).map(|n| call.nodes(MONITORS, n)));
    entry.record = 0;
    if let Some(token) = answer.token {
        // SAFETY: this is within a load; this point's memory has the size that was reserved, and no other view of it.
        let memory = unsafe { std::slice::from_raw_parts_mut(memory, entry.memory.doubles) };
        entry.record = memory.as_ptr() as usize;
        history::write(memory, entry.epoch, token, &answer.charges, &answer.base);
    }
}

/// Change of a monitor from one iteration to the next at which an equilibrium has converged, relative to its value (1). Newton's iteration
/// converges quadratically, so one or two more iterations than ngspice's own reach it.
const SETTLED_CHANGE: f64 = 1e-6;
/// Iterations for that beyond ngspice's own, at most.
const MAX_FURTHER: u32 = 4;

/// Whether the monitors of an equilibrium still move, where ngspice's own test is met: it ends at `reltol`.
pub(crate) fn moves(entry: &mut RegisteredInstance, circuit: HostCircuit) -> bool {
    let moved = |nodes: &[i32; 2]| {
        // SAFETY: nodes of the circuit, as the host set them up.
        let (new, old) = unsafe { (circuit.solved(*nodes), circuit.loaded_at(*nodes)) };
        (new - old).abs() > SETTLED_CHANGE * new.abs().max(old.abs())
    };
    let at_rest = entry.instance.answer().token.is_some() && entry.instance.answer().step == 0.0;
    let still_moves = at_rest && entry.further < MAX_FURTHER && entry.shown.iter().any(moved);
    entry.further = if still_moves { entry.further + 1 } else { 0 };
    still_moves
}

/// Puts into the record what the accepted solution differs from the one that the device was asked at.
///
/// Newton's iteration ends when two solutions lie close together, and the device was asked at the first. Up to there
/// its currents went on straight, along their derivatives, and so did the charge that the circuit delivered. The next
/// step must begin from that charge. The difference at each point would otherwise be lost or gained for good, and
/// always with the same sign where a charge curves one way.
pub(crate) fn settle(entry: &mut RegisteredInstance, circuit: HostCircuit) {
    // SAFETY: nodes of the circuit, as the host set them up.
    let asked_here = (entry.nodes.iter().zip(&entry.voltages))
        .all(|(nodes, volts)| unsafe { circuit.loaded_at(*nodes) }.to_bits() == volts.to_bits());
    if entry.record == 0 || !asked_here || entry.nodes.len() != entry.voltages.len() {
        return;
    }
    // SAFETY: as above.
    let further = entry.nodes.iter().zip(&entry.voltages).map(|(nodes, v)| unsafe { circuit.solved(*nodes) } - v);
    let further: Vec<f64> = further.collect();
    if entry.instance.settle(&further)
        && let Some(token) = entry.instance.answer().token
    {
        let answer = entry.instance.answer();
        // SAFETY: the memory of the point that is being accepted, written by the last load of this instance.
        let memory =
            unsafe { std::slice::from_raw_parts_mut(entry.record as *mut f64, history::len(answer.charges.len())) };
        history::write(memory, entry.epoch, token, &answer.charges, &answer.base);
    }
    entry.record = 0;
}

fn write_gains(call: &ModelCall<'_>, instance: &Instance) {
    let ports = call.size(PORTS);
    for n in 0..ports {
        call.set_gains(PORTS, n, instance.admittances(n));
    }
    for n in 0..call.size(MONITORS) {
        call.set_gains(MONITORS, n, instance.monitor_responses(n));
    }
}

fn trace_call(entry: &RegisteredInstance, question: EvaluationRequest, outcome: &EvaluationOutcome) {
    let (name, answer) = (entry.instance.name(), entry.instance.answer());
    let refusal = match &entry.instance.reply.status {
        Status::Ok => String::new(),
        refusal => format!(" ({refusal:?})"),
    };
    trace::line(format_args!(
        "{name} {question:?} parent {:?} v {:?} -> {outcome:?}{refusal} token {:?} i {:?} q {:?} monitors {:?}",
        entry.previous.token, entry.voltages, answer.token, answer.currents, answer.charges, answer.monitors
    ));
}
