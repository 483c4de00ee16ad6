//! Waveforms on the command line, in the words of SPICE: `sin(…)`, `pulse(…)` and `pwl(…)`.

use super::value::number;
use bimorph::domains::InputWaveform;

/// `NAME=WAVEFORM`.
pub(crate) fn motion(text: &str) -> Result<(String, InputWaveform), String> {
    let expected = || {
        format!(
            "expected NAME=sin(OFFSET AMPLITUDE HZ [DELAY]), NAME=pulse(FROM TO DELAY RISE FALL LENGTH [PERIOD]) or \
             NAME=pwl(SECONDS VALUE SECONDS VALUE …), such as base.uy='sin(0 1u 20k)', got \"{text}\""
        )
    };
    let (name, wave) = text.split_once('=').ok_or_else(expected)?;
    let (kind, rest) = wave.trim().split_once('(').ok_or_else(expected)?;
    let given = rest.trim_end().strip_suffix(')').ok_or_else(expected)?;
    let numbers = given.split([' ', ',', '\t']).filter(|word| !word.is_empty()).map(number);
    let numbers = numbers.collect::<Result<Vec<f64>, _>>().map_err(|why| format!("{}: {why}", expected()))?;
    let wave = match (kind.trim().to_ascii_lowercase().as_str(), &numbers[..]) {
        ("sin", &[offset, amplitude, frequency]) => InputWaveform::Sine { offset, amplitude, frequency, delay: 0.0 },
        ("sin", &[offset, amplitude, frequency, delay]) => InputWaveform::Sine { offset, amplitude, frequency, delay },
        ("pulse", &[low, high, delay, rise, fall, length, ref period @ ..]) if period.len() < 2 => {
            InputWaveform::Pulse { low, high, delay, lengths: [rise, length, fall], period: period.first().copied() }
        }
        ("pwl", points) if !points.is_empty() && points.len().is_multiple_of(2) => {
            InputWaveform::Lines(points.chunks_exact(2).map(|point| [point[0], point[1]]).collect())
        }
        _ => return Err(expected()),
    };
    wave.check().map_err(|wanted| format!("expected {wanted}, got \"{text}\""))?;
    let name = name.trim();
    if name.is_empty() { Err(expected()) } else { Ok((name.to_owned(), wave)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sources are those of SPICE, with suffixes of numbers; anything else is refused with the forms that exist.
    #[test]
    fn waveforms_are_read() {
        let read = |text: &str| motion(text).map(|(name, wave)| (name, wave.at(1e-6)[0]));
        assert_eq!(read("b.uy=pwl(0 0 2u 4n)"), Ok(("b.uy".to_owned(), 2e-9)));
        assert_eq!(read("b.uy = PULSE(0, 1n, 0, 2u, 2u, 5u)"), Ok(("b.uy".to_owned(), 0.5e-9)));
        assert_eq!(motion("a.ux=sin(1 2 3 4)").unwrap().1.at(0.0)[0], 1.0);
        for bad in
            ["b.uy", "b.uy=3", "=sin(0 1 1)", "b.uy=sin(0 1)", "b.uy=pwl(0 0 1)", "b.uy=exp(0 1)", "b.uy=pwl(1 0 0 1)"]
        {
            assert!(motion(bad).unwrap_err().starts_with("expected "), "{bad}");
        }
    }
}
