//! Columns of samples with names and units: the output of every analysis.

use thiserror::Error;

/// Samples of one quantity.
#[derive(Debug, Clone, PartialEq)]
pub enum ColumnSamples {
    /// Real numbers.
    Real(Vec<f64>),
    /// Complex numbers as [re, im].
    Complex(Vec<[f64; 2]>),
}

impl ColumnSamples {
    /// Number of samples.
    pub fn len(&self) -> usize {
        match self {
            Self::Real(v) => v.len(),
            Self::Complex(v) => v.len(),
        }
    }

    /// True without any sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The samples as real numbers; complex ones by magnitude.
    pub fn magnitudes(&self) -> Vec<f64> {
        match self {
            Self::Real(v) => v.clone(),
            Self::Complex(v) => v.iter().map(|[re, im]| re.hypot(*im)).collect(),
        }
    }

    /// The samples as real numbers; of complex ones the real parts. A frequency in a complex plot of ngspice has an imaginary part
    /// that ngspice never sets.
    pub fn real_parts(&self) -> Vec<f64> {
        match self {
            Self::Real(v) => v.clone(),
            Self::Complex(v) => v.iter().map(|[re, _]| *re).collect(),
        }
    }
}

/// One quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name, such as `c.x`.
    pub name: String,
    /// Unit in SI, such as "m"; empty for a pure number.
    pub unit: String,
    /// Its samples.
    pub samples: ColumnSamples,
}

/// Columns of equal length. The first is the independent one (time, voltage, frequency).
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// One line that says what this is.
    pub title: String,
    /// Kind of result as ngspice names it ("Transient Analysis").
    pub plot_name: String,
    columns: Vec<Column>,
}

/// A column that does not fit its table.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("column \"{name}\" has {got} samples where the table has {expected}")]
pub struct LengthMismatch {
    /// The column.
    pub name: String,
    /// Rows of the table.
    pub expected: usize,
    /// Samples of the column.
    pub got: usize,
}

impl Table {
    /// A table without columns.
    pub fn new(title: impl Into<String>, plot_name: impl Into<String>) -> Self {
        Self { title: title.into(), plot_name: plot_name.into(), columns: Vec::new() }
    }

    /// Adds a column.
    ///
    /// # Errors
    /// [`LengthMismatch`] when it is not as long as the others.
    pub fn push(&mut self, column: Column) -> Result<(), LengthMismatch> {
        match self.columns.first() {
            Some(first) if first.samples.len() != column.samples.len() => {
                Err(LengthMismatch { expected: first.samples.len(), got: column.samples.len(), name: column.name })
            }
            _ => {
                self.columns.push(column);
                Ok(())
            }
        }
    }

    /// Adds a column of real samples; see [`Table::push`].
    ///
    /// # Errors
    /// [`LengthMismatch`].
    pub fn push_real(&mut self, name: &str, unit: &str, samples: Vec<f64>) -> Result<(), LengthMismatch> {
        self.push(Column { name: name.to_owned(), unit: unit.to_owned(), samples: ColumnSamples::Real(samples) })
    }

    /// The columns, the independent one first.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The column of that name; letters may differ in case, as in ngspice.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|c| c.name.eq_ignore_ascii_case(name))
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |c| c.samples.len())
    }

    /// True when any column is complex.
    pub fn is_complex(&self) -> bool {
        self.columns.iter().any(|c| matches!(c.samples, ColumnSamples::Complex(_)))
    }
}
