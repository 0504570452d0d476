//! A table as comma-separated values, with a header.

use super::{Cell, Layout, Table, TableError};
use std::io::{BufWriter, Write};

/// Bytes that go to the file at once.
const BUFFER_BYTES: usize = 1 << 20;

/// A table under way.
pub(super) struct CsvTable<W: Write, L> {
    to: BufWriter<W>,
    layout: L,
    columns: usize,
}

impl<W: Write, L: Layout> CsvTable<W, L> {
    /// Writes the header.
    pub(super) fn new(to: W, layout: L) -> Result<Self, TableError> {
        let mut to = BufWriter::with_capacity(BUFFER_BYTES, to);
        let columns = layout.headings().count();
        for (column, heading) in layout.headings().enumerate() {
            write_text(&mut to, heading.name)?;
            to.write_all(end(column, columns))?;
        }
        Ok(Self { to, layout, columns })
    }
}

impl<W: Write, L: Layout> Table<L::Row> for CsvTable<W, L> {
    /// Numbers are in the shortest form that reads back as the same bits.
    fn write(&mut self, rows: &[L::Row]) -> Result<(), TableError> {
        let Self { to, layout, columns } = self;
        let (mut whole, mut real) = (itoa::Buffer::new(), zmij::Buffer::new());
        for row in rows {
            for column in 0..*columns {
                match layout.cell(row, column) {
                    Cell::Missing => Ok(()),
                    Cell::Whole(value) => to.write_all(whole.format(value).as_bytes()),
                    Cell::Real(value) => to.write_all(real.format(value).as_bytes()),
                    Cell::Double(value) => to.write_all(real.format(value).as_bytes()),
                    Cell::Truth(value) => to.write_all(if value { b"true" } else { b"false" }),
                    Cell::Word(word) => write_text(to, word),
                    Cell::Text(text) => write_text(to, &text),
                }?;
                to.write_all(end(column, *columns))?;
            }
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<(), TableError> {
        Ok(self.to.flush()?)
    }
}

/// Returns what stands behind a field.
fn end(column: usize, columns: usize) -> &'static [u8] {
    if column + 1 == columns { b"\n" } else { b"," }
}

/// Writes a text, in quotation marks where it takes them (RFC 4180).
fn write_text(to: &mut impl Write, text: &str) -> std::io::Result<()> {
    if text.contains(['"', ',', '\n', '\r']) {
        write!(to, "\"{}\"", text.replace('"', "\"\""))
    } else {
        to.write_all(text.as_bytes())
    }
}
