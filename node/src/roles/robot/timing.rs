//! How long a robot's work takes on the wall clock.
//!
//! Responsible for: the time of its steps and from its requests for path to their grants.
//! Not responsible for: the planning time of the model, which is counted in work units.

use shm_types::{Command, Point, RobotState};

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
}

impl Timing {
    pub(super) fn start(&self) -> u64 {
        clock::now_ns()
    }

    /// A step is over.
    pub(super) fn stop(&self, started_ns: u64, latencies: &mut Latencies) {
        let duration_ns = clock::now_ns().saturating_sub(started_ns);
        latencies.record(Timed::RobotStep, duration_ns);
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
