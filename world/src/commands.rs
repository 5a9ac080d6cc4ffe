//! Commands: taking in what robots want.
//!
//! Responsible for: which commands are taken (right incarnation, newer than the last), in the
//! order of the robots. Not responsible for: what each part of one means.

use scene::Scene;
use shm_types::{Activity, Checked, Command, ConstraintTable, Grip, Phase};

use crate::guards::Guard;
use crate::journal::Journal;
use crate::requests::{self, InForce};
use crate::step::{World, WorldInput};

impl World {
    /// Takes the new ones of the newest commands.
    pub(crate) fn take_commands(
        &mut self,
        input: &WorldInput<'_>,
        known: Option<&ConstraintTable>,
        journal: &mut Journal<'_>,
    ) {
        let commands = input.commands.iter().take(self.robots.len());
        for (i, command) in commands.enumerate() {
            let Some(command) = command.map(Checked::get) else {
                continue;
            };
            let link = &self.robots[i].link;
            let of_this = command.incarnation == link.incarnation;
            let newer = command.sequence > link.sequence;
            let new = link.live
                && command.robot as usize == i
                && self.guards.holds(Guard::Incarnation, of_this)
                && self.guards.holds(Guard::Sequence, newer);
            self.robots[i].told = new;
            if new {
                self.take_intent(i, command);
                self.take_claim(i, command.claim, known, journal);
                self.take_failure(i, command.failure);
            }
        }
        for robot in &self.robots {
            let stale = robot.link.live && robot.link.sequence > 0;
            self.counters.stale_commands += u64::from(stale && !robot.link.is_fresh(self.tick));
        }
    }

    fn take_intent(&mut self, i: usize, command: &Command) {
        let forever = self.guards.holds(Guard::Validity, false);
        let link = &mut self.robots[i].link;
        link.sequence = command.sequence;
        link.valid_until_tick = if forever {
            u64::MAX
        } else {
            command.valid_until_tick
        };
        link.settled_at_change = command.settled_at_change;
        link.go = command.go == 1;
        // Checked messages hold only codes that decode.
        link.grip = Grip::decode(command.grip).unwrap_or(Grip::Keep);
        link.phase = Phase::decode(command.phase).unwrap_or(Phase::Idle);
        link.waits_for = command.waits_for;
        link.activity = Activity::decode(command.activity).unwrap_or(Activity::Idle);
    }

    /// Takes the path requests of the commands taken, once their grips have begun: what is asked
    /// for in the same command comes after the grip.
    pub(crate) fn take_requests(&mut self, scene: &Scene, input: &WorldInput<'_>) {
        let in_force = InForce {
            guards: self.guards,
            tick: self.tick,
            schedule_version: self.schedules.in_force,
        };
        let commands = input.commands.iter().zip(&mut self.robots);
        for (command, robot) in commands {
            let Some(command) = command.map(Checked::get) else {
                continue;
            };
            if robot.told && !robot.awaits_grip() {
                let sound = requests::take(scene, &self.bodies, robot, &command.path, in_force);
                self.counters.invalid_requests += u64::from(!sound);
            }
        }
    }
}
