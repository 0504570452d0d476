//! A table as comma-separated values, with a header.

use super::column::{Cell, Column};
use super::{ExportError, Layout, Table};
use crate::record::mcap::Decoded;
use std::io::Write;

/// Bytes that go to the file at once.
const BUFFER_BYTES: usize = 1 << 20;

/// A table under way.
pub(super) struct CsvTable<W: Write> {
    writer: csv::Writer<W>,
    layout: Layout,
}

impl<W: Write> CsvTable<W> {
    /// Writes the header.
    pub(super) fn new(to: W, layout: Layout) -> Result<Self, ExportError> {
        let mut writer = csv::WriterBuilder::new().buffer_capacity(BUFFER_BYTES).from_writer(to);
        writer.write_record(layout.columns.iter().map(|column| &column.name))?;
        Ok(Self { writer, layout })
    }
}

impl<W: Write + Send> Table for CsvTable<W> {
    /// Numbers are in the shortest form that reads back as the same bits.
    fn write(&mut self, rows: &[Decoded]) -> Result<(), ExportError> {
        let Self { writer, layout: Layout { columns, start_ns, joint_names } } = self;
        let (mut whole, mut real) = (itoa::Buffer::new(), zmij::Buffer::new());
        for row in rows {
            for column in columns.iter() {
                match Column::cell(column, row, *start_ns, joint_names) {
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

    fn finish(mut self: Box<Self>) -> Result<(), ExportError> {
        Ok(self.writer.flush()?)
    }
}
