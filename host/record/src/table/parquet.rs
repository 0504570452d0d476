//! A table as Parquet: row groups of some ten thousand rows, snappy; units and what the layout says in its metadata.

use super::{Cell, Heading, Kind, Layout, Table, TableError};
use parquet::basic::{Compression, ConvertedType, Encoding, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{ColumnPath, Type};
use std::io::Write;
use std::sync::Arc;

/// Rows of a group.
const GROUP_ROWS: usize = 1 << 16;

/// A table under way.
pub(super) struct ParquetTable<W: Write + Send, L> {
    writer: SerializedFileWriter<W>,
    layout: L,
    buffers: Vec<Buffer>,
    rows: usize,
}

/// The values of a column in the row group under way.
struct Buffer {
    values: Values,
    /// One a row: 1 where there is a value, 0 where it is missing.
    present: Vec<i16>,
}

enum Values {
    Whole(Vec<i64>),
    Real(Vec<f32>),
    Double(Vec<f64>),
    Truth(Vec<bool>),
    Words(Vec<ByteArray>),
}

impl<W: Write + Send, L: Layout> ParquetTable<W, L> {
    /// Writes the beginning.
    pub(super) fn new(to: W, layout: L) -> Result<Self, TableError> {
        let fields = layout.headings().map(field).collect::<Result<_, _>>()?;
        let schema = Type::group_type_builder(layout.row_name()).with_fields(fields).build()?;
        let units = layout.headings().map(|column| {
            let unit = if column.unit.is_empty() { String::new() } else { format!("[{}] ", column.unit) };
            (format!("column {}", column.name), format!("{unit}{}", column.words))
        });
        let about = layout.about().into_iter();
        let metadata = about.chain(units).map(|(key, value)| KeyValue::new(key, value)).collect();
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_statistics_enabled(EnabledStatistics::Chunk)
            .set_max_row_group_row_count(Some(GROUP_ROWS))
            .set_created_by(concat!("blindgrasp ", env!("CARGO_PKG_VERSION")).to_owned())
            .set_key_value_metadata(Some(metadata));
        for column in layout.headings() {
            let path = ColumnPath::from(column.name);
            let encoding = match column.kind {
                Kind::Whole => Encoding::DELTA_BINARY_PACKED,
                // Neighbours share their exponents: byte by byte they compress.
                Kind::Real | Kind::Double => Encoding::BYTE_STREAM_SPLIT,
                // A dictionary, and its runs.
                Kind::Words => continue,
                Kind::Truth => Encoding::PLAIN,
            };
            properties = properties
                .set_column_dictionary_enabled(path.clone(), false)
                .set_column_encoding(path, encoding);
        }
        let writer = SerializedFileWriter::new(to, Arc::new(schema), Arc::new(properties.build()))?;
        let buffers = layout.headings().map(|column| Buffer::new(column.kind)).collect();
        Ok(Self { writer, layout, buffers, rows: 0 })
    }

    /// Writes the row group.
    fn flush(&mut self) -> Result<(), TableError> {
        if self.rows == 0 {
            return Ok(());
        }
        let mut group = self.writer.next_row_group()?;
        for buffer in &mut self.buffers {
            buffer.write(&mut group)?;
        }
        group.close()?;
        self.rows = 0;
        Ok(())
    }
}

impl<W: Write + Send, L: Layout> Table<L::Row> for ParquetTable<W, L> {
    fn write(&mut self, rows: &[L::Row]) -> Result<(), TableError> {
        let mut rows = rows;
        while !rows.is_empty() {
            let (now, later) = rows.split_at(rows.len().min(GROUP_ROWS - self.rows));
            for (column, buffer) in self.buffers.iter_mut().enumerate() {
                for row in now {
                    buffer.push(self.layout.cell(row, column));
                }
            }
            self.rows += now.len();
            rows = later;
            if self.rows == GROUP_ROWS {
                self.flush()?;
            }
        }
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<(), TableError> {
        self.flush()?;
        self.writer.close()?;
        Ok(())
    }
}

impl Buffer {
    fn new(kind: Kind) -> Self {
        let values = match kind {
            Kind::Whole => Values::Whole(Vec::new()),
            Kind::Real => Values::Real(Vec::new()),
            Kind::Double => Values::Double(Vec::new()),
            Kind::Truth => Values::Truth(Vec::new()),
            Kind::Words => Values::Words(Vec::new()),
        };
        Self { values, present: Vec::new() }
    }

    #[inline]
    fn push(&mut self, cell: Cell<'_>) {
        let is_there = match (&mut self.values, cell) {
            (Values::Whole(values), Cell::Whole(value)) => push(values, value),
            (Values::Real(values), Cell::Real(value)) => push(values, value),
            (Values::Double(values), Cell::Double(value)) => push(values, value),
            (Values::Truth(values), Cell::Truth(value)) => push(values, value),
            (Values::Words(values), Cell::Word(word)) => {
                // Mostly it is the same as before, whose bytes are shared.
                let value = match values.last() {
                    Some(last) if last.data() == word.as_bytes() => last.clone(),
                    _ => ByteArray::from(word),
                };
                push(values, value)
            }
            (Values::Words(values), Cell::Text(text)) => push(values, ByteArray::from(text.into_bytes())),
            _ => false,
        };
        self.present.push(is_there.into());
    }

    fn write<W: Write + Send>(
        &mut self,
        group: &mut SerializedRowGroupWriter<'_, W>,
    ) -> Result<(), TableError> {
        let present = &mut self.present;
        match &mut self.values {
            Values::Whole(values) => column::<Int64Type, W>(group, values, present)?,
            Values::Real(values) => column::<FloatType, W>(group, values, present)?,
            Values::Double(values) => column::<DoubleType, W>(group, values, present)?,
            Values::Truth(values) => column::<BoolType, W>(group, values, present)?,
            Values::Words(values) => column::<ByteArrayType, W>(group, values, present)?,
        }
        Ok(())
    }
}

fn push<T>(values: &mut Vec<T>, value: T) -> bool {
    values.push(value);
    true
}

/// Writes a column, and empties its buffer.
fn column<T: DataType, W: Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: &mut Vec<T::T>,
    present: &mut Vec<i16>,
) -> Result<(), TableError> {
    if let Some(mut column) = group.next_column()? {
        column.typed::<T>().write_batch(values, Some(present), None)?;
        column.close()?;
    }
    values.clear();
    present.clear();
    Ok(())
}

/// A column in the schema; every value may be missing.
fn field(column: Heading<'_>) -> Result<Arc<Type>, TableError> {
    let (physical, logical) = match column.kind {
        Kind::Whole => (Physical::INT64, None),
        Kind::Real => (Physical::FLOAT, None),
        Kind::Double => (Physical::DOUBLE, None),
        Kind::Truth => (Physical::BOOLEAN, None),
        Kind::Words => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let converted = if logical.is_some() { ConvertedType::UTF8 } else { ConvertedType::NONE };
    let field = Type::primitive_type_builder(column.name, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(logical)
        .with_converted_type(converted)
        .build()?;
    Ok(Arc::new(field))
}
