//! Planning anew while a run goes on: by a planner that was started again, with robots lost and
//! come back.

#![expect(clippy::unwrap_used, reason = "a test may fail")]

use scene::{GenerateOptions, Method, Scene, Settings};
use shm_types::{ObjectState, Outcome, TaskStatus};
use sim::{SimReport, Simulation};

/// Runs a room in which something happens to the run at each of some ticks.
fn run_disturbed(
    scene: &Scene,
    at_ticks: &[u64],
    mut happens: impl FnMut(&mut Simulation<'_>, usize),
) -> SimReport {
    let mut run = Simulation::new(scene, &settings(), 1);
    let mut next = 0;
    while run.outcome() == Outcome::Running {
        let tick = run.tick().header.tick;
        if at_ticks.get(next).is_some_and(|at| *at <= tick) {
            happens(&mut run, next);
            next += 1;
        }
    }
    run.report()
}

fn settings() -> Settings {
    Settings {
        method: Method::Anytime,
        ..Settings::default()
    }
}

fn random_room(seed: u64) -> Scene {
    let options = GenerateOptions {
        seed,
        robots: 2 + seed as usize % 3,
        ..GenerateOptions::default()
    };
    scene::generate(&options).unwrap().scene
}

#[test]
fn a_planner_that_is_started_again_goes_on_from_where_everything_is() {
    for seed in 0..6 {
        let room = random_room(seed);
        let mut restarts = 0;
        let report = run_disturbed(&room, &[150, 400, 900], |run, _| {
            restarts += 1;
            run.restart_planner();
        });
        let why = report.reason;
        assert_eq!(report.outcome, Outcome::Solved, "{seed}: {why:?}");
        assert!(restarts > 1, "{seed}");
    }
}

/// Once all of the plan is listed nothing is lost with the planner, not even for a robot that is
/// started after it.
#[test]
fn a_planner_that_is_started_again_leaves_robots_to_a_plan_that_is_listed_to_its_end() {
    for seed in 0..6 {
        let room = random_room(seed);
        let undisturbed = run_disturbed(&room, &[], |_, _| {});
        let late = undisturbed.ticks / 2;
        let report = run_disturbed(&room, &[late, late + 1], |run, turn| match turn {
            0 => run.restart_planner(),
            _ => run.restart_robot(0),
        });
        assert_eq!(report.outcome, Outcome::Solved, "{seed}");
        assert_eq!(report.ticks, undisturbed.ticks, "{seed}");
    }
}

/// A robot is lost, and comes back before the others find out that they cannot do without it: what
/// it held and where it stood is taken into account.
#[test]
fn robots_that_are_lost_and_come_back_take_part_again() {
    for seed in 0..6 {
        let room = random_room(seed);
        let report = run_disturbed(&room, &[300, 350, 1000, 1050], |run, turn| {
            let robot = turn / 2 % room.homes.len();
            if turn % 2 == 0 {
                run.lose_robot(robot);
            } else {
                run.restart_robot(robot);
            }
        });
        let why = report.reason;
        assert_eq!(report.outcome, Outcome::Solved, "{seed}: {why:?}");
    }
}

/// One robot is lost for good: the others bring to their goals what they can.
#[test]
fn what_can_be_done_without_a_lost_robot_is_done() {
    let (mut delivered, mut all) = (0, 0);
    for seed in 0..4 {
        let room = random_room(seed);
        let mut run = Simulation::new(&room, &settings(), 1);
        while run.outcome() == Outcome::Running {
            if run.tick().header.tick == 100 {
                run.lose_robot(0);
            }
        }
        let outcome = run.outcome();
        assert!(
            [Outcome::Solved, Outcome::Stuck].contains(&outcome),
            "{seed}: {outcome:?}"
        );
        let objects = &run.snapshot().objects[..room.objects.len()];
        let done = |object: &&ObjectState| object.status == TaskStatus::Done.code();
        delivered += objects.iter().filter(done).count();
        all += objects.len();
    }
    assert!(2 * delivered > all, "{delivered} of {all}");
}
