//! The in-process driver with a world between the machines in which things go wrong.
//!
//! Responsible for: stepping everyone in the order every driver keeps, on what has reached them;
//! letting a plan of faults happen; the part of the supervisor (whoever dies is started again,
//! and the world told of it until it shows). Not responsible for: which faults (`fault.rs`),
//! whether what came of them is right (`watch.rs`).
//!
//! With an empty plan it has the same state hash as `Simulation` at every tick.

#[cfg(test)]
mod tests;

use std::rc::Rc;

use planner::Planner;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use robot::Robot;
use scene::{Scene, Settings};
use shm_types::{
    ConstraintTable, ControlKind, ControlRequest, MotionBatch, RoleKind, TaskStatus, WorldSnapshot,
    zeroed,
};
use world::{FIRST_INCARNATION, Guard, World};

use super::active::Active;
use super::fault::{Channel, Fault, Kind, Whom};
use super::office::Office;
use super::station::{Life, Shot, Station};
use super::watch::Watch;
use crate::rollout::rollout;

/// How often the supervisor tells the world of a process again that it does not know, ticks.
const TELL_AGAIN_TICKS: u64 = 20;

/// World, planner and robots of one run in which things go wrong.
pub struct Disturbed<'s> {
    pub(crate) scene: &'s Scene,
    pub(crate) settings: Settings,
    pub(crate) world: World,
    pub(crate) stations: Vec<Station>,
    pub(crate) office: Office,
    pub(crate) faults: Active,
    pub(crate) rng: ChaCha8Rng,
    pub(crate) snapshot: Shot,
    /// Snapshots that may be written again once nobody reads them.
    pub(crate) pool: Vec<Shot>,
    pub(crate) motion: Box<MotionBatch>,
    pub(crate) empty: Box<ConstraintTable>,
    control_id: u64,
    /// The check that the world does without, in tests.
    pub(crate) guard: Option<Guard>,
    pub(crate) watch: Watch,
}

impl<'s> Disturbed<'s> {
    /// A run in which the faults of `plan` happen, none of them any more from tick `until` on.
    #[must_use]
    pub fn new(scene: &'s Scene, settings: &Settings, plan: Vec<Fault>, until: u64) -> Self {
        let world = World::new(scene, settings.clone(), 0);
        Self::with_world(scene, settings, plan, until, world)
    }

    /// As [`Self::new`], in a world that makes all its checks but this one.
    #[must_use]
    pub fn without(
        scene: &'s Scene,
        settings: &Settings,
        plan: Vec<Fault>,
        until: u64,
        guard: Option<Guard>,
    ) -> Self {
        let world = World::new(scene, settings.clone(), 0);
        let world = match guard {
            None => world,
            Some(guard) => world.without(guard),
        };
        Self {
            guard,
            ..Self::with_world(scene, settings, plan, until, world)
        }
    }

    /// As [`Self::new`], with a world of the caller's.
    fn with_world(
        scene: &'s Scene,
        settings: &Settings,
        plan: Vec<Fault>,
        until: u64,
        world: World,
    ) -> Self {
        let mut snapshot: Box<WorldSnapshot> = zeroed();
        world.snapshot_into(&mut snapshot);
        let station = |id| Station::new(Robot::new(scene, settings.clone(), id, FIRST_INCARNATION));
        let seed = plan.first().map_or(0, |fault| fault.tick);
        Self {
            stations: (0..scene.homes.len()).map(station).collect(),
            office: Office::new(Planner::new(scene, settings.clone()).with_rollouts(rollout)),
            faults: Active::new(plan, until),
            rng: ChaCha8Rng::seed_from_u64(seed),
            watch: Watch::new(&snapshot),
            snapshot: Rc::new(snapshot),
            pool: Vec::new(),
            motion: zeroed(),
            empty: ConstraintTable::none(),
            control_id: 0,
            guard: None,
            scene,
            settings: settings.clone(),
            world,
        }
    }

    /// Goes on from a world that was saved, with all other processes new, and nothing going wrong.
    #[must_use]
    pub(crate) fn afresh(scene: &'s Scene, settings: &Settings, world: World) -> Self {
        let mut run = Self::with_world(scene, settings, Vec::new(), 0, world);
        for (id, station) in run.stations.iter_mut().enumerate() {
            station.incarnation = run.snapshot.robots[id].incarnation + 1;
            let robot = Robot::new(scene, settings.clone(), id, station.incarnation);
            station.life = Life::Up(Box::new(robot));
        }
        run
    }

    /// The newest snapshot.
    #[must_use]
    pub fn snapshot(&self) -> &WorldSnapshot {
        &self.snapshot
    }

    /// Motion and events of the tick that led to it.
    #[must_use]
    pub fn motion(&self) -> &MotionBatch {
        &self.motion
    }

    /// What the world knows beside its snapshot.
    #[must_use]
    pub const fn world(&self) -> &World {
        &self.world
    }

    /// The faults so far that altered something while a task was open.
    pub fn counted(&self) -> impl Iterator<Item = &Fault> {
        self.faults.counted()
    }

    /// The first thing that was not as it should be.
    #[must_use]
    pub fn finding(&self) -> Option<&str> {
        self.watch.finding()
    }

    /// One tick.
    ///
    /// # Panics
    /// When a machine makes a message that is no valid one: that is a bug.
    pub fn tick(&mut self) {
        let now = self.snapshot.header.tick;
        self.faults.is_open = is_open(&self.snapshot);
        self.faults.end(now);
        if !self.faults.are_over(now) {
            while let Some((place, fault)) = self.faults.begin(now) {
                self.befall(now, place, fault);
            }
        }
        self.supervise(now);
        self.show(now);
        for id in 0..self.stations.len() {
            self.step_robot(now, id);
        }
        self.step_planner(now);
        self.step_world(now);
    }

    /// What happens at once when a fault begins.
    fn befall(&mut self, now: u64, place: usize, fault: Fault) {
        let back_at = now + fault.ticks;
        match (fault.kind, fault.whom) {
            (Kind::RobotCrash, Whom::Robot(id)) if self.is_alive(id) => {
                self.stations[id].die(back_at);
                self.stations[id].is_given_up = fault.share.is_multiple_of(2);
                self.faults.count(place);
            }
            (Kind::Babble, Whom::Robot(id)) => {
                if matches!(self.stations[id].life, Life::Up(_)) {
                    self.stations[id].life = Life::Babbling {
                        until: back_at,
                        back_at: back_at + u64::from(fault.share),
                    };
                    self.watch.note_babble();
                    self.faults.count(place);
                }
            }
            (Kind::PlannerCrash, _) if self.office.planner.is_some() => {
                self.office.die(back_at);
                if let Some(damage) = fault.damage() {
                    self.office.damage(damage, self.scene.counts());
                }
                for station in &mut self.stations {
                    station.requests.clear();
                }
                self.faults.count(place);
            }
            _ => {}
        }
    }

    fn is_alive(&self, id: usize) -> bool {
        !matches!(self.stations[id].life, Life::Dead { .. })
    }

    /// Starts again whoever is due, and tells the world until it shows.
    fn supervise(&mut self, now: u64) {
        if self.office.planner.is_none() && now >= self.office.back_at {
            self.office.incarnation += 1;
            let planner = Planner::succeeding(
                self.scene,
                self.settings.clone(),
                self.office.incarnation,
                self.office.published.as_ref().map(|schedule| &***schedule),
            )
            .with_rollouts(rollout);
            self.office.planner = Some(Box::new(planner));
        }
        for id in 0..self.stations.len() {
            let station = &mut self.stations[id];
            if let Life::Babbling { until, back_at } = station.life
                && now >= until
            {
                station.die(back_at);
            }
            if let Life::Dead { back_at } = station.life
                && now >= back_at
            {
                station.incarnation += 1;
                let settings = self.settings.clone();
                let robot = Robot::new(self.scene, settings, id, station.incarnation);
                station.life = Life::Up(Box::new(robot));
                let office = &mut self.office;
                let tables = office.table_history.make_contiguous();
                station.tables.reset(tables);
                let schedules = office.schedule_history.make_contiguous();
                station.schedules.reset(schedules);
                self.tell(now, ControlKind::Up, id);
            }
            let station = &mut self.stations[id];
            let known = &self.snapshot.robots[id];
            let is_known = known.live == 1 && known.incarnation == station.incarnation;
            let is_due = now >= station.told_at + TELL_AGAIN_TICKS;
            if !is_known && is_due && !matches!(station.life, Life::Dead { .. }) {
                self.tell(now, ControlKind::Up, id);
            } else if is_known
                && matches!(station.life, Life::Up(_))
                && std::mem::take(&mut station.is_given_up)
            {
                self.tell(now, ControlKind::Down, id);
            }
        }
    }

    fn tell(&mut self, now: u64, kind: ControlKind, id: usize) {
        self.control_id += 1;
        let fate = self.faults.fate(Channel::Control, Whom::Robot(id));
        let station = &mut self.stations[id];
        station.told_at = now;
        // Somebody is gone late: it was the process before.
        let before = u32::from(kind == ControlKind::Down);
        let request = ControlRequest {
            id: self.control_id,
            kind: kind.code(),
            role: RoleKind::Robot.code(),
            index: id as u32,
            incarnation: station.incarnation - before,
            ..ControlRequest::default()
        };
        station.controls.send(now, request, fate);
    }

    /// Sends the newest snapshot to all who live.
    fn show(&mut self, now: u64) {
        for id in 0..self.stations.len() {
            if !matches!(self.stations[id].life, Life::Dead { .. }) {
                let fate = self.faults.fate(Channel::Snapshot, Whom::Robot(id));
                let shot = Rc::clone(&self.snapshot);
                self.stations[id].snapshots.send(now, shot, fate);
            }
        }
        if self.office.planner.is_some() {
            let fate = self.faults.fate(Channel::Snapshot, Whom::Planner);
            let shot = Rc::clone(&self.snapshot);
            self.office.snapshots.send(now, shot, fate);
        }
    }
}

/// Whether any object is not where it is to go.
fn is_open(snapshot: &WorldSnapshot) -> bool {
    let count = snapshot.header.object_count as usize;
    let mut objects = snapshot.objects[..count].iter();
    objects.any(|object| object.status != TaskStatus::Done.code())
}
