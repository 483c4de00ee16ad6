//! A list of points as a table: names in its first row, and a row for each point.

use super::axis::SweepParameter;
use super::error::{SweepError, bad};
use bimorph_base::Setting;
use bimorph_netlist::parse_setting;

/// Reads a list of points (CSV, RFC 4180): parameters that go together, the first of them an axis. Cells are read as the entries of a list
/// are: `2u`, `-3`, `poly`. Lines that begin with `#` are left out.
///
/// # Errors
/// [`SweepError::BadSpec`] for a table without points or names, or with a cell that is no value, with the place.
pub fn points(name: &str, text: &str) -> Result<Vec<SweepParameter>, SweepError> {
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
    let failed =
        |error: csv::Error| bad(name.to_owned(), "a table of points, names in its first row", &error.to_string());
    let head = reader.headers().map_err(failed)?.clone();
    // a file of a spreadsheet may begin with a mark of its encoding
    let names: Vec<&str> = head.iter().map(|name| name.trim_start_matches('\u{feff}')).collect();
    if let Some(k) = names.iter().position(|name| name.is_empty()) {
        return Err(bad(name.to_owned(), "a name above each column", &format!("none above column {}", k + 1)));
    }
    let mut columns = vec![Vec::new(); names.len()];
    for record in reader.records() {
        let record = record.map_err(failed)?;
        for ((column, axis), cell) in columns.iter_mut().zip(&names).zip(&record) {
            let line = record.position().map_or(0, csv::Position::line);
            let what = || format!("{name}, line {line}, {axis}");
            if cell.is_empty() {
                return Err(bad(what(), "a number or a word", "nothing"));
            }
            let value = parse_setting(cell).map_err(|_| bad(what(), "a number or a word", cell))?;
            column.push(value);
        }
    }
    if columns.first().is_none_or(Vec::is_empty) {
        return Err(bad(name.to_owned(), "a table of points, names in its first row", "no point"));
    }
    let axis = |(k, (name, column)): (usize, (&str, Vec<Setting>))| SweepParameter {
        name: name.to_owned(),
        values: column.into(),
        in_step: k > 0,
    };
    Ok(names.into_iter().zip(columns).enumerate().map(axis).collect())
}

#[cfg(test)]
mod tests {
    //! Lists of points read as they are written, and slips are refused with their place.
    use super::*;

    #[test]
    fn columns_go_together() {
        let text = "\u{feff}w, layer ,heat.v\n# typical\n2u,poly,0\n\n1.8u,\"poly\",2.2\n";
        let axes = points("corners.csv", text).unwrap();
        let names: Vec<_> = axes.iter().map(|axis| (axis.name.as_str(), axis.in_step)).collect();
        assert_eq!(names, [("w", false), ("layer", true), ("heat.v", true)]);
        assert_eq!(axes[0].values, vec![Setting::Number(2e-6), Setting::Number(1.8e-6)].into());
        assert_eq!(axes[1].values, vec![Setting::Text("poly".into()); 2].into());
        assert_eq!(axes[2].values, vec![Setting::Number(0.0), Setting::Number(2.2)].into());
    }

    #[test]
    fn slips_are_refused_with_their_place() {
        let reported = |text: &str| points("p.csv", text).unwrap_err().to_string();
        for text in ["", "w,h\n", "w\n", "\n\n"] {
            assert!(reported(text).contains("no point"), "{text:?}: {}", reported(text));
        }
        assert!(reported("w,\n1,2\n").contains("none above column 2"));
        assert!(reported("w,h\n1,2\n3,\n").starts_with("p.csv, line 3, h: expected a number or a word, got nothing"));
        assert!(reported("w\n1u\n2 u u\n").starts_with("p.csv, line 3, w"));
        assert!(reported("w,h\n1,2\n3\n").contains("line: 3"), "{}", reported("w,h\n1,2\n3\n"));
    }
}
