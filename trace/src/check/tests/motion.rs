//! How bodies move: in order, without jumps, not too fast, objects only with their holders.

use nalgebra::Vector2;

use super::story::{Story, TICK_NS, empty, scene};
use super::{OBJECT, ROBOT};
use crate::check::checker::Checker;
use crate::check::report::{Kind, Who};
use crate::reader::{Close, Span};
use crate::record::{BodyKind, Gap, Happening, Mark, Outcome};

#[test]
fn a_clean_run_is_clean() {
    let report = Story::clean(scene()).show(None, None).check();
    assert_eq!(report.violations, []);
    assert!(report.complete && !report.truncated && report.swept_tests > 0);
    assert_eq!(report.outcome, Some(Outcome::Solved));
}

#[test]
fn order_of_motion_events_and_states() {
    let late = Story::clean(scene());
    let until = late.now_ns;
    let mut motion = late.motions[0];
    motion.end_ns = until + 1;
    let mut late = late;
    late.motions[0] = motion;
    // The motion is dropped, so that the next one jumps.
    assert_eq!(late.kinds(), [Kind::Order, Kind::Continuity]);

    let mut swapped = Story::clean(scene());
    swapped.events.swap(2, 3);
    assert!(swapped.kinds().contains(&Kind::Order));

    let mut state = Story::clean(scene()).show(None, None);
    state.states.last_mut().unwrap().time_ns += 1;
    assert_eq!(state.violation().kind, Kind::Order);
}

#[test]
fn order_of_marks() {
    let mut checker = Checker::new(scene());
    for (tick, time_ns) in [(2, 2 * TICK_NS), (1, TICK_NS)] {
        checker.span(empty(Close::Mark(Mark { tick, time_ns })));
    }
    let report = checker.finish(false);
    assert_eq!(report.violations[0].kind, Kind::Order);
    assert!(report.truncated && !report.complete);
}

#[test]
fn continuity() {
    let mut jump = Story::new(scene());
    jump.robots[0].x += 0.1;
    let violation = jump.go(0, None, 1.0, 2.0).violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::Continuity, &[ROBOT][..])
    );

    let two = Story::new(scene())
        .moves(BodyKind::Robot, 0, Vector2::new(0.0, 0.5), 2.0)
        .wait_s(1.0)
        .moves(BodyKind::Robot, 0, Vector2::new(0.0, 0.5), 2.0)
        .wait_s(2.0);
    assert_eq!(
        two.kinds(),
        [Kind::Continuity; 2],
        "a jump, while still under way"
    );
}

#[test]
fn speed() {
    let fast = Story::new(scene())
        .moves(BodyKind::Robot, 0, Vector2::new(0.0, 0.501), 1.0)
        .wait_s(1.0);
    let violation = fast.violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::Speed, &[ROBOT][..])
    );
    assert!(
        violation.message.contains("0.501000 m/s"),
        "{}",
        violation.message
    );
    // A speed that is exceeded by rounding alone is none.
    let rounded = Story::new(scene())
        .moves(BodyKind::Robot, 0, Vector2::new(0.0, 5e-9), 9e-9)
        .wait_s(1.0);
    assert_eq!(rounded.kinds(), []);
}

#[test]
fn objects_move_only_with_their_holder() {
    let pushed = Story::new(scene())
        .moves(BodyKind::Object, 2, Vector2::new(0.0, 0.1), 1.0)
        .wait_s(1.0);
    let violation = pushed.violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::MovedAlone, &[Who::Object(2)][..])
    );

    let thrown = Story::fetched(scene())
        .moves(BodyKind::Robot, 0, Vector2::new(0.5, 0.0), 1.0)
        .moves(BodyKind::Object, 0, Vector2::new(0.5, 0.0), 1.0)
        .wait_s(0.5)
        .release(0, 0)
        .wait_s(0.5);
    assert_eq!(thrown.violation().kind, Kind::MovedAlone);
}

#[test]
fn held_objects_move_rigidly() {
    let left = Story::fetched(scene()).go(0, None, 2.5, 1.55);
    let violation = left.violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::Rigidity, &[ROBOT, OBJECT][..])
    );

    // Same ends, different times: apart in between.
    let late = Story::fetched(scene())
        .moves(BodyKind::Robot, 0, Vector2::new(0.5, 0.0), 1.0)
        .moves(BodyKind::Object, 0, Vector2::new(0.1, 0.0), 0.5)
        .wait_s(0.5)
        .moves(BodyKind::Object, 0, Vector2::new(0.4, 0.0), 0.8)
        .wait_s(0.8);
    assert!(late.kinds().contains(&Kind::Rigidity));
}

/// A grip that began in a gap may end right after it, and what is done after that is held to the
/// rules again.
#[test]
fn of_a_grip_that_began_in_a_gap_nobody_knows_how_long_it_took() {
    let slow = || {
        let mut scene = scene();
        (scene.robot.grasp_ns, scene.robot.release_ns) = (0, 1_000_000_000);
        scene
    };
    let told = |again: fn(Story) -> Story| {
        let before = Story::fetched(slow());
        let tick = before.now_ns / TICK_NS;
        // The grip has begun to open before this.
        let mut story = Story::fetched(slow())
            .go(0, Some(0), 6.0, 1.55)
            .show(Some(0), Some(0));
        let shown = story.states[0].tick;
        (story.motions, story.events) = (Vec::new(), Vec::new());
        let mut checker = Checker::new(slow());
        checker.span(before.span());
        let gap = Gap {
            after_tick: tick,
            before_tick: shown + 1,
            batches: shown - tick,
        };
        checker.span(empty(Close::Gap(gap)));
        let story = story
            .wait_s(0.3)
            .event(Happening::Released { robot: 0, task: 0 });
        checker.span(again(story).span());
        let kinds = checker.finish(true).violations.into_iter();
        kinds.map(|violation| violation.kind).collect::<Vec<_>>()
    };
    assert_eq!(told(|story| story), []);
    let in_no_time = |story: Story| story.claim(0, 0).grasp(0, 0).release(0, 0);
    assert_eq!(told(in_no_time), [Kind::Grip]);
}

/// The clean run with its middle missing: what lies before and after is checked, and the state
/// behind the gap is the new start.
#[test]
fn a_gap_is_bridged_by_the_next_state() {
    let told = |spoil: fn(&mut Span)| {
        let before = Story::fetched(scene());
        let gap_ns = before.now_ns;
        let (tick, whole) = (gap_ns / TICK_NS, Story::clean(scene()).show(None, None));
        let mut after = Story::fetched(scene())
            .go(0, Some(0), 6.0, 1.55)
            .show(Some(0), Some(0));
        let state = after.states.pop().unwrap();
        let mut checker = Checker::new(scene());
        checker.span(before.span());
        let gap = Gap {
            after_tick: tick,
            before_tick: state.tick + 1,
            batches: 400,
        };
        checker.span(empty(Close::Gap(gap)));
        let end = whole.end();
        let mut rest = whole.span();
        rest.motions
            .retain(|motion| motion.end_ns > gap_ns + 1_000_000_000);
        rest.events.retain(|event| event.tick > state.tick);
        rest.states.insert(0, state);
        spoil(&mut rest);
        checker.span(rest);
        checker.span(empty(Close::End(end)));
        checker.finish(true)
    };
    let report = told(|_| ());
    assert_eq!(report.violations, []);
    assert!(!report.complete && !report.truncated);
    assert_eq!(report.missing_batches, 400);
    let spoilt = told(|rest| rest.motions.last_mut().unwrap().from.x += 0.1);
    assert_eq!(spoilt.violations[0].kind, Kind::Continuity);
    let unknown = told(|rest| rest.states.clear());
    assert_eq!(
        unknown.violations,
        [],
        "nothing is known after the gap, so nothing is claimed"
    );
}
