//! Control: participants up and down, stop, hold, resume.
//!
//! Responsible for: what a request changes, from the tick that takes it on, and whether it is
//! accepted. Not responsible for: who may send one (crate `node`).
//!
//! A robot that is gone stays where it is, with what it holds, and is an obstacle; its granted
//! path is taken back to where it stands.

use shm_types::{ControlKind, ControlReply, ControlRequest, EventKind, Outcome, RoleKind};

use crate::change::NotMade;
use crate::journal::{Event, Journal};
use crate::state::{Hand, Link};
use crate::step::World;

/// Incarnation of every participant at the start of a run. All robots take part from the start.
pub const FIRST_INCARNATION: u32 = 1;

impl World {
    /// What the world would reply to `request` if the step of the present tick took it.
    #[must_use]
    pub fn reply_to(&self, request: &ControlRequest) -> ControlReply {
        let words = self.object_to(request);
        ControlReply::new(request.id, words.as_deref().map_or(Ok(self.tick + 1), Err))
    }

    /// What speaks against a request. Changes of the scene are judged by [`World::prepare`].
    fn object_to(&self, request: &ControlRequest) -> Option<String> {
        let (kind, role) = (
            ControlKind::decode(request.kind),
            RoleKind::decode(request.role),
        );
        let (Ok(kind), Ok(role)) = (kind, role) else {
            return Some("this version of the program knows no such request".to_owned());
        };
        if self.outcome != Outcome::Running {
            return Some(NotMade::Over.to_string());
        }
        let about_robots = [ControlKind::Up, ControlKind::Down, ControlKind::Standby];
        if !about_robots.contains(&kind) || role != RoleKind::Robot {
            return None;
        }
        let (index, count) = (request.index, self.robots.len());
        let Some(robot) = self.robots.get(index as usize) else {
            return Some(format!(
                "there is no robot {index}: the run has {count}, counted from 0"
            ));
        };
        let link = &robot.link;
        match kind {
            ControlKind::Down if !link.live => Some(format!("robot {index} is gone already")),
            // Of a process that is no more: it may have been told late.
            ControlKind::Down | ControlKind::Up | ControlKind::Standby
                if (1..link.incarnation).contains(&request.incarnation) =>
            {
                Some(format!("a later process of robot {index} takes part"))
            }
            ControlKind::Up if request.incarnation == 0 && link.live => {
                Some(format!("robot {index} takes part already"))
            }
            _ => None,
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
                (ControlKind::Up, Some(i)) => {
                    let last = self.robots[i].link.incarnation;
                    self.robot_up(i, request.incarnation.max(last), journal);
                }
                (ControlKind::Down, Some(i)) => self.robot_down(i, journal),
                (ControlKind::Standby, Some(i)) => {
                    self.robot_stands_by(i, request.incarnation, journal);
                }
                (ControlKind::Stop, _) => self.stopped = true,
                (ControlKind::Hold, _) => self.hold(true, journal),
                (ControlKind::Resume, _) => self.hold(false, journal),
                // Other roles hold no bodies: that one is silent is seen from its messages.
                (ControlKind::Up | ControlKind::Down | ControlKind::Standby, None)
                | (ControlKind::Change, _) => {}
            }
        }
    }

    fn robot_up(&mut self, i: usize, incarnation: u32, journal: &mut Journal<'_>) {
        let link = &self.robots[i].link;
        if link.live && link.incarnation == incarnation {
            return;
        }
        if link.live && self.settings.method.plans_ahead() {
            self.hand_over(i);
        } else {
            self.park(i, journal);
        }
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

    /// Robot `i` is gone until somebody lets its next process take part.
    fn robot_stands_by(&mut self, i: usize, incarnation: u32, journal: &mut Journal<'_>) {
        self.robot_down(i, journal);
        let link = &mut self.robots[i].link;
        if incarnation > link.incarnation {
            *link = Link {
                live: false,
                ..Link::new(incarnation)
            };
            self.robots[i].request = 0;
            self.robots[i].last_failure = 0;
        }
    }

    /// Leaves what robot `i` has to its next process. Others may have passed where they wait for
    /// what is granted to it: that stays granted, and will be driven.
    fn hand_over(&mut self, i: usize) {
        self.abort_grip(i);
        self.robots[i].keep_whole_actions();
    }

    /// Leaves robot `i` standing: no path, no grip in motion, no task but that of what it holds.
    pub(crate) fn park(&mut self, i: usize, journal: &mut Journal<'_>) {
        self.abort_grip(i);
        let robot = &mut self.robots[i];
        robot.give_up_path();
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

#[cfg(test)]
mod tests {
    use shm_types::{Claim, ControlKind, EventKind, Grip, NONE, Outcome, RoleKind, TaskStatus};

    use super::*;
    use crate::testing::{BELOW, Bench, room};

    const OBJECTS: [[[f64; 2]; 2]; 2] = [[[1.0, 1.45], [1.0, 5.0]], [[5.0, 3.0], [5.0, 5.0]]];

    fn bench(more: &str) -> Bench {
        Bench::new(room(&[[1.0, 1.0], [1.0, 0.5]], &OBJECTS, BELOW, more))
    }

    #[test]
    fn word_of_a_process_that_is_no_more_changes_nothing() {
        let mut bench = bench("");
        bench.tell(ControlKind::Up, 0, 2);
        bench.step();
        bench.tell(ControlKind::Down, 0, 1);
        bench.step();
        assert_eq!((bench.robot(0).live, bench.robot(0).incarnation), (1, 2));
        bench.tell(ControlKind::Down, 0, 2);
        bench.step();
        assert_eq!(bench.robot(0).live, 0);
    }

    #[test]
    fn a_robot_that_is_gone_stays_where_it_is_as_an_obstacle() {
        let mut bench = Bench::new(room(&[[1.0, 1.0], [3.0, 1.0]], &[], BELOW, ""));
        bench.claim(0, 0);
        bench.ask(0, &[[9.0, 1.0]]);
        bench.step();
        bench.tell(ControlKind::Down, 0, 1);
        bench.step();
        assert_eq!(bench.events(EventKind::RobotDown).len(), 1);
        let robot = bench.robot(0);
        assert_eq!(
            (robot.live, robot.grant_count, robot.request_open),
            (0, 0, 0)
        );
        assert_eq!((robot.task, robot.epoch_free), (NONE, 0));
        assert_eq!(bench.object(0).status, TaskStatus::Waiting.code());
        assert_eq!(bench.header().epoch, 2);
        bench.ask(1, &[[0.5, 1.0]]);
        bench.steps(600);
        let gap_m = bench.at(1)[0] - bench.at(0)[0] - 0.5;
        assert!(
            (-1e-9..1e-3).contains(&gap_m),
            "its path is free, its place is not: {gap_m}"
        );
    }

    #[test]
    fn what_a_robot_holds_it_holds_on_to() {
        let mut bench = bench("release_s = 1.0");
        bench.claim(0, 0);
        bench.step();
        bench.grasp(0);
        bench.grip(0, Grip::Release);
        bench.step();
        bench.tell(ControlKind::Down, 0, 1);
        bench.steps(200);
        assert_eq!((bench.robot(0).holding, bench.object(0).holder), (0, 0));
        bench.tell(ControlKind::Up, 0, 2);
        bench.commands[0].incarnation = 2;
        bench.commands[0].claim = Claim::NONE;
        bench.grip(0, Grip::Keep);
        bench.step();
        assert_eq!(bench.robot(0).task, 0, "it takes up where it was");
    }

    #[test]
    fn an_unfinished_grasp_leaves_the_object_on_the_ground() {
        let mut bench = bench("grasp_s = 1.0");
        bench.claim(0, 0);
        bench.step();
        bench.grip(0, Grip::Grasp);
        bench.step();
        bench.tell(ControlKind::Down, 0, 1);
        bench.steps(200);
        assert_eq!(
            (bench.robot(0).holding, bench.object(0).holder),
            (NONE, NONE)
        );
        assert_eq!(bench.object(0).status, TaskStatus::Waiting.code());
    }

    #[test]
    fn only_the_incarnation_that_is_up_is_listened_to() {
        let mut bench = bench("");
        bench.tell(ControlKind::Down, 1, 1);
        bench.ask(1, &[[8.0, 0.5]]);
        bench.steps(5);
        assert_eq!(bench.at(1), [1.0, 0.5], "gone");
        bench.tell(ControlKind::Up, 1, 2);
        bench.steps(5);
        let up = bench.robot(1);
        assert_eq!((up.live, up.incarnation, up.acknowledged), (1, 2, 0));
        assert_eq!(bench.at(1), [1.0, 0.5], "the old one speaks");
        bench.commands[1].incarnation = 2;
        bench.commands[1].sequence = 0;
        bench.steps(5);
        assert!(bench.at(1)[0] > 1.0);
        assert_eq!(bench.robot(1).acknowledged, 5);
    }

    #[test]
    fn a_robot_that_stands_by_moves_only_once_it_is_let() {
        let mut bench = bench("");
        bench.ask(1, &[[8.0, 0.5]]);
        bench.steps(5);
        bench.tell(ControlKind::Standby, 1, 2);
        bench.commands[1].incarnation = 2;
        bench.commands[1].sequence = 0;
        bench.step();
        let stands = bench.robot(1);
        assert_eq!((stands.live, stands.incarnation), (0, 2));
        assert_eq!(bench.events(EventKind::RobotDown).len(), 1);
        let at = bench.at(1);
        bench.ask(1, &[[8.0, 0.5]]);
        bench.steps(5);
        assert_eq!(bench.at(1), at, "it is not asked to move yet");
        bench.tell(ControlKind::Up, 1, 0);
        bench.steps(5);
        let up = bench.robot(1);
        assert_eq!((up.live, up.incarnation), (1, 2));
        assert!(bench.at(1)[0] > at[0]);
    }

    #[test]
    fn being_up_already_changes_nothing() {
        let mut bench = bench("");
        bench.steps(2);
        let (epoch, change) = (bench.header().epoch, bench.header().change);
        bench.tell(ControlKind::Up, 0, FIRST_INCARNATION);
        bench.step();
        assert_eq!(
            (bench.header().epoch, bench.header().change),
            (epoch, change)
        );
    }

    #[test]
    fn holding_stops_all_motion_until_resumed() {
        let mut bench = bench("grasp_s = 0.05");
        bench.ask(1, &[[8.0, 0.5]]);
        bench.claim(0, 0);
        bench.step();
        bench.grip(0, Grip::Grasp);
        bench.step();
        bench.tell(ControlKind::Hold, 0, 0);
        bench.step();
        assert_eq!(bench.events(EventKind::Held).len(), 1);
        let at = bench.at(1);
        bench.steps(50);
        assert_eq!((bench.header().held, bench.at(1)), (1, at));
        assert_eq!(bench.robot(0).holding, NONE, "grips hold too");
        assert_eq!(bench.world.outcome(), Outcome::Running);
        bench.tell(ControlKind::Resume, 0, 0);
        bench.steps(4);
        assert_eq!(bench.robot(0).holding, 0);
        assert!((bench.at(1)[0] - at[0] - 0.02).abs() < 1e-9);
    }

    #[test]
    fn stopping_ends_the_run() {
        let mut bench = bench("");
        bench.tell(ControlKind::Stop, 0, 0);
        bench.step();
        assert_eq!(bench.header().outcome, Outcome::Interrupted.code());
        assert_eq!(bench.events(EventKind::Ended).len(), 1);
        let tick = bench.header().tick;
        bench.ask(0, &[[1.0, 3.0]]);
        bench.steps(3);
        assert_eq!((bench.header().tick, bench.at(0)), (tick, [1.0, 1.0]));
        assert!(
            bench.batch.events().is_empty(),
            "and nothing happens any more"
        );
    }

    #[test]
    fn replies_say_from_which_tick_on() {
        let mut bench = bench("");
        bench.steps(3);
        let request = |kind: ControlKind, index, incarnation| ControlRequest {
            id: 9,
            kind: kind.code(),
            role: RoleKind::Robot.code(),
            index,
            incarnation,
            ..ControlRequest::default()
        };
        let reply = bench.world.reply_to(&request(ControlKind::Up, 0, 2));
        assert_eq!((reply.id, reply.effect_tick, reply.accepted), (9, 4, 1));
        let old = request(ControlKind::Up, 0, 0);
        let unknown = request(ControlKind::Down, 7, 1);
        for refused in [old, unknown] {
            assert_eq!(bench.world.reply_to(&refused).accepted, 0);
        }
    }
}
