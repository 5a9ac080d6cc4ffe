//! The world's state as it is published, and the hash over everybody's state.
//!
//! Responsible for: writing every live field of the snapshot each tick; the chain of hashes, in
//! one canonical order. Not responsible for: publishing.
//!
//! Each link of the chain covers the link before, the snapshot, all commands and the planner's
//! report that led to it (and with them each machine's own hash of its private state), and what
//! of the world is not in the snapshot.

use shm_types::{Checked, Command, NONE, Point, RobotState, StateHash, capacity};

use crate::state::{Claimed, Hand, Object, Robot, id};
use crate::step::{World, WorldInput};

impl World {
    /// Brings the wire form up to date.
    pub(crate) fn write_wire(&mut self) {
        let (robots, objects) = (self.robots.len(), self.objects.len());
        let header = &mut self.wire.header;
        header.magic = capacity::MAGIC;
        header.layout_version = capacity::LAYOUT_VERSION;
        header.tick = self.tick;
        header.time_ns = self.time_ns;
        header.epoch = self.epoch.number;
        header.events = self.epoch.events;
        header.change = self.epoch.change;
        header.placements = self.epoch.placements;
        header.constraints_version = self.constraints.in_force.version;
        header.epoch_constraints_version = self.epoch.constraints_version;
        header.schedule_version = self.schedules.in_force;
        header.busy = self.busy;
        header.robot_count = id(robots);
        header.object_count = id(objects);
        header.outcome = self.outcome.code();
        header.held = u32::from(self.held);
        header.scene_version = self.scene_version;
        for (out, robot) in self.wire.robots.iter_mut().zip(&self.robots) {
            write_robot(out, robot);
        }
        for (out, object) in self.wire.objects.iter_mut().zip(self.objects.iter()) {
            write_object(out, object);
        }
    }

    /// Adds this tick's link to the chain of hashes.
    pub(crate) fn chain(&mut self, input: Option<&WorldInput<'_>>) {
        let mut hash = StateHash::new();
        hash.add(&self.wire.header.state_hash);
        self.wire.hash_into(&mut hash);
        if let Some(input) = input {
            for command in input.commands.iter().take(self.robots.len()) {
                hash.add(&u64::from(command.is_some()));
                if let Some(command) = command.map(Checked::get) {
                    hash_command(command, &mut hash);
                }
            }
            hash.add(&u64::from(input.planner.is_some()));
            if let Some(report) = input.planner.map(Checked::get) {
                hash.add(report);
            }
        }
        self.hash_private(&mut hash);
        self.wire.header.state_hash = hash.finish();
    }

    /// What the snapshot does not say of the world.
    fn hash_private(&self, hash: &mut StateHash) {
        for robot in &self.robots {
            hash_robot(robot, hash);
        }
        hash.add(self.bars.counts());
        self.bars.hash_parked(hash);
        self.constraints.hash_into(hash);
        self.schedules.hash_into(hash);
        hash.add(&[u32::from(self.stopped), self.settled_ticks]);
    }
}

fn write_robot(out: &mut RobotState, robot: &Robot) {
    let grant = robot.grant.points();
    out.position = scene::point(robot.position);
    out.epoch_position = scene::point(robot.epoch_position);
    out.acknowledged = robot.link.sequence;
    out.task = robot.claim.map_or(NONE, |claim| id(claim.task));
    out.holding = robot.hand.holding().map_or(NONE, id);
    out.grasp = id(robot.grasp);
    out.waits_for = robot.link.waits_for;
    out.phase = robot.link.phase.code();
    out.activity = robot.activity.code();
    out.epoch_free = u32::from(robot.epoch_free);
    out.live = u32::from(robot.link.live);
    out.incarnation = robot.link.incarnation;
    out.request = robot.request;
    out.request_open = u32::from(!robot.rest.is_empty());
    out.grant_count = id(grant.len());
    out.actions = robot.granted_actions();
    for (out, point) in out.grant.iter_mut().zip(grant) {
        *out = scene::point(*point);
    }
    out.grant[grant.len()..].fill(Point::default());
}

fn write_object(out: &mut shm_types::ObjectState, object: &Object) {
    *out = shm_types::ObjectState {
        position: scene::point(object.position),
        rest: scene::point(object.rest),
        goal: object.goal.map_or(Point::default(), scene::point),
        has_goal: u32::from(object.goal.is_some()),
        holder: object.holder.map_or(NONE, id),
        claimed_by: object.claimed_by.map_or(NONE, id),
        status: object.status.code(),
        epoch_status: object.epoch_status.code(),
        failures: object.failures,
        put_downs: object.put_downs,
        reserved: 0,
        barred: object.barred,
        epoch_barred: object.epoch_barred,
    };
}

/// Adds the live part of a command: unused points are no state.
fn hash_command(command: &Command, hash: &mut StateHash) {
    hash.add(&[
        command.sequence,
        command.tick,
        command.valid_until_tick,
        command.settled_at_change,
        command.state_hash,
    ]);
    hash.add(&[
        command.robot,
        command.incarnation,
        command.phase,
        command.activity,
        command.go,
        command.grip,
        command.path.id,
        command.path.count,
        command.path.actions,
        command.path.schedule_version,
    ]);
    hash.add(&command.claim);
    hash.add(&command.failure);
    hash.add(command.path.points());
    hash.add(&command.counters);
}

fn hash_robot(robot: &Robot, hash: &mut StateHash) {
    let (hand, object, ticks) = match robot.hand {
        Hand::Empty => (0, NONE, 0),
        Hand::Closing { object, ticks } => (1, id(object), ticks),
        Hand::Holding { object } => (2, id(object), 0),
        Hand::Opening { object, ticks } => (3, id(object), ticks),
    };
    let claimed = |claim: Option<Claimed>| {
        claim.map_or([u64::MAX, 0], |claim| [claim.task as u64, claim.epoch])
    };
    hash.add(&[
        hand,
        object,
        u32::from(robot.cut),
        u32::from(robot.refused),
        robot.last_failure,
        id(robot.rest.points().len()),
    ]);
    hash.add(&claimed(robot.claim));
    hash.add(&claimed(robot.refused_claim));
    hash.add(&[ticks, robot.request_tick]);
    for point in robot.rest.points() {
        hash.add(&scene::point(*point));
    }
    if let Some(end) = robot.action_end {
        hash.add(&scene::point(end));
    }
    for object in robot.leaving.iter() {
        hash.add(&id(object));
    }
    if let Some(pending) = &robot.failure {
        hash.add(&pending.report);
        hash.add(&pending.since_ns);
    }
}

#[cfg(test)]
mod tests {
    use scene::Vec2;
    use shm_types::{Activity, Claim, Failure, FailureCause, Grip, NONE, Point};

    use crate::state::{Claimed, Hand, PendingFailure};
    use crate::step::World;
    use crate::testing::{BELOW, Bench, room};

    const OBJECTS: [[[f64; 2]; 2]; 2] = [[[1.0, 1.45], [1.0, 5.0]], [[5.0, 3.0], [5.0, 5.0]]];

    fn bench() -> Bench {
        let mut bench = Bench::new(room(&[[1.0, 1.0], [3.0, 1.0]], &OBJECTS, BELOW, ""));
        bench.claim(0, 0);
        bench.ask(1, &[[8.0, 1.0], [8.0, 3.0]]);
        bench.steps(3);
        bench
    }

    /// The hash after one more tick with `change` made to the bench.
    fn hash(change: impl FnOnce(&mut Bench)) -> u64 {
        let mut bench = bench();
        change(&mut bench);
        bench.step_unsound();
        bench.header().state_hash
    }

    #[test]
    fn the_same_run_has_the_same_hash_at_every_tick() {
        let (mut one, mut other) = (bench(), bench());
        for _ in 0..20 {
            one.step();
            other.step();
            assert_eq!(one.header().state_hash, other.header().state_hash);
        }
        assert_ne!(one.header().state_hash, hash(|_| {}));
    }

    #[test]
    fn the_past_is_part_of_the_hash() {
        let (mut one, mut other) = (bench(), bench());
        one.commands[0].state_hash = 1;
        one.step();
        other.step();
        one.commands[0].state_hash = 0;
        one.step();
        other.step();
        assert_eq!(one.robot(0).position, other.robot(0).position);
        assert_ne!(one.header().state_hash, other.header().state_hash);
    }

    #[test]
    fn flipping_any_field_of_a_command_changes_the_hash() {
        let plain = hash(|_| {});
        let changes: [fn(&mut shm_types::Command); 29] = [
            |c| c.tick -= 1,
            |c| c.valid_until_tick += 1,
            |c| c.counters.easy_constraints = 1,
            |c| c.robot = 1,
            |c| c.incarnation = 3,
            |c| c.sequence += 7,
            |c| c.settled_at_change = 0,
            |c| c.state_hash = 5,
            |c| c.phase = 3,
            |c| c.activity = 2,
            |c| c.go = 1,
            |c| c.grip = Grip::Release.code(),
            |c| c.claim.task = 1,
            |c| c.claim.epoch = 0,
            |c| c.claim.constraints_version = 2,
            |c| c.failure.id = 1,
            |c| c.failure.task = 1,
            |c| c.failure.cause = FailureCause::Objects.code(),
            |c| c.failure.blocker = 1,
            |c| c.failure.answered = 1,
            |c| c.failure.epoch = 1,
            |c| c.path.id = 9,
            |c| {
                c.path.count = 1;
            },
            |c| {
                c.path.count = 1;
                c.path.points[0] = Point::new(0.0, 1e-300);
            },
            |c| c.counters.polygon_tests = 1,
            |c| c.counters.path_plans = 1,
            |c| c.counters.cells_expanded = 1,
            |c| c.counters.selections = 1,
            |c| c.counters.units = 1,
        ];
        let mut hashes: Vec<u64> = changes
            .iter()
            .map(|change| hash(|bench| change(&mut bench.commands[0])))
            .collect();
        hashes.push(plain);
        hashes.push(hash(|bench| bench.planner.state_hash = 1));
        hashes.push(hash(|bench| bench.planner.counters.units = 1));
        let count = hashes.len();
        hashes.sort_unstable();
        hashes.dedup();
        assert_eq!(hashes.len(), count, "each change has a hash of its own");
    }

    #[test]
    fn what_is_past_the_path_s_count_is_no_state() {
        let plain = hash(|_| {});
        let changed = hash(|bench| bench.commands[0].path.points[7] = Point::new(1.0, 1.0));
        assert_eq!(plain, changed);
    }

    type Change = Box<dyn Fn(&mut World)>;

    #[test]
    fn flipping_any_private_field_changes_the_hash() {
        let failure = PendingFailure {
            report: Failure::default(),
            since_ns: 4,
        };
        let changes: Vec<Change> = vec![
            Box::new(|w| w.robots[1].rest.push(Vec2::new(8.0, 4.0))),
            Box::new(|w| w.robots[1].request_tick += 1),
            Box::new(|w| w.robots[1].cut = true),
            Box::new(|w| w.robots[1].refused = true),
            Box::new(|w| w.robots[0].refused_claim = Some(Claimed { task: 1, epoch: 1 })),
            Box::new(|w| w.robots[0].claim = Some(Claimed { task: 0, epoch: 0 })),
            Box::new(|w| w.robots[0].leaving.add(0)),
            Box::new(|w| w.robots[0].last_failure = 4),
            Box::new(move |w| w.robots[0].failure = Some(failure)),
            Box::new(|w| {
                w.robots[0].hand = Hand::Closing {
                    object: 0,
                    ticks: 4,
                }
            }),
            Box::new(|w| {
                w.robots[0].hand = Hand::Closing {
                    object: 0,
                    ticks: 5,
                }
            }),
            Box::new(|w| {
                w.robots[0].hand = Hand::Opening {
                    object: 0,
                    ticks: 5,
                }
            }),
            Box::new(|w| w.bar(0, 1, robots_failure(1))),
            Box::new(|w| w.bar(1, 1, robots_failure(1))),
            Box::new(|w| w.stopped = true),
            Box::new(|w| w.settled_ticks = 1),
            Box::new(|w| w.constraints.in_force.effect_tick = 1),
        ];
        let mut hashes: Vec<u64> = changes
            .iter()
            .map(|change| {
                let mut bench = bench();
                change(&mut bench.world);
                bench.world.chain(None);
                bench.world.state_hash()
            })
            .collect();
        let mut plain = bench();
        plain.world.chain(None);
        hashes.push(plain.world.state_hash());
        let count = hashes.len();
        hashes.sort_unstable();
        hashes.dedup();
        assert_eq!(hashes.len(), count, "each change has a hash of its own");
    }

    fn robots_failure(blocker: u32) -> Failure {
        Failure {
            cause: FailureCause::Robots.code(),
            blocker,
            ..Failure::default()
        }
    }

    #[test]
    fn a_loan_that_held_something_else_is_written_over() {
        let bench = bench();
        let mut dirty: Box<shm_types::WorldSnapshot> = shm_types::zeroed();
        for robot in &mut dirty.robots {
            robot.grant.fill(Point::new(9.0, 9.0));
            robot.task = 5;
        }
        bench.world.snapshot_into(&mut dirty);
        let mut hashes = [shm_types::StateHash::new(), shm_types::StateHash::new()];
        bench.snapshot.hash_into(&mut hashes[0]);
        dirty.hash_into(&mut hashes[1]);
        assert_eq!(hashes[0].finish(), hashes[1].finish());
        assert_eq!(dirty.robots[0].grant[20], Point::default());
    }

    #[test]
    fn the_first_snapshot_is_the_initial_state() {
        let bench = Bench::new(room(&[[1.0, 1.0]], &OBJECTS, BELOW, ""));
        let header = bench.header();
        assert_eq!((header.tick, header.epoch, header.change), (0, 1, 0));
        assert_eq!((header.run_id, header.scenario_hash), (7, bench.scene.hash));
        assert_ne!(header.state_hash, 0);
        let robot = bench.robot(0);
        assert_eq!((robot.task, robot.holding, robot.live), (NONE, NONE, 1));
        assert_eq!((robot.epoch_free, robot.incarnation), (1, 1));
        assert_eq!(robot.activity, Activity::Idle.code());
        assert_eq!(bench.commands[0].claim, Claim::NONE);
        shm_types::Checked::new(&*bench.snapshot, bench.scene.counts()).unwrap();
    }
}
