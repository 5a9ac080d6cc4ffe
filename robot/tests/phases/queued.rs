//! What comes after a request: it waits in the queue, is granted bit by bit, or is taken back; and
//! whom the robot names that gets no further.

use super::*;

/// The two rooms with a third robot.
fn three() -> Bench {
    let mut draft = scene::parse(ROOMS, "rooms").unwrap().draft().clone();
    draft.homes.push([3.5, 2.7]);
    Bench::of(Scene::new(draft).unwrap(), Method::GraspingAndRestricted)
}

/// Ticks until `time_s` of virtual time, in each of which something changes somewhere.
fn run_while_things_change(bench: &mut Bench, time_s: f64) {
    while (bench.snapshot.header.time_ns as f64) < time_s * SECOND_NS as f64 {
        bench.step();
        bench.tick();
        bench.snapshot.header.change += 1;
    }
}

#[test]
fn a_request_in_the_queue_is_held_for_a_second_before_it_looks_again() {
    let mut bench = Bench::new(Method::GraspingAndRestricted);
    bench.grants = false;
    run_while_things_change(&mut bench, 0.9);
    assert_eq!((bench.plans(), bench.command.path.id), (SELECTION + 2, 1));
    run_while_things_change(&mut bench, 1.1);
    assert!(bench.plans() > SELECTION + 2);
    assert_eq!(bench.command.failure.id, 0);
}

#[test]
fn what_was_asked_for_is_given_back_when_there_is_no_way_any_more() {
    let mut bench = Bench::new(Method::GraspingAndRestricted);
    bench.grants = false;
    run_while_things_change(&mut bench, 0.5);
    assert!(!bench.command.path.points().is_empty());
    bench.snapshot.robots[1].position = DOORWAY;
    run_while_things_change(&mut bench, 1.5);
    assert!(bench.command.path.points().is_empty());
    assert!(bench.command.path.id > 1);
}

#[test]
fn who_waits_in_the_queue_for_too_long_names_the_robot_that_is_nearest() {
    let mut bench = three();
    bench.grants = false;
    bench.snapshot.robots[1].position = Point::new(3.5, 0.5);
    bench.snapshot.robots[2].position = Point::new(0.5, 2.0);
    bench.run_until(7);
    let failure = bench.command.failure;
    assert_eq!((failure.id, failure.blocker), (1, 2));
    assert_eq!(failure.cause, FailureCause::Robots.code());
    // And not the one that is nearer to the corner from which places count.
    let mut bench = three();
    bench.grants = false;
    bench.snapshot.robots[0].position = Point::new(1.5, 1.5);
    bench.snapshot.robots[1].position = Point::new(0.3, 0.3);
    bench.snapshot.robots[2].position = Point::new(1.5, 2.7);
    bench.run_until(7);
    let failure = bench.command.failure;
    assert_eq!((failure.id, failure.blocker), (1, 2));
}

/// Robot 1 is beside the way, with an object on its far side; it is robot 2 that is in the doorway.
#[test]
fn who_carries_something_away_from_the_way_is_not_in_it() {
    let mut bench = three();
    let beside = Point::new(0.3, 1.35);
    bench.snapshot.robots[1].position = beside;
    bench.snapshot.robots[1].holding = 1;
    let held = vec(beside) - bench.scene.objects[1].grasp;
    let object = &mut bench.snapshot.objects[1];
    (object.position, object.holder, object.claimed_by) = (point(held), 1, 1);
    object.status = TaskStatus::Held.code();
    bench.snapshot.robots[2].position = DOORWAY;
    bench.run_until(6);
    let failure = bench.command.failure;
    assert_eq!((failure.id, failure.blocker), (1, 2));
}

/// It looks again as soon as what is left is driven in one tick, so that it need not stop.
#[test]
fn it_asks_for_more_when_what_is_granted_lasts_for_one_tick() {
    for (ticks, id) in [(2.0, 1), (1.0, 2)] {
        let mut bench = Bench::new(Method::GraspingAndRestricted);
        bench.step();
        bench.tick();
        let step_m = bench.scene.robot.speed_m_per_s * bench.settings.tick_ns as f64 * 1e-9;
        let me = &mut bench.snapshot.robots[0];
        let before = me
            .grant_count
            .checked_sub(2)
            .map(|at| me.grant[at as usize]);
        let (from, end) = (
            vec(before.unwrap_or(me.position)),
            vec(*me.grant().last().unwrap()),
        );
        me.position = point(end + (from - end).normalize() * step_m * ticks);
        (me.grant[0], me.grant_count) = (point(end), 1);
        me.activity = Activity::Moving.code();
        bench.step();
        assert_eq!(bench.command.path.id, id, "{ticks}");
    }
}

#[test]
fn who_is_at_home_and_has_no_task_plans_no_way() {
    let mut bench = Bench::new(Method::GraspingAndRestricted);
    bench.snapshot.objects[0].epoch_barred[0] = 1;
    bench.step();
    assert_eq!((bench.phase(), bench.plans()), (Phase::Idle, SELECTION));
}
