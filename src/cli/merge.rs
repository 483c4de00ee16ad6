//! `bimorph merge`: the shards of a sweep put together.

use super::failure::Failure;
use super::merge_error::{LAST, MergeError};
use super::output::{check_folder, print};
use bimorph::jobs::sweep::shard::{COLUMN, SweepPart, SweepPartError};
use bimorph::results::{atomic, csv::field};
use clap::Args;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::PathBuf;

/// Put the tables of a sweep's shards together: the bytes of the sweep in one run.
///
/// Rows come in grid order. A point that is in two tables or in none is an error. Tables of different sweeps, as
/// identified by the column "part" of their rows, are an error too; the merged table omits that column.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph sweep examples/switch/switch.net --param touch=0.08u:0.12u:9 --analysis pullin --shard 0/2 --out part0.csv\n  \
    bimorph sweep examples/switch/switch.net --param touch=0.08u:0.12u:9 --analysis pullin --shard 1/2 --out part1.csv\n  \
    bimorph merge part0.csv part1.csv --out whole.csv")]
pub(crate) struct MergeCommand {
    /// Tables of `bimorph sweep --shard I/N`, in any order
    #[arg(value_name = "FILE", required = true)]
    parts: Vec<PathBuf>,

    /// Write the table to a .csv file [default: standard output]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// A row: the table it is of, and its fields.
struct ShardRow {
    table: usize,
    fields: csv::StringRecord,
}

/// Columns that all tables share, as far as known.
#[derive(Default)]
struct CommonColumns {
    parameters: Vec<String>,
    /// Of the first row, and the table it is in.
    part: Option<(SweepPart, usize)>,
}

impl MergeCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        if let Some(out) = &self.out {
            if out.extension().is_none_or(|e| !e.eq_ignore_ascii_case("csv")) {
                return Err(Failure::bad("--out", "a .csv file", format!("\"{}\"", out.display())));
            }
            check_folder(out)?;
        }
        let text = merged(&self.parts)?;
        match &self.out {
            Some(path) => atomic::write(path, |out| out.write_all(text.as_bytes()))
                .map_err(|source| Failure::Write { path: path.clone(), source }),
            None => print(&text),
        }
    }
}

fn merged(parts: &[PathBuf]) -> Result<String, MergeError> {
    let mut heads: Vec<csv::StringRecord> = Vec::new();
    let mut whole = CommonColumns::default();
    let mut rows: BTreeMap<usize, ShardRow> = BTreeMap::new();
    for (table, path) in parts.iter().enumerate() {
        let failed = |source| MergeError::Csv { path: path.clone(), source };
        let mut reader = csv::Reader::from_path(path).map_err(failed)?;
        let mut head = reader.headers().map_err(failed)?.clone();
        let of_part = head.iter().next_back() == Some(COLUMN);
        if of_part {
            head.truncate(head.len() - 1);
        } else if parts.len() > 1 && parameters_of(&head).is_some() {
            return Err(MergeError::NoPart { path: path.clone() });
        }
        let own = parameters_of(&head).ok_or_else(|| MergeError::NoTable { path: path.clone() })?;
        if table == 0 {
            whole.parameters = own;
        } else if own != whole.parameters {
            return Err(MergeError::Other { path: path.clone(), first: parts[0].clone() });
        }
        for record in reader.into_records() {
            let mut fields = record.map_err(failed)?;
            if of_part {
                let part = fields.iter().next_back().unwrap_or_default().parse();
                whole.take(part.map_err(|SweepPartError| MergeError::NoPart { path: path.clone() })?, table, parts)?;
                fields.truncate(head.len());
            }
            let number = fields.get(0).unwrap_or_default();
            let point =
                number.parse().map_err(|_| MergeError::NoNumber { path: path.clone(), got: number.to_owned() })?;
            if let Some(first) = rows.insert(point, ShardRow { table, fields }) {
                return Err(MergeError::Twice { point, first: parts[first.table].clone(), second: path.clone() });
            }
        }
        heads.push(head);
    }
    let last = rows.last_key_value().map_or(0, |(last, _)| last.saturating_add(1));
    let count = whole.part.map_or(last, |(part, _)| part.points.max(last));
    if rows.len() < count {
        let first = (0..count).find(|point| !rows.contains_key(point)).unwrap_or_default();
        return Err(MergeError::Missing { missing: count - rows.len(), first });
    }
    Ok(written(&heads, whole.parameters.len(), &rows))
}

impl CommonColumns {
    /// A row of a table says of what it is a part.
    fn take(&mut self, part: SweepPart, table: usize, paths: &[PathBuf]) -> Result<(), MergeError> {
        let (known, first) = self.part.get_or_insert_with(|| (part.clone(), table));
        if part.is_with(known) {
            return Ok(());
        }
        Err(MergeError::Other { path: paths[table].clone(), first: paths[*first].clone() })
    }
}

/// Names of the parameters: the columns between "point" and the first with a unit.
fn parameters_of(head: &csv::StringRecord) -> Option<Vec<String>> {
    let names: Vec<&str> = head.iter().collect();
    let end = names.len().checked_sub(LAST.len())?;
    if names.first() != Some(&"point") || names[end..] != LAST {
        return None;
    }
    Some(names[1..end].iter().take_while(|name| !name.ends_with(']')).map(|name| (*name).to_owned()).collect())
}

/// The table. Results stand in the order in which rows have them first, as in a sweep in one run.
fn written(heads: &[csv::StringRecord], parameters: usize, rows: &BTreeMap<usize, ShardRow>) -> String {
    let first = 1 + parameters;
    let results = |table: usize| first..heads[table].len() - LAST.len();
    let (mut names, mut places) = (Vec::new(), BTreeMap::new());
    let mut add = |table: usize, k: usize| {
        if let Entry::Vacant(place) = places.entry(&heads[table][k]) {
            place.insert(names.len());
            names.push(&heads[table][k]);
        }
    };
    for row in rows.values() {
        // what stands before the last of them in its table is of this row too, or of one that came before
        if let Some(last) = results(row.table).rev().find(|&k| !row.fields[k].is_empty()) {
            (first..=last).for_each(|k| add(row.table, k));
        }
    }
    (0..heads.len()).for_each(|table| results(table).for_each(|k| add(table, k)));
    let mut out = String::new();
    line(&mut out, heads[0].iter().take(first).chain(names.iter().copied()).chain(LAST));
    for row in rows.values() {
        let mut values = vec![""; names.len()];
        for k in results(row.table) {
            values[places[&heads[row.table][k]]] = &row.fields[k];
        }
        let rest = row.fields.iter().skip(row.fields.len() - LAST.len());
        line(&mut out, row.fields.iter().take(first).chain(values).chain(rest));
    }
    out
}

/// One line, quoted as a sweep quotes.
fn line<'a>(out: &mut String, fields: impl Iterator<Item = &'a str>) {
    let fields: Vec<String> = fields.map(field).collect();
    *out += &fields.join(",");
    out.push('\n');
}
