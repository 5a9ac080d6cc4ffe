//! How long a robot's work takes on the wall clock.
//!
//! Responsible for: the time of its steps, of the computations in them, and from its requests for
//! path to their grants.
//! Not responsible for: the planning time of the model, which is counted in work units.
//!
//! The machine reads no clock, so a computation is timed by the steps it took part in, from the
//! account of work in its commands: an upper bound, since a step holds more than one computation.

use shm_types::{Activity, Command, Counters, Phase, Point, RobotState};

use crate::clock;
use crate::histograms::{Latencies, Timed};

/// A request for path that has not been granted yet.
#[derive(Clone, Copy)]
struct Asked {
    id: u32,
    /// Where the path asked for starts: the end of the grant before it.
    from: Point,
    sent_ns: u64,
}

/// What is being timed.
#[derive(Default)]
pub(super) struct Timing {
    asked: Option<Asked>,
    /// Number of the newest request for path that was sent.
    request: u32,
    /// Work done before the step.
    before: Counters,
    easy: Sum,
    selection: Sum,
    search: Sum,
}

/// Time of the steps of one computation so far, ns.
#[derive(Default)]
struct Sum(u64);

impl Sum {
    /// Adds a step if it took part in one, and records the sum once the computation is over.
    fn step(&mut self, took_part: bool, over: bool, step_ns: u64) -> Option<u64> {
        if took_part {
            self.0 += step_ns;
        }
        let sum_ns = over.then(|| std::mem::take(&mut self.0))?;
        (sum_ns > 0).then_some(sum_ns)
    }
}

impl Timing {
    /// A step that began at `started_ns` has led to `command`.
    pub(super) fn stepped(
        &mut self,
        started_ns: u64,
        command: &Command,
        latencies: &mut Latencies,
    ) {
        let step_ns = clock::now_ns().saturating_sub(started_ns);
        latencies.record(Timed::RobotStep, step_ns);
        let (before, after) = (self.before, command.counters);
        self.before = after;
        let selected = after.selections > before.selections;
        let selecting = command.phase == Phase::Selecting.code();
        let tested = after.polygon_tests > before.polygon_tests;
        let expanded = after.cells_expanded > before.cells_expanded;
        let searching = expanded && !selecting;
        let computing = command.activity == Activity::Computing.code();
        let sums = [
            (Timed::EasyConstraints, &mut self.easy, tested, selected),
            (
                Timed::Selection,
                &mut self.selection,
                selecting || selected,
                selected,
            ),
            (Timed::PathSearch, &mut self.search, searching, !computing),
        ];
        for (timed, sum, took_part, over) in sums {
            if let Some(sum_ns) = sum.step(took_part, over, step_ns) {
                latencies.record(timed, sum_ns);
            }
        }
    }

    /// A command is sent.
    pub(super) fn sent(&mut self, command: &Command) {
        let path = &command.path;
        if path.id != self.request && path.count > 0 {
            self.request = path.id;
            self.asked = Some(Asked {
                id: path.id,
                from: path.points[0],
                sent_ns: clock::now_ns(),
            });
        }
    }

    /// A snapshot has come: some of the path asked for may be granted in it.
    pub(super) fn see(&mut self, me: &RobotState, latencies: &mut Latencies) {
        let Some(asked) = self.asked.filter(|asked| me.request == asked.id) else {
            return;
        };
        let end = me.grant().last().unwrap_or(&me.position);
        if me.request_open == 0 || *end != asked.from {
            let duration_ns = clock::now_ns().saturating_sub(asked.sent_ns);
            latencies.record(Timed::CommandToGrant, duration_ns);
            self.asked = None;
        }
    }
}
