//! The world's whole state as bytes: what a world process that is started again goes on from.
//!
//! Responsible for: every field that a later step depends on, in one canonical order, versioned;
//! refusing what is no sound state of this scene.
//! Not responsible for: how the bytes are cut into parts, and their checksums (`parts.rs`); where
//! they are kept (crate `node`).
//!
//! What a checkpoint is *of* is not in it: the scene (its hash is), the settings, and all that
//! follows from these. Counts of exact tests may differ after a restoration, since they depend on
//! the order in which bodies were put down; nothing else does.

use scene::{Scene, Settings, Vec2};
use shm_types::{
    Activity, ConstraintTable, Counts, Failure, FailureCause, Grip, NONE, Outcome, Phase, Refusal,
    TaskStatus, Validate, Verdict, Wait,
};

use crate::accounts::{ActivityTimes, WorldCounters};
use crate::epoch::Epoch;
use crate::guards::{Guard, Guards};
use crate::invariants::{Checks, Violation};
use crate::parts::{Parts, head_of};
use crate::path::Path;
use crate::saved::{Reader, Saved, Unreadable, save_bytes, saved, saved_as_bytes, saved_as_code};
use crate::schedules::{Refused, Schedules};
use crate::settled::Overflow;
use crate::state::{Claimed, Hand, Leaving, Link, Object, PendingFailure, Robot};
use crate::step::World;
use crate::track::Track;

/// Form of the bytes. Raised whenever it changes.
const VERSION: u32 = 3;
/// First bytes of each.
const MAGIC: [u8; 4] = *b"rrck";
/// Ticks and times past this are no run's.
const MOST: u64 = 1 << 60;

/// Bytes that are no state a world can go on from.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CheckpointError {
    /// Cut short, or changed since they were written.
    #[error("its checksum is wrong")]
    Damaged,
    /// Written by another version of this program, or of another scene.
    #[error("it is of another {0}")]
    Foreign(&'static str),
    /// No value of its type.
    #[error("it cannot be read: {0}")]
    Unreadable(String),
    /// Values that contradict each other or the scene.
    #[error("{0} makes no sense")]
    Unsound(&'static str),
}

impl From<Unreadable> for CheckpointError {
    fn from(error: Unreadable) -> Self {
        Self::Unreadable(error.to_string())
    }
}

saved_as_bytes!(Wait, Failure);
saved_as_code!(Activity, Grip, Outcome, Phase, TaskStatus, Verdict, Refusal);

saved!(Claimed { task, epoch });
saved!(PendingFailure { report, since_ns });
saved!(Link {
    live,
    incarnation,
    sequence,
    valid_until_tick,
    settled_at_change,
    go,
    grip,
    phase,
    activity,
    waits_for,
});
saved!(Robot {
    position,
    hand,
    grasp,
    claim,
    refused_claim,
    leaving,
    link,
    grant,
    rest,
    cut,
    request,
    request_tick,
    actions,
    action_end,
    refused,
    failure,
    last_failure,
    epoch_position,
    epoch_free,
    activity,
    times,
} but {
    drive: 1.0,
    track: Track::still(position),
    granted_m: 0.0,
    told: false,
    moved: false,
    gripped: false,
});
saved!(Object {
    position,
    rest,
    goal,
    kind,
    holder,
    claimed_by,
    status,
    epoch_status,
    failures,
    put_downs,
    barred,
    epoch_barred,
});
saved!(Epoch {
    number,
    events,
    change,
    changed_tick,
    placements,
    constraints_version,
    due,
});
saved!(Schedules {
    in_force,
    judged,
    refused,
});
saved!(Refused {
    version,
    tick,
    why,
    robot,
});
saved!(ActivityTimes { ticks });
saved!(WorldCounters {
    grants_refused,
    invalid_requests,
    stale_commands,
    invalid_claims,
    selection_conflicts,
    task_failures,
    constraints_found,
    answers_missed,
    grips_refused,
    violations,
    schedules_refused,
    swept_tests,
    checks,
});
saved!(Checks {
    made,
    anew,
    swept_tests,
});

impl Saved for Hand {
    fn save(&self, out: &mut Vec<u8>) {
        match *self {
            Self::Empty => 0_u32.save(out),
            Self::Closing { object, ticks } => (1_u32, (object, ticks)).save(out),
            Self::Holding { object } => (2_u32, object).save(out),
            Self::Opening { object, ticks } => (3_u32, (object, ticks)).save(out),
        }
    }

    fn restore(from: &mut Reader<'_>) -> Result<Self, Unreadable> {
        Ok(match u32::restore(from)? {
            0 => Self::Empty,
            tag @ (1 | 3) => {
                let (object, ticks) = Saved::restore(from)?;
                if tag == 1 {
                    Self::Closing { object, ticks }
                } else {
                    Self::Opening { object, ticks }
                }
            }
            2 => Self::Holding {
                object: Saved::restore(from)?,
            },
            other => return Err(Unreadable::Tag(other.into())),
        })
    }
}

impl Saved for Leaving {
    fn save(&self, out: &mut Vec<u8>) {
        self.slots().save(out);
    }

    fn restore(from: &mut Reader<'_>) -> Result<Self, Unreadable> {
        Ok(Self::of(Saved::restore(from)?))
    }
}

impl Saved for Path {
    fn save(&self, out: &mut Vec<u8>) {
        self.points().len().save(out);
        self.points().iter().for_each(|point| point.save(out));
    }

    fn restore(from: &mut Reader<'_>) -> Result<Self, Unreadable> {
        let count = usize::restore(from)?;
        let mut path = Self::EMPTY;
        for _ in 0..count {
            if path.is_full() {
                return Err(Unreadable::Many(count as u64));
            }
            path.push(Vec2::restore(from)?);
        }
        Ok(path)
    }
}

impl Saved for Overflow {
    fn save(&self, out: &mut Vec<u8>) {
        match self {
            Self::Events => 0_u32.save(out),
            Self::Constraints(dropped) => (1_u32, *dropped).save(out),
        }
    }

    fn restore(from: &mut Reader<'_>) -> Result<Self, Unreadable> {
        match u32::restore(from)? {
            0 => Ok(Self::Events),
            1 => Ok(Self::Constraints(u32::restore(from)?)),
            other => Err(Unreadable::Tag(other.into())),
        }
    }
}

impl Saved for Violation {
    fn save(&self, out: &mut Vec<u8>) {
        match *self {
            Self::Robots { robot, other } => [0, robot, other],
            Self::Object { robot, object } => [1, robot, object],
            Self::Wall { robot } => [2, robot, 0],
            Self::Holding { robot, object } => [3, robot, object],
            Self::Lost { object } => [4, 0, object],
            Self::Motion { robot } => [5, robot, 0],
            Self::Grants { robot, other } => [6, robot, other],
        }
        .save(out);
    }

    fn restore(from: &mut Reader<'_>) -> Result<Self, Unreadable> {
        let [tag, robot, other] = <[u32; 3]>::restore(from)?;
        Ok(match tag {
            0 => Self::Robots { robot, other },
            1 => Self::Object {
                robot,
                object: other,
            },
            2 => Self::Wall { robot },
            3 => Self::Holding {
                robot,
                object: other,
            },
            4 => Self::Lost { object: other },
            5 => Self::Motion { robot },
            6 => Self::Grants { robot, other },
            _ => return Err(Unreadable::Tag(tag.into())),
        })
    }
}

impl Saved for Box<ConstraintTable> {
    fn save(&self, out: &mut Vec<u8>) {
        save_bytes(&[self.version, self.count], out);
        save_bytes(&[self.effect_tick, self.complete_for_events], out);
        for constraint in self.constraints() {
            save_bytes(constraint, out);
        }
    }

    fn restore(from: &mut Reader<'_>) -> Result<Self, Unreadable> {
        let mut table: Self = shm_types::zeroed();
        let [version, count] = <[u32; 2]>::restore(from)?;
        let [effect_tick, complete_for_events] = <[u64; 2]>::restore(from)?;
        (table.version, table.count) = (version, count);
        (table.effect_tick, table.complete_for_events) = (effect_tick, complete_for_events);
        let live = table.constraints.get_mut(..count as usize);
        for constraint in live.ok_or(Unreadable::Many(count.into()))? {
            *constraint = crate::saved::restore_bytes(from)?;
        }
        Ok(table)
    }
}

impl World {
    /// Appends what changes in most ticks: all but constraints and objects.
    pub(crate) fn save_head(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&MAGIC);
        let Self {
            settings,
            tick,
            time_ns,
            tick_m: _,
            robots,
            objects: _,
            bodies,
            grants: _,
            guards: _,
            bars,
            constraints: _,
            epoch,
            schedules,
            scene_version,
            verdict,
            busy,
            held,
            stopped,
            overflow,
            settled_ticks,
            outcome,
            violation,
            counters,
            cleared: _,
            saving: _,
            wire,
        } = self;
        let header = &wire.header;
        (VERSION, (header.scenario_hash, settings.tick_ns)).save(out);
        (*tick, *time_ns).save(out);
        (header.run_id, (header.state_hash, header.generation)).save(out);
        robots.save(out);
        bodies.tests().save(out);
        bars.save(out);
        epoch.save(out);
        schedules.save(out);
        (*scene_version, (*verdict, (*busy, *settled_ticks))).save(out);
        ((*held, *stopped), (*overflow, (*outcome, *violation))).save(out);
        counters.save(out);
    }

    /// Hash of the scene that `bytes` are a state of, if they are one at all.
    #[must_use]
    pub fn scene_of(bytes: &[u8]) -> Option<u64> {
        let mut from = head_of(bytes)?;
        (from.take(MAGIC.len()).ok()? == MAGIC).then_some(())?;
        (u32::restore(&mut from).ok()? == VERSION).then_some(())?;
        u64::restore(&mut from).ok()
    }

    /// The world that was saved as `bytes`, in the version of the scene that was in force then.
    /// All memory that it will ever use is allocated here.
    ///
    /// # Errors
    /// They are no sound state of this scene.
    pub fn restore(
        scene: &Scene,
        settings: Settings,
        bytes: &[u8],
    ) -> Result<Self, CheckpointError> {
        Self::restore_with(scene, settings, bytes, Guards::default())
    }

    /// As [`Self::restore`], with all checks except this one, in the world that it becomes, too.
    ///
    /// # Errors
    /// As that.
    pub fn restore_without(
        scene: &Scene,
        settings: Settings,
        bytes: &[u8],
        guard: Guard,
    ) -> Result<Self, CheckpointError> {
        Self::restore_with(scene, settings, bytes, Guards::without(guard))
    }

    fn restore_with(
        scene: &Scene,
        settings: Settings,
        bytes: &[u8],
        guards: Guards,
    ) -> Result<Self, CheckpointError> {
        let mut parts = Parts::of(bytes, guards)?;
        let from = &mut parts.head;
        if from.take(MAGIC.len())? != MAGIC {
            return Err(CheckpointError::Foreign("program"));
        }
        if u32::restore(from)? != VERSION {
            return Err(CheckpointError::Foreign("version"));
        }
        if u64::restore(from)? != scene.hash {
            return Err(CheckpointError::Foreign("scene"));
        }
        if u64::restore(from)? != settings.tick_ns {
            return Err(CheckpointError::Foreign("length of a tick"));
        }
        let mut world = Self::new(scene, settings, 0);
        world.guards = guards;
        world.read(scene, parts)?;
        world.check(scene)?;
        let state_hash = world.wire.header.state_hash;
        world.write_wire();
        world.wire.header.state_hash = state_hash;
        Ok(world)
    }

    /// Puts what was saved in the place of the initial state.
    fn read(&mut self, scene: &Scene, mut parts: Parts<'_>) -> Result<(), CheckpointError> {
        let (robots, count) = (self.robots.len(), self.objects.len());
        let from = &mut parts.head;
        (self.tick, self.time_ns) = Saved::restore(from)?;
        let header = &mut self.wire.header;
        (header.run_id, (header.state_hash, header.generation)) = Saved::restore(from)?;
        self.robots = Saved::restore(from)?;
        if self.robots.len() != robots {
            return Err(CheckpointError::Unsound("the number of robots"));
        }
        let tests = u64::restore(from)?;
        self.bars.restore(from)?;
        self.epoch = Saved::restore(from)?;
        self.schedules = Saved::restore(from)?;
        (
            self.scene_version,
            (self.verdict, (self.busy, self.settled_ticks)),
        ) = Saved::restore(from)?;
        (
            (self.held, self.stopped),
            (self.overflow, (self.outcome, self.violation)),
        ) = Saved::restore(from)?;
        self.counters = Saved::restore(from)?;
        parts.end_head()?;
        parts.constraints(|from| self.constraints.restore(from))?;
        let mut objects: Vec<Object> = Vec::with_capacity(count);
        let mut places: Vec<Option<Vec2>> = Vec::with_capacity(count);
        parts.objects(count, |from| {
            objects.push(Saved::restore(from)?);
            places.push(Saved::restore(from)?);
            Ok::<(), Unreadable>(())
        })?;
        self.objects = objects.into_iter().collect();
        self.bodies = self.bodies.of_version(scene, |object| places[object]);
        self.bodies.go_on_counting(tests);
        Ok(())
    }

    /// Whether every id is that of something there is, and numbers are in range.
    fn check(&self, scene: &Scene) -> Result<(), CheckpointError> {
        let (robots, objects) = (self.robots.len(), self.objects.len());
        let sound = |what: &'static str, holds: bool| {
            holds.then_some(()).ok_or(CheckpointError::Unsound(what))
        };
        let is_object = |object: Option<usize>| object.is_none_or(|object| object < objects);
        let is_robot = |robot: Option<usize>| robot.is_none_or(|robot| robot < robots);
        let id_in = |id: u32, count: usize| id == NONE || (id as usize) < count;
        sound("the tick", self.tick < MOST && self.time_ns < MOST)?;
        for robot in &self.robots {
            let object = robot.hand.object();
            sound("an object in a hand", is_object(object))?;
            let grasps = object.map_or(1, |object| scene.objects[object].grasps.len());
            sound("a grasp", robot.grasp < grasps)?;
            let claim = robot.claim.map(|claim| claim.task);
            let leaving = robot.leaving.iter().all(|object| object < objects);
            sound("a claim", is_object(claim) && leaving)?;
            if let Some(PendingFailure { report, .. }) = &robot.failure {
                let ids = id_in(report.task, objects) && id_in(report.blocker, robots);
                let cause = FailureCause::decode(report.cause).is_ok();
                sound("a failure", ids && cause)?;
            }
            let waits_for = robot.link.waits_for.robot;
            sound("whom a robot waits for", id_in(waits_for, robots))?;
        }
        for (id, object) in self.objects.iter().enumerate() {
            let hands = (self.robots.iter()).filter(|robot| robot.hand.object() == Some(id));
            // It stands on the ground, or one robot has it, or is about to.
            let places = hands.count() + usize::from(self.bodies.ground.place(id).is_some());
            sound("where an object is", places == 1)?;
            sound("a holder", is_robot(object.holder))?;
            sound("who has claimed a task", is_robot(object.claimed_by))?;
        }
        sound("a bar", self.bars.is_sound(robots, objects))?;
        let counts = Counts {
            robots: robots as u32,
            objects: objects as u32,
        };
        let tables = self.constraints.tables();
        let legal = tables.iter().all(|table| table.validate(counts).is_ok());
        sound("a constraint", legal)
    }
}

#[cfg(test)]
mod tests {
    use shm_types::StateHash;

    use super::*;
    use crate::testing::{BELOW, Bench, room};

    const OBJECTS: [[[f64; 2]; 2]; 2] = [[[1.0, 1.45], [1.0, 5.0]], [[5.0, 3.0], [5.0, 5.0]]];

    fn bench() -> Bench {
        let mut bench = Bench::new(room(&[[1.0, 1.0], [3.0, 1.0]], &OBJECTS, BELOW, ""));
        bench.claim(0, 0);
        bench.ask(1, &[[8.0, 1.0], [8.0, 3.0]]);
        bench.steps(3);
        bench
    }

    fn saved(bench: &Bench) -> Vec<u8> {
        let mut bytes = Vec::new();
        bench.world.save(&mut bytes);
        bytes
    }

    fn restore(bench: &Bench, bytes: &[u8]) -> Result<World, CheckpointError> {
        World::restore(&bench.scene, crate::testing::papers(), bytes)
    }

    /// Whatever its checksums: what lies behind them is looked at.
    fn restore_anyhow(bench: &Bench, bytes: &[u8]) -> Result<World, CheckpointError> {
        let settings = crate::testing::papers();
        World::restore_without(&bench.scene, settings, bytes, Guard::Checksum)
    }

    #[test]
    fn what_is_saved_is_restored_to_the_last_bit() {
        let bench = bench();
        let bytes = saved(&bench);
        let world = restore(&bench, &bytes).unwrap();
        let mut again = Vec::new();
        world.save(&mut again);
        assert!(bytes == again);
        assert_eq!(World::scene_of(&bytes), Some(bench.scene.hash));
        let mut snapshot: Box<shm_types::WorldSnapshot> = shm_types::zeroed();
        world.snapshot_into(&mut snapshot);
        assert_eq!(snapshot.header.state_hash, bench.header().state_hash);
        let mut hashes = [StateHash::new(), StateHash::new()];
        snapshot.hash_into(&mut hashes[0]);
        bench.snapshot.hash_into(&mut hashes[1]);
        assert_eq!(hashes[0].finish(), hashes[1].finish());
    }

    #[test]
    fn any_bit_that_is_flipped_is_noticed() {
        let bench = bench();
        let bytes = saved(&bench);
        for at in 0..bytes.len() {
            let mut other = bytes.clone();
            other[at] ^= 1 << (at % 8);
            let error = restore(&bench, &other).err();
            assert_eq!(error, Some(CheckpointError::Damaged), "{at}");
        }
        let short = restore(&bench, &bytes[..bytes.len() - 1]).err();
        assert_eq!(short, Some(CheckpointError::Damaged));
    }

    #[test]
    fn no_bytes_with_a_right_checksum_make_anybody_panic() {
        let mut bench = bench();
        let bytes = saved(&bench);
        let (mut refused, mut taken) = (0, 0);
        for at in 0..bytes.len() {
            for value in [0, 1, 0x7f, 0xff] {
                let mut other = bytes.clone();
                other[at] = value;
                match restore_anyhow(&bench, &other) {
                    Err(_) => refused += 1,
                    Ok(world) => {
                        taken += 1;
                        bench.world = world;
                        bench.step_unsound();
                    }
                }
            }
        }
        assert!(refused > 100 && taken > 100, "{refused} and {taken}");
    }

    #[test]
    fn an_object_is_in_one_place() {
        let mut bench = bench();
        bench.world.robots[0].hand = Hand::Holding { object: 1 };
        let there_too = CheckpointError::Unsound("where an object is");
        let error = restore(&bench, &saved(&bench)).err();
        assert_eq!(error, Some(there_too.clone()), "on the ground");
        bench.world.bodies.ground.take(1);
        assert!(restore(&bench, &saved(&bench)).is_ok());
        bench.world.robots[1].hand = Hand::Holding { object: 1 };
        let error = restore(&bench, &saved(&bench)).err();
        assert_eq!(error, Some(there_too), "in another hand");
    }

    #[test]
    fn another_scene_or_version_is_named() {
        let bench = bench();
        let bytes = saved(&bench);
        let other = room(&[[1.0, 1.0], [3.0, 2.0]], &OBJECTS, BELOW, "");
        let error = World::restore(&other, crate::testing::papers(), &bytes).err();
        assert_eq!(error, Some(CheckpointError::Foreign("scene")));
        let mut newer = bytes.clone();
        newer[size_of::<u64>() + MAGIC.len()] += 1;
        let error = restore_anyhow(&bench, &newer).err();
        assert_eq!(error, Some(CheckpointError::Foreign("version")));
        let slow = Settings {
            tick_ns: 1,
            ..crate::testing::papers()
        };
        let error = World::restore(&bench.scene, slow, &bytes).err();
        assert_eq!(error, Some(CheckpointError::Foreign("length of a tick")));
    }

    #[test]
    fn every_violation_comes_back() {
        let (robot, other, object) = (3, 4, 5);
        for violation in [
            Violation::Robots { robot, other },
            Violation::Object { robot, object },
            Violation::Wall { robot },
            Violation::Holding { robot, object },
            Violation::Lost { object },
            Violation::Motion { robot },
            Violation::Grants { robot, other },
        ] {
            let mut bytes = Vec::new();
            violation.save(&mut bytes);
            let restored = Violation::restore(&mut Reader(&bytes));
            assert_eq!(restored.ok(), Some(violation));
        }
    }

    #[test]
    fn the_first_id_that_nobody_has_is_refused() {
        const NOBODY: usize = 2;
        fn fails(world: &mut World, task: u32, blocker: u32) {
            let mut report = *shm_types::zeroed::<Failure>();
            (report.task, report.blocker) = (task, blocker);
            let since_ns = 0;
            world.robots[0].failure = Some(PendingFailure { report, since_ns });
        }
        type Change = fn(&mut World);
        let changes: [(&str, Change); 6] = [
            ("an object in a hand", |world| {
                world.robots[0].hand = Hand::Holding { object: NOBODY };
            }),
            ("a holder", |world| world.objects[0].holder = Some(NOBODY)),
            ("who has claimed a task", |world| {
                world.objects[0].claimed_by = Some(NOBODY);
            }),
            ("whom a robot waits for", |world| {
                world.robots[0].link.waits_for.robot = NOBODY as u32;
            }),
            ("a failure", |world| fails(world, NOBODY as u32, NONE)),
            ("a failure", |world| fails(world, 0, NOBODY as u32)),
        ];
        for (what, change) in changes {
            let mut bench = bench();
            change(&mut bench.world);
            let error = restore(&bench, &saved(&bench)).err();
            assert_eq!(error, Some(CheckpointError::Unsound(what)));
        }
        let mut bench = bench();
        fails(&mut bench.world, 1, NONE);
        assert!(restore(&bench, &saved(&bench)).is_ok());
    }
}
