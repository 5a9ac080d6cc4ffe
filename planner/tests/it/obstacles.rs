//! What is an obstacle to what.

use planner::{PathSearch, Robots, obstacles};
use scene::{Draft, ROBOT_ALONE, Scene, Vec2};
use shm_types::{Counters, Point, WorldSnapshot};

use crate::room::{Trip, checked, draft, scene_of, start};
use crate::search::run;

/// A corridor 1 m high along x, robots of 0.5 m, objects of 0.4 m.
fn corridor(homes: &[[f64; 2]], trips: &[Trip]) -> Draft {
    draft([0.0, 0.0, 8.0, 1.0], &[], homes, trips)
}

/// A leg of the first robot.
#[derive(Clone, Copy)]
enum Leg {
    Approach(usize),
    Transfer(usize),
    Home,
}

/// Whether it finds a way.
fn finds(scene: &Scene, world: &WorldSnapshot, leg: Leg, robots: Robots) -> bool {
    let view = checked(scene, world);
    let mut search = PathSearch::new(scene);
    let space = search.occupancy();
    let (units, from, to) = match leg {
        Leg::Approach(task) => (
            obstacles::block_for_approach(space, scene, view, 0, task, robots),
            obstacles::plan_from(view, 0),
            obstacles::grasp_at_rest(scene, view, task),
        ),
        Leg::Transfer(task) => (
            obstacles::block_for_transfer(space, scene, view, 0, task, robots),
            obstacles::grasp_at_rest(scene, view, task),
            obstacles::grasp_at_goal(scene, view, task).unwrap(),
        ),
        Leg::Home => (
            obstacles::block_for_home(space, scene, view, 0, robots),
            obstacles::plan_from(view, 0),
            scene.homes[0],
        ),
    };
    assert!(units >= scene::UNITS_PER_RESET);
    let mut counters = Counters::default();
    run(&mut search, scene, from, to, u64::MAX, &mut counters)
        .0
        .is_some()
}

fn finds_any(scene: &Scene, world: &WorldSnapshot, leg: Leg) -> bool {
    let with = finds(scene, world, leg, Robots::Include);
    assert!(
        !with || finds(scene, world, leg, Robots::Ignore),
        "fewer obstacles, more ways"
    );
    with
}

/// Objects on their side of the robot: grasped from the left, so that they fit the corridor.
fn from_the_left(mut draft: Draft) -> Draft {
    for object in &mut draft.objects {
        object.grasp = [-0.45, 0.0];
    }
    draft
}

#[test]
fn objects_block_both_legs_and_the_own_target_neither() {
    let trips = [
        ([4.0, 0.5], Some([7.0, 0.5])),
        ([2.0, 0.5], Some([6.0, 0.5])),
    ];
    let scene = scene_of(from_the_left(corridor(&[[0.5, 0.5]], &trips)));
    let mut world = start(&scene);
    assert!(finds_any(&scene, &world, Leg::Approach(1)));
    assert!(
        !finds_any(&scene, &world, Leg::Approach(0)),
        "behind object 1"
    );
    assert!(
        !finds_any(&scene, &world, Leg::Transfer(1)),
        "object 0 is in the way"
    );
    assert!(finds_any(&scene, &world, Leg::Transfer(0)));
    // What is carried stands nowhere.
    world.objects[1].holder = 0;
    assert!(finds_any(&scene, &world, Leg::Approach(0)));
}

#[test]
fn clearance_is_kept_from_others_but_not_from_the_target() {
    let trips = [([4.0, 0.5], Some([7.0, 0.5]))];
    let mut draft = from_the_left(corridor(&[[0.5, 0.5]], &trips));
    draft.robot.clearance_m = 0.2;
    let scene = scene_of(draft);
    let mut world = start(&scene);
    assert!(
        finds_any(&scene, &world, Leg::Approach(0)),
        "its grasp touches it"
    );
    // Once put down it may be left, although it is closer than the clearance.
    world.robots[0].position = scene::point(scene.grasp_at(0, scene.objects[0].start));
    assert!(finds_any(&scene, &world, Leg::Home));
    // From a place further away the clearance counts again: here it fills the corridor.
    world.robots[0].position = Point::new(5.5, 0.5);
    assert!(!finds_any(&scene, &world, Leg::Home));
}

#[test]
fn a_passage_is_as_wide_as_the_clearance_leaves_it() {
    // Between the object and the wall 0.6 m are left.
    let trips = [
        ([4.0, 0.8], Some([4.0, 0.8])),
        ([6.0, 0.5], Some([7.0, 0.5])),
    ];
    for (clearance_m, passes) in [(0.0, true), (0.05, true), (0.06, false)] {
        let mut draft = from_the_left(corridor(&[[0.5, 0.5]], &trips));
        draft.robot.clearance_m = clearance_m;
        let scene = scene_of(draft);
        let leg = Leg::Approach(1);
        assert_eq!(
            finds_any(&scene, &start(&scene), leg),
            passes,
            "{clearance_m}"
        );
    }
}

#[test]
fn empty_robots_pass_under_what_allows_it_and_loaded_ones_do_not() {
    let trips = [
        ([4.0, 0.5], Some([7.0, 0.5])),
        ([2.0, 0.5], Some([6.0, 0.5])),
    ];
    for pass_under in [true, false] {
        let mut draft = corridor(&[[0.5, 0.5]], &trips);
        for object in &mut draft.objects {
            object.grasp = [0.0, 0.0];
            object.pass_under = pass_under;
        }
        let scene = scene_of(draft);
        let mut world = start(&scene);
        assert!(
            finds_any(&scene, &world, Leg::Approach(1)),
            "lifted from below"
        );
        assert_eq!(finds_any(&scene, &world, Leg::Approach(0)), pass_under);
        assert!(
            !finds_any(&scene, &world, Leg::Transfer(1)),
            "object 0 is in the way"
        );
        // A robot that stands under what it has put down gets out, and home.
        world.robots[0].position = world.objects[1].position;
        assert!(finds_any(&scene, &world, Leg::Home));
        assert!(finds_any(&scene, &world, Leg::Approach(0)));
        world.robots[0].position = Point::new(7.0, 0.5);
        assert_eq!(finds_any(&scene, &world, Leg::Home), pass_under);
    }
}

#[test]
fn robots_block_where_they_stand_and_where_they_may_go() {
    let trips = [
        ([5.0, 0.5], Some([7.0, 0.5])),
        ([0.3, 0.7], Some([0.3, 0.7])),
    ];
    let mut draft = from_the_left(corridor(&[[1.5, 0.5], [3.0, 0.3]], &trips));
    draft.bounds[3] = 1.4;
    let scene = scene_of(draft);
    let mut world = start(&scene);
    assert!(finds_any(&scene, &world, Leg::Approach(0)), "past robot 1");
    world.robots[1].grant[0] = Point::new(3.0, 1.1);
    world.robots[1].grant_count = 1;
    assert!(!finds_any(&scene, &world, Leg::Approach(0)));
    assert!(finds(&scene, &world, Leg::Approach(0), Robots::Ignore));
    // With what it holds: object 1, to the right of the robot's centre and up to y = 0.5.
    world.robots[1].grant_count = 0;
    assert!(finds_any(&scene, &world, Leg::Approach(0)));
    world.robots[1].holding = 1;
    world.objects[1].holder = 1;
    world.robots[1].position = Point::new(3.0, 0.7);
    world.objects[1].position = Point::new(3.45, 0.7);
    assert!(!finds_any(&scene, &world, Leg::Approach(0)));
}

#[test]
fn plans_begin_where_the_grant_ends() {
    let scene = scene_of(corridor(&[[0.5, 0.5]], &[]));
    let mut world = start(&scene);
    let view = checked(&scene, &world);
    assert_eq!(obstacles::plan_from(view, 0), Vec2::new(0.5, 0.5));
    world.robots[0].grant[..2].copy_from_slice(&[Point::new(1.0, 0.5), Point::new(1.0, 0.7)]);
    world.robots[0].grant_count = 2;
    let view = checked(&scene, &world);
    assert_eq!(obstacles::plan_from(view, 0), Vec2::new(1.0, 0.7));
    let mut search = PathSearch::new(&scene);
    obstacles::block_for_home(search.occupancy(), &scene, view, 0, Robots::Include);
    assert!(
        search.occupancy().at_is_free(&scene, Vec2::new(1.0, 0.6)),
        "its own grant is free"
    );
    assert_eq!(search.occupancy().class(), ROBOT_ALONE);
}
