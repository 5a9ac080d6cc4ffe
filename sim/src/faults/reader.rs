//! The robots' side of a disturbed run.
//!
//! Responsible for: which snapshots a process acts on, and when; one step of a robot on what has
//! reached it, and what it sends. Not responsible for: what happens on the way (`line.rs`).

use std::rc::Rc;

use robot::RobotInput;
use shm_types::{Activity, WorldSnapshot};

use super::active::Active;
use super::babble;
use super::driver::Disturbed;
use super::fault::{Channel, Kind, Whom};
use super::station::{Life, Shot};
use crate::simulation::checked;

impl Disturbed<'_> {
    /// The snapshots that a process acts on now, and whether it acts at all.
    pub(crate) fn seen(
        now: u64,
        faults: &mut Active,
        whom: Whom,
        arrived: Vec<Shot>,
        unread: &mut Option<Shot>,
    ) -> Vec<Shot> {
        if let Some(newest) = arrived.last() {
            *unread = Some(Rc::clone(newest));
        }
        if let Some((place, _)) = faults.at_work(Kind::Stall, whom) {
            faults.count(place);
            return Vec::new();
        }
        if let Some((place, jump)) = faults.at_work(Kind::ClockJump, whom) {
            if jump.share % 2 == 1 {
                faults.count(place);
                return Vec::new();
            }
            if jump.tick == now && unread.is_some() {
                faults.count(place);
                let again = unread.take().into_iter().cycle();
                return again.take(1 + jump.ticks as usize).collect();
            }
        }
        let newest = unread.take();
        if arrived.is_empty() {
            newest.into_iter().collect()
        } else {
            arrived
        }
    }

    pub(crate) fn step_robot(&mut self, now: u64, id: usize) {
        let whom = Whom::Robot(id);
        let station = &mut self.stations[id];
        station.tables.arrive(now);
        station.schedules.arrive(now);
        let arrived = station.snapshots.arrived(now);
        if let Some(answer) = station.answers.arrived(now).pop() {
            station.answer = Some(answer);
        }
        if matches!(station.life, Life::Babbling { .. }) {
            babble::command(
                &mut self.rng,
                &self.snapshot,
                self.scene.counts(),
                id,
                &mut station.command,
            );
            station.command.incarnation = station.incarnation;
            station.commands.send(now, station.command, None);
            return;
        }
        if matches!(station.life, Life::Dead { .. }) {
            return;
        }
        let unread = &mut station.unread;
        let seen = Self::seen(now, &mut self.faults, whom, arrived, unread);
        for shot in seen {
            self.act(now, id, &shot);
        }
    }

    /// One step of a robot.
    fn act(&mut self, now: u64, id: usize, shot: &WorldSnapshot) {
        let counts = self.scene.counts();
        let station = &mut self.stations[id];
        let Life::Up(robot) = &mut station.life else {
            return;
        };
        let snapshot = checked(shot, counts);
        let header = &shot.header;
        station
            .tables
            .look(counts, header.epoch_constraints_version);
        station.schedules.look(counts, header.schedule_version);
        let table = station.tables.version(header.epoch_constraints_version);
        let input = RobotInput {
            snapshot,
            table: table.unwrap_or_else(|| checked(&*self.empty, counts)),
            schedule: station.schedules.version(header.schedule_version),
            answer: station.answer,
        };
        let mut units = self.settings.units_per_tick(header.busy);
        let whom = Whom::Robot(id);
        let slow = self.faults.at_work(Kind::SlowPlanner, whom);
        if let Some((_, slow)) = slow {
            units = (units * u64::from(slow.share) / 100).max(1);
        }
        let asked = robot.step(self.scene, input, units, &mut station.command);
        let computes = station.command.activity == Activity::Computing.code();
        if let Some((place, _)) = slow.filter(|_| computes) {
            self.faults.count_from(place, now);
        }
        if let Some(question) = asked {
            let fate = self.faults.fate(Channel::Request, whom);
            station.requests.send(now + 1, question, fate);
        }
        let fate = self.faults.fate(Channel::Command, whom);
        station.commands.send(now, station.command, fate);
    }
}
