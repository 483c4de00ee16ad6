//! ngspice raw files, binary and ASCII, real and complex.
//!
//! The form is that of ngspice's own `write` command: header lines `Key: value`, the list of variables, then `Values:`
//! or `Binary:` (little-endian doubles, point by point). A file may hold several plots one after another. Files written
//! here carry a fixed date, so that the same result gives the same bytes.

mod read;

pub use read::{RawError, read};

use super::table::{ColumnSamples, Table};
use std::io::{self, Write};

/// How the numbers are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Little-endian doubles.
    Binary,
    /// Decimal text, in full precision.
    Ascii,
}

/// ngspice's word for a quantity, from its SI unit.
const KINDS: [(&str, &str); 9] = [
    ("s", "time"),
    ("Hz", "frequency"),
    ("V", "voltage"),
    ("A", "current"),
    ("K", "temperature"),
    ("C", "charge"),
    ("F", "capacitance"),
    ("S", "admittance"),
    ("W", "power"),
];

fn kind_of(unit: &str) -> &'static str {
    KINDS.iter().find(|(u, _)| *u == unit).map_or("notype", |(_, kind)| kind)
}

fn unit_of(kind: &str) -> &'static str {
    KINDS.iter().find(|(_, k)| *k == kind).map_or("", |(unit, _)| unit)
}

/// Writes one plot. Blanks in names become underscores, since the format separates by blanks. If one column is complex
/// all are. Units that ngspice has no word for (metres, radians) are lost: `notype`.
///
/// # Errors
/// Those of `out`.
pub fn write(table: &Table, encoding: Encoding, out: &mut dyn Write) -> io::Result<()> {
    let complex = table.is_complex();
    writeln!(out, "Title: {}", one_line(&table.title))?;
    writeln!(out, "Date: Thu Jan  1 00:00:00 1970")?;
    writeln!(out, "Plotname: {}", one_line(&table.plot_name))?;
    writeln!(out, "Flags: {}", if complex { "complex" } else { "real" })?;
    writeln!(out, "No. Variables: {}", table.columns().len())?;
    writeln!(out, "No. Points: {}", table.rows())?;
    writeln!(out, "Variables:")?;
    for (i, column) in table.columns().iter().enumerate() {
        let name: String = column.name.split_whitespace().collect::<Vec<_>>().join("_");
        writeln!(out, "\t{i}\t{name}\t{}", kind_of(&column.unit))?;
    }
    match encoding {
        Encoding::Binary => {
            out.write_all(b"Binary:\n")?;
            for row in 0..table.rows() {
                for column in table.columns() {
                    let [re, im] = sample(&column.samples, row);
                    out.write_all(&re.to_le_bytes())?;
                    if complex {
                        out.write_all(&im.to_le_bytes())?;
                    }
                }
            }
        }
        Encoding::Ascii => {
            out.write_all(b"Values:\n")?;
            for row in 0..table.rows() {
                for (i, column) in table.columns().iter().enumerate() {
                    if i == 0 {
                        write!(out, " {row}")?;
                    }
                    let [re, im] = sample(&column.samples, row);
                    // 17 significant digits read back to the same bits.
                    if complex { writeln!(out, "\t{re:.16e},{im:.16e}")? } else { writeln!(out, "\t{re:.16e}")? }
                }
                out.write_all(b"\n")?;
            }
        }
    }
    Ok(())
}

fn sample(samples: &ColumnSamples, row: usize) -> [f64; 2] {
    match samples {
        ColumnSamples::Real(v) => [v[row], 0.0],
        ColumnSamples::Complex(v) => v[row],
    }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::super::table::Column;
    use super::*;
    use proptest::prelude::*;

    fn bits(table: &Table) -> Vec<Vec<[u64; 2]>> {
        let row = |c: &Column| (0..table.rows()).map(|r| sample(&c.samples, r).map(f64::to_bits)).collect();
        table.columns().iter().map(row).collect()
    }

    fn any_table() -> impl Strategy<Value = Table> {
        let number = || any::<f64>().prop_filter("NaN has no single decimal form", |x| !x.is_nan());
        (1usize..5, 0usize..12, any::<bool>()).prop_flat_map(move |(columns, rows, complex)| {
            let values = prop::collection::vec(prop::array::uniform2(number()), rows);
            prop::collection::vec(("[a-z][a-z0-9_.()#]{0,12}", 0..KINDS.len(), values), columns).prop_map(move |list| {
                let mut table = Table::new("made up", "Transient Analysis");
                for (name, kind, values) in list {
                    let samples = if complex {
                        ColumnSamples::Complex(values)
                    } else {
                        ColumnSamples::Real(values.into_iter().map(|[re, _]| re).collect())
                    };
                    table.push(Column { name, unit: KINDS[kind].0.to_owned(), samples }).unwrap();
                }
                table
            })
        })
    }

    proptest! {
        /// Written files round-trip: names, units, kinds and every bit, in both encodings, two plots in one file.
        #[test]
        fn round_trip(table in any_table(), second in any_table(), ascii in any::<bool>()) {
            let encoding = if ascii { Encoding::Ascii } else { Encoding::Binary };
            let mut bytes = Vec::new();
            write(&table, encoding, &mut bytes).unwrap();
            write(&second, encoding, &mut bytes).unwrap();
            let back = read(&bytes).unwrap();
            prop_assert_eq!(back.len(), 2);
            for (back, table) in back.iter().zip([&table, &second]) {
                prop_assert_eq!(&back.title, &table.title);
                prop_assert_eq!(&back.plot_name, &table.plot_name);
                prop_assert_eq!(bits(back), bits(table));
                for (a, b) in back.columns().iter().zip(table.columns()) {
                    prop_assert_eq!((&a.name, &a.unit), (&b.name, &b.unit));
                }
            }
        }

        /// No prefix of a file is taken for the whole of it.
        #[test]
        fn truncation_is_seen(table in any_table(), ascii in any::<bool>(), cut in 0.0..1.0f64) {
            prop_assume!(table.rows() > 0);
            let encoding = if ascii { Encoding::Ascii } else { Encoding::Binary };
            let mut bytes = Vec::new();
            write(&table, encoding, &mut bytes).unwrap();
            // The last character of an ASCII number may go unnoticed; the last line may not.
            let keep = ((bytes.len() - 25) as f64 * cut) as usize;
            prop_assert!(read(&bytes[..keep]).map(|plots| plots.is_empty()).unwrap_or(true) || keep == 0);
        }
    }

    /// A file as ngspice 39 writes it (blanks after the counts, `min`/`max` after a kind, no final blank line).
    #[test]
    fn a_file_of_ngspice() {
        let text = "Title: rc\nDate: Fri Nov 20 12:00:00  2026\nPlotname: AC Analysis\nFlags: complex\n\
            No. Variables: 2\nNo. Points: 2       \nVariables:\n\t0\tfrequency\tfrequency grid=3\n\t1\tv(out)\tvoltage\n\
            Values:\n 0\t1.0e+00,0.0e+00\n\t5.0e-01,-5.0e-01\n\n 1\t1.0e+01,0.0e+00\n\t1.0e-02,-1.0e-01\n";
        let plots = read(text.as_bytes()).unwrap();
        assert_eq!(plots.len(), 1);
        assert_eq!(plots[0].column("V(OUT)").unwrap().samples, ColumnSamples::Complex(vec![[0.5, -0.5], [0.01, -0.1]]));
        assert_eq!(plots[0].columns()[0].unit, "Hz");
    }

    /// ngspice never sets the imaginary part of a frequency: the axis of a complex plot is its real part.
    #[test]
    fn the_axis_of_a_complex_plot() {
        let text = "Title: rc\nDate: Fri Nov 20 12:00:00  2026\nPlotname: AC Analysis\nFlags: complex\n\
            No. Variables: 2\nNo. Points: 1\nVariables:\n\t0\tfrequency\tfrequency\n\t1\tv(out)\tvoltage\n\
            Values:\n 0\t6.77e+04,7.3e+267\n\t3.0e+00,-4.0e+00\n";
        let plots = read(text.as_bytes()).unwrap();
        assert_eq!(plots[0].columns()[0].samples.real_parts(), [6.77e4]);
        assert_eq!(plots[0].columns()[1].samples.magnitudes(), [5.0]);
    }
}
