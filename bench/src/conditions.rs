//! What else could explain a time: load, time stolen by the host, the governor, the clock itself.
//!
//! Responsible for: reading them from Linux before and after a measurement, and putting them in
//! words.
//! Not responsible for: judging whether the machine is fit for a measurement, or the machine
//! itself (`machine`).
//!
//! Terms: *stolen* time is time in which this machine wanted to run but its host ran another.

use std::collections::BTreeMap;
use std::fs;
use std::hint::black_box;
use std::time::Instant;

use crate::stats::median;

/// Places in the first line of `/proc/stat`, after its name (proc_stat(5)).
const IDLE: usize = 3;
const IOWAIT: usize = 4;
const STEAL: usize = 7;
/// Times that add up; the two after them are contained in the first two.
const TIMES: usize = 8;
/// Readings of the clock in a batch, and batches.
const READINGS: u32 = 10_000;
const BATCHES: usize = 11;
const UNKNOWN: &str = "unknown";

/// Processor time of the whole machine so far, in ticks of the kernel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ProcessorTime {
    total: u64,
    idle: u64,
    stolen: u64,
}

impl ProcessorTime {
    /// So far. Nothing where the kernel does not tell.
    #[must_use]
    pub fn now() -> Self {
        Self::parse(&fs::read_to_string("/proc/stat").unwrap_or_default())
    }

    fn parse(stat: &str) -> Self {
        let line = stat.lines().find_map(|line| line.strip_prefix("cpu "));
        let times: Vec<u64> = line
            .unwrap_or_default()
            .split_whitespace()
            .take(TIMES)
            .filter_map(|time| time.parse().ok())
            .collect();
        let at = |place: usize| times.get(place).copied().unwrap_or(0);
        Self {
            total: times.iter().sum(),
            idle: at(IDLE) + at(IOWAIT),
            stolen: at(STEAL),
        }
    }

    /// Share of the processor time since `before` that the host took, 0–1; none if no time has
    /// passed.
    #[must_use]
    pub fn stolen_since(self, before: Self) -> Option<f64> {
        self.share(before, self.stolen - before.stolen)
    }

    /// Share of the processor time since `before` in which a core had nothing to do, 0–1.
    #[must_use]
    pub fn idle_since(self, before: Self) -> Option<f64> {
        self.share(before, self.idle.saturating_sub(before.idle))
    }

    fn share(self, before: Self, part: u64) -> Option<f64> {
        let total = self.total.saturating_sub(before.total);
        (total > 0).then(|| part as f64 / total as f64)
    }
}

/// The conditions at the beginning of a measurement.
#[derive(Clone, Debug)]
pub struct Conditions {
    load: String,
    time: ProcessorTime,
    clock_ns: f64,
}

impl Conditions {
    /// Reads them.
    #[must_use]
    pub fn begin() -> Self {
        Self {
            load: load(),
            time: ProcessorTime::now(),
            clock_ns: clock_overhead_ns(),
        }
    }

    /// Cost of one reading of the clock, ns: what each duration holds besides.
    #[must_use]
    pub const fn clock_ns(&self) -> f64 {
        self.clock_ns
    }

    /// All of them in words, now that the measurement is over.
    #[must_use]
    pub fn end(&self) -> BTreeMap<String, String> {
        let now = ProcessorTime::now();
        let share = |share: Option<f64>| {
            share.map_or(UNKNOWN.to_owned(), |share| {
                format!("{:.2} %", share * 100.0)
            })
        };
        let words = [
            ("load average before", self.load.clone()),
            ("load average after", load()),
            ("stolen by the host", share(now.stolen_since(self.time))),
            ("cores idle", share(now.idle_since(self.time))),
            ("governor", governor()),
            (
                "clock source",
                word("/sys/devices/system/clocksource/clocksource0/current_clocksource"),
            ),
            (
                "reading the clock",
                format!("{:.1} ns (each duration holds about one)", self.clock_ns),
            ),
        ];
        words.map(|(name, value)| (name.to_owned(), value)).into()
    }
}

/// One, five and fifteen minutes.
fn load() -> String {
    let text = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let words: Vec<_> = text.split_whitespace().take(3).collect();
    if words.is_empty() {
        UNKNOWN.to_owned()
    } else {
        words.join(" ")
    }
}

/// How the first core's frequency is chosen.
fn governor() -> String {
    let governor = word("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
    if governor == UNKNOWN {
        "not told (a virtual machine's host keeps it to itself)".to_owned()
    } else {
        governor
    }
}

fn word(path: &str) -> String {
    let text = fs::read_to_string(path).unwrap_or_default();
    let text = text.trim();
    if text.is_empty() { UNKNOWN } else { text }.to_owned()
}

/// Median over batches of what a reading of `CLOCK_MONOTONIC` costs, ns.
#[must_use]
pub fn clock_overhead_ns() -> f64 {
    let batch = || {
        let started = Instant::now();
        for _ in 0..READINGS {
            black_box(Instant::now());
        }
        started.elapsed().as_nanos() as f64 / f64::from(READINGS)
    };
    let batches: Vec<_> = (0..BATCHES).map(|_| batch()).collect();
    median(&batches).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stolen_and_idle_time_are_shares_of_all_time() {
        let before = ProcessorTime::parse("cpu  10 0 10 70 10 0 0 0 5 0\ncpu0 1 1 1 1\n");
        assert_eq!(before.total, 100, "guest time is in user time already");
        let after = ProcessorTime::parse("cpu  60 0 20 90 20 0 0 10 9 0\n");
        assert_eq!(after.stolen_since(before), Some(0.1));
        assert_eq!(after.idle_since(before), Some(0.3));
        assert_eq!(after.stolen_since(after), None);
        assert_eq!(ProcessorTime::parse(""), ProcessorTime::default());
    }

    #[test]
    fn all_conditions_have_words() {
        let conditions = Conditions::begin();
        assert!(conditions.clock_ns() > 0.0);
        let words = conditions.end();
        assert!(words.len() >= 7 && words.values().all(|value| !value.is_empty()));
    }
}
