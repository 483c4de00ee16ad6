//! The reading half. Nothing in a file is trusted: counts are checked against what is there before space is taken.

use super::super::table::{Column, ColumnSamples, Table};
use super::unit_of;
use thiserror::Error;

/// Why bytes are no raw file.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum RawError {
    /// A line that does not belong there.
    #[error("raw file, byte {offset}: expected {expected}, found \"{found}\"")]
    Unexpected {
        /// Offset of the line from the start of the file.
        offset: usize,
        /// The expected content.
        expected: &'static str,
        /// The line as it stands, shortened.
        found: String,
    },
    /// The file ends before its data does.
    #[error("raw file ends after {got} of {expected} numbers")]
    Truncated {
        /// Numbers announced.
        expected: usize,
        /// Numbers there.
        got: usize,
    },
    /// The file ends inside a header.
    #[error("raw file ends inside its header")]
    HeaderTruncated,
}

struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn line(&mut self) -> Option<(usize, &'a str)> {
        let rest = &self.bytes[self.at..];
        if rest.is_empty() {
            return None;
        }
        let end = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        let start = self.at;
        self.at += (end + 1).min(rest.len());
        Some((start, std::str::from_utf8(&rest[..end]).unwrap_or("(not text)").trim_end_matches('\r')))
    }
}

fn unexpected(offset: usize, expected: &'static str, line: &str) -> RawError {
    RawError::Unexpected { offset, expected, found: line.chars().take(40).collect() }
}

/// Reads every plot of a file.
///
/// # Errors
/// See [`RawError`].
pub fn read(bytes: &[u8]) -> Result<Vec<Table>, RawError> {
    let mut cursor = Cursor { bytes, at: 0 };
    let mut plots = Vec::new();
    while let Some((offset, line)) = cursor.line() {
        if line.trim().is_empty() {
            continue;
        }
        let Some(title) = line.strip_prefix("Title:") else {
            return Err(unexpected(offset, "\"Title:\"", line));
        };
        plots.push(read_plot(title.trim(), &mut cursor)?);
    }
    Ok(plots)
}

fn read_plot(title: &str, cursor: &mut Cursor<'_>) -> Result<Table, RawError> {
    let (mut plot_name, mut complex, mut variables, mut points) = (String::new(), false, 0, 0);
    let mut columns: Vec<(String, &str)> = Vec::new();
    let binary = loop {
        let (offset, line) = cursor.line().ok_or(RawError::HeaderTruncated)?;
        let (key, value) = line.split_once(':').ok_or_else(|| unexpected(offset, "a line \"Key: value\"", line))?;
        let value = value.trim();
        let count = |what| value.parse::<usize>().map_err(|_| unexpected(offset, what, value));
        match key.trim().to_ascii_lowercase().as_str() {
            "plotname" => plot_name = value.to_owned(),
            "flags" => complex = value.split_whitespace().any(|word| word == "complex"),
            "no. variables" => variables = count("a number of variables")?,
            "no. points" => points = count("a number of points")?,
            "variables" => {
                for _ in 0..variables {
                    let (offset, line) = cursor.line().ok_or(RawError::HeaderTruncated)?;
                    let mut words = line.split_whitespace().skip(1);
                    let (Some(name), Some(kind)) = (words.next(), words.next()) else {
                        return Err(unexpected(offset, "\"index name kind\"", line));
                    };
                    columns.push((name.to_owned(), unit_of(kind)));
                }
            }
            "values" => break false,
            "binary" => break true,
            _ => {} // Date, Command, Option: nothing in them is needed.
        }
    };
    let width = if complex { 2 } else { 1 };
    let expected = columns.len().saturating_mul(points).saturating_mul(width);
    let numbers =
        if binary { binary_numbers(cursor, expected)? } else { ascii_numbers(cursor, columns.len(), points, complex)? };
    let mut table = Table::new(title, plot_name);
    let stride = columns.len() * width;
    for (i, (name, unit)) in columns.into_iter().enumerate() {
        let rows = (0..points).map(|row| row * stride + i * width);
        let samples = if complex {
            ColumnSamples::Complex(rows.map(|k| [numbers[k], numbers[k + 1]]).collect())
        } else {
            ColumnSamples::Real(rows.map(|k| numbers[k]).collect())
        };
        // All columns have `points` samples, so this cannot fail; the error is passed on all the same.
        table
            .push(Column { name, unit: unit.to_owned(), samples })
            .map_err(|e| RawError::Truncated { expected: e.expected, got: e.got })?;
    }
    Ok(table)
}

fn binary_numbers(cursor: &mut Cursor<'_>, expected: usize) -> Result<Vec<f64>, RawError> {
    let rest = &cursor.bytes[cursor.at..];
    let got = rest.len() / 8;
    if got < expected {
        return Err(RawError::Truncated { expected, got });
    }
    cursor.at += expected * 8;
    let (numbers, _) = rest[..expected * 8].as_chunks::<8>();
    Ok(numbers.iter().map(|&b| f64::from_le_bytes(b)).collect())
}

fn ascii_numbers(cursor: &mut Cursor<'_>, columns: usize, points: usize, complex: bool) -> Result<Vec<f64>, RawError> {
    let width = if complex { 2 } else { 1 };
    let expected = columns.saturating_mul(points).saturating_mul(width);
    let mut numbers = Vec::with_capacity(expected.min(cursor.bytes.len()));
    for _ in 0..points {
        for column in 0..columns {
            let truncated = RawError::Truncated { expected, got: numbers.len() };
            let (offset, line) = loop {
                let (offset, line) = cursor.line().ok_or(truncated.clone())?;
                if !line.trim().is_empty() {
                    break (offset, line);
                }
            };
            // The first value of a point stands behind the point's index.
            let text = if column == 0 { line.split_whitespace().nth(1) } else { line.split_whitespace().next() };
            let parts: Vec<f64> = text.unwrap_or_default().split(',').map_while(|p| p.parse().ok()).collect();
            if parts.len() != width {
                return Err(unexpected(offset, "a number", line));
            }
            numbers.extend(parts);
        }
    }
    Ok(numbers)
}
