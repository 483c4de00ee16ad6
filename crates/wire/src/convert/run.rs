//! Arrays of runs: the bytes of doubles, little endian, row by row.

use super::{Violation, number};
use crate::proto;

/// Bytes of a double.
const WIDTH: usize = size_of::<f64>();

/// Doubles as they travel.
pub fn pack(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Appends doubles as they travel.
pub fn append(bytes: &mut Vec<u8>, values: &[f64]) {
    values.iter().for_each(|value| bytes.extend_from_slice(&value.to_le_bytes()));
}

/// Doubles back; what is left over at the end is dropped.
pub fn unpack(bytes: &[u8]) -> impl Iterator<Item = f64> {
    bytes.as_chunks::<WIDTH>().0.iter().map(|word| f64::from_le_bytes(*word))
}

/// How many doubles there are.
///
/// # Errors
/// An incomplete number, and numbers that are not finite.
fn counted(field: &str, bytes: &[u8]) -> Result<usize, Violation> {
    if !bytes.len().is_multiple_of(WIDTH) {
        return Err(Violation::new(field, format!("expected doubles of {WIDTH} bytes, got {} bytes", bytes.len())));
    }
    unpack(bytes).enumerate().try_for_each(|(i, x)| {
        if x.is_finite() { Ok(()) } else { number(&format!("{field}[{i}]"), x, false).map(drop) }
    })?;
    Ok(bytes.len() / WIDTH)
}

/// Times of a request: finite and ascending.
///
/// # Errors
/// Other ones.
pub fn times(bytes: &[u8]) -> Result<Vec<f64>, Violation> {
    counted("times", bytes)?;
    let times: Vec<f64> = unpack(bytes).collect();
    match times.windows(2).position(|pair| pair[0] >= pair[1]) {
        _ if times.is_empty() => Err(Violation::new("times", "expected at least one time")),
        None => Ok(times),
        Some(at) => {
            let order = format!("expected ascending times, got {:e} s after {:e} s", times[at + 1], times[at]);
            Err(Violation::new(format!("times[{}]", at + 1), order))
        }
    }
}

/// Port values over a run: a row for each step, or one for all.
#[derive(Debug, Clone)]
pub struct Rows {
    bytes: Vec<u8>,
    ports: usize,
    /// Bytes from a row to the next; 0: there is one.
    stride: usize,
}

impl Rows {
    /// Values of `ports` ports at `steps` times.
    ///
    /// # Errors
    /// Another number of values, and numbers that are not finite.
    pub fn read(field: &str, bytes: Vec<u8>, ports: usize, steps: usize) -> Result<Self, Violation> {
        let count = counted(field, &bytes)?;
        let stride = match count {
            _ if count == ports => 0,
            _ if Some(count) == ports.checked_mul(steps) => WIDTH * ports,
            _ => {
                let expected = format!("expected {steps} rows of {ports} port values, or one row, got {count} values");
                return Err(Violation::new(field, expected));
            }
        };
        Ok(Self { bytes, ports, stride })
    }

    /// Ports of a row.
    pub fn ports(&self) -> usize {
        self.ports
    }

    /// Writes the row of a step.
    pub fn row(&self, step: usize, row: &mut Vec<f64>) {
        row.clear();
        row.extend(unpack(&self.bytes[step * self.stride..]).take(self.ports));
    }
}

/// Places of the wanted signals among those of a session.
///
/// # Errors
/// An unknown name.
pub fn places(wanted: &[String], opened: &proto::DeviceDescription) -> Result<Vec<usize>, Violation> {
    let place = |name: &String| {
        opened.signals.iter().position(|signal| signal.name == *name).ok_or_else(|| {
            let there: Vec<&str> = opened.signals.iter().map(|signal| signal.name.as_str()).collect();
            Violation::new("signals", format!("the session was opened without \"{name}\"; it has {there:?}"))
        })
    };
    wanted.iter().map(place).collect()
}

#[cfg(test)]
mod tests {
    //! Doubles keep their bits, and an invalid one is named by its position.
    use super::*;

    #[test]
    fn doubles_keep_their_bits() {
        let odd = [-0.0, f64::MIN_POSITIVE / 4.0, 0.1 + 0.2, -1e300];
        let back: Vec<u64> = unpack(&pack(&odd)).map(f64::to_bits).collect();
        assert_eq!(back, odd.map(f64::to_bits));
        let rows = Rows::read("values", pack(&[1.0, 2.0, 3.0, 4.0]), 2, 2).expect("two rows");
        let mut row = Vec::new();
        rows.row(1, &mut row);
        assert_eq!(row, [3.0, 4.0]);
        let one = Rows::read("values", pack(&[1.0, 2.0]), 2, 9).expect("one row for all");
        one.row(8, &mut row);
        assert_eq!(row, [1.0, 2.0]);
    }

    #[test]
    fn what_is_none_is_named() {
        let field = |found: Result<Vec<f64>, Violation>| found.map_err(|v| v.field).unwrap_err();
        assert_eq!(field(times(&[])), "times");
        assert_eq!(field(times(&[0; 9])), "times");
        assert_eq!(field(times(&pack(&[1.0, f64::NAN]))), "times[1]");
        assert_eq!(field(times(&pack(&[1.0, 2.0, 2.0]))), "times[2]");
        assert_eq!(Rows::read("values", pack(&[1.0, f64::INFINITY]), 2, 1).unwrap_err().field, "values[1]");
        assert!(Rows::read("values", pack(&[1.0; 3]), 2, 2).is_err());
        assert!(Rows::read("values", pack(&[1.0; 4]), usize::MAX, 2).is_err());
    }
}
