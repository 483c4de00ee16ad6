//! Motion in time under waveforms of the ports.
//!
//! Voltages that do not change are those of a transient run. Waveforms of straight pieces step the device, whose ports go linearly from one output time to the
//! next; corners of the waveforms are output times.

use super::sentences;
use crate::answer::Answer;
use crate::bench::Bench;
use crate::figure;
use crate::question::{BenchState, MotionQuestion};
use crate::refusal::Refusal;
use bimorph_analysis::chosen_run::{FittedRun, run_as_chosen};
use bimorph_analysis::mesh::fitted_in_time;
use bimorph_analysis::transient::{TransientOptions, transient};
use bimorph_base::budget;
use bimorph_device::local::LocalDevice;
use bimorph_device::run::{Run, Stepped};
use bimorph_device::{Device, OpenRequest};
use bimorph_model::compile::CompiledModel;
use bimorph_model::options::OptionValue;
use bimorph_model::options::analysis::{TRAN_POINTS, TRAN_STOP};
use std::sync::Arc;

/// Frames of the moving picture.
const MAX_FRAMES: usize = 240;
/// Numbers of all frames.
const MAX_NUMBERS: usize = 3_000_000;
/// Most output times.
const MAX_POINTS: usize = 20_001;
/// Most corners of one waveform.
const MAX_CORNERS: usize = 20_000;

/// Samples of a run: times, and one column for each signal.
struct MotionSamples {
    t: Vec<f64>,
    columns: Vec<Vec<f64>>,
    units: Vec<String>,
    warnings: Vec<String>,
}

/// The motion from rest, with the requested signals and the frames of the picture.
pub(crate) fn motion(
    bench: &Bench,
    state: &BenchState,
    asked: &MotionQuestion,
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Answer, Refusal> {
    TRAN_STOP.check(&OptionValue::Number(asked.stop)).map_err(Refusal::of)?;
    TRAN_POINTS.check(&OptionValue::Count(asked.points)).map_err(Refusal::of)?;
    if asked.points > MAX_POINTS {
        return Err(Refusal::of(format!("{} output times; the page shows at most {MAX_POINTS}", asked.points)));
    }
    check_waves(asked)?;
    let drawn = bench.compiled(state)?;
    let drawn = if asked.waves.is_empty() { drawn } else { drawn.for_given_steps() };
    let mut held = state.voltages();
    // the mesh is that of the largest voltages
    for (port, corners) in &asked.waves {
        held.retain(|(name, _)| name != port);
        let largest = corners.iter().map(|[_, v]| *v).max_by(|a, b| a.abs().total_cmp(&b.abs()));
        held.extend(largest.map(|volts| (port.clone(), volts)));
    }
    let options = TransientOptions {
        stop: asked.stop,
        signals: asked.signals.clone(),
        points: asked.points,
        tol: drawn.options.errors().requested(),
        voltages: held,
        ..TransientOptions::default()
    };
    let signals_on = |fitted: &CompiledModel| {
        let chosen = if asked.signals.is_empty() { free_nodes(fitted) } else { asked.signals.clone() };
        let all: Vec<String> = chosen.iter().cloned().chain(picture_signals(fitted)).collect();
        (chosen, all)
    };
    let (fitted, chosen, samples) = if asked.waves.is_empty() {
        let mut attempt = |run: FittedRun, _: &mut dyn FnMut(f64, &[f64]), watch: &mut dyn FnMut(f64) -> bool| {
            let (chosen, all) = signals_on(&run.moving);
            let found = transient(&run.moving, &options.with_signals(all), &mut |_, _| (), watch)?;
            Ok((found, (run.moving, chosen)))
        };
        let watch = &mut |fraction| progress(fraction);
        let (found, (fitted, chosen)) = run_as_chosen(&drawn, &options, &mut attempt, &mut |_, _| (), watch)?;
        let samples = MotionSamples {
            t: found.t,
            units: found.signals.iter().map(|s| s.1.clone()).collect(),
            columns: found.signals.into_iter().map(|s| s.2).collect(),
            warnings: found.warnings,
        };
        (fitted, chosen, samples)
    } else {
        let (fitted, _) = fitted_in_time(&drawn, &options)?;
        let (chosen, all) = signals_on(&fitted);
        let samples = stepped(&fitted, state, asked, &all, progress)?;
        (fitted, chosen, samples)
    };
    let mut answer = Answer::default();
    put_signals(&mut answer, &chosen, &samples, asked.signals.is_empty());
    put_frames(&mut answer, &fitted, &samples, chosen.len());
    let warnings = sentences(&fitted.warnings.items).into_iter().chain(samples.warnings);
    answer.put("warnings", warnings.collect::<Vec<_>>());
    Ok(answer)
}

/// Corners ascend, and there are not too many.
fn check_waves(asked: &MotionQuestion) -> Result<(), Refusal> {
    for (port, corners) in &asked.waves {
        let ascends = corners.windows(2).all(|pair| pair[0][0] < pair[1][0]);
        let finite = corners.iter().flatten().all(|x| x.is_finite());
        if corners.is_empty() || corners.len() > MAX_CORNERS || !ascends || !finite {
            let expected = format!("1 to {MAX_CORNERS} corners with ascending times");
            return Err(Refusal::of(format!("waveform of port \"{port}\": expected {expected}")));
        }
    }
    Ok(())
}

/// Value of a waveform at a time; it keeps its first and last value outside its corners.
fn wave_at(corners: &[[f64; 2]], t: f64) -> f64 {
    let after = corners.partition_point(|[corner, _]| *corner <= t);
    match (after.checked_sub(1).map(|k| corners[k]), corners.get(after)) {
        (None, Some([_, v])) => *v,
        (Some([_, v]), None) => v,
        (Some([t0, v0]), Some([t1, v1])) => v0 + (v1 - v0) * (t - t0) / (t1 - t0),
        (None, None) => 0.0,
    }
}

/// The motion under waveforms, stepped by the device.
fn stepped(
    fitted: &CompiledModel,
    state: &BenchState,
    asked: &MotionQuestion,
    signals: &[String],
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<MotionSamples, Refusal> {
    let mut device = LocalDevice::new(Arc::new(fitted.clone()));
    let open = OpenRequest { ports: Vec::new(), signals: signals.to_vec(), noise: None };
    let opened = device.open(&open).map_err(Refusal::of)?;
    if let Some(unknown) = asked.waves.keys().find(|port| opened.ports.iter().all(|p| p.name != **port)) {
        return Err(Refusal::of(format!("no port named \"{unknown}\"")));
    }
    let given = |t: f64| -> Vec<f64> {
        let port = |name: &str| match asked.waves.get(name) {
            Some(corners) => wave_at(corners, t),
            None => state.ports.get(name).copied().unwrap_or_default(),
        };
        opened.ports.iter().map(|p| port(&p.name)).collect()
    };
    let even = (1..asked.points).map(|k| asked.stop * k as f64 / (asked.points - 1) as f64);
    let mut times: Vec<f64> = even.collect();
    let corners = asked.waves.values().flatten().map(|[t, _]| *t).filter(|t| *t > 0.0 && *t < asked.stop);
    times.extend(corners);
    times.sort_by(f64::total_cmp);
    times.dedup_by(|a, b| *a - *b <= 1e-12 * asked.stop);
    let mut samples = MotionSamples {
        t: vec![0.0],
        columns: vec![vec![0.0]; signals.len()],
        units: opened.signals.iter().map(|s| s.unit.clone()).collect(),
        warnings: Vec::new(),
    };
    first_sample(fitted, signals, &given(0.0), &mut samples)?;
    let mut run = Run::new(None, 0.0, given(0.0));
    for &t in &times {
        budget::check();
        if !progress(t / asked.stop) {
            return Err(Refusal { superseded: true, ..Refusal::of("cancelled") });
        }
        match run.step(&mut device, t, &given(t)).map_err(Refusal::of)? {
            Stepped::Taken => {}
            Stepped::Failed(why) => {
                samples.warnings.push(format!("the run ends at {:.4e} s: {why}", run.t()));
                break;
            }
        }
        samples.t.push(t);
        let outputs = &run.last().outputs;
        samples.columns.iter_mut().zip(outputs).for_each(|(column, value)| column.push(*value));
        if let Some(token) = run.last().token {
            device.accept(token);
        }
    }
    Ok(samples)
}

/// The signals at rest as drawn.
fn first_sample(
    fitted: &CompiledModel,
    signals: &[String],
    given: &[f64],
    samples: &mut MotionSamples,
) -> Result<(), Refusal> {
    let ports = fitted.structure.ports.iter().map(|p| p.name.clone()).zip(given.iter().copied());
    let instant = TransientOptions {
        stop: 1e-15,
        signals: signals.to_vec(),
        points: 2,
        voltages: ports.collect(),
        step: Some(1e-15),
        ..TransientOptions::default()
    };
    let found = transient(fitted, &instant, &mut |_, _| (), &mut |_| true)?;
    samples.columns.iter_mut().zip(found.signals).for_each(|(column, s)| column[0] = s.2[0]);
    Ok(())
}

/// Signals that the picture needs: x, y and rotation of every node and of the inner points of every beam, in the order of the figure.
fn picture_signals(fitted: &CompiledModel) -> Vec<String> {
    let nodes = fitted.structure.nodes.iter().filter(|node| node.mechanical).map(|node| node.name.clone());
    let beams = fitted.structure.beams.iter().zip(&fitted.parts.beams);
    let inner =
        beams.flat_map(|(beam, points)| (1..points.len().saturating_sub(1)).map(|k| format!("{}[{k}]", beam.name)));
    nodes.chain(inner).flat_map(|name| ["x", "y", "rz"].map(|d| format!("{name}.{d}"))).collect()
}

/// x and y of every mechanical node that no anchor holds.
fn free_nodes(fitted: &CompiledModel) -> Vec<String> {
    let structure = &fitted.structure;
    let anchored = structure.anchored();
    let free = structure.nodes.iter().zip(anchored).filter(|(node, anchored)| node.mechanical && !anchored);
    free.flat_map(|(node, _)| [format!("{}.x", node.name), format!("{}.y", node.name)]).collect()
}

/// The chosen signals; of those that were not chosen the two of the node that moves most.
fn put_signals(answer: &mut Answer, chosen: &[String], samples: &MotionSamples, by_size: bool) {
    let span = |k: usize| {
        let column = &samples.columns[k];
        let (low, high) = column.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |r, x| (r.0.min(*x), r.1.max(*x)));
        high - low
    };
    let kept: Vec<usize> = if by_size {
        let pair = (0..chosen.len() / 2)
            .max_by(|a, b| span(2 * a).hypot(span(2 * a + 1)).total_cmp(&span(2 * b).hypot(span(2 * b + 1))));
        pair.map_or(Vec::new(), |k| vec![2 * k, 2 * k + 1])
    } else {
        (0..chosen.len()).collect()
    };
    answer.put("t", &samples.t);
    let signals = kept.iter().map(|&k| (&chosen[k], &samples.units[k], &samples.columns[k]));
    answer.put("signals", signals.collect::<Vec<_>>());
}

/// The geometry and the frames: displacements of all points at some of the times.
fn put_frames(answer: &mut Answer, fitted: &CompiledModel, samples: &MotionSamples, skipped: usize) {
    let structure = &fitted.structure;
    let columns = &samples.columns[skipped..];
    let curves = fitted.parts.beams.iter().map(|points| vec![Default::default(); points.len()]).collect();
    figure::put(answer, structure, &curves, &[]);
    let times = samples.t.len();
    let wanted = (MAX_NUMBERS / columns.len().max(1)).clamp(2, MAX_FRAMES).min(times);
    let rows: Vec<usize> = (0..wanted).map(|i| i * (times - 1) / (wanted - 1).max(1)).collect();
    answer.put("frame_times", rows.iter().map(|&row| samples.t[row]).collect::<Vec<_>>());
    let held = [0.0; 3];
    let frame = |&row: &usize| {
        let mut next = columns.chunks_exact(3).map(move |c| [c[0][row], c[1][row], c[2][row]]);
        let nodes: Vec<[f64; 3]> = structure
            .nodes
            .iter()
            .map(|node| if node.mechanical { next.next().unwrap_or(held) } else { held })
            .collect();
        nodes.into_iter().chain(next).flatten().collect::<Vec<f64>>()
    };
    answer.array("frames", rows.iter().flat_map(frame));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A waveform is linear between its corners and constant outside.
    #[test]
    fn waveforms_are_linear_between_corners() {
        let corners = [[1.0, 0.0], [2.0, 4.0]];
        let at = [0.0, 1.0, 1.5, 2.0, 9.0].map(|t| wave_at(&corners, t));
        assert_eq!(at, [0.0, 0.0, 2.0, 4.0, 4.0]);
        assert_eq!(wave_at(&[[0.0, 3.0]], 5.0), 3.0);
    }
}
