//! Sweeps: requests and tables.

use super::model::{setting_from_wire, setting_to_wire};
use super::{Violation, named, number, options, required, samples, voltages};
use crate::proto;
use bimorph_base::Setting;
use bimorph_jobs::sweep::journal::JournalRow;
use bimorph_jobs::sweep::{self, Shard, SweepAnalysis, SweepParameter, SweepRow, SweepSpec, SweepTable};
use bimorph_model::options::analysis::{MODES_COUNT, PULL_IN_MAX, TRAN_STOP};
use bimorph_model::options::{OptionDescription, OptionValue};
use proto::sweep_parameter::Values;
use proto::sweep_spec::Analysis;

/// A specification as it travels.
pub fn spec_to_wire(spec: &SweepSpec) -> proto::SweepSpec {
    let analysis = match &spec.analysis {
        SweepAnalysis::Static { outputs, voltages } => {
            Analysis::Static(proto::SweepStatic { outputs: outputs.clone(), voltages: named(voltages) })
        }
        SweepAnalysis::Modes { count, voltages } => {
            let count = u32::try_from(*count).unwrap_or(u32::MAX);
            Analysis::Modes(proto::SweepModes { count, voltages: named(voltages) })
        }
        SweepAnalysis::PullIn { port, max } => {
            Analysis::PullIn(proto::SweepPullIn { port: port.clone().unwrap_or_default(), max_v: *max })
        }
        SweepAnalysis::Transient { stop, outputs, voltages } => {
            let (outputs, voltages) = (outputs.clone(), named(voltages));
            Analysis::Transient(proto::SweepTransient { stop_s: *stop, outputs, voltages })
        }
    };
    let axis = |axis: &SweepParameter| {
        let values = match axis.values {
            sweep::Values::Linear { low, high, count } if !axis.in_step => {
                Values::Linear(proto::Linear { low, high, count: u32::try_from(count).unwrap_or(u32::MAX) })
            }
            _ => {
                let values = axis.values.iter().map(|value| setting_to_wire("", &value)).collect();
                let list = proto::SettingList { values };
                if axis.in_step { Values::InStep(list) } else { Values::List(list) }
            }
        };
        proto::SweepParameter { name: axis.name.clone(), values: Some(values) }
    };
    proto::SweepSpec {
        parameters: spec.parameters.iter().map(axis).collect(),
        analysis: Some(analysis),
        shard: u32::try_from(spec.shard.index).unwrap_or(u32::MAX),
        shards: u32::try_from(spec.shard.count).unwrap_or(u32::MAX),
        samples: spec.samples.as_ref().map(|samples| samples::to_wire(&samples.asked)),
    }
}

/// Requested outputs at each point.
pub fn outputs(spec: &proto::SweepSpec) -> usize {
    match &spec.analysis {
        Some(Analysis::Static(asked)) => asked.outputs.len(),
        Some(Analysis::Transient(asked)) => asked.outputs.len(),
        Some(Analysis::Modes(_) | Analysis::PullIn(_)) | None => 0,
    }
}

/// Requested modes at each point.
pub fn modes(spec: &proto::SweepSpec) -> usize {
    match &spec.analysis {
        Some(Analysis::Modes(asked)) => modes_of(asked),
        _ => 0,
    }
}

fn modes_of(asked: &proto::SweepModes) -> usize {
    if asked.count == 0 { MODES_COUNT.count() } else { asked.count as usize }
}

/// Points of a grid as it came, before any axis is laid out; an axis without values counts as one.
pub fn grid_points(spec: &proto::SweepSpec) -> usize {
    let values = |axis: &proto::SweepParameter| match &axis.values {
        Some(Values::Linear(linear)) => linear.count as usize,
        Some(Values::List(list)) => list.values.len(),
        // goes along with the one before it
        Some(Values::InStep(_)) | None => 1,
    };
    let samples = spec.samples.as_ref().map_or(1, |samples| samples.count as usize).max(1);
    spec.parameters.iter().fold(samples, |points, axis| points.saturating_mul(values(axis).max(1)))
}

/// A checked specification. Allocates every axis: [`grid_points`] gives their lengths before.
///
/// # Errors
/// Anything missing, empty, or not finite.
pub fn spec_from_wire(spec: Option<proto::SweepSpec>) -> Result<SweepSpec, Violation> {
    let spec = required("spec", spec)?;
    let mut parameters = Vec::with_capacity(spec.parameters.len());
    for (i, axis) in spec.parameters.into_iter().enumerate() {
        parameters.push(axis_from_wire(&format!("spec.parameters[{i}]"), axis)?);
    }
    let within = |part: &str, about: &OptionDescription, value: OptionValue| {
        options::analysis(about, value)
            .map_err(|refused| Violation { field: format!("spec.{part}.{}", refused.field), ..refused })
    };
    let analysis = match required("spec.analysis", spec.analysis)? {
        Analysis::Static(s) => {
            SweepAnalysis::Static { outputs: s.outputs, voltages: voltages("spec.static.voltages", s.voltages)? }
        }
        Analysis::Modes(m) => {
            let count = modes_of(&m);
            within("modes", &MODES_COUNT, OptionValue::Count(count))?;
            SweepAnalysis::Modes { count, voltages: voltages("spec.modes.voltages", m.voltages)? }
        }
        Analysis::PullIn(p) => {
            within("pull_in", &PULL_IN_MAX, OptionValue::Number(p.max_v))?;
            SweepAnalysis::PullIn { port: (!p.port.is_empty()).then_some(p.port), max: p.max_v }
        }
        Analysis::Transient(t) => {
            within("transient", &TRAN_STOP, OptionValue::Number(t.stop_s))?;
            let voltages = voltages("spec.transient.voltages", t.voltages)?;
            SweepAnalysis::Transient { stop: t.stop_s, outputs: t.outputs, voltages }
        }
    };
    let shard = Shard { index: spec.shard as usize, count: spec.shards.max(1) as usize };
    let samples = spec.samples.map(samples::from_wire).transpose()?;
    Ok(SweepSpec { parameters, samples, analysis, shard, threads: None })
}

fn axis_from_wire(field: &str, axis: proto::SweepParameter) -> Result<SweepParameter, Violation> {
    let listed = |list: proto::SettingList, kind: &str| {
        let convert = |(i, value)| setting_from_wire(&format!("{field}.{kind}.values[{i}]"), value);
        list.values.into_iter().enumerate().map(convert).collect::<Result<Vec<_>, _>>().map(sweep::Values::List)
    };
    let in_step = matches!(axis.values, Some(Values::InStep(_)));
    let values = match required(&format!("{field}.values"), axis.values)? {
        Values::Linear(l) => {
            let low = number(&format!("{field}.linear.low"), l.low, false)?;
            let high = number(&format!("{field}.linear.high"), l.high, false)?;
            sweep::Values::Linear { low, high, count: l.count as usize }
        }
        Values::List(list) => listed(list, "list")?,
        Values::InStep(list) => listed(list, "in_step")?,
    };
    if axis.name.is_empty() {
        return Err(Violation::new(format!("{field}.name"), "the parameter has no name"));
    }
    Ok(SweepParameter { name: axis.name, values, in_step })
}

/// A row as it travels.
pub fn row_to_wire(row: &SweepRow) -> proto::SweepRow {
    let (results, error) = match &row.values {
        Ok(values) => (values.iter().map(|value| value.unwrap_or(f64::NAN)).collect(), String::new()),
        Err(error) => (Vec::new(), error.clone()),
    };
    let parameters = row.parameters.iter().map(|value| setting_to_wire("", value)).collect();
    let (estimated_error, warning) = (row.estimated_error, row.warning.clone());
    proto::SweepRow { point: row.point as u64, parameters, results, error, estimated_error, warning }
}

/// A row of a job, with the values of its parameters; `columns` are names and units of what it found.
///
/// # Errors
/// As many numbers as there are no columns.
pub fn job_row_from_wire(
    row: proto::SweepRow,
    columns: Option<&proto::JobColumns>,
) -> Result<(Vec<Setting>, JournalRow), Violation> {
    let convert = |value| setting_from_wire("rows.parameters", value);
    let settings = row.parameters.into_iter().map(convert).collect::<Result<_, _>>()?;
    let columns = columns.filter(|_| row.error.is_empty());
    let (names, units) = columns.map_or((&[][..], &[][..]), |columns| (&*columns.results, &*columns.units));
    if (names.len(), units.len()) != (row.results.len(), row.results.len()) {
        return Err(Violation::new(
            "rows.results",
            format!("expected {} values, got {}", names.len(), row.results.len()),
        ));
    }
    let number = |x: f64| (!x.is_nan()).then_some(x);
    let values = names.iter().zip(units).zip(row.results);
    let kept = JournalRow {
        point: usize::try_from(row.point).unwrap_or(usize::MAX),
        values: values.map(|((name, unit), x)| (name.clone(), unit.clone(), number(x))).collect(),
        estimated_error: row.estimated_error,
        warning: row.warning,
        error: (!row.error.is_empty()).then_some(row.error),
    };
    Ok((settings, kept))
}

/// Adds a chunk to a table.
///
/// # Errors
/// A row without a value where one belongs.
pub fn chunk_from_wire(chunk: proto::SweepChunk, table: &mut SweepTable) -> Result<(), Violation> {
    if !chunk.parameters.is_empty() || !chunk.results.is_empty() {
        table.parameters = chunk.parameters;
        table.results = chunk.results;
        table.units = chunk.units;
    }
    for row in chunk.rows {
        let convert = |value| setting_from_wire("rows.parameters", value);
        let parameters = row.parameters.into_iter().map(convert).collect::<Result<_, _>>()?;
        let values = if row.error.is_empty() {
            Ok(row.results.into_iter().map(|x| (!x.is_nan()).then_some(x)).collect())
        } else {
            Err(row.error)
        };
        let point = usize::try_from(row.point).unwrap_or(usize::MAX);
        let (estimated_error, warning) = (row.estimated_error, row.warning);
        table.rows.push(SweepRow { point, parameters, values, estimated_error, warning });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    //! A specification and a row come back as they were sent.
    use super::*;
    use bimorph_jobs::sweep::{Design, SampleGenerator, Sampling};

    fn samples() -> SampleGenerator {
        let vary = ["w=normal:2u:0.1u", "g=uniform:1u:2u", "E=lognormal:165e9:0.1"].map(|text| text.parse().unwrap());
        let correlations = vec![("w".to_owned(), "E".to_owned(), -0.5)];
        let asked = Sampling { vary: vary.to_vec(), count: 7, seed: u64::MAX, design: Design::Sobol, correlations };
        SampleGenerator::new(asked).unwrap()
    }

    /// However many and long the axes are, their product is known without them.
    #[test]
    fn grids_are_counted_before_they_are_laid_out() {
        let axis = |count| proto::SweepParameter {
            name: "V".into(),
            values: Some(Values::Linear(proto::Linear { low: 0.0, high: 1.0, count })),
        };
        let points = |counts: &[u32]| {
            grid_points(&proto::SweepSpec {
                parameters: counts.iter().map(|c| axis(*c)).collect(),
                ..Default::default()
            })
        };
        assert_eq!(points(&[]), 1);
        assert_eq!(points(&[3, 4]), 12);
        assert_eq!(points(&[0, 4_000_000_000]), 4_000_000_000);
        assert_eq!(points(&[4_000_000_000; 600]), usize::MAX);
    }

    /// A sweep rejects, by field, all values that a single call rejects.
    #[test]
    fn ranges_are_those_of_single_calls() {
        let field = |analysis| {
            let spec = proto::SweepSpec { analysis: Some(analysis), ..Default::default() };
            spec_from_wire(Some(spec)).err().map(|violation| violation.field)
        };
        let pull_in = |max_v| field(Analysis::PullIn(proto::SweepPullIn { max_v, ..Default::default() }));
        let transient = |stop_s| field(Analysis::Transient(proto::SweepTransient { stop_s, ..Default::default() }));
        let modes = |count| field(Analysis::Modes(proto::SweepModes { count, ..Default::default() }));
        for bad in [1e300, f64::INFINITY, f64::NAN, 0.0, -1.0] {
            assert_eq!(pull_in(bad).as_deref(), Some("spec.pull_in.max_v"), "{bad}");
            assert_eq!(transient(bad).as_deref(), Some("spec.transient.stop_s"), "{bad}");
        }
        assert_eq!(modes(4_000_000_000).as_deref(), Some("spec.modes.count"));
        assert_eq!((pull_in(30.0), transient(1e-3), modes(0)), (None, None, None));
    }

    #[test]
    fn specifications_and_rows_survive_the_wire() {
        let axis = |text: &str| text.parse::<SweepParameter>().expect("an axis");
        let spec = SweepSpec {
            parameters: vec![
                axis("w=1u:2u:3"),
                SweepParameter { in_step: true, ..axis("h=1u,3u,2u") },
                axis("layer=p1,p2"),
            ],
            samples: Some(samples()),
            analysis: SweepAnalysis::PullIn { port: None, max: 30.0 },
            shard: Shard { index: 1, count: 4 },
            threads: None,
        };
        assert_eq!(spec_from_wire(Some(spec_to_wire(&spec))), Ok(spec));
        for values in [Ok(vec![Some(1.0), None]), Err("no equilibrium".to_owned())] {
            let (estimated_error, warning) = (values.is_ok().then_some(3e-4), "W040: off".to_owned());
            let row = SweepRow { point: 5, parameters: vec![Setting::Number(1e-6)], values, estimated_error, warning };
            let mut table = SweepTable::default();
            let chunk = proto::SweepChunk { rows: vec![row_to_wire(&row)], ..Default::default() };
            chunk_from_wire(chunk, &mut table).expect("our own row");
            assert_eq!(table.rows, [row]);
        }
    }
}
