//! Control: participants up and down, stop, hold, resume.
//!
//! Responsible for: what a request changes, from the tick that takes it on, and whether it is
//! accepted. Not responsible for: who may send one (crate `node`).
//!
//! A robot that is gone stays where it is, with what it holds, and is an obstacle; its granted
//! path is taken back to where it stands.

use shm_types::{ControlKind, ControlReply, ControlRequest, EventKind, Outcome, RoleKind};

use crate::journal::{Event, Journal};
use crate::state::{Hand, Link};
use crate::step::World;

/// Incarnation of every participant at the start of a run. All robots take part from the start.
pub const FIRST_INCARNATION: u32 = 1;

impl World {
    /// What the world would reply to `request` if the step of the present tick took it.
    #[must_use]
    pub fn reply_to(&self, request: &ControlRequest) -> ControlReply {
        let running = self.outcome == Outcome::Running;
        let known = match (
            ControlKind::decode(request.kind),
            RoleKind::decode(request.role),
        ) {
            (Ok(ControlKind::Up | ControlKind::Down), Ok(RoleKind::Robot)) => {
                self.robots.get(request.index as usize).is_some_and(|r| {
                    request.kind == ControlKind::Down.code()
                        || request.incarnation >= r.link.incarnation
                })
            }
            (Ok(_), Ok(_)) => true,
            _ => false,
        };
        ControlReply {
            id: request.id,
            effect_tick: self.tick + 1,
            accepted: u32::from(running && known),
            reserved: 0,
        }
    }

    /// Does what `requests` ask for, those that are accepted.
    pub(crate) fn take_control(&mut self, requests: &[ControlRequest], journal: &mut Journal<'_>) {
        for request in requests {
            let Ok(kind) = ControlKind::decode(request.kind) else {
                continue;
            };
            if self.reply_to(request).accepted == 0 {
                continue;
            }
            let robot = (request.role == RoleKind::Robot.code()).then_some(request.index as usize);
            match (kind, robot) {
                (ControlKind::Up, Some(i)) => self.robot_up(i, request.incarnation, journal),
                (ControlKind::Down, Some(i)) => self.robot_down(i, journal),
                (ControlKind::Stop, _) => self.stopped = true,
                (ControlKind::Hold, _) => self.hold(true, journal),
                (ControlKind::Resume, _) => self.hold(false, journal),
                // Other roles hold no bodies: that one is silent is seen from its messages.
                (ControlKind::Up | ControlKind::Down, None) => {}
            }
        }
    }

    fn robot_up(&mut self, i: usize, incarnation: u32, journal: &mut Journal<'_>) {
        let link = &self.robots[i].link;
        if link.live && link.incarnation == incarnation {
            return;
        }
        self.park(i, journal);
        let robot = &mut self.robots[i];
        robot.link = Link::new(incarnation);
        robot.request = 0;
        robot.last_failure = 0;
        robot.refused_claim = None;
        self.epoch.due = true;
        let event = Event::new(EventKind::RobotUp).robot(i);
        journal.event(event.value(u64::from(incarnation)));
    }

    fn robot_down(&mut self, i: usize, journal: &mut Journal<'_>) {
        if !self.robots[i].link.live {
            return;
        }
        self.park(i, journal);
        self.robots[i].link.live = false;
        self.epoch.due = true;
        journal.event(Event::new(EventKind::RobotDown).robot(i));
    }

    /// Leaves robot `i` standing: no path, no grip in motion, no task but that of what it holds.
    fn park(&mut self, i: usize, journal: &mut Journal<'_>) {
        self.abort_grip(i);
        let robot = &mut self.robots[i];
        robot.grant.clear();
        robot.drop_rest();
        robot.failure = None;
        if robot.hand == Hand::Empty {
            self.unclaim(i, journal);
        }
    }

    fn hold(&mut self, held: bool, journal: &mut Journal<'_>) {
        if self.held == held {
            return;
        }
        self.held = held;
        let kind = if held {
            EventKind::Held
        } else {
            EventKind::Resumed
        };
        journal.event(Event::new(kind));
    }
}
