//! What a benchmark found, as data: tables whose every row is one repeat, and what follows.
//!
//! Responsible for: the words of a result file, and finding things in it again.
//! Not responsible for: writing files (`files`), the page for people (`report`), statistics
//! (`stats`).
//!
//! Terms: a *key* column says what was measured (method, robots), a *repeat* column which
//! repetition this is, a *measure* what came out. A *finding* is a statement that the numbers
//! bear out or do not.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::machine::{Machine, date_utc};

/// Version of the result file's words; raised when a reader would misread it.
pub const SCHEMA_VERSION: u32 = 1;

/// Everything one call of a benchmark found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// [`SCHEMA_VERSION`] of the program that wrote it.
    pub schema_version: u32,
    /// Version of that program.
    pub program_version: String,
    /// Which benchmark.
    pub benchmark: String,
    /// Command line that made it.
    pub command: String,
    /// When it began, UTC.
    pub date: String,
    /// Where.
    pub machine: Machine,
    /// What else could explain the numbers: load, stolen time, governor, limits.
    pub conditions: BTreeMap<String, String>,
    /// Whether it was interrupted before everything was measured.
    pub partial: bool,
    /// The rows.
    pub tables: Vec<Table>,
    /// What follows from them.
    pub findings: Vec<Finding>,
    /// What a reader has to know besides.
    pub notes: Vec<String>,
}

impl Results {
    /// A result without rows, of here and now.
    #[must_use]
    pub fn new(benchmark: &str, command: &str) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
            benchmark: benchmark.to_owned(),
            command: command.to_owned(),
            date: date_utc(),
            machine: Machine::current(),
            conditions: BTreeMap::new(),
            partial: false,
            tables: Vec::new(),
            findings: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// The table of this name.
    #[must_use]
    pub fn table(&self, name: &str) -> Option<&Table> {
        self.tables.iter().find(|table| table.name == name)
    }
}

/// A statement, and whether the numbers bear it out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// What is claimed.
    pub claim: String,
    /// Whether it holds; none if the rows do not tell.
    pub held: Option<bool>,
    /// The numbers that say so.
    pub evidence: String,
}

/// What a column is there for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Part of what was measured.
    Key,
    /// Which repetition.
    Repeat,
    /// A measure that should be low.
    Lower,
    /// A measure that should be high.
    Higher,
    /// Told, but not judged.
    Info,
}

impl Role {
    /// Whether the column holds numbers to compare.
    #[must_use]
    pub const fn is_judged(self) -> bool {
        matches!(self, Self::Lower | Self::Higher)
    }
}

/// A column of a table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Column {
    /// Name, unit last.
    pub name: String,
    /// Unit, empty for counts and words.
    pub unit: String,
    /// What it is there for.
    pub role: Role,
    /// What its numbers mean.
    pub about: String,
}

/// A cell of a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A finite number.
    Number(f64),
    /// Words.
    Text(String),
    /// Not measured.
    Missing(()),
}

impl Value {
    /// The number in it, if it is one.
    #[must_use]
    pub const fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            _ => None,
        }
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Text(text) => f.write_str(text),
            Self::Missing(()) => Ok(()),
        }
    }
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        if number.is_finite() {
            Self::Number(number)
        } else {
            Self::Missing(())
        }
    }
}

impl From<u64> for Value {
    fn from(number: u64) -> Self {
        Self::Number(number as f64)
    }
}

impl From<usize> for Value {
    fn from(number: usize) -> Self {
        Self::Number(number as f64)
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Value {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl<T: Into<Self>> From<Option<T>> for Value {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Missing(()), Into::into)
    }
}

/// Rows under named columns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Short name, that of its CSV file too.
    pub name: String,
    /// What the rows are, for people.
    pub title: String,
    /// The columns.
    pub columns: Vec<Column>,
    /// The rows, each as long as `columns`.
    pub rows: Vec<Vec<Value>>,
}

impl Table {
    /// A table without columns.
    #[must_use]
    pub fn new(name: &str, title: &str) -> Self {
        Self {
            name: name.to_owned(),
            title: title.to_owned(),
            columns: Vec::new(),
            rows: Vec::new(),
        }
    }

    /// With a column that says what was measured.
    #[must_use]
    pub fn key(self, name: &str, unit: &str, about: &str) -> Self {
        self.column(name, unit, Role::Key, about)
    }

    /// With a column that counts repetitions.
    #[must_use]
    pub fn repeat(self) -> Self {
        self.column("repeat", "", Role::Repeat, "which repetition, from 0")
    }

    /// With a measure that should be low.
    #[must_use]
    pub fn lower(self, name: &str, unit: &str, about: &str) -> Self {
        self.column(name, unit, Role::Lower, about)
    }

    /// With a measure that should be high.
    #[must_use]
    pub fn higher(self, name: &str, unit: &str, about: &str) -> Self {
        self.column(name, unit, Role::Higher, about)
    }

    /// With a column that is told but not judged.
    #[must_use]
    pub fn info(self, name: &str, unit: &str, about: &str) -> Self {
        self.column(name, unit, Role::Info, about)
    }

    fn column(mut self, name: &str, unit: &str, role: Role, about: &str) -> Self {
        self.columns.push(Column {
            name: name.to_owned(),
            unit: unit.to_owned(),
            role,
            about: about.to_owned(),
        });
        self
    }

    /// Adds a row.
    ///
    /// # Panics
    /// The row is not as long as the columns: a mistake of the benchmark.
    pub fn push(&mut self, row: Vec<Value>) {
        assert_eq!(row.len(), self.columns.len(), "a row of {}", self.name);
        self.rows.push(row);
    }

    /// Where the column of this name is.
    #[must_use]
    pub fn position(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column.name == name)
    }

    /// The numbers of column `name` in all rows whose cells under `keys` read as given.
    pub fn numbers<'a>(
        &'a self,
        name: &str,
        keys: &'a [(&str, &str)],
    ) -> impl Iterator<Item = f64> + 'a {
        let column = self.position(name);
        let keys: Vec<_> = keys
            .iter()
            .map(|(key, value)| (self.position(key), *value))
            .collect();
        self.rows
            .iter()
            .filter(move |row| {
                keys.iter().all(|(position, value)| {
                    position.is_some_and(|position| row[position].to_string() == *value)
                })
            })
            .filter_map(move |row| row[column?].number())
    }

    /// Rows grouped by their key cells, in the order of their first row: key texts and the rows'
    /// indices.
    #[must_use]
    pub fn groups(&self) -> Vec<(Vec<String>, Vec<usize>)> {
        let mut places = BTreeMap::new();
        let mut groups: Vec<(Vec<String>, Vec<usize>)> = Vec::new();
        for (index, row) in self.rows.iter().enumerate() {
            let cells = self.columns.iter().zip(row);
            let key: Vec<_> = cells
                .filter(|(column, _)| column.role == Role::Key)
                .map(|(_, cell)| cell.to_string())
                .collect();
            let place = *places.entry(key.clone()).or_insert_with(|| {
                groups.push((key, Vec::new()));
                groups.len() - 1
            });
            groups[place].1.push(index);
        }
        groups
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut table = Table::new("runs", "Runs")
            .key("method", "", "")
            .repeat()
            .lower("time_s", "s", "");
        for (method, repeat, time) in [("a", 0, 1.0), ("b", 0, 2.0), ("a", 1, 3.0)] {
            table.push(vec![method.into(), Value::from(repeat as u64), time.into()]);
        }
        table
    }

    #[test]
    fn rows_are_grouped_by_what_was_measured() {
        let groups = table().groups();
        assert_eq!(groups[0], (vec!["a".to_owned()], vec![0, 2]));
        assert_eq!(groups[1], (vec!["b".to_owned()], vec![1]));
    }

    #[test]
    fn numbers_are_found_by_their_keys() {
        let table = table();
        let times: Vec<_> = table.numbers("time_s", &[("method", "a")]).collect();
        assert_eq!(times, [1.0, 3.0]);
        assert_eq!(table.numbers("time_s", &[("method", "c")]).count(), 0);
        assert_eq!(table.numbers("no such", &[]).count(), 0);
    }

    #[test]
    fn a_result_file_reads_back() {
        let mut results = Results::new("paper", "rearrange bench paper");
        results.tables.push(table());
        results.tables[0].rows[0][2] = f64::NAN.into();
        let text = serde_json::to_string(&results).unwrap();
        let read: Results = serde_json::from_str(&text).unwrap();
        assert_eq!(read, results);
        assert_eq!(read.tables[0].rows[0][2], Value::Missing(()));
    }

    #[test]
    #[should_panic(expected = "a row of runs")]
    fn a_row_of_the_wrong_length_is_a_mistake() {
        table().push(vec![]);
    }
}
