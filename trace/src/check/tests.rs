//! Each kind of violation, planted in a run that is clean without it.

use nalgebra::Vector2;

use super::checker::Checker;
use super::report::{Kind, Who};
use super::story::{Story, TICK_NS, empty, scene};
use crate::reader::Close;
use crate::record::{
    BodyKind, Gap, Happening, Instant, Mark, Order, Outcome, Place, SceneRecord, TaskInstant,
};

const ROBOT: Who = Who::Robot(0);
const OBJECT: Who = Who::Object(0);

fn seconds(time_ns: u64) -> f64 {
    time_ns as f64 / 1e9
}

fn assert_near(time_ns: u64, expected_s: f64) {
    assert!(
        (seconds(time_ns) - expected_s).abs() < 1e-4,
        "{} s, not {expected_s} s",
        seconds(time_ns)
    );
}

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

#[test]
fn robots_collide_with_robots() {
    // Robot 0 drives through robot 1 at (3, 1): sides meet 1.5 m on, after 3 s.
    let violation = Story::new(scene()).go(0, None, 5.0, 1.0).violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::Collision, &[ROBOT, Who::Robot(1)][..])
    );
    assert_near(violation.time_ns, 3.0);
}

#[test]
fn collisions_are_exact_in_time() {
    // Nose to tail at full speed they touch all the way; a hundredth of a second later they do not.
    let follow = |gap_m: f64, wait_s: f64| {
        let mut story = Story::new(scene());
        story.scene.homes[1] = Place::new(1.5 + gap_m, 1.0);
        story.robots[1] = Vector2::new(1.5 + gap_m, 1.0);
        story
            .moves(BodyKind::Robot, 0, Vector2::new(3.0, 0.0), 6.0)
            .wait_s(wait_s)
            .moves(BodyKind::Robot, 1, Vector2::new(3.0, 0.0), 6.0)
            .wait_s(6.0)
    };
    assert_eq!(follow(0.0, 0.0).kinds(), []);
    assert_eq!(follow(0.005, 0.01).kinds(), []);
    let violation = follow(0.0, 0.01).violation();
    assert_eq!(violation.kind, Kind::Collision);
    assert_near(violation.time_ns, 0.0);

    // Two that cross each other's line, one long after the other.
    let cross = |wait_s: f64| {
        let mut story = Story::new(scene());
        story.scene.homes[1] = Place::new(3.0, 3.0);
        story.robots[1] = Vector2::new(3.0, 3.0);
        story
            .moves(BodyKind::Robot, 0, Vector2::new(4.0, 0.0), 8.0)
            .wait_s(wait_s)
            .moves(BodyKind::Robot, 1, Vector2::new(0.0, -2.5), 5.0)
            .wait_s(8.0)
    };
    assert_eq!(cross(3.0).kinds(), []);
    let violation = cross(0.0).violation();
    assert_eq!(violation.kind, Kind::Collision);
    assert_near(violation.time_ns, 3.0 + 0.0);
}

#[test]
fn robots_collide_with_objects_and_objects_with_each_other() {
    let violation = Story::new(scene())
        .go(0, None, 1.0, 2.0)
        .go(0, None, 1.7, 2.0)
        .violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::Collision, &[ROBOT, OBJECT][..])
    );

    let mut cluttered = scene();
    cluttered.objects[2].start = Place::new(4.0, 2.0);
    let violation = Story::fetched(cluttered)
        .go(0, Some(0), 6.0, 1.55)
        .violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::Collision, &[OBJECT, Who::Object(2)][..])
    );
    assert_near(violation.time_ns, 3.1 + 1.6 / 0.5);
}

#[test]
fn bodies_collide_with_walls_and_bounds() {
    let violation = Story::new(scene())
        .go(0, None, 1.0, 6.0)
        .go(0, None, 5.0, 6.0)
        .go(0, None, 5.0, 6.8)
        .violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::Collision, &[ROBOT, Who::Wall(0)][..])
    );

    let violation = Story::new(scene()).go(0, None, 0.2, 1.0).violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::Collision, &[ROBOT, Who::Bounds][..])
    );
    assert_near(violation.time_ns, 1.5);

    let violation = Story::fetched(scene()).go(0, Some(0), 2.0, 9.4).violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::Collision, &[OBJECT, Who::Bounds][..])
    );
}

#[test]
fn an_overlap_that_lasts_is_one_violation() {
    let story = Story::new(scene())
        .go(0, None, 2.8, 1.0)
        .go(0, None, 2.9, 1.0)
        .wait_s(3.0)
        .go(0, None, 2.9, 1.1);
    assert_eq!(story.kinds(), [Kind::Collision]);
    let twice = Story::new(scene())
        .go(0, None, 2.8, 1.0)
        .go(0, None, 1.0, 1.0)
        .go(0, None, 2.8, 1.0);
    assert_eq!(twice.kinds(), [Kind::Collision; 2]);
}

#[test]
fn bodies_that_overlap_from_the_start_are_seen() {
    let mut crowded = scene();
    crowded.homes[1] = Place::new(1.3, 1.0);
    let report = Story::new(crowded).check();
    assert_eq!(report.violations[0].who, [ROBOT, Who::Robot(1)]);
}

#[test]
fn clearance() {
    let mut wide = scene();
    wide.robot.clearance_m = 0.1;
    // The own target may be touched, coming and going; the run as such keeps clear of all else.
    let mut alone = wide.clone();
    alone.homes[1] = Place::new(9.0, 1.0);
    assert_eq!(Story::clean(alone).kinds(), []);
    let violation = Story::new(wide.clone()).go(0, None, 2.45, 1.0).violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::Clearance, &[ROBOT, Who::Robot(1)][..])
    );
    let violation = Story::new(wide.clone())
        .go(0, None, 1.0, 2.0)
        .go(0, None, 1.5, 2.0)
        .violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::Clearance, &[ROBOT, OBJECT][..])
    );
    // What is carried keeps clear as well.
    let mut cluttered = wide.clone();
    cluttered.homes[1] = Place::new(9.0, 1.0);
    cluttered.objects[2].start = Place::new(4.0, 2.45);
    let violation = Story::fetched(cluttered)
        .go(0, Some(0), 6.0, 1.55)
        .violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::Clearance, &[OBJECT, Who::Object(2)][..])
    );
    // From walls and bounds too, and one step off is enough.
    let violation = Story::new(wide.clone()).go(0, None, 0.3, 1.0).violation();
    assert_eq!(
        (violation.kind, &violation.who[..]),
        (Kind::Clearance, &[ROBOT, Who::Bounds][..])
    );
    assert_eq!(Story::new(wide).go(0, None, 0.35, 1.0).kinds(), []);
}

#[test]
fn clearance_is_waived_for_the_own_target_until_it_is_left() {
    let mut wide = scene();
    wide.robot.clearance_m = 0.1;
    let near = |story: Story| story.go(0, None, 2.0, 1.0).go(0, None, 2.0, 1.5);
    let unclaimed = |story: Story| story.event(Happening::Unclaimed { robot: 0, task: 0 });
    // Without a claim it may not come near; with one that was given back on the way, it may.
    assert_eq!(
        near(Story::new(wide.clone())).violation().kind,
        Kind::Clearance
    );
    let given_back = near(unclaimed(Story::new(wide.clone()).claim(0, 0)));
    assert_eq!(given_back.kinds(), []);
    // But once it has left, it may not come back.
    let back = near(unclaimed(Story::new(wide).claim(0, 0)))
        .go(0, None, 2.0, 1.0)
        .go(0, None, 2.0, 1.5);
    assert_eq!(back.violation().kind, Kind::Clearance);
}

/// Objects 0 and 2 are lifted from below; 2 stands in the robot's way up from (2, 1).
fn low_bodies() -> SceneRecord {
    let mut low = scene();
    for object in [0, 2] {
        low.objects[object].grasp = Place::new(0.0, 0.0);
    }
    low.objects[2].start = Place::new(4.0, 4.0);
    low
}

#[test]
fn lifting_from_below_waives_the_own_target_alone() {
    let lift = |story: Story| story.go(0, None, 2.0, 1.0).go(0, None, 2.0, 2.0);
    let lifted = || lift(Story::new(low_bodies()).claim(0, 0)).grasp(0, 0);
    assert_eq!(
        lift(Story::new(low_bodies())).violation().kind,
        Kind::Collision,
        "not claimed"
    );
    // Under it, up with it, down again, away from under it.
    let brought = lifted()
        .go(0, Some(0), 6.0, 2.0)
        .release(0, 0)
        .go(0, None, 6.0, 3.0);
    assert_eq!(brought.kinds(), []);
    // Not back under it, and not under another with it.
    let back = lifted()
        .release(0, 0)
        .go(0, None, 2.0, 1.0)
        .go(0, None, 2.0, 2.0);
    assert_eq!(back.violation().kind, Kind::Collision);
    let mut on = lifted().go(0, Some(0), 4.0, 2.0);
    on.scene.robot.speed_m_per_s = 0.5;
    let under_another = on.go(0, Some(0), 4.0, 4.0);
    let violations = under_another.check().violations;
    let who: Vec<_> = violations
        .iter()
        .map(|violation| violation.who.clone())
        .collect();
    assert_eq!(
        who,
        [vec![ROBOT, Who::Object(2)], vec![OBJECT, Who::Object(2)]]
    );
}

#[test]
fn passing_under_is_for_empty_hands_and_grounded_objects() {
    let mut passable = scene();
    passable.objects[2].pass_under = true;
    passable.objects[2].start = Place::new(4.0, 1.95);
    assert_eq!(
        Story::new(passable.clone()).go(0, None, 1.0, 2.0).kinds(),
        []
    );
    let under = Story::new(passable.clone())
        .go(1, None, 4.0, 1.0)
        .go(1, None, 4.0, 3.0);
    assert_eq!(under.kinds(), []);
    // Carrying, it is an obstacle to both.
    let carrying = Story::fetched(passable.clone())
        .go(0, Some(0), 6.0, 1.55)
        .check()
        .violations;
    let who: Vec<_> = carrying
        .iter()
        .map(|violation| violation.who.clone())
        .collect();
    assert_eq!(
        who,
        [vec![ROBOT, Who::Object(2)], vec![OBJECT, Who::Object(2)]]
    );
    // And a held one is an obstacle to everybody.
    passable.objects[0].pass_under = true;
    passable.homes[1] = Place::new(4.0, 2.0);
    passable.objects[2].start = Place::new(9.0, 5.0);
    let violations = Story::fetched(passable)
        .go(0, Some(0), 4.0, 1.0)
        .check()
        .violations;
    assert!(
        violations
            .iter()
            .any(|violation| violation.who == [Who::Robot(1), OBJECT])
    );
}

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

/// The clean run with its middle missing: what lies before and after is checked, and the state
/// behind the gap is the new start.
#[test]
fn a_gap_is_bridged_by_the_next_state() {
    let told = |spoil: fn(&mut crate::reader::Span)| {
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
