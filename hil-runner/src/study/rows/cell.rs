//! One value of a result, and how it is written so that it reads back exactly.

use std::borrow::Cow;

use crc::{CRC_32_ISO_HDLC, Crc, Table};

static CRC: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISO_HDLC);

/// The checksum of bytes of results.
pub(in crate::study) fn checksum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// A value in a row of results.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Not known, or not applicable.
    Empty,
    /// A finite number.
    Number(f64),
    /// Yes or no.
    Flag(bool),
    /// Words.
    Text(Cow<'static, str>),
}

/// Kind of a column's cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColumnKind {
    /// [`Cell::Number`].
    #[default]
    Number,
    /// [`Cell::Number`] without a fraction.
    Whole,
    /// [`Cell::Flag`].
    Flag,
    /// [`Cell::Text`].
    Text,
}

/// A column of the results.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Name with the unit as suffix; that of the key for an axis.
    pub name: String,
    /// Kind of its cells.
    pub kind: ColumnKind,
}

impl ColumnKind {
    /// True if the cells are numbers.
    pub fn is_number(self) -> bool {
        matches!(self, Self::Number | Self::Whole)
    }
}

impl Cell {
    /// A number; what is not finite is empty.
    pub fn number(number: impl Into<Option<f64>>) -> Self {
        match number.into() {
            // The sum turns −0 into 0, which reads back as itself.
            Some(number) if number.is_finite() => Self::Number(number + 0.0),
            _ => Self::Empty,
        }
    }

    /// Words.
    pub fn text(text: impl Into<Cow<'static, str>>) -> Self {
        Self::Text(text.into())
    }

    /// The number, if it is one.
    pub fn as_number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            _ => None,
        }
    }

    /// The number, if it is a whole one that a float holds exactly.
    pub fn as_whole(&self) -> Option<i64> {
        const MOST: f64 = 9_007_199_254_740_992.0; // 2^53
        let number = self.as_number()?;
        (number.fract() == 0.0 && number.abs() <= MOST).then_some(number as i64)
    }

    /// Appends the cell to a record of CSV.
    ///
    /// # Errors
    /// Those of the writer.
    fn write(&self, writer: &mut csv::Writer<Vec<u8>>) -> csv::Result<()> {
        match self {
            Self::Empty => writer.write_field(b""),
            Self::Number(number) => {
                let mut buffer = ryu::Buffer::new();
                let text = buffer.format_finite(*number);
                // Whole numbers without the fraction that says so.
                writer.write_field(text.strip_suffix(".0").unwrap_or(text))
            }
            Self::Flag(true) => writer.write_field(b"true"),
            Self::Flag(false) => writer.write_field(b"false"),
            Self::Text(text) => writer.write_field(text.as_bytes()),
        }
    }

    /// Reads a field back; [`None`] if it is not what the column holds.
    pub(in crate::study) fn read(field: &str, kind: ColumnKind) -> Option<Self> {
        match (kind, field) {
            (_, "") => Some(Self::Empty),
            (ColumnKind::Number | ColumnKind::Whole, field) => {
                let number: f64 = field.parse().ok()?;
                number.is_finite().then_some(Self::Number(number))
            }
            (ColumnKind::Flag, "true") => Some(Self::Flag(true)),
            (ColumnKind::Flag, "false") => Some(Self::Flag(false)),
            (ColumnKind::Flag, _) => None,
            (ColumnKind::Text, field) => Some(Self::text(field.to_owned())),
        }
    }
}

/// Rows of results as CSV, one record each.
///
/// # Errors
/// Those of the writer, which has no reason for any.
pub(super) fn to_csv(rows: &[Vec<Cell>]) -> csv::Result<Vec<u8>> {
    let bytes_a_row = rows.first().map_or(0, |row| 24 * row.len());
    let mut writer = csv::WriterBuilder::new()
        .buffer_capacity(1 << 14)
        .from_writer(Vec::with_capacity(bytes_a_row * rows.len()));
    for row in rows {
        for cell in row {
            cell.write(&mut writer)?;
        }
        writer.write_record(None::<&[u8]>)?;
    }
    let written = writer.into_inner();
    written.map_err(|error| csv::Error::from(error.into_error()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_reads_back() {
        let large = 123_456_789_012.0;
        let numbers = [0.1, -1.0 / 3.0, 1e-300, large, 5e-324, f64::MAX, 0.0];
        let mut row: Vec<Cell> = numbers.map(Cell::Number).to_vec();
        let text = Cell::Text("a, \"b\"\nc".into());
        row.extend([Cell::Empty, Cell::Flag(true), text]);
        let bytes = to_csv(std::slice::from_ref(&row)).unwrap();
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .from_reader(bytes.as_slice());
        let record = reader.records().next().unwrap().unwrap();
        for (field, cell) in record.iter().zip(&row) {
            let kind = match cell {
                Cell::Number(_) | Cell::Empty => ColumnKind::Number,
                Cell::Flag(_) => ColumnKind::Flag,
                Cell::Text(_) => ColumnKind::Text,
            };
            assert_eq!(Cell::read(field, kind).as_ref(), Some(cell), "{field}");
        }
    }

    #[test]
    fn no_number_is_empty_and_zero_has_no_sign() {
        assert_eq!(Cell::number(f64::NAN), Cell::Empty);
        assert_eq!(Cell::number(f64::INFINITY), Cell::Empty);
        assert_eq!(Cell::number(None), Cell::Empty);
        let Cell::Number(zero) = Cell::number(-0.0) else {
            panic!()
        };
        assert!(zero.is_sign_positive());
        assert_eq!(Cell::read("inf", ColumnKind::Number), None);
        assert_eq!(Cell::read("yes", ColumnKind::Flag), None);
    }
}
