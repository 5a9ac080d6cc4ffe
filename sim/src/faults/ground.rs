//! The world's side of a disturbed run.
//!
//! Responsible for: one step of the world on what has reached it; its process's death and what it
//! goes on from; drives that fail. Not responsible for: what the world decides.

use std::rc::Rc;

use rand::RngExt;
use shm_types::capacity::MAX_ROBOTS;
use shm_types::{Command, WorldSnapshot, zeroed};
use world::{CheckpointError, World, WorldInput};

use super::active::Active;
use super::driver::Disturbed;
use super::fault::{Kind, Whom};
use super::station::Shot;
use super::watch::Heard;
use crate::simulation::checked;

impl Disturbed<'_> {
    /// One step of the world, and its end and new beginning, if that is due.
    pub(crate) fn step_world(&mut self, now: u64) {
        let crash = self.faults.at_work(Kind::WorldCrash, Whom::World);
        let Some((place, crash)) = crash.filter(|(_, crash)| crash.tick == now) else {
            return self.advance(now);
        };
        self.faults.count(place);
        let mut journal = Vec::new();
        self.world.save(&mut journal);
        self.step(now);
        let state_hash = self.world.state_hash();
        let is_torn = crash.share % 2 == 0;
        let mut newest = Vec::new();
        self.world.save(&mut newest);
        let whole = newest.clone();
        if is_torn {
            newest.truncate(self.rng.random_range(0..whole.len()));
            newest.resize(whole.len(), 0);
        }
        let is_damaged = is_torn && newest != whole;
        match self.restore(&newest) {
            Ok(_) if is_damaged => self
                .watch
                .find(now, "the world goes on from half a journal"),
            Ok(world) if world.state_hash() == state_hash => self.world = world,
            Ok(_) => self
                .watch
                .find(now, "the world goes on from what it never was"),
            Err(_) if is_torn => match self.restore(&journal) {
                Ok(world) => {
                    self.world = world;
                    self.forget_heard();
                    return self.advance(now);
                }
                Err(why) => self.watch.find(now, &format!("no journal is left: {why}")),
            },
            Err(why) => self
                .watch
                .find(now, &format!("a journal is no good: {why}")),
        }
        self.publish();
        self.forget_heard();
    }

    fn restore(&self, journal: &[u8]) -> Result<World, CheckpointError> {
        let (scene, settings) = (self.scene, self.settings.clone());
        match self.guard {
            None => World::restore(scene, settings, journal),
            Some(guard) => World::restore_without(scene, settings, journal, guard),
        }
    }

    /// The world's process is another one: nobody's messages have reached it yet.
    fn forget_heard(&mut self) {
        for station in &mut self.stations {
            station.heard = None;
            station.commands.clear();
            station.controls.clear();
        }
        let office = &mut self.office;
        office.heard = None;
        office.reports.clear();
        office.tables.reset(office.table_history.make_contiguous());
        office
            .schedules
            .reset(office.schedule_history.make_contiguous());
    }

    fn advance(&mut self, now: u64) {
        self.step(now);
        self.publish();
    }

    /// The world takes in what it has heard, and makes a tick.
    fn step(&mut self, now: u64) {
        let counts = self.scene.counts();
        let office = &mut self.office;
        let mut control = Vec::new();
        for (id, station) in self.stations.iter_mut().enumerate() {
            if let Some(command) = station.commands.arrived(now).pop() {
                station.heard = Some(command);
            }
            control.extend(station.controls.arrived(now));
            let heard = station.heard.as_ref();
            let share = Self::drive(&mut self.faults, id, &self.snapshot, heard);
            self.world.set_drive(id, share);
        }
        if let Some(report) = office.reports.arrived(now).pop() {
            office.heard = Some(report);
        }
        office.tables.arrive(now);
        office.tables.look(counts, 0);
        office.schedules.arrive(now);
        office.schedules.look(counts, 0);
        let mut commands = [None; MAX_ROBOTS];
        for (place, station) in commands.iter_mut().zip(&self.stations) {
            *place = station.heard.as_ref().map(|heard| checked(heard, counts));
        }
        let input = WorldInput {
            commands: &commands[..self.stations.len()],
            planner: office.heard.as_ref().map(|report| checked(report, counts)),
            table: office.tables.newest().and_then(|(_, table)| table),
            schedule: office.schedules.newest(),
            control: &control,
            change: None,
        };
        self.world.step(self.scene, input, &mut self.motion);
    }

    /// What came of it is looked at, and shown to all from the next tick on.
    fn publish(&mut self) {
        let counts = self.scene.counts();
        let mut commands = [None; MAX_ROBOTS];
        for (place, station) in commands.iter_mut().zip(&self.stations) {
            *place = station.heard.as_ref().map(|heard| checked(heard, counts));
        }
        let heard = Heard {
            commands: &commands[..self.stations.len()],
            table: self.office.tables.newest().and_then(|(_, table)| table),
        };
        let next = next_snapshot(&mut self.pool, &self.world);
        let (before, batch) = (&self.snapshot, &self.motion);
        self.watch.look(heard, before, &next, batch, &self.world);
        self.pool.push(std::mem::replace(&mut self.snapshot, next));
    }

    /// The share of its speed that a robot's drive gives it.
    fn drive(
        faults: &mut Active,
        id: usize,
        snapshot: &WorldSnapshot,
        heard: Option<&Command>,
    ) -> f64 {
        let whom = Whom::Robot(id);
        let (place, share) = match faults.at_work(Kind::Stop, whom) {
            Some((place, _)) => (place, 0.0),
            None => match faults.at_work(Kind::Slip, whom) {
                Some((place, slip)) => (place, f64::from(slip.share) / 100.0),
                None => return 1.0,
            },
        };
        let goes = heard
            .is_some_and(|heard| heard.go == 1 && heard.valid_until_tick >= snapshot.header.tick);
        if snapshot.robots[id].grant_count > 0 && goes {
            faults.count(place);
        }
        share
    }
}

/// The world's snapshot, in memory that nobody reads any more.
fn next_snapshot(pool: &mut Vec<Shot>, world: &World) -> Shot {
    let free = pool.iter().position(|shot| Rc::strong_count(shot) == 1);
    let mut shot = match free {
        Some(free) => pool.swap_remove(free),
        None => Rc::new(zeroed()),
    };
    if let Some(snapshot) = Rc::get_mut(&mut shot) {
        world.snapshot_into(snapshot);
    }
    shot
}
