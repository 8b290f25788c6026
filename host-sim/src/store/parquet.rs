//! Trials as uncompressed Parquet with a row group per chunk. The metadata of the file contains the header, the range,
//! and the SHA-256 of all values and of the header.

use std::cell::Cell;
use std::fs::File;
use std::io;
use std::panic::{self, AssertUnwindSafe};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Once};

use parquet::basic::{ConvertedType, Repetition, Type as Physical};
use parquet::column::reader::ColumnReader;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::{FileReader, RowGroupReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{PrimitiveTypeBuilder, Type, TypePtr};
use sha2::{Digest, Sha256};
use whole_file::Existing;

use study::monte_carlo::Outcome;

use super::{Chunk, Header, hex};

/// File extension.
pub const EXTENSION: &str = "parquet";

impl Chunk {
    fn hash(&self, into: &mut Sha256) {
        into.update(self.first.to_le_bytes());
        self.outcomes.iter().for_each(|outcome| into.update([*outcome as u8]));
        self.numbers.iter().flatten().for_each(|value| into.update(value.to_bits().to_le_bytes()));
    }
}

thread_local! {
    /// Whether this thread reads a file that may be damaged.
    static IS_GUARDED: Cell<bool> = const { Cell::new(false) };
}

const HEADER: &str = "host-sim monte-carlo";
const FIRST: &str = "first";
const COUNT: &str = "count";
const SHA256: &str = "sha256";

fn schema(header: &Header) -> Result<TypePtr, ParquetError> {
    let field = |builder: PrimitiveTypeBuilder<'_>| builder.with_repetition(Repetition::REQUIRED).build().map(Arc::new);
    let word = Type::primitive_type_builder("outcome", Physical::BYTE_ARRAY).with_converted_type(ConvertedType::UTF8);
    let mut fields = vec![field(Type::primitive_type_builder("trial", Physical::INT64))?, field(word)?];
    for name in &header.columns {
        fields.push(field(Type::primitive_type_builder(name, Physical::DOUBLE))?);
    }
    Ok(Arc::new(Type::group_type_builder("trials").with_fields(fields).build()?))
}

/// Writes a file of the trials `first..end`, completely or not at all. An existing file stays.
///
/// # Errors
/// If the file cannot be written, or if a chunk has an error.
pub fn write(
    path: &Path,
    header: &Header,
    [first, end]: [u64; 2],
    chunks: impl IntoIterator<Item = io::Result<Chunk>>,
) -> io::Result<()> {
    whole_file::write(path, Existing::Keep, |out| {
        let properties = WriterProperties::builder()
            .set_created_by(header.program.clone())
            .set_dictionary_enabled(false)
            .set_statistics_enabled(EnabledStatistics::None)
            .set_offset_index_disabled(true);
        let mut writer = SerializedFileWriter::new(Vec::new(), schema(header)?, Arc::new(properties.build()))?;
        let (mut hash, mut next) = (Sha256::new(), first);
        for chunk in chunks {
            let chunk = chunk?;
            if chunk.first != next {
                return Err(io::Error::other(format!("trial {} after trial {next}", chunk.first)));
            }
            next += chunk.outcomes.len() as u64;
            chunk.hash(&mut hash);
            let mut group = writer.next_row_group()?;
            let mut column = 0;
            while let Some(mut into) = group.next_column()? {
                match column {
                    0 => {
                        let numbers: Vec<i64> = (chunk.first..next).map(|trial| trial as i64).collect();
                        into.typed::<Int64Type>().write_batch(&numbers, None, None)?;
                    }
                    1 => {
                        let words = chunk.outcomes.iter().map(|outcome| ByteArray::from(outcome.word()));
                        into.typed::<ByteArrayType>().write_batch(&words.collect::<Vec<_>>(), None, None)?;
                    }
                    k => _ = into.typed::<DoubleType>().write_batch(&chunk.numbers[k - 2], None, None)?,
                }
                into.close()?;
                column += 1;
            }
            group.close()?;
            writer.flush()?;
            out.write_all(writer.inner())?;
            writer.inner_mut().clear();
        }
        if next != end {
            return Err(io::Error::other(format!("trials {next} to {end} are missing")));
        }
        let json = serde_json::to_string(header)?;
        hash.update(&json);
        let hex = hex(&hash.finalize());
        for (key, value) in
            [(HEADER, json), (FIRST, first.to_string()), (COUNT, (end - first).to_string()), (SHA256, hex)]
        {
            writer.append_key_value_metadata(KeyValue::new(key.to_owned(), value));
        }
        out.write_all(&writer.into_inner()?)
    })
}

/// File of trials whose checksum is valid.
pub struct Trials {
    path: PathBuf,
    /// Header of the plan.
    pub header: Header,
    /// First trial, and the one after the last.
    pub range: [u64; 2],
    reader: SerializedFileReader<File>,
}

impl Trials {
    /// Opens a file and checks all of it.
    ///
    /// # Errors
    /// If the file cannot be read, is not a file of trials, or is damaged. The message contains its path.
    pub fn open(path: &Path) -> Result<Self, String> {
        let file = whole_file::open(path).map_err(|why| format!("{}: {why}", path.display()))?;
        let trials = guarded(|| {
            let reader =
                SerializedFileReader::new(file).map_err(|error| format!("not a readable Parquet file: {error}"))?;
            let pairs = reader.metadata().file_metadata().key_value_metadata().cloned().unwrap_or_default();
            let value = |key: &str| {
                let pair = pairs.iter().find(|pair| pair.key == key);
                pair.and_then(|pair| pair.value.clone()).ok_or("not a file of trials: it has no such header")
            };
            let number = |key: &str| value(key)?.parse::<u64>().map_err(|_| "its header is damaged");
            let header: Header =
                serde_json::from_str(&value(HEADER)?).map_err(|error| format!("its header is damaged: {error}"))?;
            if header.scenario.contains(['/', '\\']) {
                return Err("its header is damaged: a scenario of that name would leave its folder".into());
            }
            let (first, count) = (number(FIRST)?, number(COUNT)?);
            let end = first.checked_add(count).filter(|end| *end <= header.trials);
            let trials =
                Self { path: path.to_owned(), range: [first, end.ok_or("its range is damaged")?], header, reader };
            let mut hash = Sha256::new();
            let mut next = first;
            for k in 0..trials.groups() {
                let chunk = trials.group(k)?;
                if chunk.first != next {
                    return Err(format!("damaged: trial {} after trial {next}", chunk.first));
                }
                next += chunk.outcomes.len() as u64;
                chunk.hash(&mut hash);
            }
            hash.update(value(HEADER)?);
            let hex = hex(&hash.finalize());
            if next != trials.range[1] || hex != value(SHA256)? {
                return Err("damaged: the checksum of header and values is wrong".into());
            }
            Ok(trials)
        });
        trials.map_err(|why| format!("{}: {why}", path.display()))
    }

    /// Number of row groups.
    fn groups(&self) -> usize {
        self.reader.metadata().num_row_groups()
    }

    /// Reads row group `k`.
    fn group(&self, k: usize) -> Result<Chunk, String> {
        let told = |error: ParquetError| format!("damaged: {error}");
        let group = self.reader.get_row_group(k).map_err(told)?;
        let rows: usize = group.metadata().num_rows().try_into().map_err(|_| "damaged: a number of rows")?;
        if group.metadata().num_columns() != self.header.columns.len() + 2 || rows as u64 > self.header.chunk {
            return Err("damaged: its columns or chunks differ from its header".into());
        }
        let first = match group.get_column_reader(0).map_err(told)? {
            ColumnReader::Int64ColumnReader(mut reader) => {
                let mut numbers = Vec::new();
                reader.read_records(rows, None, None, &mut numbers).map_err(told)?;
                let first = numbers.first().copied().unwrap_or(-1);
                let follow = numbers.len() == rows && numbers.iter().enumerate().all(|(k, n)| *n == first + k as i64);
                u64::try_from(first).ok().filter(|_| follow).ok_or("damaged: numbers of trials")?
            }
            _ => return Err("damaged: numbers of trials".into()),
        };
        let outcomes = outcomes(group.as_ref(), rows)?;
        let numbers = (0..self.header.columns.len()).map(|k| column(group.as_ref(), k, rows));
        Ok(Chunk { first, outcomes, numbers: numbers.collect::<Result<_, _>>()? })
    }

    /// Returns the chunks in order.
    pub fn chunks(&self) -> impl Iterator<Item = io::Result<Chunk>> {
        (0..self.groups()).map(|k| {
            let chunk = guarded(|| self.group(k));
            chunk.map_err(|why| io::Error::other(format!("{}: {why}", self.path.display())))
        })
    }

    /// Returns the outcome of each trial.
    ///
    /// # Errors
    /// If the file can no longer be read.
    pub fn outcomes(&self) -> Result<Vec<Outcome>, String> {
        self.each(|group, rows| outcomes(group, rows))
    }

    /// Returns the column with this index in [`Header::columns`].
    ///
    /// # Errors
    /// If the file can no longer be read.
    pub fn column(&self, k: usize) -> Result<Vec<f64>, String> {
        self.each(|group, rows| column(group, k, rows))
    }

    fn each<T>(&self, read: impl Fn(&dyn RowGroupReader, usize) -> Result<Vec<T>, String>) -> Result<Vec<T>, String> {
        let mut all = Vec::with_capacity((self.range[1] - self.range[0]) as usize);
        let read = guarded(|| {
            for k in 0..self.groups() {
                let group = self.reader.get_row_group(k).map_err(|error| error.to_string())?;
                all.extend(read(group.as_ref(), group.metadata().num_rows() as usize)?);
            }
            Ok(())
        });
        read.map(|()| all).map_err(|why| format!("{}: {why}", self.path.display()))
    }
}

fn outcomes(group: &dyn RowGroupReader, rows: usize) -> Result<Vec<Outcome>, String> {
    let mut words = Vec::new();
    match group.get_column_reader(1).map_err(|error| format!("damaged: {error}"))? {
        ColumnReader::ByteArrayColumnReader(mut reader) => {
            reader.read_records(rows, None, None, &mut words).map_err(|error| format!("damaged: {error}"))?
        }
        _ => return Err("damaged: outcomes".into()),
    };
    let of = |word: &ByteArray| Outcome::ALL.into_iter().find(|outcome| outcome.word().as_bytes() == word.data());
    let outcomes: Option<Vec<Outcome>> = words.iter().map(of).collect();
    outcomes.filter(|outcomes| outcomes.len() == rows).ok_or_else(|| "damaged: outcomes".into())
}

fn column(group: &dyn RowGroupReader, k: usize, rows: usize) -> Result<Vec<f64>, String> {
    let mut values = Vec::new();
    match group.get_column_reader(k + 2).map_err(|error| format!("damaged: {error}"))? {
        ColumnReader::DoubleColumnReader(mut reader) => {
            reader.read_records(rows, None, None, &mut values).map_err(|error| format!("damaged: {error}"))?
        }
        _ => return Err("damaged: a column of numbers".into()),
    };
    if values.len() == rows { Ok(values) } else { Err("damaged: a column is too short".into()) }
}

/// Catches panics of the Parquet library: a damaged file must not end the program, and must give a readable message.
fn guarded<T>(read: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    static SILENT: Once = Once::new();
    SILENT.call_once(|| {
        let told = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !IS_GUARDED.get() {
                told(info);
            }
        }));
    });
    let was = IS_GUARDED.replace(true);
    let read = panic::catch_unwind(AssertUnwindSafe(read));
    IS_GUARDED.set(was);
    read.unwrap_or_else(|_| Err("damaged: it cannot be read".into()))
}
