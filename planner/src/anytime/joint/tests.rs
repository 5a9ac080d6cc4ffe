//! The complete search in rooms drawn by hand.

use scene::Settings;

use super::*;
use crate::anytime::situation::Situation;
use crate::anytime::solver::testing::cells;

/// What came of a search, and how many configurations it saw.
fn search(scene: &Scene) -> (Found, usize) {
    let mut ground = Ground::new(scene, &Settings::default(), Vec::new());
    let start = Start::new(scene, &ground, &Situation::at_start(scene)).unwrap();
    let goals: Vec<_> = (scene.objects.iter().enumerate())
        .map(|(object, spec)| Some(Place::of(scene, &ground, object, spec.goal?)))
        .collect();
    let homes: Vec<u32> = start.robots.iter().map(|track| track.start).collect();
    let mut joint = Joint::new(scene, &mut ground, &start, &homes, &goals).unwrap();
    loop {
        match joint.advance(&ground, 100) {
            Found::Open => {}
            found => return (found, joint.seen()),
        }
    }
}

/// Holds moves against the rules of unit cells: nobody in a wall, in another robot, or with an
/// object where another stands; every object at its goal and every robot at home in the end.
fn assert_solved_by(scene: &Scene, moves: &[(usize, JointMove)]) {
    let cell = |at: scene::Vec2| ((at.x - 0.5).round() as i32, (at.y - 0.5).round() as i32);
    let walls = &scene.draft().walls;
    let is_wall = |(x, y): (i32, i32)| {
        walls.iter().any(|wall| match wall {
            scene::WallDraft::Box([x0, y0, ..]) => (x0.round() as i32, y0.round() as i32) == (x, y),
            scene::WallDraft::Polygon(_) => false,
        })
    };
    let homes: Vec<_> = scene.homes.iter().map(|&home| cell(home)).collect();
    let mut robots: Vec<_> = homes.iter().map(|&home| (home, None)).collect();
    let mut objects: Vec<_> = (scene.objects.iter())
        .map(|object| cell(object.start))
        .collect();
    for &(robot, made) in moves {
        let (at, held) = &mut robots[robot];
        match made {
            JointMove::Step(direction) => {
                let (dx, dy) = crate::search::DIRECTIONS[usize::from(direction)];
                *at = (at.0 + dx, at.1 + dy);
                if let Some(object) = *held {
                    objects[object] = *at;
                }
            }
            JointMove::Grasp(object) => {
                assert_eq!((*held, objects[usize::from(object)]), (None, *at));
                *held = Some(usize::from(object));
            }
            JointMove::Release(object) => assert_eq!(held.take(), Some(usize::from(object))),
        }
        let (at, held) = robots[robot];
        assert!(!is_wall(at), "{made:?}");
        let is_met = |other: usize| other != robot && robots[other].0 == at;
        assert!(!(0..robots.len()).any(is_met), "{made:?}");
        let is_there = |object: usize| Some(object) != held && objects[object] == at;
        assert!(
            held.is_none() || !(0..objects.len()).any(is_there),
            "{made:?}"
        );
    }
    let goals = scene.objects.iter().filter_map(|object| object.goal);
    assert!(objects.into_iter().eq(goals.map(cell)));
    assert!(
        robots
            .into_iter()
            .eq(homes.into_iter().map(|home| (home, None)))
    );
}

#[test]
fn what_it_finds_can_be_carried_out_move_by_move() {
    for rows in [
        &["A.a.1"][..],
        &["1.A.B.a", "##.####"],
        &["A1a2b", "....."],
        &["A2a...B", "..#b#..", "..#1#.."],
        &["Bb.1", "A.#.", "2a.C"],
    ] {
        let scene = cells(rows);
        let (Found::Plan(moves), _) = search(&scene) else {
            panic!("{rows:?} has a plan");
        };
        assert_solved_by(&scene, &moves);
    }
}

/// Steps are smaller than bodies: on its way under the object a robot is in its room for several.
#[test]
fn who_comes_for_an_object_from_below_may_go_on_in_its_room() {
    let mut draft = cells(&["A.b.2", "a1..."]).draft().clone();
    draft.objects[1].pass_under = false;
    draft.objects[1].start[0] += 0.5;
    let scene = Scene::new(draft).unwrap();
    assert!(scene.lattice.pitch_m <= 0.5 && scene.lifts_from_below(1));
    assert!(matches!(search(&scene).0, Found::Plan(_)));
}

#[test]
fn where_there_is_no_plan_it_comes_to_an_end() {
    // Two objects that would have to change places, and one shut off.
    for rows in [["Aab21"], ["Aa#.1"]] {
        let (found, _) = search(&cells(&rows));
        assert!(matches!(found, Found::Exhausted), "{rows:?}");
    }
}

/// Nothing is in the way, so every step that is nearer is right: no more is looked at than the
/// way, and what lies beside it.
#[test]
fn it_goes_straight_to_where_something_is_to_be_done_and_home_again() {
    const FREE: &str = ".........................";
    let rows = [
        "A.......................a",
        FREE,
        FREE,
        FREE,
        FREE,
        FREE,
        FREE,
        FREE,
        FREE,
        FREE,
        FREE,
        "........................1",
    ];
    let (found, seen) = search(&cells(&rows));
    let Found::Plan(moves) = found else {
        panic!("there is a plan");
    };
    // 24 there, 11 with the object, both back, 2 grips.
    let least = 24 + 11 + (24 + 11) + 2;
    assert_eq!(moves.len(), least);
    // From each at most four steps and a grip lead on.
    assert!(seen <= 1 + 5 * least, "{seen}");
}
