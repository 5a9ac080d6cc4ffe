//! The supervisor's part, and what late comers get.

use scene::{GenerateOptions, Method};
use shm_types::Versioned;

use super::*;

fn room() -> Scene {
    let options = GenerateOptions {
        robots: 2,
        ..GenerateOptions::default()
    };
    scene::generate(&options).unwrap().scene
}

fn settings() -> Settings {
    Settings {
        method: Method::Anytime,
        ..Settings::default()
    }
}

/// Robot 0 dies at this tick and is back so many ticks later.
fn crash(tick: u64, ticks: u64) -> Fault {
    Fault {
        number: 0,
        tick,
        kind: Kind::RobotCrash,
        channel: None,
        whom: Whom::Robot(0),
        ticks,
        share: 1,
    }
}

fn run_until(run: &mut Disturbed<'_>, tick: u64) {
    while run.snapshot().header.tick < tick {
        run.tick();
    }
}

#[test]
fn the_world_is_told_of_a_process_until_it_knows_it_and_no_more() {
    let scene = room();
    let mut run = Disturbed::new(&scene, &settings(), Vec::new(), 0);
    run_until(&mut run, 3 * TELL_AGAIN_TICKS);
    assert_eq!(run.control_id, 0, "nobody is new");
    let mut run = Disturbed::new(&scene, &settings(), vec![crash(50, 10)], 100);
    run_until(&mut run, 60 + 3 * TELL_AGAIN_TICKS);
    assert_eq!(run.control_id, 1, "one is, and shows at once");
    assert_eq!(run.snapshot().robots[0].incarnation, FIRST_INCARNATION + 1);
}

#[test]
fn a_process_that_is_started_again_gets_the_schedule_that_others_follow() {
    let scene = room();
    let until = 200;
    let mut run = Disturbed::new(&scene, &settings(), vec![crash(until, 5)], 1_000);
    run_until(&mut run, until);
    let in_force = run.snapshot().header.schedule_version;
    assert!(in_force > 0);
    run_until(&mut run, until + 6);
    // The planner has not published it again since.
    let kept = &run.stations[0].schedules;
    assert!(
        kept.version(in_force)
            .is_some_and(|it| it.version() == in_force)
    );
}
