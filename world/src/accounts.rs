//! What a run is charged: each robot's time, and the world's own counts.
//!
//! Responsible for: exactly one [`Activity`] per robot and tick (rule 24), so that for each robot
//! they sum up to the ticks; how many participants were computing.
//! Not responsible for: what planning costs (the participants count that themselves).

use shm_types::{Activity, Checked, Phase, PlannerReport};

use crate::invariants::Checks;
use crate::state::Robot;

/// Ticks of one robot by what it did in them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ActivityTimes {
    pub(crate) ticks: [u64; Activity::ALL.len()],
}

impl ActivityTimes {
    /// Ticks spent on `activity`.
    #[must_use]
    pub const fn ticks(&self, activity: Activity) -> u64 {
        self.ticks[activity as usize]
    }

    /// Of a robot that comes after so many ticks: it had nothing to do in them.
    pub(crate) fn idle_for(ticks: u64) -> Self {
        let mut times = Self::default();
        times.ticks[Activity::Idle as usize] = ticks;
        times
    }

    /// All ticks so far.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.ticks.iter().sum()
    }

    const fn add(&mut self, activity: Activity) {
        self.ticks[activity as usize] += 1;
    }
}

/// What the world has counted so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorldCounters {
    /// Path requests that could not be granted whole at once, and waited in the queue.
    pub grants_refused: u64,
    /// Path requests that start at the wrong place, leave the room or cross a wall: dropped.
    pub invalid_requests: u64,
    /// Ticks in which a live robot was held because its newest command was past its validity.
    pub stale_commands: u64,
    /// Claims refused: too late, forbidden by a constraint, barred, or of no free task.
    pub invalid_claims: u64,
    /// Claims of two robots on one task in one epoch (always 0: all select alike).
    pub selection_conflicts: u64,
    /// Failures counted (rule 21).
    pub task_failures: u64,
    /// Hard constraints that came into force, each once for every time it did.
    pub constraints_found: u64,
    /// Failures counted without the planner's answer, its deadline having passed.
    pub answers_missed: u64,
    /// Grips asked for that could not begin.
    pub grips_refused: u64,
    /// Invariants found broken.
    pub violations: u64,
    /// Schedules that were no legal messages or did not go on from what was granted.
    pub schedules_refused: u64,
    /// Exact swept tests of two shapes.
    pub swept_tests: u64,
    /// How often the invariants were checked.
    pub checks: Checks,
}

/// What `robot` did in a tick: a body that moved was moving whatever its robot says, and one that
/// stood still was not.
pub(crate) fn activity_of(robot: &Robot, fresh: bool, held: bool) -> Activity {
    if robot.moved {
        return Activity::Moving;
    }
    if robot.gripped {
        return Activity::Gripping;
    }
    if !robot.link.live {
        return Activity::Idle;
    }
    if held || !fresh {
        return Activity::Waiting;
    }
    match robot.link.activity {
        Activity::Moving | Activity::Gripping => Activity::Waiting,
        said => said,
    }
}

/// Enters every robot's tick and returns how many participants were computing: what one shared
/// computer is divided by. Waiting for the planner, for its answer or, where robots never compute
/// themselves, for its schedule, is computing to the robot's account but takes none of the
/// computer's time.
pub(crate) fn settle(
    robots: &mut [Robot],
    planner: Option<&PlannerReport>,
    robots_compute: bool,
    tick: u64,
    held: bool,
) -> u32 {
    let mut busy = planner.map_or(0, |report| report.busy);
    for robot in robots {
        robot.activity = activity_of(robot, robot.link.is_fresh(tick), held);
        robot.times.add(robot.activity);
        let computes = robots_compute && robot.link.phase != Phase::Failing;
        if computes && robot.activity == Activity::Computing {
            busy += 1;
        }
    }
    busy
}

/// The report inside a checked message.
pub(crate) fn report<'a>(planner: Option<Checked<'a, PlannerReport>>) -> Option<&'a PlannerReport> {
    planner.map(Checked::get)
}

#[cfg(test)]
mod tests {
    use shm_types::ControlKind;

    use super::*;
    use crate::testing::{BELOW, Bench, room};

    fn bench() -> Bench {
        let homes = [[1.0, 1.0], [4.0, 1.0], [8.0, 1.0]];
        Bench::new(room(&homes, &[], BELOW, ""))
    }

    fn activities(bench: &Bench) -> [Activity; 3] {
        [0, 1, 2].map(|i| Activity::decode(bench.robot(i).activity).unwrap())
    }

    #[test]
    fn what_a_robot_did_decides_before_what_it_says() {
        use Activity::{Computing, Idle, Moving, Waiting};
        let mut bench = bench();
        bench.ask(0, &[[2.0, 1.0]]);
        bench.commands[0].activity = Idle.code();
        bench.commands[1].activity = Computing.code();
        bench.commands[2].activity = Moving.code();
        bench.step();
        assert_eq!(activities(&bench), [Moving, Computing, Waiting]);
        bench.tell(ControlKind::Down, 1, 1);
        bench.tell(ControlKind::Hold, 0, 0);
        bench.step();
        assert_eq!(activities(&bench), [Waiting, Idle, Waiting]);
        assert_eq!(bench.world.times(0).ticks(Moving), 1);
        assert_eq!(bench.world.times(0).ticks(Waiting), 1);
    }

    #[test]
    fn those_that_wait_for_an_answer_share_no_computer() {
        let mut bench = bench();
        for command in &mut bench.commands {
            command.activity = Activity::Computing.code();
        }
        bench.commands[1].phase = Phase::Failing.code();
        bench.planner.busy = 1;
        bench.step();
        assert_eq!(bench.header().busy, 3, "two robots and the planner");
        bench.planner.busy = 0;
        bench.silent = vec![true; 3];
        bench.steps(20);
        assert_eq!(bench.header().busy, 0, "nor those that are silent");
    }
}
