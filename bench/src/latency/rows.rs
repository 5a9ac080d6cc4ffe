//! Rows and histograms of what was measured.
//!
//! Responsible for: the columns, one row for each name and repeat, histograms over all repeats.
//! Not responsible for: measuring (`measure`), what follows (`findings`, `figures`).

use hdrhistogram::Histogram;
use node::histograms::{empty, summary};

use crate::files::Tagged;
use crate::latency::combination::Combination;
use crate::results::{Table, Value};

/// Table of times.
pub(super) const TIMES: &str = "latency";
/// Table of runs.
pub(super) const RUNS: &str = "runs";

/// Who was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum System {
    Ours,
    Bare,
    CacheLine,
    Datagram,
}

impl System {
    pub(super) const fn word(self) -> &'static str {
        match self {
            Self::Ours => "rearrange",
            Self::Bare => node::reference::NAME,
            Self::CacheLine => "cache line",
            Self::Datagram => "unix datagram",
        }
    }
}

/// What a row is about: everything but its name and its repeat.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Key {
    pub(super) system: System,
    pub(super) words: [&'static str; 4],
    pub(super) robots: usize,
    pub(super) objects: usize,
}

impl Key {
    pub(super) const fn of(system: System, one: &Combination) -> Self {
        Self {
            system,
            words: one.words(),
            robots: one.robots,
            objects: one.objects,
        }
    }

    fn cells(&self) -> Vec<Value> {
        let mut cells = vec![self.system.word().into()];
        cells.extend(self.words.map(Value::from));
        cells.extend([self.robots.into(), self.objects.into()]);
        cells
    }
}

/// A histogram over all repeats.
#[derive(Clone, Debug)]
pub(super) struct Kept {
    pub(super) key: Key,
    pub(super) name: &'static str,
    pub(super) histogram: Histogram<u64>,
}

impl Kept {
    pub(super) fn tagged(self) -> Tagged {
        let Key {
            system,
            words,
            robots,
            objects,
        } = self.key;
        Tagged {
            tag: format!(
                "{};{};{};robots={robots};objects={objects}",
                system.word(),
                self.name,
                words.join(";")
            ),
            histogram: self.histogram,
        }
    }
}

/// How a run went.
#[derive(Clone, Debug, Default)]
pub(super) struct Run {
    pub(super) status: &'static str,
    pub(super) reason: String,
    pub(super) ticks: u64,
    pub(super) wall_s: f64,
    pub(super) cpu_s: f64,
    pub(super) missed: Option<u64>,
    pub(super) skipped: Option<u64>,
    pub(super) stolen: Option<f64>,
    pub(super) processes: usize,
    pub(super) payload: usize,
}

/// All rows so far.
#[derive(Debug)]
pub(super) struct Rows {
    times: Table,
    runs: Table,
    kept: Vec<Kept>,
    cores: usize,
}

fn keys(table: Table) -> Table {
    table
        .key("system", "", "who was measured")
        .key(
            "clock",
            "",
            "virtual time that waits for all, or the wall clock at 1 kHz",
        )
        .key("wait", "", "how processes wait for each other")
        .key("pinned", "", "whether each process is bound to a core")
        .key("priority", "", "SCHED_FIFO, or none in particular")
        .key(
            "robots",
            "",
            "robot processes; for references, as many readers",
        )
        .key("objects", "", "objects in the snapshot")
}

impl Rows {
    pub(super) fn new(cores: usize) -> Self {
        let times = keys(Table::new(TIMES, "Times by name"))
            .key(
                "name",
                "",
                "what was timed; docs/benchmarks.md says from when to when",
            )
            .repeat()
            .info("count", "", "durations in this repeat")
            .lower("p50_ns", "ns", "half of the durations are shorter")
            .lower("p99_ns", "ns", "99 of 100 are shorter")
            .info("p999_ns", "ns", "999 of 1000 are shorter")
            .info("max_ns", "ns", "the longest");
        let runs = keys(Table::new(RUNS, "Runs"))
            .repeat()
            .info("status", "", "ok, failed, refused or interrupted")
            .info("reason", "", "why it failed or cannot run here")
            .info("ticks", "", "ticks made, warm-up included")
            .lower("tick_us", "µs", "wall time of a tick, mean")
            .info("cpu_s", "s", "processor time of all processes")
            .info("missed", "", "real time: deadlines that had passed before anybody came for them, warm-up not counted")
            .info("skipped", "", "snapshots that were gone before a robot or the planner looked")
            .info("stolen", "", "share of the processor time that the host took")
            .info("processes", "", "that work in every tick")
            .info("oversubscribed", "", "1 if these are more than cores")
            .info("payload_bytes", "B", "live bytes of a snapshot");
        Self {
            times,
            runs,
            kept: Vec::new(),
            cores,
        }
    }

    /// Adds the times of one name in one repeat.
    pub(super) fn time(
        &mut self,
        key: &Key,
        name: &'static str,
        repeat: usize,
        histogram: &Histogram<u64>,
    ) {
        if histogram.is_empty() {
            return;
        }
        let times = summary(histogram);
        let mut row = key.cells();
        row.extend([name.into(), repeat.into()]);
        let numbers = [
            times.count,
            times.p50_ns,
            times.p99_ns,
            times.p999_ns,
            times.max_ns,
        ];
        row.extend(numbers.map(Value::from));
        self.times.push(row);
        let same = |kept: &&mut Kept| kept.key == *key && kept.name == name;
        if let Some(kept) = self.kept.iter_mut().find(same) {
            // Equal bounds, so nothing can be out of range.
            let _ = kept.histogram.add(histogram);
        } else {
            let mut sum = empty();
            let _ = sum.add(histogram);
            self.kept.push(Kept {
                key: key.clone(),
                name,
                histogram: sum,
            });
        }
    }

    /// Adds a run.
    pub(super) fn run(&mut self, key: &Key, repeat: usize, run: &Run) {
        let tick_us = (run.ticks > 0).then(|| run.wall_s * 1e6 / run.ticks as f64);
        let mut row = key.cells();
        row.extend([
            repeat.into(),
            run.status.into(),
            run.reason.as_str().into(),
            run.ticks.into(),
            tick_us.into(),
            run.cpu_s.into(),
            run.missed.into(),
            run.skipped.into(),
            run.stolen.into(),
            run.processes.into(),
            u64::from(run.processes > self.cores).into(),
            run.payload.into(),
        ]);
        self.runs.push(row);
    }

    pub(super) fn into_parts(self) -> (Vec<Table>, Vec<Kept>) {
        (vec![self.times, self.runs], self.kept)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeats_are_rows_of_their_own_and_one_histogram_together() {
        let mut rows = Rows::new(2);
        let key = Key {
            system: System::Bare,
            words: ["lockstep", "hybrid", "free", "normal"],
            robots: 4,
            objects: 100,
        };
        for repeat in 0..2 {
            let mut histogram = empty();
            histogram.saturating_record(1_000);
            rows.time(&key, "snapshot_age", repeat, &histogram);
        }
        rows.time(&key, "nothing", 0, &empty());
        rows.run(
            &key,
            0,
            &Run {
                processes: 7,
                ..Run::default()
            },
        );
        let (tables, kept) = rows.into_parts();
        assert_eq!((tables[0].rows.len(), tables[1].rows.len()), (2, 1));
        assert_eq!(tables[0].groups().len(), 1);
        assert_eq!(kept.len(), 1);
        assert_eq!(kept[0].histogram.len(), 2);
        let oversubscribed = tables[1].numbers("oversubscribed", &[("robots", "4")]);
        assert_eq!(oversubscribed.collect::<Vec<_>>(), [1.0]);
        assert!(kept[0].clone().tagged().tag.contains("robots=4"));
    }
}
