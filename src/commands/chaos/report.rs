//! What chaos came to.
//!
//! Responsible for: counting blows by phase and role, recovery times, how the runs ended, what they
//! left; the verdict.
//! Not responsible for: dealing blows (`victim`).

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::Instant;

use hdrhistogram::Histogram;
use serde_json::{Value, json};

use crate::cli::{ChaosArgs, Phase, Target};
use crate::commands::chaos::plan::{How, Plan};
use crate::commands::chaos::victim::{Ended, Victim};
use crate::output;

/// Parts that a set-up is cut into, to see that blows came in all of them; the last one is for
/// those that took longer than usual.
const PARTS: usize = 5;
/// Words of processes that ended by themselves that are quoted.
const MOST_QUOTED: usize = 10;

/// All of it.
pub(crate) struct Report {
    scenario: String,
    robots: usize,
    seed: u64,
    clock: String,
    asked: usize,
    began: Instant,
    pub(crate) runs: usize,
    solved: usize,
    /// Kills and stalls, by phase and role.
    kills: BTreeMap<(Phase, Target), u64>,
    stalls: BTreeMap<(Phase, Target), u64>,
    sets: u64,
    /// Kills in set-up by how far into it they came.
    spread: [u64; PARTS],
    recovery: BTreeMap<Target, Histogram<u64>>,
    cleared: u64,
    erred: Vec<String>,
    pub(crate) violations: u64,
    pub(crate) leftovers: usize,
    /// Whether it was broken off, with the last run.
    pub(crate) interrupted: bool,
    /// Runs that did not end as they should, in words.
    pub(crate) failures: Vec<String>,
}

impl Report {
    pub(crate) fn new(args: &ChaosArgs, robots: usize) -> Self {
        Self {
            scenario: args.scenario.clone(),
            robots,
            seed: args.seed,
            clock: format!("{:?}", args.clock).to_lowercase(),
            asked: args.kills,
            began: Instant::now(),
            runs: 0,
            solved: 0,
            kills: BTreeMap::new(),
            stalls: BTreeMap::new(),
            sets: 0,
            spread: [0; PARTS],
            recovery: BTreeMap::new(),
            cleared: 0,
            erred: Vec::new(),
            violations: 0,
            leftovers: 0,
            interrupted: false,
            failures: Vec::new(),
        }
    }

    /// Takes in a run that is over.
    pub(crate) fn take(&mut self, mut victim: Victim, ended: Ended, plan: &mut Plan) {
        self.runs += 1;
        victim.discount(plan);
        for dealt in &victim.dealt {
            let key = (dealt.phase, dealt.target);
            if dealt.blow.how == How::Stall {
                *self.stalls.entry(key).or_default() += 1;
                continue;
            }
            *self.kills.entry(key).or_default() += 1;
            self.sets += u64::from(dealt.blow.how == How::Set);
            if dealt.phase == Phase::Setup {
                let part = (dealt.into * (PARTS - 1) as f64) as usize;
                self.spread[part.min(PARTS - 1)] += 1;
            }
            if let Some(recovered_ns) = dealt.recovered_ns {
                self.recovery
                    .entry(dealt.target)
                    .or_insert_with(histogram)
                    .saturating_record(recovered_ns);
            }
        }
        self.cleared += victim.cleared;
        self.erred.append(&mut victim.erred);
        let result = victim.result();
        if let Some(words) = self.judge(&victim, &ended, result.as_ref()) {
            let number = victim.number;
            let kept = victim.kept();
            self.failures.push(format!("run {number}: {words}; {kept}"));
        } else {
            self.solved += 1;
            victim.clean_up();
        }
    }

    /// What is wrong with a run, if anything.
    fn judge(&mut self, victim: &Victim, ended: &Ended, result: Option<&Value>) -> Option<String> {
        let status = match ended {
            Ended::Wedged => return Some(format!("wedged; {}", victim.last_words())),
            Ended::With(status) => status,
        };
        let Some(result) = result else {
            return Some(format!("no result, {status}; {}", victim.last_words()));
        };
        let checker = &result["checker"];
        let violations = checker["violations"].as_u64().unwrap_or(0);
        self.violations += violations;
        let left = victim.id.as_ref().map_or(0, |id| left_of(id));
        if result["outcome"] != "solved" || !status.success() || violations > 0 {
            let (outcome, reason) = (&result["outcome"], &result["reason"]);
            Some(format!(
                "{outcome}, {reason}, {status}; {violations} violations"
            ))
        } else if checker["complete"] != true {
            Some("its trace is incomplete".to_owned())
        } else if left > 0 {
            Some(format!("it left {left} files in shared memory"))
        } else {
            None
        }
    }

    /// Whether every run ended solved, with nothing violated and nothing left, and all blows were
    /// dealt.
    pub(crate) fn is_clean(&self, plan: &Plan) -> bool {
        self.failures.is_empty() && self.violations == 0 && self.leftovers == 0 && !plan.is_open()
    }

    pub(crate) fn progress(&self, plan: &Plan) -> String {
        let dealt: u64 = self.kills.values().sum();
        format!(
            "{} runs, {dealt} kills, {} blows left, {} failures",
            self.runs,
            plan.left(),
            self.failures.len()
        )
    }

    pub(crate) fn json(&self) -> Value {
        let counts = |of: &BTreeMap<(Phase, Target), u64>| -> Value {
            let lines = of.iter().map(|((phase, target), count)| {
                json!({ "phase": phase, "role": target, "count": count })
            });
            lines.collect()
        };
        let recovery: Value = (self.recovery.iter())
            .map(|(target, times)| {
                json!({
                    "role": target,
                    "count": times.len(),
                    "p50_ms": ms(times.value_at_quantile(0.5)),
                    "p99_ms": ms(times.value_at_quantile(0.99)),
                    "max_ms": ms(times.max()),
                })
            })
            .collect();
        json!({
            "scenario": self.scenario,
            "robots": self.robots,
            "clock": self.clock,
            "seed": self.seed,
            "kills_asked": self.asked,
            "kills": self.kills.values().sum::<u64>(),
            "kills_by": counts(&self.kills),
            "stalls_by": counts(&self.stalls),
            "whole_sets": self.sets,
            "set_up_kills_by_quarter_and_later": self.spread,
            "runs": self.runs,
            "solved": self.solved,
            "recovery": recovery,
            "half_made_files_removed": self.cleared,
            "survivors_erred": self.erred.len(),
            "survivors_words": &self.erred[..self.erred.len().min(MOST_QUOTED)],
            "violations": self.violations,
            "leftovers": self.leftovers,
            "failures": self.failures,
            "interrupted": self.interrupted,
            "wall_s": self.began.elapsed().as_secs_f64(),
            "machine": bench::machine::Machine::current(),
            "date": bench::machine::date_utc(),
        })
    }

    pub(crate) fn text(&self) -> String {
        let mut text = String::new();
        if self.interrupted {
            text.push_str("Interrupted: this is what came of the runs that were over.\n");
        }
        let kills: u64 = self.kills.values().sum();
        let stalls: u64 = self.stalls.values().sum();
        let _ = writeln!(
            text,
            "{kills} kills ({} of whole sets) and {} in {} of {}, seed {}",
            self.sets,
            output::count(stalls, "stall"),
            output::count(self.runs as u64, "run"),
            self.scenario,
            self.seed
        );
        for ((phase, target), count) in &self.kills {
            let share = 100.0 * *count as f64 / kills.max(1) as f64;
            let _ = writeln!(text, "  {phase:7} {target:11} {count:6}  {share:4.1} %");
        }
        let _ = writeln!(
            text,
            "in set-up by its quarters, and past its usual end: {:?}",
            self.spread
        );
        for (target, times) in &self.recovery {
            let _ = writeln!(
                text,
                "recovery {target:11} p50 {:7.1} ms, p99 {:7.1} ms, max {:7.1} ms of {}",
                ms(times.value_at_quantile(0.5)),
                ms(times.value_at_quantile(0.99)),
                ms(times.max()),
                times.len()
            );
        }
        let _ = writeln!(
            text,
            "{} of {} runs solved, {} violations, {} half-made files removed, {} survivors that \
             erred and came back, {} leftovers",
            self.solved,
            self.runs,
            self.violations,
            self.cleared,
            self.erred.len(),
            self.leftovers
        );
        for words in self.erred.iter().take(MOST_QUOTED) {
            let _ = writeln!(text, "  erred: {words}");
        }
        for failure in &self.failures {
            let _ = writeln!(text, "FAILED {failure}");
        }
        text
    }
}

/// Files that a run has left in shared memory.
fn left_of(id: &str) -> usize {
    let prefix = format!("rr{id}_");
    let files = std::fs::read_dir("/dev/shm")
        .into_iter()
        .flatten()
        .flatten();
    let ours = files.filter(|file| file.file_name().to_string_lossy().starts_with(&prefix));
    ours.count()
}

/// Up to an hour, to three digits.
#[expect(clippy::expect_used, reason = "the bounds are constants that fit")]
fn histogram() -> Histogram<u64> {
    Histogram::new_with_bounds(1, 3_600_000_000_000, 3).expect("legal bounds")
}

fn ms(ns: u64) -> f64 {
    (ns as f64 / 1e5).round() / 10.0
}
