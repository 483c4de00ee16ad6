//! The rows of a job, in the order in which they were finished. Rows have the same columns nearly always, so each says only which of those
//! that there are it has.

use super::super::pace::CHUNK_BYTES;
use bimorph_jobs::sweep::SweepSpec;
use bimorph_jobs::sweep::journal::JournalRow;
use bimorph_wire::convert::model::setting_to_wire;
use bimorph_wire::proto;
use prost::Message;
use std::collections::BTreeMap;

/// Names and units of the columns of a row.
type RowColumns = Vec<(String, String)>;

/// Rows in the order in which they were finished.
#[derive(Debug, Default)]
pub(super) struct FinishedRows {
    columns: Vec<RowColumns>,
    known: BTreeMap<RowColumns, u32>,
    rows: Vec<FinishedRow>,
    failed: u64,
}

#[derive(Debug)]
struct FinishedRow {
    point: usize,
    columns: u32,
    /// NaN where the quantity does not exist.
    values: Box<[f64]>,
    estimated_error: Option<f64>,
    warning: Box<str>,
    /// Why there are no values.
    error: Option<Box<str>>,
}

/// How far a stream has come.
#[derive(Debug, Default)]
pub(super) struct RowCursor {
    /// The next row.
    pub(super) next: u64,
    /// Announced columns, and their numbers on the stream.
    reported: BTreeMap<u32, u32>,
    /// Whether there was a message.
    pub(super) begun: bool,
}

impl RowCursor {
    /// From a row on.
    pub(super) fn from(next: u64) -> Self {
        Self { next, ..Self::default() }
    }
}

impl FinishedRows {
    /// Takes in a row.
    pub(super) fn push(&mut self, kept: JournalRow) {
        let JournalRow { point, values, estimated_error, warning, error } = kept;
        let numbers = values.iter().map(|(_, _, value)| value.unwrap_or(f64::NAN)).collect();
        let columns: RowColumns = values.into_iter().map(|(name, unit, _)| (name, unit)).collect();
        let last = self.rows.last().map(|row| row.columns).filter(|last| self.columns[*last as usize] == columns);
        let columns = match last.or_else(|| self.known.get(&columns).copied()) {
            Some(known) => known,
            None => {
                // no more of them than rows, which are numbered so as well
                let number = u32::try_from(self.columns.len()).unwrap_or(u32::MAX);
                self.columns.push(columns.clone());
                *self.known.entry(columns).or_insert(number)
            }
        };
        self.failed += u64::from(error.is_some());
        let (warning, error) = (warning.into(), error.map(Into::into));
        self.rows.push(FinishedRow { point, columns, values: numbers, estimated_error, warning, error });
    }

    /// Rows that there are.
    pub(super) fn len(&self) -> u64 {
        self.rows.len() as u64
    }

    /// Those of them with an error.
    pub(super) fn failed(&self) -> u64 {
        self.failed
    }

    /// Points that have a row.
    pub(super) fn points(&self) -> impl Iterator<Item = usize> {
        self.rows.iter().map(|row| row.point)
    }

    /// Bytes that they take, about.
    pub(super) fn bytes(&self) -> usize {
        let texts = |row: &FinishedRow| row.warning.len() + row.error.as_ref().map_or(0, |error| error.len());
        self.rows.iter().map(|row| size_of::<FinishedRow>() + 8 * row.values.len() + texts(row)).sum()
    }

    /// Every row as it was found.
    pub(super) fn found(&self) -> impl Iterator<Item = JournalRow> {
        self.rows.iter().map(|row| {
            let number = |x: &f64| (!x.is_nan()).then_some(*x);
            let columns = self.columns[row.columns as usize].iter().zip(&row.values);
            JournalRow {
                point: row.point,
                values: columns.map(|((name, unit), x)| (name.clone(), unit.clone(), number(x))).collect(),
                estimated_error: row.estimated_error,
                warning: row.warning.to_string(),
                error: row.error.as_ref().map(ToString::to_string),
            }
        })
    }

    /// The next rows of a stream, as many as fit into a message, and below `end`.
    pub(super) fn chunk(&self, spec: &SweepSpec, reading: &mut RowCursor, end: u64) -> proto::JobRows {
        let mut chunk = proto::JobRows { first_row: reading.next, ..Default::default() };
        if !std::mem::replace(&mut reading.begun, true) {
            chunk.parameters = spec.names().map(str::to_owned).collect();
        }
        let mut bytes = chunk.encoded_len();
        let first = usize::try_from(reading.next).unwrap_or(usize::MAX);
        let end = usize::try_from(end).unwrap_or(usize::MAX).min(self.rows.len());
        for row in self.rows.get(first..end).unwrap_or_default() {
            let new = !reading.reported.contains_key(&row.columns) && row.error.is_none();
            let columns = new.then(|| wire_columns(&self.columns[row.columns as usize]));
            let number = match reading.reported.get(&row.columns) {
                Some(number) => *number,
                None if new => u32::try_from(reading.reported.len()).unwrap_or(u32::MAX),
                None => 0,
            };
            let wire = proto::JobRow { row: Some(row.to_wire(spec)), columns: number };
            bytes += wire.encoded_len() + 8 + columns.as_ref().map_or(0, |columns| columns.encoded_len() + 8);
            if bytes > CHUNK_BYTES && !chunk.rows.is_empty() {
                break;
            }
            if let Some(columns) = columns {
                reading.reported.insert(row.columns, number);
                chunk.columns.push(columns);
            }
            chunk.rows.push(wire);
            reading.next += 1;
        }
        chunk
    }
}

fn wire_columns(columns: &RowColumns) -> proto::JobColumns {
    let (results, units) = columns.iter().cloned().unzip();
    proto::JobColumns { results, units }
}

impl FinishedRow {
    fn to_wire(&self, spec: &SweepSpec) -> proto::SweepRow {
        proto::SweepRow {
            point: self.point as u64,
            parameters: spec.settings(self.point).iter().map(|(_, value)| setting_to_wire("", value)).collect(),
            results: self.values.to_vec(),
            error: self.error.as_deref().unwrap_or_default().to_owned(),
            estimated_error: self.estimated_error,
            warning: self.warning.to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    //! Rows keep their content for any columns, in messages that can resume at any row.
    use super::*;
    use bimorph_jobs::sweep::{Shard, SweepAnalysis};

    fn kept(point: usize, columns: &[&str], error: Option<&str>) -> JournalRow {
        let value = |name: &&str| ((*name).to_owned(), "m".to_owned(), (*name != "gone").then_some(point as f64));
        let values = if error.is_some() { Vec::new() } else { columns.iter().map(value).collect() };
        JournalRow { point, values, estimated_error: Some(0.5), warning: "w".into(), error: error.map(str::to_owned) }
    }

    #[test]
    fn rows_go_on_from_any_row() {
        let given = [
            kept(3, &["a", "gone"], None),
            kept(1, &[], Some("no way")),
            kept(0, &["a"], None),
            kept(2, &["a", "gone"], None),
        ];
        let mut rows = FinishedRows::default();
        given.iter().cloned().for_each(|kept| rows.push(kept));
        assert_eq!((rows.len(), rows.failed()), (4, 1));
        assert!(rows.found().eq(given.iter().cloned()));
        let analysis = SweepAnalysis::PullIn { port: None, max: 1.0 };
        let axis = "w=1:4:4".parse().expect("an axis");
        let spec =
            SweepSpec { parameters: vec![axis], samples: None, analysis, shard: Shard::default(), threads: None };
        for first in 0..=4 {
            let mut reading = RowCursor::from(first);
            let chunk = rows.chunk(&spec, &mut reading, 4);
            assert_eq!((chunk.first_row, chunk.parameters.as_slice()), (first, &["w".to_owned()][..]));
            assert_eq!(reading.next, 4);
            for (row, given) in chunk.rows.iter().zip(&given[first as usize..]) {
                let wire = row.row.as_ref().expect("a row");
                assert_eq!((wire.point, &wire.error), (given.point as u64, &given.error.clone().unwrap_or_default()));
                if given.error.is_none() {
                    let columns = &chunk.columns[row.columns as usize];
                    assert!(columns.results.iter().eq(given.values.iter().map(|(name, _, _)| name)));
                    assert_eq!(wire.results.len(), columns.results.len());
                }
            }
        }
    }
}
