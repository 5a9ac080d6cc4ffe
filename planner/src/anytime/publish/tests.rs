//! Tests of how plans are published.

use scene::Settings;
use shm_types::capacity::MAX_WAITS;
use shm_types::{Point, zeroed};

use super::*;
use crate::anytime::keep::kept;
use crate::anytime::solver::Solver;
use crate::anytime::solver::testing::{cells, planned_for, written};
use crate::anytime::track::grips_in_turn;

fn ends_at_home(scene: &Scene, script: &Script) {
    for (part, home) in script.robots.iter().zip(&scene.homes) {
        let (last, _) = part.actions.last().unwrap();
        assert!((scene::vec(last.to) - home).norm() <= CONTACT_M, "{last:?}");
    }
}

#[test]
fn robots_that_only_stand_beside_their_homes_end_there_too() {
    for seed in 0..6 {
        let options = scene::GenerateOptions {
            seed,
            objects: 1,
            robots: 3,
            ..scene::GenerateOptions::default()
        };
        let scene = scene::generate(&options).unwrap().scene;
        let mut situation = Situation::at_start(&scene);
        let ground = Ground::new(&scene, &Settings::default(), Vec::new());
        for robot in &mut situation.robots {
            let beside = [
                [0.004, 0.003],
                [0.004, -0.003],
                [-0.004, 0.003],
                [-0.004, -0.003],
            ];
            let mut beside = beside.iter().map(|&by| robot.at + Vec2::from(by));
            let is_free = |at: &Vec2| ground.entry(&scene, &[0], *at, &[]).is_some();
            robot.at = beside.find(is_free).unwrap();
        }
        let mut solver = Solver::new(&scene, &Settings::default(), &situation).unwrap();
        let makespan = (0..5).find_map(|attempt| solver.first(&scene, attempt));
        solver.restore().unwrap();
        let script = Script::of(&scene, &solver.ground, &solver.plan, &situation);
        ends_at_home(&scene, &script);
        let until = makespan.unwrap() / 3;
        if solver.go_on(&scene, until, |tracks| kept(&script, tracks, until)) {
            solver.improve(&scene);
            solver.restore();
            ends_at_home(&scene, &script.go_on(&scene, &solver.ground, &solver.plan));
        }
    }
}

/// A robot with more actions than a message has room for, each with so many waits.
fn script(actions: usize, waits: usize) -> Script {
    let wait = Wait {
        robot: 0,
        actions: 0,
    };
    let listed = (0..actions).map(|number| {
        let action = Action {
            to: Point::new(number as f64, 0.0),
            grip: Grip::Keep.code(),
            object: NONE,
            turn: 0,
            first_wait: 0,
            waits: 0,
            reserved: 0,
        };
        (action, vec![wait; waits])
    });
    let part = Part {
        first: 0,
        begun: 0,
        kept: 0,
        actions: listed.collect(),
    };
    Script {
        robots: vec![part],
        granted: Vec::new(),
        limits: vec![u32::MAX],
        limited_until_tick: 0,
    }
}

#[test]
fn a_long_plan_is_listed_from_what_is_granted_as_far_as_there_is_room() {
    let script = script(MAX_ACTIONS + 100, 0);
    let mut out: Box<Schedule> = zeroed();
    for (granted, first, complete) in [(0, 0, 0), (50, 49, 0), (200, 199, 1)] {
        script.write(|_| granted, &mut out);
        let listed = out.robots[0];
        assert_eq!((listed.first, listed.complete), (first, complete));
        let end = u32::try_from(MAX_ACTIONS + 100).unwrap();
        let expected = if complete == 1 {
            end
        } else {
            first + MAX_ACTIONS as u32
        };
        assert_eq!(listed.first + listed.count, expected);
        let action = out.action(0, first + 7).unwrap();
        assert_eq!(action.to.x, f64::from(first + 7), "numbers go on");
    }
}

#[test]
fn where_waits_have_no_room_fewer_actions_are_listed() {
    let script = script(MAX_ACTIONS, 9);
    let mut out: Box<Schedule> = zeroed();
    script.write(|_| 0, &mut out);
    let count = out.robots[0].count as usize;
    assert!(
        count * 9 <= MAX_WAITS && 2 * count * 9 > MAX_WAITS,
        "{count}"
    );
    assert_eq!(out.wait_count as usize, count * 9);
    assert_eq!(out.robots[0].complete, 0);
}

/// The robot on the right stands beside its object, which may be put down only after the other one,
/// and that is far away.
const LATER: &str = r#"
    name = "later"
    [robot]
    shape = { box = [0.5, 0.5] }
    speed = 0.5
    [object]
    shape = { box = [0.4, 0.4] }
    [workspace]
    bounds = [0.0, 0.0, 9.0, 3.0]
    [[robots]]
    home = [0.5, 0.5]
    [[robots]]
    home = [8.0, 0.5]
    [[objects]]
    start = [4.0, 2.0]
    goal = [0.5, 2.0]
    [[objects]]
    start = [8.0, 1.2]
    goal = [8.0, 2.4]
    [[before]]
    first = "0.finish"
    then = "1.finish"
"#;

#[test]
fn nobody_grasps_long_before_it_can_put_down_while_that_can_still_change() {
    let scene = scene::parse(LATER, "later").unwrap();
    let (mut solver, makespan) = planned_for(&scene);
    let mut script = written(&scene, &mut solver);
    let tracks = solver.plan.tracks();
    let grips: Vec<Time> = tracks[1].grips().map(|grip| grip.time).collect();
    let transfer = grips[1] - grips[0];
    assert!(solver.ground.seconds(transfer) < 5.0 && 3 * transfer < makespan);
    let until = solver.ground.time(4.0);
    script.limit(tracks, (until, 1));
    let listed = &script.robots[1].actions[..script.listable(1) as usize];
    assert!(!listed.is_empty(), "it goes there");
    let keeps = |(action, _): &(Action, Vec<Wait>)| action.grip == Grip::Keep.code();
    assert!(listed.iter().all(keeps), "{listed:?}");
    assert!(kept(&script, tracks, until)[1] < tracks[1].deeds.len());
}

/// The robot that is gone stands between the other one and its home.
#[test]
fn who_has_no_way_home_past_one_that_is_gone_brings_what_it_can_and_goes_back_to_where_it_was() {
    let scene = cells(&["A.Ba1."]);
    let mut situation = Situation::at_start(&scene);
    situation.robots[0].at = scene.homes[1] + Vec2::new(3.0, 0.0);
    situation.robots[1].is_live = false;
    let mut solver = Solver::new(&scene, &Settings::default(), &situation).unwrap();
    solver.first(&scene, 0).unwrap();
    solver.restore().unwrap();
    let grips = grips_in_turn(solver.plan.tracks());
    let released: Vec<Vec2> = (grips.iter().filter(|grip| grip.is_release))
        .map(|grip| grip.place.at)
        .collect();
    assert_eq!(released, [scene.objects[0].goal.unwrap()]);
    let script = Script::of(&scene, &solver.ground, &solver.plan, &situation);
    let (last, _) = script.robots[0].actions.last().unwrap();
    let off = scene::vec(last.to) - situation.robots[0].at;
    assert!(off.norm() <= CONTACT_M, "{last:?}");
}
