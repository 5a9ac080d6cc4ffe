//! The version of the schedule in force, for methods that plan ahead.
//!
//! Responsible for: bringing a newer schedule into force, no earlier than the tick it names, or
//! refusing it whole. Not responsible for: making schedules (crate `planner`), following them
//! (crate `robot`). Whether a robot follows is not checked: the world grants what is free.
//!
//! What is asked for under one version and not granted is dropped when the next comes into force:
//! it may go elsewhere now, or wait for others.

use std::fmt;

use scene::vec;
use shm_types::{Checked, EventKind, NONE, Refusal, Schedule, StateHash};

use crate::journal::{Event, Journal};
use crate::state::{Robot, id, is_at};
use crate::step::World;

/// A schedule as it came: its version, and what it says unless it is no legal message.
pub type PublishedSchedule<'a> = (u32, Option<Checked<'a, Schedule>>);

/// Versions of schedules.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Schedules {
    /// The one in force; 0 for none.
    pub(crate) in_force: u32,
    /// The newest brought into force or refused.
    pub(crate) judged: u32,
    /// The newest that was refused.
    pub(crate) refused: Option<Refused>,
}

/// A schedule that was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refused {
    /// Its version.
    pub version: u32,
    /// Tick whose step refused it.
    pub tick: u64,
    /// Why.
    pub why: Refusal,
    /// The robot that it does not fit, and how many actions were granted to that one.
    pub robot: Option<(usize, u32)>,
}

impl Refused {
    /// The event that tells of it.
    pub(crate) fn event(&self) -> Event {
        let granted = self.robot.map_or(0, |(_, granted)| granted);
        let value = u64::from(self.version) | u64::from(granted) << 32;
        let mut event = Event::new(EventKind::ScheduleRefused).value(value);
        event.robot = self.robot.map_or(NONE, |(robot, _)| id(robot));
        event.other(self.why.code())
    }
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { version, tick, .. } = self;
        write!(
            f,
            "version {version} of the plan was refused in tick {tick}: "
        )?;
        match (self.why, self.robot) {
            (Refusal::Gap, Some((robot, granted))) => write!(
                f,
                "it does not go on from the {granted} actions that are granted to robot {robot}"
            ),
            (Refusal::Elsewhere, Some((robot, granted))) => write!(
                f,
                "robot {robot} has been granted {granted} actions, and they lead elsewhere than it says"
            ),
            _ => f.write_str("it is no legal message"),
        }
    }
}

impl Schedules {
    /// Adds all of it.
    pub(crate) fn hash_into(self, hash: &mut StateHash) {
        hash.add(&[self.in_force, self.judged]);
    }
}

impl World {
    /// Brings `published` into force for the snapshot of the next tick, if it is newer, may be
    /// named by then and goes on from what is granted. Whether it did.
    pub(crate) fn adopt_schedule(
        &mut self,
        published: Option<PublishedSchedule<'_>>,
        journal: &mut Journal<'_>,
    ) -> bool {
        let Some((version, schedule)) = published else {
            return false;
        };
        let early = schedule.is_some_and(|s| s.effect_tick > self.tick + 1);
        if !self.settings.method.plans_ahead() || version <= self.schedules.judged || early {
            return false;
        }
        self.schedules.judged = version;
        let misfit = match schedule {
            None => Some((Refusal::Illegal, None)),
            Some(schedule) => self.robots.iter().enumerate().find_map(|(i, robot)| {
                let why = misfit(&schedule, i, robot)?;
                Some((why, Some((i, robot.granted_actions()))))
            }),
        };
        let Some((why, robot)) = misfit else {
            self.schedules.in_force = version;
            for (i, robot) in self.robots.iter_mut().enumerate() {
                let part = schedule.and_then(|schedule| schedule.get().part(i));
                if part.is_none_or(|part| part.count == 0) {
                    robot.keep_path();
                } else {
                    robot.keep_whole_actions();
                }
            }
            return true;
        };
        let refused = Refused {
            version,
            tick: self.tick,
            why,
            robot,
        };
        journal.event(refused.event());
        self.counters.schedules_refused += 1;
        self.schedules.refused = Some(refused);
        false
    }

    /// The newest schedule that was refused, if one was.
    #[must_use]
    pub const fn refused_schedule(&self) -> Option<Refused> {
        self.schedules.refused
    }
}

/// Why a schedule does not go on where robot `i`'s grant ends: a gap after what is granted, or
/// what it lists of that leads elsewhere than it was granted to. One that lists nothing stops the
/// robot where its grant ends, be it between the ends of actions, and so does one that does not
/// know it yet.
fn misfit(schedule: &Schedule, i: usize, robot: &Robot) -> Option<Refusal> {
    let granted = robot.granted_actions();
    let part = schedule.part(i)?;
    if part.count == 0 {
        return (part.first > granted).then_some(Refusal::Gap);
    }
    let leads_to = |number: u32, place| {
        let action = schedule.action(i, number);
        action.is_some_and(|action| is_at(vec(action.to), place))
    };
    let last_is_same = match (granted.checked_sub(1), robot.action_end) {
        (Some(last), Some(end)) if last >= part.first => leads_to(last, end),
        _ => true,
    };
    let part_is_same = match robot.rest.first() {
        Some(end) if robot.cut => leads_to(granted, end),
        _ => true,
    };
    let begun = granted.saturating_add(u32::from(robot.cut));
    if part.first > granted || granted > part.first + part.count || begun > part.kept {
        Some(Refusal::Gap)
    } else if !last_is_same || !part_is_same {
        Some(Refusal::Elsewhere)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use scene::{Method, Settings};
    use shm_types::{
        Action, ControlKind, EventKind, Grip, NONE, Outcome, Point, Refusal, RobotSchedule,
        Schedule, StateHash, TaskStatus, Verdict, zeroed,
    };

    use super::{Refused, Schedules};
    use crate::testing::{BELOW, Bench, room};

    /// Object 0 stands where robot 0 may grasp it, object 1 at its goal, robot 1 beside it.
    const OBJECTS: [[[f64; 2]; 2]; 2] = [[[1.0, 1.45], [5.0, 5.0]], [[8.0, 1.45], [8.0, 1.45]]];

    fn bench() -> Bench {
        let settings = Settings {
            method: Method::Anytime,
            ..Settings::default()
        };
        let homes = [[1.0, 1.0], [8.0, 1.0]];
        Bench::with(room(&homes, &OBJECTS, BELOW, ""), settings)
    }

    /// Robot 0's actions are numbered from `first` and lead to these places; robot 1 has none.
    fn schedule(version: u32, first: u32, places: &[[f64; 2]]) -> Box<Schedule> {
        let mut schedule: Box<Schedule> = zeroed();
        (schedule.version, schedule.robot_count) = (version, 2);
        let count = places.len() as u32;
        schedule.action_count = count;
        schedule.robots[0] = RobotSchedule {
            first,
            count,
            offset: 0,
            complete: 1,
            kept: u32::MAX,
        };
        for (action, place) in schedule.actions.iter_mut().zip(places) {
            *action = Action {
                to: Point::new(place[0], place[1]),
                grip: Grip::Keep.code(),
                object: NONE,
                turn: 0,
                first_wait: 0,
                waits: 0,
                reserved: 0,
            };
        }
        schedule
    }

    const PLACES: [[f64; 2]; 3] = [[2.0, 1.0], [3.0, 1.0], [4.0, 1.0]];

    /// A world in which `PLACES` are in force.
    fn scheduled() -> Bench {
        let mut bench = bench();
        bench.schedule = Some(schedule(1, 0, &PLACES));
        bench.step();
        assert_eq!(bench.header().schedule_version, 1);
        bench
    }

    /// Asks for `corners`, each of which ends an action, under the version in force.
    fn ask(bench: &mut Bench, corners: &[[f64; 2]]) {
        bench.ask(0, corners);
        let actions = bench.robot(0).actions + corners.len() as u32;
        let version = bench.header().schedule_version;
        let path = &mut bench.commands[0].path;
        (path.actions, path.schedule_version) = (actions, version);
    }

    fn refused(bench: &Bench) -> u64 {
        bench.world.counters().schedules_refused
    }

    #[test]
    fn a_schedule_comes_into_force_at_the_tick_it_names_and_is_a_change() {
        let mut bench = bench();
        let mut plan = schedule(1, 0, &PLACES);
        plan.effect_tick = 3;
        bench.schedule = Some(plan);
        bench.steps(2);
        let change = bench.header().change;
        assert_eq!(bench.header().schedule_version, 0);
        bench.step();
        assert_eq!(
            (bench.header().tick, bench.header().schedule_version),
            (3, 1)
        );
        assert_eq!(bench.header().change, change + 1);
        bench.step();
        assert_eq!(bench.header().change, change + 1, "once");
    }

    #[test]
    fn the_papers_methods_know_no_schedule() {
        let mut bench = Bench::new(room(&[[1.0, 1.0], [8.0, 1.0]], &OBJECTS, BELOW, ""));
        bench.schedule = Some(schedule(1, 0, &PLACES));
        bench.planner.schedule_version = 1;
        bench.steps(3);
        assert_eq!((bench.header().schedule_version, refused(&bench)), (0, 0));
    }

    #[test]
    fn points_granted_are_actions_granted() {
        let mut bench = scheduled();
        ask(&mut bench, &PLACES[..2]);
        bench.step();
        assert_eq!(bench.robot(0).actions, 2);
        // What goes nowhere is granted at once.
        bench.steps(500);
        ask(&mut bench, &[]);
        bench.commands[0].path.actions = 3;
        bench.step();
        assert_eq!((bench.robot(0).actions, bench.robot(0).grant_count), (3, 0));
        assert_eq!(bench.world.counters().invalid_requests, 0);
    }

    #[test]
    fn a_request_that_miscounts_its_actions_is_no_sound_one() {
        for (corners, actions) in [(&PLACES[..2], 1), (&PLACES[..2], 3), (&[PLACES[0]; 2], 2)] {
            let mut bench = scheduled();
            ask(&mut bench, corners);
            bench.commands[0].path.actions = actions;
            bench.step();
            assert_eq!(bench.world.counters().invalid_requests, 1);
            assert_eq!((bench.robot(0).actions, bench.robot(0).grant_count), (0, 0));
        }
    }

    #[test]
    fn a_request_of_another_version_is_dropped_without_blame() {
        let mut bench = scheduled();
        ask(&mut bench, &PLACES[..1]);
        bench.commands[0].path.schedule_version = 2;
        bench.step();
        assert_eq!(bench.robot(0).request, bench.commands[0].path.id, "taken");
        assert_eq!((bench.robot(0).actions, bench.robot(0).grant_count), (0, 0));
        assert_eq!(bench.world.counters().invalid_requests, 0);
    }

    /// What comes after a stop begins where the robot stands, also if an earlier process of it was
    /// granted part of an action and left it there.
    #[test]
    fn a_robot_left_between_the_ends_of_actions_can_be_planned_for() {
        let mut bench = scheduled();
        // Robot 1 is in the way, so that the last action is granted in part.
        let far = [[2.0, 1.0], [9.0, 1.0]];
        ask(&mut bench, &far);
        bench.steps(600);
        let cut = bench.robot(0);
        assert_eq!((cut.actions, cut.request_open), (1, 1));
        bench.tell(ControlKind::Up, 0, 2);
        bench.step();
        let mut stop = schedule(2, 1, &[]);
        stop.robots[0].complete = 0;
        bench.schedule = Some(stop);
        bench.steps(2);
        assert_eq!(bench.header().schedule_version, 2);
        let here = bench.at(0);
        bench.schedule = Some(schedule(3, 0, &[here, [3.0, 2.0]]));
        bench.steps(2);
        assert_eq!(bench.world.refused_schedule(), None);
        assert_eq!(bench.header().schedule_version, 3);
    }

    #[test]
    fn a_schedule_that_does_not_go_on_from_what_is_granted_is_refused_once() {
        let plans = [
            ("a gap", schedule(2, 3, &PLACES)),
            ("less than is granted", schedule(2, 0, &PLACES[..1])),
            ("elsewhere", schedule(2, 1, &[[3.0, 2.0], [4.0, 1.0]])),
        ];
        for (what, plan) in plans {
            let mut bench = scheduled();
            ask(&mut bench, &PLACES[..2]);
            bench.step();
            bench.schedule = Some(plan);
            bench.steps(3);
            assert_eq!(bench.header().schedule_version, 1, "{what}");
            assert_eq!(refused(&bench), 1, "{what}");
            // The next that does is taken.
            bench.schedule = Some(schedule(3, 1, &[PLACES[1], [3.0, 2.0]]));
            bench.step();
            assert_eq!(bench.header().schedule_version, 3, "{what}");
        }
        let mut bench = scheduled();
        let mut plan = schedule(2, 0, &PLACES);
        plan.actions[1].object = 9;
        bench.schedule = Some(plan);
        bench.steps(3);
        assert_eq!((bench.header().schedule_version, refused(&bench)), (1, 1));
    }

    /// Robot 1 stands in the way of the second action.
    fn partly_granted() -> Bench {
        let mut bench = bench();
        bench.schedule = Some(schedule(1, 0, &[[3.0, 1.0], [8.0, 1.0]]));
        bench.step();
        ask(&mut bench, &[[3.0, 1.0], [8.0, 1.0]]);
        bench.step();
        let robot = bench.robot(0);
        assert_eq!((robot.actions, robot.grant_count), (1, 2));
        bench
    }

    #[test]
    fn what_is_not_granted_is_dropped_when_a_schedule_comes_into_force() {
        let mut bench = partly_granted();
        bench.schedule = Some(schedule(2, 1, &[[3.0, 2.0]]));
        bench.steps(2);
        assert_eq!(refused(&bench), 1, "half of the second action is granted");
        bench.schedule = Some(schedule(3, 1, &[[8.0, 1.0], [8.0, 3.0]]));
        bench.step();
        assert_eq!(bench.header().schedule_version, 3);
        let robot = bench.robot(0);
        assert_eq!(
            (robot.actions, robot.grant_count, robot.request_open),
            (1, 1, 0)
        );
        bench.steps(600);
        assert_eq!(bench.at(0), [3.0, 1.0], "and no further");
    }

    #[test]
    fn where_nothing_is_listed_a_robot_stops_where_its_grant_ends() {
        let mut bench = partly_granted();
        let granted = bench.robot(0).grant()[1];
        bench.schedule = Some(schedule(2, 0, &[]));
        bench.step();
        assert_eq!((bench.header().schedule_version, refused(&bench)), (2, 0));
        bench.steps(1_400);
        assert_eq!(bench.at(0), [granted.x, granted.y]);
        assert!(granted.x > 3.0, "between two ends");
        // From there it goes on, and what comes after is numbered as ever.
        bench.schedule = Some(schedule(3, 0, &[[granted.x, granted.y], [3.0, 2.0]]));
        bench.step();
        assert_eq!((bench.header().schedule_version, refused(&bench)), (3, 0));
        assert_eq!(bench.robot(0).actions, 1);
    }

    #[test]
    fn where_more_is_granted_than_a_schedule_keeps_it_is_refused() {
        for (kept, refusals) in [(0, 1), (1, 1), (2, 0)] {
            let mut bench = partly_granted();
            let mut plan = schedule(2, 0, &[[3.0, 1.0], [8.0, 1.0]]);
            plan.robots[0].kept = kept;
            bench.schedule = Some(plan);
            bench.step();
            // One action is granted, and a part of the next.
            assert_eq!(refused(&bench), refusals, "{kept}");
        }
    }

    #[test]
    fn a_restarted_robot_keeps_its_grant_and_one_that_is_gone_does_not() {
        let mut bench = partly_granted();
        bench.tell(ControlKind::Up, 0, 2);
        (bench.commands[0].incarnation, bench.commands[0].sequence) = (2, 0);
        bench.commands[0].path = Default::default();
        bench.step();
        assert_eq!((bench.robot(0).actions, bench.robot(0).grant_count), (1, 1));
        bench.tell(ControlKind::Down, 0, 2);
        bench.step();
        assert_eq!((bench.robot(0).actions, bench.robot(0).grant_count), (0, 0));
    }

    #[test]
    fn an_object_that_needs_no_transport_is_claimed_and_given_back_as_it_was() {
        let mut bench = bench();
        for (task, status) in [(1, TaskStatus::Done), (0, TaskStatus::Waiting)] {
            bench.claim(1, task);
            bench.step();
            let object = bench.object(task as usize);
            assert_eq!(object.status, TaskStatus::Claimed.code());
            bench.commands[1].claim.task = NONE;
            bench.step();
            assert_eq!(bench.object(task as usize).status, status.code());
        }
        assert_eq!(bench.world.counters().invalid_claims, 0);
        bench.claim(1, 1);
        bench.step();
        bench.grasp(1);
        bench.release(1);
        let object = bench.object(1);
        assert_eq!(
            (object.put_downs, object.status),
            (1, TaskStatus::Done.code())
        );
    }

    #[test]
    fn what_is_refused_is_told() {
        let mut bench = bench();
        bench.schedule = Some(schedule(1, 3, &PLACES));
        bench.step();
        let told = bench.events(EventKind::ScheduleRefused)[0];
        assert_eq!((told.robot, told.value), (0, 1));
        assert_eq!(told.other, Refusal::Gap.code());
        assert_eq!(
            bench.world.refused_schedule().unwrap().to_string(),
            "version 1 of the plan was refused in tick 0: it does not go on from the 0 actions that \
             are granted to robot 0"
        );
        bench.schedule = Some(schedule(2, 0, &PLACES));
        bench.step();
        ask(&mut bench, &PLACES[..1]);
        bench.step();
        bench.schedule = Some(schedule(3, 0, &[[2.0, 2.0]]));
        bench.step();
        let told = bench.events(EventKind::ScheduleRefused)[0];
        assert_eq!((told.robot, told.value), (0, 3 | 1 << 32));
        assert_eq!(told.other, Refusal::Elsewhere.code());
        assert_eq!((bench.header().schedule_version, refused(&bench)), (2, 2));
    }

    #[test]
    fn the_process_that_was_there_last_may_take_part_again() {
        let mut bench = scheduled();
        bench.tell(ControlKind::Down, 1, 1);
        bench.step();
        assert_eq!(bench.robot(1).live, 0);
        bench.tell(ControlKind::Up, 1, 0);
        bench.step();
        assert_eq!((bench.robot(1).live, bench.robot(1).incarnation), (1, 1));
    }

    #[test]
    fn a_claim_refused_is_judged_again_and_counted_once() {
        let mut bench = bench();
        bench.claim(0, 0);
        bench.claim(1, 0);
        bench.steps(3);
        assert_eq!(bench.world.counters().selection_conflicts, 1);
        bench.commands[0].claim.task = NONE;
        bench.step();
        assert_eq!(bench.robot(1).task, 0);
    }

    #[test]
    fn who_waits_for_a_schedule_takes_no_computer() {
        let mut bench = bench();
        for command in &mut bench.commands {
            command.activity = shm_types::Activity::Computing.code();
        }
        bench.step();
        assert_eq!(bench.header().busy, 0);
    }

    #[test]
    fn a_planner_that_has_given_up_says_why_the_run_is_stuck() {
        for (verdict, words) in [
            (
                Verdict::NotFound,
                "found no plan within its limits; 1 tasks wait",
            ),
            (Verdict::Exhausted, "no plan exists on this lattice"),
        ] {
            let mut bench = bench();
            bench.step();
            bench.planner.verdict = verdict.code();
            bench.planner.schedule_version = 1;
            for _ in 0..5 {
                (0..2).for_each(|robot| bench.settle(robot));
                bench.step();
            }
            assert_eq!(bench.world.outcome(), Outcome::Running, "one is on its way");
            bench.planner.schedule_version = 0;
            for _ in 0..2 {
                (0..2).for_each(|robot| bench.settle(robot));
                bench.step();
            }
            assert_eq!(bench.world.outcome(), Outcome::Stuck);
            assert_eq!(bench.world.verdict(), verdict);
            let reason = bench.world.reason(&bench.scene).unwrap();
            assert!(reason.contains(words), "{reason}");
        }
    }
    #[test]
    fn the_version_in_force_and_the_one_judged_last_are_state() {
        let hash = |in_force: u32, judged: u32| {
            let mut hash = StateHash::new();
            let refused = None;
            let schedules = Schedules {
                in_force,
                judged,
                refused,
            };
            schedules.hash_into(&mut hash);
            hash.finish()
        };
        let [nothing, refused, in_force] = [hash(0, 0), hash(0, 1), hash(1, 1)];
        assert!(nothing != refused && refused != in_force && nothing != in_force);
    }

    #[test]
    fn who_is_refused_is_told_why() {
        let told = |why, robot| {
            let refused = Refused {
                version: 3,
                tick: 9,
                why,
                robot,
            };
            refused.to_string()
        };
        for (why, words) in [
            (
                Refusal::Gap,
                "does not go on from the 4 actions that are granted to robot 1",
            ),
            (
                Refusal::Elsewhere,
                "robot 1 has been granted 4 actions, and they lead elsewhere",
            ),
        ] {
            let told = told(why, Some((1, 4)));
            assert!(
                told.contains("version 3") && told.contains("tick 9"),
                "{told}"
            );
            assert!(told.contains(words), "{told}");
        }
        assert!(told(Refusal::Illegal, None).contains("no legal message"));
    }
}
