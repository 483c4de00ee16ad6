//! The rows of a sweep, and the same as CSV.

use super::point::PointOutcome;
use bimorph_base::Setting;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Everything a sweep found, in grid order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SweepTable {
    /// Parameter columns.
    pub parameters: Vec<String>,
    /// Result columns, in order of first appearance: `b.x`, `f1`, `pull_in`, ….
    pub results: Vec<String>,
    /// Unit of each result column.
    pub units: Vec<String>,
    /// One per point.
    pub rows: Vec<SweepRow>,
}

/// One point.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepRow {
    /// Number of the point in the full grid, from 0.
    pub point: usize,
    /// Value of each parameter.
    pub parameters: Vec<Setting>,
    /// One per result column, none where the quantity does not exist at this point; or why the point has no result.
    pub values: Result<Vec<Option<f64>>, String>,
    /// Largest estimated relative error by the mesh (1); none without an estimate, and for a point without a result.
    pub estimated_error: Option<f64>,
    /// Why the numbers may be further off than the tolerance: code and message; empty where they are not.
    pub warning: String,
}

/// Puts the points into one table. A netlist whose nodes depend on a parameter has more columns than any one point.
pub(super) fn assemble(parameters: Vec<String>, outcomes: Vec<PointOutcome>) -> SweepTable {
    let mut table = SweepTable { parameters, ..SweepTable::default() };
    let mut columns = BTreeMap::new();
    for value in outcomes.iter().filter_map(|outcome| outcome.values.as_ref().ok()).flat_map(|found| &found.values) {
        if !columns.contains_key(&value.name) {
            columns.insert(value.name.clone(), table.results.len());
            table.results.push(value.name.clone());
            table.units.push(value.unit.clone().into_owned());
        }
    }
    for outcome in outcomes {
        let (values, estimated_error, warning) = match outcome.values {
            Ok(found) => {
                let mut row = vec![None; table.results.len()];
                for value in found.values {
                    if let Some(&column) = columns.get(&value.name) {
                        row[column] = value.value;
                    }
                }
                (Ok(row), found.estimated_error, found.warning)
            }
            Err(error) => (Err(error.to_string()), None, String::new()),
        };
        let PointOutcome { number: point, parameters, .. } = outcome;
        table.rows.push(SweepRow { point, parameters, values, estimated_error, warning });
    }
    table
}

impl SweepTable {
    /// Points with an error.
    pub fn failed(&self) -> usize {
        self.rows.iter().filter(|row| row.values.is_err()).count()
    }

    /// CSV (RFC 4180, LF): `point`, the parameters, the results as `name [unit]`, `estimated_error [1]`, `warning`, `error`.
    /// Numbers are the shortest text that reads back to the same bits.
    pub fn to_csv(&self) -> String {
        self.csv(None)
    }

    /// The same with one more column at the end, `part`, which says in every row of which part of which sweep it is.
    pub fn to_csv_of_part(&self, part: &str) -> String {
        self.csv(Some(part))
    }

    fn csv(&self, part: Option<&str>) -> String {
        let mut out = String::from("point");
        for name in &self.parameters {
            field(&mut out, name);
        }
        for (name, unit) in self.results.iter().zip(&self.units) {
            field(&mut out, &format!("{name} [{unit}]"));
        }
        out.push_str(",estimated_error [1],warning,error");
        out.push_str(if part.is_some() { ",part\n" } else { "\n" });
        for row in &self.rows {
            let _ = write!(out, "{}", row.point);
            for setting in &row.parameters {
                match setting {
                    Setting::Number(x) => field(&mut out, &format!("{x:e}")),
                    Setting::Text(text) => field(&mut out, text),
                }
            }
            match &row.values {
                Ok(values) => {
                    for value in values {
                        field(&mut out, &value.map(|x| format!("{x:e}")).unwrap_or_default());
                    }
                    field(&mut out, &row.estimated_error.map(|x| format!("{x:e}")).unwrap_or_default());
                    field(&mut out, &row.warning);
                    out.push(',');
                }
                Err(error) => {
                    out.extend(std::iter::repeat_n(',', self.results.len() + 2));
                    field(&mut out, error.trim_end());
                }
            }
            if let Some(part) = part {
                field(&mut out, part);
            }
            out.push('\n');
        }
        out
    }
}

fn field(out: &mut String, text: &str) {
    out.push(',');
    if text.contains([',', '"', '\n', '\r']) {
        out.push('"');
        out.push_str(&text.replace('"', "\"\""));
        out.push('"');
    } else {
        out.push_str(text);
    }
}

#[cfg(test)]
mod tests {
    //! A failed point has its reason and no number; text is quoted so that it reads back.
    use super::*;

    #[test]
    fn a_failed_point_has_no_number() {
        let table = SweepTable {
            parameters: vec!["w".into()],
            results: vec!["b.x".into(), "release".into()],
            units: vec!["m".into(), "V".into()],
            rows: vec![
                SweepRow {
                    point: 0,
                    parameters: vec![Setting::Number(2e-6)],
                    values: Ok(vec![Some(1.5e-9), None]),
                    estimated_error: Some(2e-3),
                    warning: "W040: off".into(),
                },
                SweepRow {
                    point: 3,
                    parameters: vec![Setting::Text("a,b".into())],
                    values: Err("say \"no\"".into()),
                    estimated_error: None,
                    warning: String::new(),
                },
            ],
        };
        let expected = "point,w,b.x [m],release [V],estimated_error [1],warning,error\n\
                        0,2e-6,1.5e-9,,2e-3,W040: off,\n3,\"a,b\",,,,,\"say \"\"no\"\"\"\n";
        assert_eq!(table.to_csv(), expected);
        let of_part = "point,w,b.x [m],release [V],estimated_error [1],warning,error,part\n\
                       0,2e-6,1.5e-9,,2e-3,W040: off,,0/3 of it\n3,\"a,b\",,,,,\"say \"\"no\"\"\",0/3 of it\n";
        assert_eq!(table.to_csv_of_part("0/3 of it"), of_part);
        assert_eq!(table.failed(), 1);
    }
}
