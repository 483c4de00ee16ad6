//! Tables as Parquet files (Apache Parquet format 2.10, data pages of version 1): columns of numbers and texts, plain and uncompressed, so that
//! no library is needed. Metadata is in the compact protocol of Thrift.

use std::io::{self, Write};

/// A column and its values, as many as rows.
#[derive(Debug, Clone, PartialEq)]
pub struct ParquetColumn {
    /// Name, with the unit in brackets where it has one.
    pub name: String,
    /// Values.
    pub values: ParquetValues,
}

/// Values of one kind.
#[derive(Debug, Clone, PartialEq)]
pub enum ParquetValues {
    /// Whole numbers.
    Integers(Vec<i64>),
    /// Numbers; none: null.
    Numbers(Vec<Option<f64>>),
    /// Texts in UTF-8.
    Texts(Vec<String>),
}

const MAGIC: &[u8] = b"PAR1";
/// Rows that are written together.
const GROUP: usize = 1 << 16;
/// Encodings: values one after another, and levels as runs.
const PLAIN: i64 = 0;
const RUNS: i64 = 3;

/// Writes a table.
///
/// # Errors
/// Those of `out`, and columns of different lengths.
pub fn write(columns: &[ParquetColumn], out: &mut dyn Write) -> io::Result<()> {
    let rows = columns.first().map_or(0, |column| column.values.len());
    if columns.iter().any(|column| column.values.len() != rows) {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "columns of different lengths"));
    }
    out.write_all(MAGIC)?;
    let mut offset = MAGIC.len();
    let mut groups = Vec::new();
    for first in (0..rows).step_by(GROUP) {
        let rows = first..rows.min(first + GROUP);
        let count = rows.len();
        let mut chunks = Vec::new();
        for column in columns {
            let data = column.values.page(rows.clone());
            let header = page_header(count, data.len());
            out.write_all(&header)?;
            out.write_all(&data)?;
            chunks.push((offset, header.len() + data.len()));
            offset += header.len() + data.len();
        }
        groups.push((count, chunks));
    }
    let footer = file_metadata(columns, rows, &groups);
    out.write_all(&footer)?;
    let length =
        u32::try_from(footer.len()).map_err(|_| io::Error::new(io::ErrorKind::InvalidInput, "too many columns"))?;
    out.write_all(&length.to_le_bytes())?;
    out.write_all(MAGIC)
}

impl ParquetValues {
    fn len(&self) -> usize {
        match self {
            Self::Integers(values) => values.len(),
            Self::Numbers(values) => values.len(),
            Self::Texts(values) => values.len(),
        }
    }

    /// Physical type: INT64, DOUBLE, BYTE_ARRAY.
    fn kind(&self) -> i64 {
        match self {
            Self::Integers(_) => 2,
            Self::Numbers(_) => 5,
            Self::Texts(_) => 6,
        }
    }

    /// The bytes of a page.
    fn page(&self, rows: std::ops::Range<usize>) -> Vec<u8> {
        let mut data = Vec::new();
        match self {
            Self::Integers(values) => values[rows].iter().for_each(|value| data.extend(value.to_le_bytes())),
            Self::Numbers(values) => {
                let levels = levels(&values[rows.clone()]);
                data.extend((levels.len() as u32).to_le_bytes());
                data.extend(levels);
                values[rows].iter().flatten().for_each(|value| data.extend(value.to_le_bytes()));
            }
            Self::Texts(values) => {
                for text in &values[rows] {
                    data.extend((text.len() as u32).to_le_bytes());
                    data.extend(text.as_bytes());
                }
            }
        }
        data
    }
}

/// Which values are there, as runs of 1 and 0.
fn levels(values: &[Option<f64>]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for run in values.chunk_by(|a, b| a.is_some() == b.is_some()) {
        varint(&mut bytes, (run.len() as u64) << 1);
        bytes.push(u8::from(run[0].is_some()));
    }
    bytes
}

fn page_header(count: usize, bytes: usize) -> Vec<u8> {
    let mut page = Struct::default();
    // a data page
    page.int(1, 5, 0);
    page.int(2, 5, bytes as i64);
    page.int(3, 5, bytes as i64);
    let mut about = Struct::default();
    about.int(1, 5, count as i64);
    about.int(2, 5, PLAIN);
    about.int(3, 5, RUNS);
    about.int(4, 5, RUNS);
    page.inner(5, about);
    page.end()
}

type Group = (usize, Vec<(usize, usize)>);

fn file_metadata(columns: &[ParquetColumn], rows: usize, groups: &[Group]) -> Vec<u8> {
    let mut file = Struct::default();
    file.int(1, 5, 1);
    let mut root = Struct::default();
    root.text(4, "table");
    root.int(5, 5, columns.len() as i64);
    let schema = std::iter::once(root.end()).chain(columns.iter().map(element)).collect();
    file.list(2, 12, schema);
    file.int(3, 6, rows as i64);
    file.list(4, 12, groups.iter().map(|group| row_group(columns, group)).collect());
    file.text(6, concat!("bimorph ", env!("CARGO_PKG_VERSION")));
    file.end()
}

/// A column of the schema.
fn element(column: &ParquetColumn) -> Vec<u8> {
    let mut element = Struct::default();
    element.int(1, 5, column.values.kind());
    element.int(3, 5, i64::from(matches!(column.values, ParquetValues::Numbers(_))));
    element.text(4, &column.name);
    if matches!(column.values, ParquetValues::Texts(_)) {
        // UTF-8
        element.int(6, 5, 0);
    }
    element.end()
}

fn row_group(columns: &[ParquetColumn], (count, chunks): &Group) -> Vec<u8> {
    let chunk = |(column, (offset, bytes)): (&ParquetColumn, &(usize, usize))| {
        let mut about = Struct::default();
        about.int(1, 5, column.values.kind());
        about.list(2, 5, [PLAIN, RUNS].iter().map(|encoding| zigzag(*encoding)).collect());
        about.list(3, 8, vec![binary(&column.name)]);
        // uncompressed
        about.int(4, 5, 0);
        about.int(5, 6, *count as i64);
        about.int(6, 6, *bytes as i64);
        about.int(7, 6, *bytes as i64);
        about.int(9, 6, *offset as i64);
        let mut chunk = Struct::default();
        chunk.int(2, 6, *offset as i64);
        chunk.inner(3, about);
        chunk.end()
    };
    let mut group = Struct::default();
    group.list(1, 12, columns.iter().zip(chunks).map(chunk).collect());
    group.int(2, 6, chunks.iter().map(|(_, bytes)| *bytes as i64).sum());
    group.int(3, 6, *count as i64);
    group.end()
}

/// A struct of Thrift's compact protocol: fields with ascending numbers. Kinds are 5 and 6 (integers), 8 (text), 9 (list), 12 (struct).
#[derive(Default)]
struct Struct {
    bytes: Vec<u8>,
    last: u8,
}

impl Struct {
    fn field(&mut self, number: u8, kind: u8) {
        self.bytes.push((number - self.last) << 4 | kind);
        self.last = number;
    }

    fn int(&mut self, number: u8, kind: u8, value: i64) {
        self.field(number, kind);
        self.bytes.extend(zigzag(value));
    }

    fn text(&mut self, number: u8, text: &str) {
        self.field(number, 8);
        self.bytes.extend(binary(text));
    }

    fn inner(&mut self, number: u8, inner: Self) {
        self.field(number, 12);
        self.bytes.extend(inner.end());
    }

    fn list(&mut self, number: u8, kind: u8, items: Vec<Vec<u8>>) {
        self.field(number, 9);
        if items.len() < 15 {
            self.bytes.push((items.len() as u8) << 4 | kind);
        } else {
            self.bytes.push(0xf0 | kind);
            varint(&mut self.bytes, items.len() as u64);
        }
        self.bytes.extend(items.concat());
    }

    fn end(mut self) -> Vec<u8> {
        self.bytes.push(0);
        self.bytes
    }
}

fn varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

fn zigzag(value: i64) -> Vec<u8> {
    let mut bytes = Vec::new();
    varint(&mut bytes, ((value << 1) ^ (value >> 63)) as u64);
    bytes
}

fn binary(text: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    varint(&mut bytes, text.len() as u64);
    bytes.extend(text.as_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    //! The bytes of small parts by the documents of Parquet and Thrift; whole files are read by another program in the tests of the Python client.
    use super::*;

    /// Two values, a null and a value: runs of 2, 1 and 1.
    #[test]
    fn levels_are_runs() {
        assert_eq!(levels(&[Some(1.0), Some(2.0), None, Some(3.0)]), [4, 1, 2, 0, 2, 1]);
    }

    /// 300 is 0xd8 0x04 as zigzag varint; −1 is 1.
    #[test]
    fn integers() {
        assert_eq!(zigzag(300), [0xd8, 0x04]);
        assert_eq!(zigzag(-1), [1]);
    }

    /// Magic at both ends, and the length of the metadata before the last.
    #[test]
    fn a_file() {
        let mut bytes = Vec::new();
        let column = ParquetColumn { name: "a".into(), values: ParquetValues::Texts(vec!["x".into(); 3]) };
        write(&[column], &mut bytes).expect("written");
        assert!(bytes.starts_with(MAGIC) && bytes.ends_with(MAGIC));
        let length =
            u32::from_le_bytes(bytes[bytes.len() - 8..bytes.len() - 4].try_into().expect("four bytes")) as usize;
        assert!(length + 12 < bytes.len());
    }
}
