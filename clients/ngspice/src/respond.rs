//! One call of the model: read what ngspice asks, ask the device, write the answer and what is to be remembered.

use crate::call::{Call, MONITORS, PORTS};
use crate::history;
use crate::instance::{Instance, Outcome, Question};
use crate::registry::{Entry, Registry};
use crate::{host, trace};
use std::ffi::c_int;

/// Answers a call.
pub(crate) fn respond(call: &Call<'_>, registry: &mut Registry) -> Outcome {
    let (delta, sweep) = (registry.delta, registry.sweep);
    let Some(entry) = registry.find(call.key()) else {
        return Outcome::Stop("an instance was not set up".into());
    };
    let question = call.question(delta);
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
    if question == Question::Static && !sweep {
        entry.previous.token = None;
    }
    if matches!(question, Question::Transient { .. }) && !entry.integrals {
        // SAFETY: this is within a load of a transient, and the charges lie within this point's memory.
        entry.integrals = unsafe { (0..ports).all(|n| host::integral(host::memory(0).add(history::HEAD + n))) };
    }
    call.voltages(&mut entry.voltages);
    let outcome = entry.instance.ask(question, &entry.voltages, &entry.previous);
    if outcome == Outcome::Solved {
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

fn write_answer(call: &Call<'_>, entry: &Entry, doubles: usize) {
    let (answer, ports) = (entry.instance.answer(), call.size(PORTS));
    for n in 0..ports {
        call.set(PORTS, n, answer.currents[n], &answer.conductances[n * ports..(n + 1) * ports]);
    }
    for n in 0..call.size(MONITORS) {
        call.set(MONITORS, n, answer.monitors[n], &answer.monitor_gains[n * ports..(n + 1) * ports]);
    }
    // SAFETY: this is within a load; this point's memory has the size that was reserved, and no other view of it.
    let memory = unsafe { host::memory(0).as_mut().map(|m| std::slice::from_raw_parts_mut(m, doubles)) };
    if let (Some(memory), Some(token)) = (memory, answer.token) {
        history::write(memory, entry.epoch, token, &answer.charges, &answer.base);
    }
}

fn write_gains(call: &Call<'_>, instance: &Instance) {
    let (small, ports) = (instance.small_signal(), call.size(PORTS));
    for n in 0..ports {
        call.set_gains(PORTS, n, small.admittance[n * ports..(n + 1) * ports].iter().copied());
    }
    for (n, monitor) in instance.monitors().iter().enumerate() {
        let row = &small.outputs[n * ports..(n + 1) * ports];
        call.set_gains(MONITORS, n, row.iter().map(|[re, im]| [monitor.scale * re, monitor.scale * im]));
    }
}

fn trace_call(entry: &Entry, question: Question, outcome: &Outcome) {
    let (name, answer) = (entry.instance.name(), entry.instance.answer());
    trace::line(format_args!(
        "{name} {question:?} parent {:?} v {:?} -> {outcome:?} token {:?} i {:?} q {:?} monitors {:?}",
        entry.previous.token, entry.voltages, answer.token, answer.currents, answer.charges, answer.monitors
    ));
}
