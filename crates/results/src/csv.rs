//! Tables as comma-separated text (RFC 4180): one header line `name [unit]`, then full-precision numbers.

use super::table::{ColumnSamples, Table};
use std::io::{self, Write};

/// Writes `table`. A complex column becomes two, `re(name)` and `im(name)`. Numbers read back to the same bits.
///
/// # Errors
/// Those of `out`.
pub fn write(table: &Table, out: &mut dyn Write) -> io::Result<()> {
    let mut header = Vec::new();
    for column in table.columns() {
        let unit = if column.unit.is_empty() { String::new() } else { format!(" [{}]", column.unit) };
        match column.samples {
            ColumnSamples::Real(_) => header.push(field(&format!("{}{unit}", column.name))),
            ColumnSamples::Complex(_) => {
                header.push(field(&format!("re({}){unit}", column.name)));
                header.push(field(&format!("im({}){unit}", column.name)));
            }
        }
    }
    writeln!(out, "{}", header.join(","))?;
    for row in 0..table.rows() {
        for (i, column) in table.columns().iter().enumerate() {
            if i > 0 {
                out.write_all(b",")?;
            }
            match &column.samples {
                ColumnSamples::Real(v) => write!(out, "{:e}", v[row])?,
                ColumnSamples::Complex(v) => write!(out, "{:e},{:e}", v[row][0], v[row][1])?,
            }
        }
        out.write_all(b"\n")?;
    }
    Ok(())
}

/// A text field, quoted where commas or quotes require it.
pub fn field(text: &str) -> String {
    if text.contains(['"', ',', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::super::table::Column;
    use super::*;

    /// Header with units, complex columns split, and every number reads back to the same bits.
    #[test]
    fn columns_and_full_precision() {
        let mut table = Table::new("t", "AC");
        let values = vec![0.1 + 0.2, -1e-300, f64::MAX];
        table.push_real("time", "s", values.clone()).unwrap();
        table
            .push(Column {
                name: "i,1".into(),
                unit: "A".into(),
                samples: ColumnSamples::Complex(vec![[1.0, -2.5e-9]; 3]),
            })
            .unwrap();
        let mut text = Vec::new();
        write(&table, &mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("time [s],\"re(i,1) [A]\",\"im(i,1) [A]\""));
        for (line, value) in lines.zip(values) {
            let cells: Vec<f64> = line.split(',').map(|c| c.parse().unwrap()).collect();
            assert_eq!(cells, [value, 1.0, -2.5e-9]);
        }
    }
}
