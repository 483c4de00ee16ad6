//! One call of the model: read what ngspice asks, ask the device, write the answer and what is to be remembered.

use crate::call::{Call, MONITORS, PORTS};
use crate::circuit::Circuit;
use crate::history;
use crate::instance::Instance;
use crate::question::{Outcome, Question};
use crate::registry::{Entry, Registry};
use crate::{host, trace};
use std::ffi::c_int;

/// Answers a call.
pub(crate) fn respond(call: &Call<'_>, registry: &mut Registry) -> Outcome {
    let Some(entry) = registry.find(call.key()) else {
        return Outcome::Stop("an instance was not set up".into());
    };
    let question = match call.question() {
        Ok(question) => question,
        Err(why) => return Outcome::Stop(why.into()),
    };
    let ports = call.size(PORTS);
    let doubles = history::len(ports);
    if call.init() {
        // SAFETY: this is the instance's first call in a load.
        unsafe { host::reserve(doubles) };
    }
    let from = c_int::from(!matches!(question, Question::SmallSignal { .. }));
    // SAFETY: this is within a load; the memory has the size that was reserved.
    let recalled = unsafe { host::memory(from).as_ref().map(|m| std::slice::from_raw_parts(m, doubles)) };
    let Some(recalled) = recalled else {
        return Outcome::Stop("ngspice gave no state memory".into());
    };
    history::read(recalled, entry.epoch, &mut entry.previous);
    if question == Question::Static && call.sweep() {
        if !entry.sweeping {
            // the host's memory still holds a point of the analysis before, which is no point of this sweep
            entry.stale = entry.previous.token;
        }
        if entry.stale.is_some() && entry.previous.token == entry.stale {
            entry.previous.token = None;
        } else {
            entry.stale = None;
        }
    } else if question == Question::Static {
        // from rest
        entry.previous.token = None;
    }
    entry.sweeping = question == Question::Static && call.sweep();
    if matches!(question, Question::SmallSignal { .. }) {
        // A host that takes this for a transient has copied another point's record over this one's.
        entry.previous.token = entry.balanced.or(entry.previous.token);
    }
    if matches!(question, Question::Transient { .. }) && !entry.integrals {
        // SAFETY: this is within a load of a transient, and the charges lie within this point's memory.
        entry.integrals = unsafe { (0..ports).all(|n| host::integral(host::memory(0).add(history::HEAD + n))) };
    }
    call.voltages(&mut entry.voltages);
    let outcome = entry.instance.ask(question, &entry.voltages, &entry.previous);
    if outcome == Outcome::Solved {
        if question == Question::Static {
            entry.balanced = entry.instance.answer().token;
        }
        match question {
            Question::SmallSignal { .. } => write_gains(call, &entry.instance),
            _ => write_answer(call, entry, doubles),
        }
    }
    if trace::on() {
        trace_call(entry, question, &outcome);
    }
    outcome
}

fn write_answer(call: &Call<'_>, entry: &mut Entry, doubles: usize) {
    let (answer, ports) = (entry.instance.answer(), call.size(PORTS));
    entry.nodes.clear();
    entry.nodes.extend((0..ports).map(|n| call.given(n)));
    for n in 0..ports {
        call.set(PORTS, n, answer.currents[n], &answer.conductances[n * ports..(n + 1) * ports]);
    }
    for n in 0..call.size(MONITORS) {
        call.set(MONITORS, n, answer.monitors[n], &answer.monitor_gains[n * ports..(n + 1) * ports]);
    }
    // SAFETY: this is within a load; this point's memory has the size that was reserved, and no other view of it.
    let memory = unsafe { host::memory(0).as_mut().map(|m| std::slice::from_raw_parts_mut(m, doubles)) };
    entry.record = 0;
    if let (Some(memory), Some(token)) = (memory, answer.token) {
        entry.record = memory.as_ptr() as usize;
        history::write(memory, entry.epoch, token, &answer.charges, &answer.base);
    }
}

/// Puts into the record what the accepted solution differs from the one that the device was asked at.
///
/// Newton's iteration ends when two solutions lie close together, and the device was asked at the first. Up to there its
/// currents went on straight, along their derivatives, and so did the charge that the circuit delivered. The next step has
/// to begin from that charge: what is left out at each point would be lost or gained for good, and always with the same
/// sign where a charge curves one way.
pub(crate) fn settle(entry: &mut Entry, circuit: Circuit) {
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

fn write_gains(call: &Call<'_>, instance: &Instance) {
    let ports = call.size(PORTS);
    for n in 0..ports {
        call.set_gains(PORTS, n, instance.admittances(n));
    }
    for n in 0..call.size(MONITORS) {
        call.set_gains(MONITORS, n, instance.monitor_responses(n));
    }
}

fn trace_call(entry: &Entry, question: Question, outcome: &Outcome) {
    let (name, answer) = (entry.instance.name(), entry.instance.answer());
    trace::line(format_args!(
        "{name} {question:?} parent {:?} v {:?} -> {outcome:?} token {:?} i {:?} q {:?} monitors {:?}",
        entry.previous.token, entry.voltages, answer.token, answer.currents, answer.charges, answer.monitors
    ));
}
