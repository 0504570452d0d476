//! A table as comma-separated values, with a header.

use super::{Cell, Layout, Table, TableError};
use std::io::Write;

/// Bytes that go to the file at once.
const BUFFER_BYTES: usize = 1 << 20;

/// A table under way.
pub(super) struct CsvTable<W: Write, L> {
    writer: csv::Writer<W>,
    layout: L,
    columns: usize,
}

impl<W: Write, L: Layout> CsvTable<W, L> {
    /// Writes the header.
    pub(super) fn new(to: W, layout: L) -> Result<Self, TableError> {
        let mut writer = csv::WriterBuilder::new().buffer_capacity(BUFFER_BYTES).from_writer(to);
        writer.write_record(layout.headings().map(|heading| heading.name))?;
        let columns = layout.headings().count();
        Ok(Self { writer, layout, columns })
    }
}

impl<W: Write, L: Layout> Table<L::Row> for CsvTable<W, L> {
    /// Numbers are in the shortest form that reads back as the same bits.
    fn write(&mut self, rows: &[L::Row]) -> Result<(), TableError> {
        let Self { writer, layout, columns } = self;
        let (mut whole, mut real) = (itoa::Buffer::new(), zmij::Buffer::new());
        for row in rows {
            for column in 0..*columns {
                match layout.cell(row, column) {
                    Cell::Missing => writer.write_field(b""),
                    Cell::Whole(value) => writer.write_field(whole.format(value)),
                    Cell::Real(value) => writer.write_field(real.format(value)),
                    Cell::Double(value) => writer.write_field(real.format(value)),
                    Cell::Truth(value) => writer.write_field(if value { "true" } else { "false" }),
                    Cell::Word(word) => writer.write_field(word),
                    Cell::Text(text) => writer.write_field(text),
                }?;
            }
            writer.write_record(None::<&[u8]>)?;
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<(), TableError> {
        Ok(self.writer.flush()?)
    }
}
