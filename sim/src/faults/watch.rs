//! What must hold at every tick of a run, whatever goes wrong between its machines.
//!
//! Responsible for: holding what the world did against what it had heard, by rules stated here
//! once more and in other words than the world's own. Not responsible for: geometry (the world's
//! invariants, and the checker of crate `trace`).
//!
//! Held: ticks and epochs count up; of each robot exactly those commands are taken that are
//! its present process's and newer than the last; a path request is taken once; whoever moves or
//! grips has been told to by a command that still holds; a claim is of this epoch, under this
//! epoch's constraints, or of the one before, and then no known constraint speaks against it; all
//! robots select alike; no invariant is broken.

use shm_types::capacity::MAX_ROBOTS;
use shm_types::{
    BodyKind, Checked, Command, ConstraintTable, EventKind, MotionBatch, ObjectState, TaskStatus,
    WorldSnapshot, index,
};
use world::World;

/// What the world had heard when it stepped.
#[derive(Clone, Copy)]
pub(crate) struct Heard<'a> {
    /// The newest command of each robot, as it came.
    pub(crate) commands: &'a [Option<Checked<'a, Command>>],
    /// The newest constraint table.
    pub(crate) table: Option<Checked<'a, ConstraintTable>>,
}

/// What is known of the command that a robot goes by.
#[derive(Clone, Copy, Default)]
struct Taken {
    sequence: u64,
    valid_until_tick: u64,
    request: u32,
}

/// Looks on.
pub(crate) struct Watch {
    taken: Vec<Taken>,
    /// Path requests taken so far, each once.
    requests: u64,
    /// A process has gone mad: what it claims may contradict what others do.
    babbled: bool,
    finding: Option<String>,
}

impl Watch {
    pub(crate) fn new(snapshot: &WorldSnapshot) -> Self {
        Self {
            taken: vec![Taken::default(); (snapshot.header.robot_count as usize).min(MAX_ROBOTS)],
            requests: 0,
            babbled: false,
            finding: None,
        }
    }

    /// The first thing that was not as it should be.
    pub(crate) fn finding(&self) -> Option<&str> {
        self.finding.as_deref()
    }

    /// Something that the driver itself has found.
    pub(crate) fn find(&mut self, tick: u64, what: &str) {
        self.finding.get_or_insert(format!("tick {tick}: {what}"));
    }

    /// From here on a robot may claim what others have selected.
    pub(crate) const fn note_babble(&mut self) {
        self.babbled = true;
    }

    /// One step of the world, from `before` to `after`.
    pub(crate) fn look(
        &mut self,
        heard: Heard<'_>,
        before: &WorldSnapshot,
        after: &WorldSnapshot,
        motion: &MotionBatch,
        world: &World,
    ) {
        if self.finding.is_some() {
            return;
        }
        let found = self
            .look_at_commands(heard, before, after, motion)
            .or_else(|| self.look_at_motion(before, after, motion))
            .or_else(|| look_at_claims(heard, before, motion))
            .or_else(|| self.look_at_counts(before, after, world));
        self.finding = found.map(|found| format!("tick {}: {found}", before.header.tick));
    }

    fn look_at_commands(
        &mut self,
        heard: Heard<'_>,
        before: &WorldSnapshot,
        after: &WorldSnapshot,
        motion: &MotionBatch,
    ) -> Option<String> {
        for (id, taken) in self.taken.iter_mut().enumerate() {
            let (was, is) = (&before.robots[id], &after.robots[id]);
            let came_up = motion
                .events()
                .iter()
                .any(|event| event.kind == EventKind::RobotUp.code() && event.robot as usize == id);
            if came_up {
                *taken = Taken::default();
            } else if is.incarnation != was.incarnation {
                return Some(format!("robot {id} is another process all at once"));
            }
            let command = heard.commands[id].map(Checked::get);
            let newer = command.filter(|command| {
                is.live == 1
                    && command.incarnation == is.incarnation
                    && command.sequence > taken.sequence
            });
            if let Some(command) = newer {
                self.requests += u64::from(command.path.id > taken.request);
                *taken = Taken {
                    sequence: command.sequence,
                    valid_until_tick: command.valid_until_tick,
                    request: command.path.id.max(taken.request),
                };
            }
            if is.acknowledged != taken.sequence {
                return Some(format!(
                    "robot {id} goes by command {}, but its newest is {}",
                    is.acknowledged, taken.sequence
                ));
            }
            if is.request > taken.request {
                return Some(format!("robot {id} has asked for no path {}", is.request));
            }
        }
        None
    }

    fn look_at_motion(
        &self,
        before: &WorldSnapshot,
        after: &WorldSnapshot,
        motion: &MotionBatch,
    ) -> Option<String> {
        let tick = before.header.tick;
        let is_told = |id: usize| {
            self.taken.get(id).is_some_and(|taken| {
                after.robots[id].live == 1 && taken.sequence > 0 && taken.valid_until_tick >= tick
            })
        };
        let robot = BodyKind::Robot.code();
        let mut moved = motion.motions().iter().filter(|piece| piece.body == robot);
        if let Some(piece) = moved.find(|piece| !is_told(piece.id as usize)) {
            return Some(format!("robot {} moves untold", piece.id));
        }
        let begins = [EventKind::GraspStarted, EventKind::ReleaseStarted].map(EventKind::code);
        let mut grips = motion.events().iter().filter(|e| begins.contains(&e.kind));
        let untold = grips.find(|event| index(event.robot).is_none_or(|id| !is_told(id)));
        untold.map(|event| format!("robot {} grips untold", event.robot))
    }

    fn look_at_counts(
        &self,
        before: &WorldSnapshot,
        after: &WorldSnapshot,
        world: &World,
    ) -> Option<String> {
        let counters = world.counters();
        let (was, is) = (&before.header, &after.header);
        if let Some(violation) = world.violation() {
            Some(format!("an invariant is broken: {violation:?}"))
        } else if is.tick != was.tick + 1 || !(was.epoch..=was.epoch + 1).contains(&is.epoch) {
            Some("a tick or an epoch does not count up".to_owned())
        } else if counters.selection_conflicts > 0 && !self.babbled {
            Some("two robots have selected one task".to_owned())
        } else if counters.invalid_requests > self.requests {
            Some("a path request is taken more than once".to_owned())
        } else {
            None
        }
    }
}

fn look_at_claims(
    heard: Heard<'_>,
    before: &WorldSnapshot,
    motion: &MotionBatch,
) -> Option<String> {
    let header = &before.header;
    let claims = motion.events().iter();
    let mut claims = claims.filter(|event| event.kind == EventKind::Claimed.code());
    claims.find_map(|event| {
        let (robot, task) = (index(event.robot)?, index(event.task)?);
        let claim = heard.commands.get(robot)?.map(Checked::get)?.claim;
        let is_open = |task: u32| is_open(&before.objects[task as usize]);
        if event.value == header.epoch {
            let version = header.epoch_constraints_version;
            (claim.constraints_version != version)
                .then(|| format!("robot {robot} has claimed task {task} under other constraints"))
        } else if event.value + 1 == header.epoch {
            let known = heard.table.map(Checked::get)?;
            let mut against = known.constraints().iter();
            let against = against.find(|c| c.after as usize == task && is_open(c.before))?;
            Some(format!(
                "robot {robot} has claimed task {task} late, before task {}",
                against.before
            ))
        } else {
            Some(format!(
                "robot {robot} has claimed task {task} of epoch {} in epoch {}",
                event.value, header.epoch
            ))
        }
    })
}

fn is_open(object: &ObjectState) -> bool {
    object.status != TaskStatus::Done.code()
}

#[cfg(test)]
mod tests {
    use shm_types::zeroed;

    use super::*;

    #[test]
    fn who_moves_without_a_command_that_holds_is_found() {
        let world = || {
            let mut world: Box<WorldSnapshot> = zeroed();
            (world.header.robot_count, world.robots[0].live) = (1, 1);
            world
        };
        let (mut before, after) = (world(), world());
        let mut motion: Box<MotionBatch> = zeroed();
        motion.motion_count = 1;
        motion.motions[0].body = BodyKind::Robot.code();
        let mut watch = Watch::new(&before);
        let told = |watch: &Watch, before: &WorldSnapshot| {
            watch.look_at_motion(before, &after, &motion).is_none()
        };
        assert!(
            !told(&watch, &before),
            "no command at all, in the first tick"
        );
        watch.taken[0] = Taken {
            sequence: 1,
            valid_until_tick: 5,
            request: 0,
        };
        before.header.tick = 5;
        assert!(told(&watch, &before));
        before.header.tick = 6;
        assert!(!told(&watch, &before), "too late");
    }
}
