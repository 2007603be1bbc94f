//! The trials of a campaign as a Parquet file: a row a trial, by variation and seed. `docs/researcher/campaigns.md` has the columns.
//!
//! The same trials give the same bytes. Rows are held back for one row group at a time.

use std::collections::BTreeMap;
use std::io::Write;
use std::sync::Arc;

use parquet::basic::{Compression, ConvertedType, Repetition, Type as Physical, ZstdLevel};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use scenario::Settings;
use serde_json::Value;

use crate::campaign::row::TrialRow;
use crate::campaign::{Plan, PlanVariation};

/// Rows of a row group.
const GROUP: usize = 32_768;
/// Name of the writer; without a version, so that the bytes depend on the trials alone.
const CREATED_BY: &str = "holdsafe";

/// The table cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("trials.parquet: {0}")]
pub struct TableError(#[from] ParquetError);

/// A Parquet file of trials that is being written.
pub struct TrialTable<'p, W: Write + Send> {
    plan: &'p Plan,
    columns: Vec<Column>,
    waiting: Vec<Record<'p>>,
    writer: SerializedFileWriter<W>,
}

/// One trial with its part of the plan.
struct Record<'p> {
    number: usize,
    variation: &'p PlanVariation,
    seed: u64,
    set: BTreeMap<String, Value>,
    row: TrialRow,
}

struct Column {
    name: String,
    optional: bool,
    read: Read,
}

/// Getter of a column's value from a trial; `None` where it has none.
enum Read {
    Whole(fn(&Record<'_>) -> Option<u64>),
    Number(fn(&Record<'_>) -> Option<f64>),
    Flag(fn(&Record<'_>) -> Option<bool>),
    Text(for<'r> fn(&'r Record<'_>) -> Option<&'r str>),
    /// A number that the grid sets or the trial drew, at this path.
    SetNumber(String),
    /// Any other such value, text as it is and the rest as JSON.
    SetText(String),
}

impl<'p, W: Write + Send> TrialTable<'p, W> {
    /// Writes into `to`.
    ///
    /// # Errors
    ///
    /// The writer's error.
    pub fn new(to: W, plan: &'p Plan) -> Result<Self, TableError> {
        let columns = columns(plan);
        let fields = columns.iter().map(|column| column.field().map(Arc::new)).collect::<Result<_, _>>()?;
        let schema = Type::group_type_builder("trials").with_fields(fields).build()?;
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_created_by(CREATED_BY.to_owned())
            .build();
        let writer = SerializedFileWriter::new(to, Arc::new(schema), Arc::new(properties))?;
        Ok(Self { plan, columns, waiting: Vec::new(), writer })
    }

    /// Adds trial `i` of variation `v`; in order.
    ///
    /// # Errors
    ///
    /// The writer's error.
    pub fn put(&mut self, v: usize, i: u64, row: TrialRow) -> Result<(), TableError> {
        let Some(variation) = self.plan.variations.get(v) else { return Ok(()) };
        let drawn = self.plan.drawn(v, i);
        let set =
            variation.set.iter().chain(drawn.iter()).map(|(path, value)| (path.to_owned(), value.clone())).collect();
        self.waiting.push(Record { number: v, variation, seed: self.plan.seed(i), set, row });
        if self.waiting.len() < GROUP { Ok(()) } else { self.flush() }
    }

    /// Writes buffered rows, and the end.
    ///
    /// # Errors
    ///
    /// The writer's error.
    pub fn finish(mut self) -> Result<(), TableError> {
        self.flush()?;
        self.writer.close()?;
        Ok(())
    }

    fn flush(&mut self) -> Result<(), TableError> {
        if self.waiting.is_empty() {
            return Ok(());
        }
        let mut group = self.writer.next_row_group()?;
        for column in &self.columns {
            column.write(&mut group, &self.waiting)?;
        }
        group.close()?;
        self.waiting.clear();
        Ok(())
    }
}

/// Every column, in order.
fn columns(plan: &Plan) -> Vec<Column> {
    let column = |name: &str, optional, read| Column { name: name.to_owned(), optional, read };
    let mut columns = vec![
        column("variation", false, Read::Whole(|r| Some(r.number as u64))),
        column("scenario", false, Read::Text(|r| Some(&r.variation.scenario))),
        column("cell", true, Read::Text(|r| r.variation.cell.as_deref())),
        column("policy", false, Read::Text(|r| Some(&r.variation.policy))),
        column("evidence", false, Read::Text(|r| Some(r.variation.mode.evidence().name()))),
        column("seed", false, Read::Whole(|r| Some(r.seed))),
    ];
    columns.extend(set_columns(plan));
    columns.extend([
        column("outcome", false, Read::Text(|r| Some(r.row.outcome.name()))),
        column("expected", false, Read::Flag(|r| Some(!r.row.outcome.is_unexpected(&r.variation.expected)))),
        column("receipt", false, Read::Flag(|r| Some(r.row.receipt))),
        column("finding", true, Read::Text(|r| r.row.finding.as_deref())),
        column("to_degraded_ms", true, Read::Number(|r| r.row.latency_us[0].map(ms))),
        column("to_hold_safe_ms", true, Read::Number(|r| r.row.latency_us[1].map(ms))),
        column("to_authority_revoked_ms", true, Read::Number(|r| r.row.latency_us[2].map(ms))),
        column("received", false, Read::Whole(|r| Some(r.row.received))),
        column("accepted", false, Read::Whole(|r| Some(r.row.accepted))),
        column("refused", false, Read::Whole(|r| Some(r.row.refused))),
        column("false_trips", false, Read::Whole(|r| Some(r.row.false_trips.into()))),
        column("nominal_s", false, Read::Number(|r| Some(r.row.nominal_us as f64 / 1e6))),
        column("sim_s", false, Read::Number(|r| Some(r.row.sim_us as f64 / 1e6))),
        column("log_hash", false, Read::Text(|r| Some(&r.row.log_hash))),
        column("decision_hash", false, Read::Text(|r| Some(&r.row.decision_hash))),
    ]);
    columns
}

/// A column for each path that the grid sets or the trials draw: numbers where all of its values are.
fn set_columns(plan: &Plan) -> Vec<Column> {
    let mut values: BTreeMap<&str, Vec<Value>> = BTreeMap::new();
    let grids: Vec<&Settings> = plan.variations.iter().map(|variation| &variation.set).collect();
    for (path, value) in grids.into_iter().flat_map(Settings::iter) {
        values.entry(path).or_default().push(value.clone());
    }
    for (path, how) in &plan.terms.draws {
        values.entry(path).or_default().extend(how.ends());
    }
    let column = |(path, values): (&str, Vec<Value>)| {
        let numbers = values.iter().all(Value::is_number);
        let read = if numbers { Read::SetNumber(path.to_owned()) } else { Read::SetText(path.to_owned()) };
        Column { name: format!("set.{path}"), optional: false, read }
    };
    values.into_iter().map(column).collect()
}

fn ms(us: u64) -> f64 {
    us as f64 / 1e3
}

impl Column {
    fn field(&self) -> Result<Type, ParquetError> {
        let (physical, converted) = match &self.read {
            Read::Whole(_) => (Physical::INT64, ConvertedType::UINT_64),
            Read::Number(_) | Read::SetNumber(_) => (Physical::DOUBLE, ConvertedType::NONE),
            Read::Flag(_) => (Physical::BOOLEAN, ConvertedType::NONE),
            Read::Text(_) | Read::SetText(_) => (Physical::BYTE_ARRAY, ConvertedType::UTF8),
        };
        let repetition = if self.optional { Repetition::OPTIONAL } else { Repetition::REQUIRED };
        let field = Type::primitive_type_builder(&self.name, physical).with_converted_type(converted);
        field.with_repetition(repetition).build()
    }

    fn write<W: Write + Send>(
        &self,
        group: &mut SerializedRowGroupWriter<'_, W>,
        rows: &[Record<'_>],
    ) -> Result<(), ParquetError> {
        let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        match &self.read {
            Read::Whole(read) => self.put::<Int64Type, W>(group, rows.iter().map(|r| read(r).map(|n| n as i64))),
            Read::Number(read) => self.put::<DoubleType, W>(group, rows.iter().map(read)),
            Read::Flag(read) => self.put::<BoolType, W>(group, rows.iter().map(read)),
            Read::Text(read) => self.put::<ByteArrayType, W>(group, rows.iter().map(|r| read(r).map(ByteArray::from))),
            Read::SetNumber(path) => {
                let number = |r: &Record<'_>| r.set.get(path).and_then(Value::as_f64);
                self.put::<DoubleType, W>(group, rows.iter().map(number))
            }
            Read::SetText(path) => {
                let word = |r: &Record<'_>| r.set.get(path).map(|value| ByteArray::from(text(value).into_bytes()));
                self.put::<ByteArrayType, W>(group, rows.iter().map(word))
            }
        }
    }

    /// Writes the values; a column that is not optional has one in each row, which the writer holds it to.
    fn put<T: DataType, W: Write + Send>(
        &self,
        group: &mut SerializedRowGroupWriter<'_, W>,
        values: impl Iterator<Item = Option<T::T>>,
    ) -> Result<(), ParquetError> {
        let values: Vec<Option<T::T>> = values.collect();
        let levels: Vec<i16> = values.iter().map(|value| i16::from(value.is_some())).collect();
        let present: Vec<T::T> = values.into_iter().flatten().collect();
        let missing = || ParquetError::General(format!("no column `{}`", self.name));
        let mut column = group.next_column()?.ok_or_else(missing)?;
        column.typed::<T>().write_batch(&present, self.optional.then_some(levels.as_slice()), None)?;
        column.close()
    }
}

#[cfg(test)]
mod tests {
    use evidence::trial::Outcome;
    use evidence::trial::Trial;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;

    use super::*;
    use crate::campaign::draw::Distribution;
    use crate::campaign::example::plan;

    fn written(plan: &Plan, n: u64) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut table = TrialTable::new(&mut bytes, plan).unwrap();
        for v in 0..plan.variations.len() {
            for i in 0..n {
                table
                    .put(
                        v,
                        i,
                        TrialRow::from_trial(plan.number(v, i), &Trial::example(plan.seed(i), Outcome::HoldSafe)),
                    )
                    .unwrap();
            }
        }
        table.finish().unwrap();
        bytes
    }

    fn column(bytes: Vec<u8>, name: &str) -> Vec<Field> {
        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).unwrap();
        let rows = reader.get_row_iter(None).unwrap().map(Result::unwrap);
        let field = |row: parquet::record::Row| row.get_column_iter().find(|(n, _)| *n == name).unwrap().1.clone();
        rows.map(field).collect()
    }

    #[test]
    fn every_trial_is_a_row_with_its_settings() {
        let mut plan = plan(3);
        plan.terms.draws.insert("loss.0.direction".into(), Distribution::Choice(vec!["up".into(), 7.into()]));
        let bytes = written(&plan, 3);
        assert_eq!(column(bytes.clone(), "seed"), [7, 8, 9, 7, 8, 9].map(Field::ULong));
        let shares = [0.5, 0.5, 0.5, 1.0, 1.0, 1.0].map(Field::Double);
        assert_eq!(column(bytes.clone(), "set.loss.0.share"), shares);
        let drawn = column(bytes.clone(), "set.loss.0.at_s");
        let x = plan.drawn(1, 2).iter().find(|(path, _)| *path == "loss.0.at_s").and_then(|(_, v)| v.as_f64()).unwrap();
        assert_eq!(drawn[5], Field::Double(x));
        let words = column(bytes.clone(), "set.loss.0.direction");
        assert!(words.iter().all(|w| [Field::Str("up".into()), Field::Str("7".into())].contains(w)), "{words:?}");
        assert_eq!(column(bytes.clone(), "to_degraded_ms")[0], Field::Double(7.0));
        assert_eq!(column(bytes.clone(), "to_hold_safe_ms")[0], Field::Null);
        assert_eq!(column(bytes.clone(), "outcome")[0], Field::Str("HOLD_SAFE".into()));
        assert_eq!(column(bytes, "expected")[0], Field::Bool(true));
    }

    #[test]
    fn rows_repeat_bytewise_over_row_groups() {
        let plan = plan(GROUP as u64);
        let bytes = written(&plan, 20_000);
        assert_eq!(bytes, written(&plan, 20_000));
        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).unwrap();
        let groups: Vec<i64> = reader.metadata().row_groups().iter().map(|group| group.num_rows()).collect();
        assert_eq!(groups, [GROUP as i64, 40_000 - GROUP as i64]);
    }

    #[test]
    fn every_column_is_in_docs_campaigns() {
        let doc = include_str!("../../../../../docs/researcher/campaigns.md");
        let kind = |read: &Read| match read {
            Read::Whole(_) => "uint64",
            Read::Number(_) | Read::SetNumber(_) => "double",
            Read::Flag(_) => "bool",
            Read::Text(_) | Read::SetText(_) => "string",
        };
        for column in columns(&plan(1)).iter().filter(|column| !column.name.starts_with("set.")) {
            let (name, kind) = (&column.name, kind(&column.read));
            let nulls = if column.optional { "null" } else { "never null" };
            assert!(doc.contains(&format!("| `{name}` | {kind} | {nulls}")), "{name} {kind} {nulls}");
        }
    }
}
