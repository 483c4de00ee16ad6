//! Records of GDSII stream files: length, type, type of data, data; numbers big-endian, reals in excess-64 notation to base 16.

use super::error::{GdsError, GdsFault};
use std::io::Read;

/// Types of records that the reader knows, by number.
pub(crate) mod kind {
    macro_rules! kinds {
        ($($name:ident = $number:literal),* $(,)?) => {
            $(#[allow(dead_code)] pub(crate) const $name: u8 = $number;)*
            /// The name of a type of record in the format's documentation.
            pub(crate) fn name(kind: u8) -> Option<&'static str> {
                match kind { $($number => Some(stringify!($name)),)* _ => None }
            }
        };
    }
    kinds! {
        HEADER = 0x00, BGNLIB = 0x01, LIBNAME = 0x02, UNITS = 0x03, ENDLIB = 0x04, BGNSTR = 0x05, STRNAME = 0x06, ENDSTR = 0x07,
        BOUNDARY = 0x08, PATH = 0x09, SREF = 0x0a, AREF = 0x0b, TEXT = 0x0c, LAYER = 0x0d, DATATYPE = 0x0e, WIDTH = 0x0f,
        XY = 0x10, ENDEL = 0x11, SNAME = 0x12, COLROW = 0x13, NODE = 0x15, TEXTTYPE = 0x16, PRESENTATION = 0x17, STRING = 0x19,
        STRANS = 0x1a, MAG = 0x1b, ANGLE = 0x1c, REFLIBS = 0x1f, FONTS = 0x20, PATHTYPE = 0x21, GENERATIONS = 0x22,
        ATTRTABLE = 0x23, STYPTABLE = 0x24, STRTYPE = 0x25, ELFLAGS = 0x26, ELKEY = 0x27, NODETYPE = 0x2a, PROPATTR = 0x2b,
        PROPVALUE = 0x2c, BOX = 0x2d, BOXTYPE = 0x2e, PLEX = 0x2f, BGNEXTN = 0x30, ENDEXTN = 0x31, TAPENUM = 0x32,
        TAPECODE = 0x33, STRCLASS = 0x34, FORMAT = 0x36, MASK = 0x37, ENDMASKS = 0x38, LIBDIRSIZE = 0x39, SRFNAME = 0x3a,
        LIBSECUR = 0x3b,
    }
}

/// One record.
#[derive(Debug)]
pub(super) struct Record<'a> {
    /// Its type, one of [`kind`].
    pub(super) kind: u8,
    /// Its bytes after the head.
    pub(super) data: &'a [u8],
    /// Where it begins in the file (bytes).
    pub(super) offset: u64,
}

/// Reads records one after the other.
pub(super) struct Records<R> {
    from: R,
    file: String,
    /// Where the current record begins, and the next one.
    at: [u64; 2],
    kind: Option<u8>,
    data: Vec<u8>,
}

impl<R: Read> Records<R> {
    pub(super) fn new(from: R, file: &str) -> Self {
        Self { from, file: file.to_owned(), at: [0, 0], kind: None, data: Vec::new() }
    }

    /// Bytes read so far.
    pub(super) fn offset(&self) -> u64 {
        self.at[1]
    }

    /// An error at the current record.
    pub(super) fn error(&self, fault: GdsFault) -> GdsError {
        let record = match self.kind {
            None => "before its type".to_owned(),
            Some(kind) => kind::name(kind).map_or_else(|| format!("0x{kind:02x}"), str::to_owned),
        };
        GdsError { file: self.file.clone(), offset: self.at[0], record, fault }
    }

    /// The next record.
    pub(super) fn next(&mut self) -> Result<Record<'_>, GdsError> {
        self.at[0] = self.at[1];
        self.kind = None;
        let mut head = [0; 4];
        self.fill(&mut head)?;
        let [a, b, kind, _] = head;
        let length = u16::from_be_bytes([a, b]);
        self.kind = Some(kind);
        if length < 4 || length % 2 == 1 {
            return Err(self.error(GdsFault::Length { length }));
        }
        let mut data = std::mem::take(&mut self.data);
        data.resize(usize::from(length) - 4, 0);
        let filled = self.fill(&mut data);
        self.data = data;
        filled?;
        self.at[1] = self.at[0] + u64::from(length);
        Ok(Record { kind, data: &self.data, offset: self.at[0] })
    }

    fn fill(&mut self, buffer: &mut [u8]) -> Result<(), GdsError> {
        let mut got = 0;
        while got < buffer.len() {
            match self.from.read(&mut buffer[got..]) {
                Ok(0) => return Err(self.error(GdsFault::Truncated { missing: buffer.len() - got })),
                Ok(n) => got += n,
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) => return Err(self.error(GdsFault::Read { reason: e.to_string() })),
            }
        }
        Ok(())
    }
}

impl Record<'_> {
    /// Two-byte numbers.
    pub(super) fn short(&self, index: usize) -> Option<i16> {
        let bytes = self.data.get(2 * index..2 * index + 2)?;
        Some(i16::from_be_bytes(bytes.try_into().ok()?))
    }

    /// Four-byte numbers.
    pub(super) fn long(&self, index: usize) -> Option<i32> {
        let bytes = self.data.get(4 * index..4 * index + 4)?;
        Some(i32::from_be_bytes(bytes.try_into().ok()?))
    }

    /// Eight-byte reals.
    pub(super) fn real(&self, index: usize) -> Option<f64> {
        let bytes = self.data.get(8 * index..8 * index + 8)?;
        Some(real_from(bytes.try_into().ok()?))
    }

    /// Text, without the zero that fills it up to an even length.
    pub(super) fn text(&self) -> String {
        let end = self.data.iter().rposition(|b| *b != 0).map_or(0, |k| k + 1);
        String::from_utf8_lossy(&self.data[..end]).into_owned()
    }
}

/// A real: sign bit, seven bits of exponent to base 16 in excess of 64, 56 bits of fraction.
pub(super) fn real_from(bytes: [u8; 8]) -> f64 {
    let bits = u64::from_be_bytes(bytes);
    let fraction = (bits & 0x00ff_ffff_ffff_ffff) as f64;
    let exponent = i32::from(bytes[0] & 0x7f) - 64;
    let size = fraction * 2f64.powi(4 * exponent - 56);
    if bytes[0] & 0x80 == 0 { size } else { -size }
}

/// The other way; 0 for what is no number.
pub(crate) fn real_to(value: f64) -> [u8; 8] {
    if value == 0.0 || !value.is_finite() {
        return [0; 8];
    }
    let mut exponent = 64;
    let mut fraction = value.abs();
    while fraction >= 1.0 && exponent < 127 {
        fraction /= 16.0;
        exponent += 1;
    }
    while fraction < 1.0 / 16.0 && exponent > 0 {
        fraction *= 16.0;
        exponent -= 1;
    }
    let mut bits = (fraction * 2f64.powi(56)) as u64;
    bits = bits.min(0x00ff_ffff_ffff_ffff) | (exponent as u64) << 56;
    if value < 0.0 {
        bits |= 1 << 63;
    }
    bits.to_be_bytes()
}

#[cfg(test)]
mod tests {
    //! Reals are those of the format's documentation: 1 is 0x4110…, 1e-3 is 0x3e4189374bc6a7f0, 1e-9 is 0x3944b82fa09b5a54.
    use super::*;

    #[test]
    fn reals_in_excess_64() {
        for (value, bits) in [
            (1.0, 0x4110_0000_0000_0000_u64),
            (1e-3, 0x3e41_8937_4bc6_a7f0),
            (1e-9, 0x3944_b82f_a09b_5a54),
            (-2.0, 0xc120_0000_0000_0000),
        ] {
            assert!((real_from(bits.to_be_bytes()) / value - 1.0).abs() < 1e-15);
            assert!((real_from(real_to(value)) / value - 1.0_f64).abs() < 1e-15, "{value}");
        }
        assert_eq!(u64::from_be_bytes(real_to(1.0)), 0x4110_0000_0000_0000);
        assert_eq!(real_from([0; 8]), 0.0);
    }
}
