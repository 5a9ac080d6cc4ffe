//! Who touches whom: collisions, clearance, and what is exempt.

use nalgebra::Vector2;

use super::story::{Story, scene};
use super::{OBJECT, ROBOT};
use crate::check::report::{Kind, Who};
use crate::record::{BodyKind, Happening, Place, SceneRecord};

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
