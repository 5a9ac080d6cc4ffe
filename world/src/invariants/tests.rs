//! Each invariant, broken by hand, is found.

use scene::Vec2;
use shm_types::{EventKind, Outcome};

use super::*;
use crate::path::Path;
use crate::state::Hand;
use crate::testing::{BELOW, Bench, room};
use crate::track::Track;

const OBJECTS: [[[f64; 2]; 2]; 2] = [[[1.0, 1.45], [1.0, 5.0]], [[5.0, 3.0], [5.0, 5.0]]];

/// Robot 0 holds object 0; robot 1 is on its way.
fn bench() -> Bench {
    let mut bench = Bench::new(room(&[[1.0, 1.0], [3.0, 1.0]], &OBJECTS, BELOW, ""));
    bench.claim(0, 0);
    bench.step();
    bench.grasp(0);
    bench.ask(1, &[[8.0, 1.0]]);
    bench.steps(3);
    bench
}

fn found(bench: &mut Bench) -> Option<Violation> {
    bench.world.find_violation(&bench.scene)
}

fn put(bench: &mut Bench, robot: usize, x: f64, y: f64) {
    let robot = &mut bench.world.robots[robot];
    robot.position = Vec2::new(x, y);
    robot.track = Track::still(robot.position);
    robot.moved = false;
    robot.grant.clear();
}

#[test]
fn a_sound_world_has_none() {
    assert_eq!(found(&mut bench()), None);
}

#[test]
fn two_robots_in_one_place_are_found() {
    let mut bench = bench();
    put(&mut bench, 1, 1.499, 1.0);
    let violation = Violation::Robots { robot: 0, other: 1 };
    assert_eq!(found(&mut bench), Some(violation));
    put(&mut bench, 1, 1.449, 1.45);
    assert_eq!(found(&mut bench), Some(violation), "by what it holds");
    put(&mut bench, 1, 1.5, 1.0);
    assert_eq!(found(&mut bench), None, "touching");
}

#[test]
fn robots_that_pass_through_each_other_within_the_tick_are_found() {
    let mut bench = bench();
    put(&mut bench, 1, 3.0, 1.0);
    let mut path = Path::EMPTY;
    path.push(Vec2::new(0.4, 1.0));
    bench.world.robots[1].track = Track::walk(Vec2::new(3.0, 1.0), &path, 9.0);
    bench.world.tick_m = 9.0;
    bench.world.robots[1].position = Vec2::new(0.4, 1.0);
    bench.world.robots[1].moved = true;
    bench.world.robots[1].granted_m = 2.6;
    let violation = Violation::Robots { robot: 0, other: 1 };
    assert_eq!(found(&mut bench), Some(violation));
}

#[test]
fn a_robot_in_an_object_or_a_wall_is_found() {
    let mut bench = bench();
    put(&mut bench, 1, 5.0, 2.6);
    let violation = Violation::Object {
        robot: 1,
        object: 1,
    };
    assert_eq!(found(&mut bench), Some(violation));
    put(&mut bench, 1, 5.0, 0.2);
    assert_eq!(found(&mut bench), Some(Violation::Wall { robot: 1 }));
}

#[test]
fn disagreement_on_what_is_held_is_found() {
    let holding = Violation::Holding {
        robot: 0,
        object: 0,
    };
    let mut bench = bench();
    bench.world.objects[0].holder = Some(1);
    assert_eq!(found(&mut bench), Some(holding));
    bench.world.objects[0].holder = Some(0);
    bench.world.objects[0].position.x += 1e-9;
    assert_eq!(found(&mut bench), Some(holding));
}

#[test]
fn a_lost_or_doubled_object_is_found() {
    let mut bench = bench();
    bench.world.bodies.ground.take(1);
    assert_eq!(found(&mut bench), Some(Violation::Lost { object: 1 }));
    bench.world.bodies.ground.put(1, Vec2::new(5.0, 3.0));
    assert_eq!(found(&mut bench), None);
    bench.world.objects[1].position.x += 1e-3;
    assert_eq!(found(&mut bench), Some(Violation::Lost { object: 1 }));
    bench.world.objects[1].position.x = 5.0;
    for hand in [
        Hand::Empty,
        Hand::Closing {
            object: 0,
            ticks: 1,
        },
    ] {
        bench.world.robots[0].hand = hand;
        assert_eq!(found(&mut bench), Some(Violation::Lost { object: 0 }));
        bench.world.robots[0].hand = Hand::Holding { object: 0 };
        assert_eq!(found(&mut bench), None);
    }
}

#[test]
fn motion_off_the_grant_or_too_fast_is_found() {
    let mut bench = bench();
    bench.world.cleared[1] = Cleared::nothing();
    bench.world.robots[1].granted_m += 1e-3;
    assert_eq!(found(&mut bench), Some(Violation::Motion { robot: 1 }));
    bench.world.robots[1].granted_m -= 1e-3;
    assert_eq!(found(&mut bench), None);
    bench.step();
    let at = bench.world.robots[1].position;
    let mut path = Path::EMPTY;
    path.push(at + Vec2::new(0.003, 0.001));
    bench.world.robots[1].track = Track::walk(at, &path, 9.0);
    bench.world.robots[1].position = bench.world.robots[1].track.end();
    bench.world.robots[1].granted_m = bench.world.robots[1].grant.length_from(at);
    let motion = Violation::Motion { robot: 1 };
    assert_eq!(found(&mut bench), Some(motion), "beside its way");
    bench.world.robots[1].position = at;
    bench.world.robots[1].track = Track::still(at);
    bench.world.robots[1].moved = false;
    assert_eq!(found(&mut bench), None);
    bench.world.robots[1].moved = true;
    bench.world.robots[1].track = Track::walk(at, &bench.world.robots[1].grant, 0.005);
    bench.world.robots[1].position = bench.world.robots[1].track.end();
    bench.world.tick_m = 0.004;
    assert_eq!(found(&mut bench), Some(Violation::Motion { robot: 1 }));
}

#[test]
fn grants_that_overlap_are_found() {
    let mut bench = bench();
    bench.world.robots[0].grant.push(Vec2::new(6.0, 1.0));
    let violation = Violation::Grants { robot: 0, other: 1 };
    assert_eq!(found(&mut bench), Some(violation));
}

#[test]
fn a_grant_that_goes_on_into_another_is_found() {
    let mut bench = bench();
    // Nothing of the other robot changes: the grant alone is to be noticed.
    let other = &mut bench.world.robots[1];
    (other.track, other.moved) = (Track::still(other.position), false);
    let at = bench.world.robots[0].position;
    bench.world.robots[0].grant.push(Vec2::new(at.x, 4.0));
    bench.world.robots[0].grant.push(Vec2::new(8.0, 4.0));
    assert_eq!(found(&mut bench), None);
    bench.world.robots[0].grant.push(Vec2::new(8.0, 2.0));
    assert_eq!(found(&mut bench), None);
    for (y, meets) in [(1.55, false), (1.45, true), (1.55, false), (0.9, true)] {
        bench.world.robots[0].grant.replace_last(Vec2::new(8.0, y));
        let violation = Violation::Grants { robot: 0, other: 1 };
        assert_eq!(found(&mut bench), meets.then_some(violation), "{y}");
    }
}

#[test]
fn path_that_was_given_back_and_taken_again_is_looked_at_again() {
    let mut bench = bench();
    let ahead = bench.world.robots[1].grant;
    let at = bench.world.robots[1].position;
    put(&mut bench, 1, at.x, at.y);
    bench.world.robots[1].grant = ahead;
    assert_eq!(found(&mut bench), None);
    bench.world.robots[1].grant.clear();
    assert_eq!(found(&mut bench), None);
    // Robot 0 is granted a place on it meanwhile, and has it to itself.
    let at = bench.world.robots[0].position;
    bench.world.robots[0].grant.push(Vec2::new(at.x, 3.0));
    bench.world.robots[0].grant.push(Vec2::new(6.0, 3.0));
    bench.world.robots[0].grant.push(Vec2::new(6.0, 1.0));
    assert_eq!(found(&mut bench), None);
    bench.world.robots[1].grant = ahead;
    let violation = Violation::Grants { robot: 0, other: 1 };
    assert_eq!(found(&mut bench), Some(violation));
}

#[test]
fn what_has_not_changed_is_not_looked_at_again() {
    let mut bench = bench();
    bench.steps(3);
    let anew = |bench: &Bench| bench.world.counters().checks.anew(Invariant::Robots);
    let (made, before) = (bench.world.counters().checks, anew(&bench));
    bench.steps(10);
    let checks = bench.world.counters().checks;
    assert_eq!(anew(&bench), before, "one holds, one goes straight on");
    for (invariant, count) in [
        (Invariant::Robots, 10),
        (Invariant::Wall, 20),
        (Invariant::Motion, 20),
        (Invariant::Holding, 10),
        (Invariant::Lost, 20),
    ] {
        let more = checks.made(invariant) - made.made(invariant);
        assert_eq!(more, count, "{invariant:?}");
    }
    bench.ask(0, &[[1.0, 2.0]]);
    bench.step();
    assert_eq!(anew(&bench), before + 1);
}

#[test]
fn one_that_is_broken_ends_the_run() {
    let mut bench = bench();
    bench.world.objects[1].position.x += 1e-3;
    bench.step_unsound();
    assert_eq!(bench.header().outcome, Outcome::Violated.code());
    assert_eq!(bench.world.counters().violations, 1);
    let event = bench.events(EventKind::Violated)[0];
    assert_eq!((event.task, event.value), (1, 5));
    let at = bench.at(1);
    bench.step_unsound();
    assert_eq!(bench.at(1), at, "all motion is held");
}

#[test]
fn each_look_at_two_bodies_is_counted() {
    let mut bench = bench();
    let tests = |bench: &Bench| bench.world.counters().checks.swept_tests;
    let before = tests(&bench);
    // The two robots touch: whether they overlap has to be looked at.
    put(&mut bench, 1, 1.5, 1.0);
    assert_eq!(found(&mut bench), None);
    let after = tests(&bench);
    assert!(after > before, "{before} {after}");
    assert!(bench.world.bodies.tests() >= after);
}
