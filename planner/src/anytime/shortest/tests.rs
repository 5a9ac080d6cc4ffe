//! Shortest plans of rooms small enough to count in.

use scene::{Budget, Settings};
use shm_types::{Checked, Counters, RobotState, Schedule, SnapshotHeader, WorldSnapshot, zeroed};

use super::*;
use crate::anytime::plan::Plan;
use crate::anytime::situation::Situation;
use crate::anytime::solver::testing::{cells, solver_of};
use crate::anytime::track::grips_in_turn;
use crate::anytime::{Anytime, Standing};

/// A shortest plan with fewer than `most` steps, laid out, and how many it has; none if there is
/// none.
fn shortest(scene: &Scene, most: u32) -> Option<(Plan, usize)> {
    let ground = Ground::new(scene, &Settings::default(), Vec::new());
    let start = Start::new(scene, &ground, &Situation::at_start(scene)).unwrap();
    let goals: Vec<_> = (scene.objects.iter().enumerate())
        .map(|(object, spec)| Some(Place::of(scene, &ground, object, spec.goal?)))
        .collect();
    let homes: Vec<u32> = start.robots.iter().map(|track| track.start).collect();
    let known = most * duration(0);
    let mut shortest = Shortest::new(scene, &ground, &start, &homes, &goals, known).unwrap();
    loop {
        match shortest.advance(&ground, 100) {
            Least::Open => {}
            Least::Plan(steps) => {
                let mut plan = Plan::new(&ground, homes);
                plan.replay(scene, &ground, &start, &steps);
                return Some((plan, steps.len()));
            }
            Least::NoneShorter => return None,
            Least::TooMany => panic!("there are few configurations"),
        }
    }
}

/// The number of its steps.
fn least(rows: &[&'static str], most: u32) -> Option<usize> {
    shortest(&cells(rows), most).map(|(_, steps)| steps)
}

#[test]
fn its_steps_bring_robots_home_and_objects_to_their_goals() {
    for (rows, robots) in [(["A.a1...2b.B"], 2), (["Aa1B..b2..C"], 3)] {
        let scene = cells(&rows);
        let (plan, _) = shortest(&scene, 20).unwrap();
        assert!(
            (0..robots).all(|robot| plan.ends_at_home(robot)),
            "{rows:?}"
        );
        let mut brought = 0;
        for grip in grips_in_turn(plan.tracks())
            .iter()
            .filter(|grip| grip.is_release)
        {
            let goal = scene.objects[grip.object].goal.unwrap();
            assert!((grip.place.at - goal).norm() < 1e-9, "{rows:?}");
            brought += 1;
        }
        assert_eq!(brought, scene.objects.len());
    }
}

/// Straight down through the object it would be two steps to where it is grasped.
#[test]
fn nobody_passes_through_an_object_that_is_not_to_be_passed_under() {
    let mut draft = cells(&["..A..", "..a.1", "....."]).draft().clone();
    draft.objects[0].pass_under = false;
    draft.objects[0].grasp = [0.0, -1.0];
    let scene = Scene::new(draft).unwrap();
    // Four there, two with the object, four back, two grips.
    let steps = |most| shortest(&scene, most).map(|(_, steps)| steps);
    assert_eq!((steps(13), steps(12)), (Some(12), None));
}

#[test]
fn as_many_steps_are_taken_as_have_to_be() {
    for (rows, steps) in [
        // Two there, two with the object, four back, two grips.
        (&["A.a.1"][..], 10),
        // Two there, one with the object, three back, two grips, by both at once.
        (&["A.a1.2b.B"], 8),
        // The nearer robot does it, on the way round the wall: one there, two and two past the
        // wall, and three back.
        (&["Aa#1", "....", "...B"], 1 + 1 + 4 + 1 + 5),
    ] {
        assert_eq!(least(rows, steps + 1), Some(steps as usize), "{rows:?}");
        assert_eq!(least(rows, steps), None, "{rows:?}");
    }
}

/// The world at the start of a run.
fn start(scene: &Scene) -> Box<WorldSnapshot> {
    let mut world = zeroed::<WorldSnapshot>();
    let counts = scene.counts();
    world.header = SnapshotHeader {
        robot_count: counts.robots,
        object_count: counts.objects,
        ..SnapshotHeader::default()
    };
    for (state, home) in world.robots.iter_mut().zip(&scene.homes) {
        *state = RobotState {
            position: scene::point(*home),
            live: 1,
            ..RobotState::default()
        };
    }
    for (state, spec) in world.objects.iter_mut().zip(&scene.objects) {
        state.position = scene::point(spec.start);
        state.rest = state.position;
        state.goal = spec.goal.map(scene::point).unwrap_or_default();
        state.has_goal = 1;
        (state.holder, state.claimed_by) = (shm_types::NONE, shm_types::NONE);
    }
    world
}

/// Two that have to get past each other: the first plan found is not a shortest one.
#[test]
fn where_a_shortest_plan_can_be_found_robots_set_off_with_one() {
    let rows = ["aA2.", "bB1."];
    let scene = cells(&rows);
    let first = solver_of(&scene).first(&scene, 0).unwrap();
    let steps = least(&rows, first / duration(0)).unwrap();
    let world = start(&scene);
    let snapshot = Checked::new(&*world, scene.counts()).unwrap();
    let mut anytime = Anytime::new(&Settings::default());
    let mut out = zeroed::<Schedule>();
    let mut counters = Counters::default();
    let mut budget = Budget::new(u64::MAX);
    let standing = anytime.advance(&scene, snapshot, &mut budget, &mut counters, &mut out);
    assert_eq!(standing, Standing::Written);
    let solver = anytime.solver.as_ref().unwrap();
    assert_eq!(solver.plan.makespan() / duration(0), steps as u32);
}
