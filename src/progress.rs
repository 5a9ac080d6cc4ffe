//! What people see while a run goes on: objects done, what each robot does, world time.
//!
//! Responsible for: one line on stderr, only where somebody watches it.
//! Not responsible for: the result.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use shm_types::{Checked, Phase, TaskStatus, WorldSnapshot};

/// How often the line is worth drawing anew.
pub(crate) const PERIOD: Duration = Duration::from_millis(100);
/// Robots named one by one; more are counted by phase.
const MOST_NAMED: usize = 8;

/// The line, or nothing if nobody watches.
#[derive(Debug)]
pub(crate) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// A line for a run with `goals` objects to bring to their goals.
    pub(crate) fn new(goals: usize) -> Self {
        let watched = crate::output::is_watched();
        let target = if watched {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(Some(goals as u64), target);
        if let Ok(style) =
            ProgressStyle::with_template("[{bar:20}] {pos}/{len} objects  {wide_msg}")
        {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_message("starting");
        Self { bar }
    }

    /// Shows this state.
    pub(crate) fn show(&self, snapshot: Checked<'_, WorldSnapshot>) {
        let done = snapshot
            .objects()
            .iter()
            .filter(|object| object.has_goal == 1 && object.status == TaskStatus::Done.code())
            .count();
        self.bar.set_position(done as u64);
        self.bar.set_message(message(snapshot));
    }

    /// Takes the line away.
    pub(crate) fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

impl node::Observer for Progress {
    fn progress(&mut self, snapshot: Checked<'_, WorldSnapshot>) {
        self.show(snapshot);
    }
}

fn message(snapshot: Checked<'_, WorldSnapshot>) -> String {
    let phases = snapshot
        .robots()
        .iter()
        .map(|robot| Phase::decode(robot.phase).unwrap_or(Phase::Idle));
    let robots = if snapshot.robots().len() <= MOST_NAMED {
        phases.map(word).collect::<Vec<_>>().join(", ")
    } else {
        let phases: Vec<_> = phases.collect();
        Phase::ALL
            .iter()
            .map(|phase| {
                (
                    *phase,
                    phases.iter().filter(|other| *other == phase).count(),
                )
            })
            .filter(|(_, count)| *count > 0)
            .map(|(phase, count)| format!("{count} {}", word(phase)))
            .collect::<Vec<_>>()
            .join(", ")
    };
    format!("{:.1} s  {robots}", snapshot.header.time_ns as f64 / 1e9)
}

const fn word(phase: Phase) -> &'static str {
    match phase {
        Phase::Idle => "idle",
        Phase::Selecting => "selecting",
        Phase::Transit => "transit",
        Phase::Grasping => "grasping",
        Phase::Transfer => "transfer",
        Phase::Releasing => "releasing",
        Phase::Failing => "failing",
        Phase::GoingHome => "going home",
    }
}
