//! The planner's side of a disturbed run.
//!
//! Responsible for: its process, one step of it on what has reached it, and what it sends to
//! whom. Not responsible for: what happens on the way (`line.rs`).

use std::collections::VecDeque;
use std::rc::Rc;

use planner::{Planner, PlannerInput};
use shm_types::{
    ConstraintTable, Counts, HardRequest, PlannerReport, Schedule, Versioned, WorldSnapshot, zeroed,
};
use world::FIRST_INCARNATION;

use super::driver::Disturbed;
use super::fault::{Channel, Damage, Kind, Whom};
use super::line::Line;
use super::station::{Inbox, Shared, Shot};
use crate::simulation::checked;

/// What a topic keeps for those who come late.
const HISTORY: usize = 2;

/// The planner's process, and what is on its way to and from it.
pub(crate) struct Office {
    pub(crate) planner: Option<Box<Planner>>,
    pub(crate) back_at: u64,
    pub(crate) incarnation: u32,
    pub(crate) snapshots: Line<Shot>,
    pub(crate) unread: Option<Shot>,
    pub(crate) requests: Vec<HardRequest>,
    pub(crate) reports: Line<PlannerReport>,
    /// The newest that the world has heard.
    pub(crate) heard: Option<PlannerReport>,
    pub(crate) tables: Inbox<ConstraintTable>,
    pub(crate) schedules: Inbox<Schedule>,
    pub(crate) table_history: VecDeque<Shared<ConstraintTable>>,
    pub(crate) schedule_history: VecDeque<Shared<Schedule>>,
    /// The newest schedule, as a planner process writes it down for the next one; none if that
    /// cannot be read.
    pub(crate) published: Option<Shared<Schedule>>,
}

impl Office {
    pub(crate) fn new(planner: Planner) -> Self {
        Self {
            planner: Some(Box::new(planner)),
            back_at: 0,
            incarnation: FIRST_INCARNATION,
            snapshots: Line::new(),
            unread: None,
            requests: Vec::new(),
            reports: Line::new(),
            heard: None,
            tables: Inbox::new(),
            schedules: Inbox::new(),
            table_history: VecDeque::new(),
            schedule_history: VecDeque::new(),
            published: None,
        }
    }

    /// What the process has written down is damaged.
    pub(crate) fn damage(&mut self, damage: Damage, counts: Counts) {
        if let Some(published) = self.published.take() {
            let mut bytes = published.sealed();
            match damage {
                Damage::CutOff { percent } => bytes.truncate(bytes.len() * percent / 100),
                Damage::Altered { at } => bytes[at] ^= u8::MAX,
            }
            self.published = Schedule::unsealed(&bytes, counts).map(Rc::new);
        }
    }

    /// The process dies, and with it what was on its way to it and what its topics keep.
    pub(crate) fn die(&mut self, back_at: u64) {
        self.planner = None;
        self.back_at = back_at;
        self.snapshots.clear();
        self.unread = None;
        self.requests.clear();
        self.table_history.clear();
        self.schedule_history.clear();
    }
}

impl Disturbed<'_> {
    pub(crate) fn step_planner(&mut self, now: u64) {
        let arrived = self.office.snapshots.arrived(now);
        if self.office.planner.is_none() {
            return;
        }
        for station in &mut self.stations {
            self.office.requests.extend(station.requests.arrived(now));
        }
        let unread = &mut self.office.unread;
        let seen = Self::seen(now, &mut self.faults, Whom::Planner, arrived, unread);
        for shot in seen {
            self.plan(now, &shot);
        }
    }

    /// One step of the planner.
    fn plan(&mut self, now: u64, shot: &WorldSnapshot) {
        let counts = self.scene.counts();
        let office = &mut self.office;
        let Some(planner) = &mut office.planner else {
            return;
        };
        let mut units = self.settings.units_per_tick(shot.header.busy);
        let slow = self.faults.at_work(Kind::SlowPlanner, Whom::Planner);
        if let Some((_, slow)) = slow {
            units = (units * u64::from(slow.share) / 100).max(1);
        }
        let requests = std::mem::take(&mut office.requests);
        let input = PlannerInput {
            snapshot: checked(shot, counts),
            requests: &requests,
        };
        let output = planner.step(self.scene, input, units);
        if let Some((place, _)) = slow
            && output.report.busy == 1
        {
            self.faults.count_from(place, now);
        }
        let report = PlannerReport {
            incarnation: office.incarnation,
            ..output.report
        };
        let fate = self.faults.fate(Channel::Report, Whom::World);
        office.reports.send(now, report, fate);
        for answer in output.answers {
            let id = answer.robot as usize;
            let fate = self.faults.fate(Channel::Answer, Whom::Robot(id));
            self.stations[id].answers.send(now, *answer, fate);
        }
        if let Some(table) = output.table {
            let table = copy(table);
            for (id, station) in self.stations.iter_mut().enumerate() {
                let fate = self.faults.fate(Channel::Table, Whom::Robot(id));
                station.tables.line().send(now, Rc::clone(&table), fate);
            }
            let fate = self.faults.fate(Channel::Table, Whom::World);
            office.tables.line().send(now, Rc::clone(&table), fate);
            remember(&mut office.table_history, table);
        }
        if let Some(schedule) = output.schedule {
            let schedule = copy(schedule);
            office.published = Some(Rc::clone(&schedule));
            for (id, station) in self.stations.iter_mut().enumerate() {
                let fate = self.faults.fate(Channel::Schedule, Whom::Robot(id));
                let message = Rc::clone(&schedule);
                station.schedules.line().send(now, message, fate);
            }
            let fate = self.faults.fate(Channel::Schedule, Whom::World);
            let message = Rc::clone(&schedule);
            office.schedules.line().send(now, message, fate);
            remember(&mut office.schedule_history, schedule);
        }
    }
}

fn copy<T: Versioned>(message: &T) -> Shared<T> {
    let mut copied: Box<T> = zeroed();
    copied.copy_from(message);
    Rc::new(copied)
}

fn remember<T>(history: &mut VecDeque<T>, message: T) {
    history.push_back(message);
    if history.len() > HISTORY {
        history.pop_front();
    }
}
