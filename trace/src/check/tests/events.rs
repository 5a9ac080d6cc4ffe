//! What events say, and how a run ends.

use super::story::{Story, empty, scene};
use super::{OBJECT, ROBOT};
use crate::check::checker::Checker;
use crate::check::report::{Kind, Who};
use crate::reader::Close;
use crate::record::{Happening, Instant, Order, Outcome, Place, TaskInstant};

#[test]
fn claims() {
    let two = Story::new(scene()).claim(0, 0).claim(1, 0);
    assert_eq!(two.violation().kind, Kind::Claim, "claimed already");
    let more = Story::new(scene()).claim(0, 0).claim(0, 2);
    assert_eq!(more.violation().kind, Kind::Claim, "claims another");
    let held = Story::fetched(scene()).claim(1, 0);
    assert_eq!(held.violation().kind, Kind::Claim, "held");
    let holding = Story::fetched(scene()).claim(0, 2);
    assert_eq!(holding.violation().kind, Kind::Claim, "while it holds");
    let early = Story::new(scene()).event(Happening::Claimed {
        robot: 0,
        task: 0,
        epoch: 2,
    });
    assert_eq!(early.violation().kind, Kind::Claim, "of an epoch to come");
    let given_back = Story::new(scene()).event(Happening::Unclaimed { robot: 0, task: 0 });
    assert_eq!(given_back.violation().kind, Kind::Claim, "not claimed");
}

#[test]
fn grasps() {
    let mut unclaimed = Story::fetched(scene());
    unclaimed
        .events
        .retain(|event| !matches!(event.what, Happening::Claimed { .. }));
    let violation = unclaimed.violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::Grasp, &[ROBOT, OBJECT][..])
    );

    let beside = Story::new(scene())
        .claim(0, 0)
        .go(0, None, 2.0, 1.0)
        .go(0, None, 2.0, 1.54)
        .grasp(0, 0);
    assert_eq!(
        beside.kinds(),
        [Kind::Grasp, Kind::Rigidity],
        "held in the wrong place from then on"
    );
}

#[test]
fn holding() {
    // Robot 1 takes the object out of robot 0's hand.
    let mut close = scene();
    close.objects[0].grasp = Place::new(0.0, -0.45);
    let stolen = Story::fetched(close).event(Happening::Grasped { robot: 1, task: 0 });
    let kinds = stolen.kinds();
    assert!(
        kinds.contains(&Kind::Holding) && kinds.contains(&Kind::Grasp),
        "{kinds:?}"
    );

    let second = Story::fetched(scene()).event(Happening::Grasped { robot: 0, task: 2 });
    let report = second.check();
    let message = "robot 0 grasps object 2 while it holds object 0";
    assert!(
        report
            .violations
            .iter()
            .any(|violation| violation.message == message)
    );

    let not_held = Story::new(scene()).release(0, 0);
    assert_eq!(not_held.violation().kind, Kind::Holding);
}

#[test]
fn grips_take_their_time_and_stand_still() {
    let slow = |grasp_s: f64, does: fn(Story) -> Story| {
        let mut slow = scene();
        slow.robot.grasp_ns = 1_000_000_000;
        let story = Story::new(slow)
            .claim(0, 0)
            .go(0, None, 2.0, 1.0)
            .go(0, None, 2.0, 1.55);
        let story = story.event(Happening::GraspStarted { robot: 0, task: 0 });
        does(story)
            .wait_s(grasp_s)
            .event(Happening::Grasped { robot: 0, task: 0 })
    };
    assert_eq!(slow(1.0, |story| story).kinds(), []);
    assert_eq!(slow(0.9, |story| story).violation().kind, Kind::Grip);
    let moving = slow(0.2, |story| {
        story.go(0, None, 2.0, 1.35).go(0, None, 2.0, 1.55)
    });
    assert_eq!(moving.violation().kind, Kind::Grip);
    // Given up with the robot, and started anew.
    let again = slow(1.0, |story| {
        story
            .event(Happening::RobotDown { robot: 0 })
            .event(Happening::RobotUp {
                robot: 0,
                incarnation: 2,
            })
            .event(Happening::GraspStarted { robot: 0, task: 0 })
    });
    assert_eq!(again.kinds(), []);

    let mut slow = scene();
    slow.robot.release_ns = 1_000_000_000;
    assert_eq!(
        Story::fetched(slow).release(0, 0).violation().kind,
        Kind::Grip
    );
}

#[test]
fn completion() {
    let early = Story::fetched(scene())
        .release(0, 0)
        .event(Happening::Completed { task: 0 });
    let violation = early.violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::Completion, &[OBJECT][..])
    );
    let held = Story::fetched(scene())
        .go(0, Some(0), 6.0, 1.55)
        .event(Happening::Completed { task: 0 });
    assert_eq!(held.violation().kind, Kind::Completion);
}

#[test]
fn epochs_and_versions_never_go_back() {
    let story = Story::new(scene())
        .event(Happening::Epoch { epoch: 2 })
        .event(Happening::Epoch { epoch: 2 });
    assert_eq!(story.violation().kind, Kind::Epoch);
    let mut story = Story::new(scene())
        .show(None, None)
        .wait_s(1.0)
        .show(None, None);
    story.states[0].constraints_version = 1;
    assert_eq!(story.violation().kind, Kind::Epoch);
}

#[test]
fn the_users_own_order() {
    let ordered = |first, then| {
        let mut ordered = scene();
        let instant = |(task, instant)| TaskInstant { task, instant };
        ordered.before = vec![Order {
            first: instant(first),
            then: instant(then),
        }];
        ordered
    };
    let kept = ordered((0, Instant::Grasp), (0, Instant::Finish));
    assert_eq!(Story::clean(kept).kinds(), []);
    let not_kept = ordered((1, Instant::Finish), (0, Instant::Grasp));
    let violation = Story::clean(not_kept).violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::UserOrder, &[Who::Object(1), OBJECT][..])
    );
}

#[test]
fn states_show_what_happened() {
    let mut off = Story::clean(scene()).show(None, None);
    off.states.last_mut().unwrap().objects[0].at.x += 1e-4;
    assert_eq!(off.violation().kind, Kind::State);
    let held = Story::clean(scene()).show(None, Some(0));
    assert_eq!(
        held.kinds(),
        [Kind::State; 2],
        "of the robot and of the object"
    );
}

#[test]
fn solved_means_at_goals_at_home_with_empty_hands() {
    let solved = |mut story: Story| {
        story.outcome = Outcome::Solved;
        story.check().violations
    };
    let away = solved(Story::brought(scene()));
    assert_eq!(
        (away[0].kind, &away[0].who[..]),
        (Kind::Final, &[ROBOT][..])
    );
    let undone = solved(Story::new(scene()));
    assert_eq!(
        (undone[0].kind, &undone[0].who[..]),
        (Kind::Final, &[OBJECT][..])
    );
    let mut near = scene();
    near.homes[0] = Place::new(6.0, 1.0);
    near.objects[0].start = Place::new(6.0, 1.45);
    near.objects[0].goal = Some(Place::new(6.0, 1.45));
    let holding = solved(Story::new(near).claim(0, 0).grasp(0, 0));
    assert_eq!(
        (holding[0].kind, &holding[0].who[..]),
        (Kind::Final, &[ROBOT, OBJECT][..])
    );
    assert_eq!(holding.len(), 1);
}

#[test]
fn the_end_is_what_the_events_say() {
    let mut story = Story::clean(scene());
    story = story.event(Happening::Ended {
        outcome: Outcome::Stuck,
    });
    assert_eq!(story.check_without_ended().violations[0].kind, Kind::Final);

    let story = Story::clean(scene());
    let mut end = story.end();
    end.makespan_ns -= 1_000;
    let mut checker = Checker::new(scene());
    checker.span(story.span());
    checker.span(empty(Close::End(end)));
    let violations = checker.finish(true).violations;
    assert_eq!(
        (violations[0].kind, &violations[0].who[..]),
        (Kind::Final, &[ROBOT][..])
    );
}

#[test]
fn what_the_world_itself_found_is_told() {
    let violated = Happening::Violated {
        robot: Some(0),
        task: None,
        other: None,
        invariant: 3,
    };
    assert_eq!(
        Story::new(scene()).event(violated).violation().kind,
        Kind::Reported
    );
}
