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
        header.schedule_version = self.schedule_version;
        header.busy = self.busy;
        header.robot_count = id(robots);
        header.object_count = id(objects);
        header.outcome = self.outcome.code();
        header.held = u32::from(self.held);
        for (out, robot) in self.wire.robots.iter_mut().zip(&self.robots) {
            write_robot(out, robot);
        }
        for (out, object) in self.wire.objects.iter_mut().zip(&self.objects) {
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
    out.phase = robot.link.phase.code();
    out.activity = robot.activity.code();
    out.epoch_free = u32::from(robot.epoch_free);
    out.live = u32::from(robot.link.live);
    out.incarnation = robot.link.incarnation;
    out.request = robot.request;
    out.request_open = u32::from(!robot.rest.is_empty());
    out.grant_count = id(grant.len());
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
    for object in robot.leaving.iter() {
        hash.add(&id(object));
    }
    if let Some(pending) = &robot.failure {
        hash.add(&pending.report);
        hash.add(&pending.since_ns);
    }
}
