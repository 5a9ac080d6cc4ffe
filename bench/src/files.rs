//! The files a benchmark leaves: JSON, a CSV of every table, HdrHistogram logs, the page.
//!
//! Responsible for: making the directory before anything is measured, and writing into it.
//! Not responsible for: what the files say (`results`, `report`).

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use hdrhistogram::Histogram;
use hdrhistogram::serialization::V2DeflateSerializer;
use hdrhistogram::serialization::interval_log::{IntervalLogWriterBuilder, Tag};

use crate::figure::Figure;
use crate::report;
use crate::results::{Results, Table};

/// Name of the result file in a directory of results.
pub const RESULTS: &str = "results.json";
/// Name of the page.
pub const PAGE: &str = "report.html";
/// Histograms of a benchmark, one log for all.
const LOG: &str = "histograms.hlog";

/// A directory or file could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum FilesError {
    /// Nothing can be written there.
    #[error("{path} cannot be written: {source}; give another directory with --out")]
    Unwritable {
        /// Where.
        path: String,
        /// Why.
        source: io::Error,
    },
    /// No results can be read there.
    #[error("{path} cannot be read: {source}")]
    Unreadable {
        /// Where.
        path: String,
        /// Why.
        source: io::Error,
    },
    /// The file holds something else.
    #[error("{path} is no result file of this version: {source}")]
    Foreign {
        /// Where.
        path: String,
        /// Why.
        source: serde_json::Error,
    },
}

/// A histogram and what it is of; the words stand in the log as its tag.
#[derive(Clone, Debug)]
pub struct Tagged {
    /// What was measured, without blanks or commas (they become dashes).
    pub tag: String,
    /// The values.
    pub histogram: Histogram<u64>,
}

/// A directory for results that can be written.
#[derive(Clone, Debug)]
pub struct Output {
    dir: PathBuf,
}

impl Output {
    /// Makes the directory if need be, and tries it, so that nobody measures for an hour in vain.
    ///
    /// # Errors
    /// It cannot be made or written.
    pub fn create(dir: &Path) -> Result<Self, FilesError> {
        let unwritable = |source| FilesError::Unwritable {
            path: dir.display().to_string(),
            source,
        };
        fs::create_dir_all(dir).map_err(unwritable)?;
        let probe = dir.join(".probe");
        File::create(&probe)
            .and_then(|mut file| file.write_all(b"probe"))
            .map_err(unwritable)?;
        fs::remove_file(&probe).map_err(unwritable)?;
        Ok(Self {
            dir: dir.to_owned(),
        })
    }

    /// Writes everything; the names of the files.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(
        &self,
        results: &Results,
        figures: &[Figure],
        histograms: &[Tagged],
    ) -> Result<Vec<PathBuf>, FilesError> {
        let mut written = Vec::new();
        let json = serde_json::to_string(results).map_err(io::Error::other);
        self.put(RESULTS, &mut written, |file| writeln!(file, "{}", json?))?;
        for table in &results.tables {
            let name = format!("{}.csv", table.name);
            self.put(&name, &mut written, |file| write_csv(table, file))?;
        }
        if !histograms.is_empty() {
            self.put(LOG, &mut written, |file| {
                write_log(results, histograms, file)
            })?;
        }
        let page = report::page(results, figures);
        self.put(PAGE, &mut written, |file| file.write_all(page.as_bytes()))?;
        Ok(written)
    }

    fn put(
        &self,
        name: &str,
        written: &mut Vec<PathBuf>,
        write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
    ) -> Result<(), FilesError> {
        let path = self.dir.join(name);
        let wrote = File::create(&path).and_then(|file| {
            let mut file = BufWriter::new(file);
            write(&mut file)?;
            file.flush()
        });
        wrote.map_err(|source| FilesError::Unwritable {
            path: path.display().to_string(),
            source,
        })?;
        written.push(path);
        Ok(())
    }
}

/// Reads the results at `path`: the file, or the directory it lies in.
///
/// # Errors
/// It cannot be read, or holds something else.
pub fn read(path: &Path) -> Result<Results, FilesError> {
    let path = if path.is_dir() {
        path.join(RESULTS)
    } else {
        path.to_owned()
    };
    let name = path.display().to_string();
    let text = fs::read_to_string(&path).map_err(|source| FilesError::Unreadable {
        path: name.clone(),
        source,
    })?;
    serde_json::from_str(&text).map_err(|source| FilesError::Foreign { path: name, source })
}

fn write_csv(table: &Table, file: impl Write) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(file);
    writer.write_record(table.columns.iter().map(|column| &column.name))?;
    for row in &table.rows {
        writer.write_record(row.iter().map(ToString::to_string))?;
    }
    writer.flush()
}

/// All histograms as one log in `HdrHistogram`'s compressed V2 encoding, told apart by their tags.
fn write_log(results: &Results, histograms: &[Tagged], file: &mut impl Write) -> io::Result<()> {
    let mut serializer = V2DeflateSerializer::new();
    let mut log = IntervalLogWriterBuilder::new()
        .add_comment(&results.command)
        .with_start_time(SystemTime::now())
        .begin_log_with(file, &mut serializer)?;
    for one in histograms {
        let tag: String = one
            .tag
            .chars()
            .map(|c| {
                if c.is_whitespace() || c == ',' {
                    '-'
                } else {
                    c
                }
            })
            .collect();
        log.write_histogram(
            &one.histogram,
            Duration::ZERO,
            Duration::ZERO,
            Tag::new(&tag),
        )
        .map_err(|error| io::Error::other(format!("{error:?}")))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use hdrhistogram::serialization::interval_log::{IntervalLogIterator, LogEntry};

    use super::*;

    fn results() -> Results {
        let mut results = Results::new("paper", "rearrange bench paper");
        let mut table = Table::new("runs", "Runs")
            .key("room", "", "")
            .lower("time_s", "s", "");
        table.push(vec!["a, \"b\"".into(), 1.5.into()]);
        table.push(vec!["c".into(), None::<f64>.into()]);
        results.tables.push(table);
        results
    }

    #[test]
    fn what_is_written_reads_back() {
        let place = tempfile::tempdir().unwrap();
        let dir = place.path().join("deep/er");
        let output = Output::create(&dir).unwrap();
        let mut histogram = Histogram::<u64>::new(3).unwrap();
        histogram.record(1234).unwrap();
        let tagged = Tagged {
            tag: "age, 4 robots".into(),
            histogram,
        };
        let written = output.write(&results(), &[], &[tagged]).unwrap();
        assert_eq!(written.len(), 4);
        assert_eq!(read(&dir).unwrap(), results());
        let csv = fs::read_to_string(dir.join("runs.csv")).unwrap();
        assert_eq!(csv, "room,time_s\n\"a, \"\"b\"\"\",1.5\nc,\n");
        let log = fs::read(dir.join(LOG)).unwrap();
        let entries: Vec<_> = IntervalLogIterator::new(&log)
            .filter_map(|entry| match entry.unwrap() {
                LogEntry::Interval(interval) => Some(interval),
                _ => None,
            })
            .collect();
        assert_eq!(entries.len(), 1);
        assert_eq!(entries[0].tag().unwrap().as_str(), "age--4-robots");
        // The cookie of the compressed V2 encoding, the only one that log readers take.
        assert!(entries[0].encoded_histogram().starts_with("HISTF"));
    }

    #[test]
    fn a_place_that_cannot_be_written_is_refused_before_anything_is_measured() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("file");
        fs::write(&file, "").unwrap();
        let refused = Output::create(&file.join("below")).unwrap_err().to_string();
        assert!(
            refused.contains("file/below") && refused.contains("--out"),
            "{refused}"
        );
    }

    #[test]
    fn foreign_files_are_told_from_missing_ones() {
        let place = tempfile::tempdir().unwrap();
        assert!(matches!(
            read(place.path()),
            Err(FilesError::Unreadable { .. })
        ));
        fs::write(place.path().join(RESULTS), "{}").unwrap();
        assert!(matches!(
            read(place.path()),
            Err(FilesError::Foreign { .. })
        ));
    }
}
