//! Each small shipped scenario is what its comment says: the constraints it isolates, and no
//! other, worked out here by the letter of rules 9 and 10 and nothing else. The rooms of the
//! paper's sizes are held to their comments where whole runs are tested.

use scene::{
    BUILTIN, Body, Builtin, Flood, Infeasible, Occupancy, Scene, Vec2, builtin, certificate,
    check_certificate,
};

/// Kind, first task, second task: "E1 between 0 and 1" is `("E1", 0, 1)`.
type Found = (&'static str, usize, usize);

fn load(name: &str) -> Scene {
    let text = builtin(name).expect("a shipped scenario").text;
    scene::parse(text, name).unwrap_or_else(|error| panic!("{}", error.plain()))
}

/// Rule 9, for every ordered pair.
fn easy(scene: &Scene) -> Vec<Found> {
    let mut found = Vec::new();
    for (one, first) in scene.objects.iter().enumerate() {
        for (two, second) in scene.objects.iter().enumerate() {
            if one == two {
                continue;
            }
            let body: &Body = scene.body(second.class);
            let meets = |first_at: Vec2, second_at: Vec2| {
                body.overlaps(scene.grasp_at(two, second_at), true, &first.shape, first_at)
            };
            let (first_goal, second_goal) = (first.goal.unwrap(), second.goal.unwrap());
            for (kind, first_at, second_at) in [
                ("E1", first.start, second.start),
                ("E2", first_goal, second.start),
                ("E3", first.start, second_goal),
                ("E4", first_goal, second_goal),
            ] {
                if meets(first_at, second_at) {
                    found.push((kind, one, two));
                }
            }
        }
    }
    found
}

/// Whether `object` can be carried to its goal with these others standing around.
fn transfers(scene: &Scene, object: usize, others: &[(usize, Vec2)]) -> bool {
    let spec = &scene.objects[object];
    let mut space = Occupancy::new(scene);
    space.reset(scene, spec.class);
    for (other, at) in others {
        space.block(scene, &scene.objects[*other].shape, *at, true);
    }
    let mut flood = Flood::new(scene);
    flood.run(scene, &space, scene.grasp_at(object, spec.start));
    flood.reached_at(scene, &space, scene.grasp_at(object, spec.goal.unwrap()))
}

/// The hard constraints of §III.B.2 that no easy one of the same pair and placement implies.
fn hard(scene: &Scene) -> Vec<Found> {
    let easy = easy(scene);
    let mut found = Vec::new();
    for (one, first) in scene.objects.iter().enumerate() {
        for two in (0..scene.objects.len()).filter(|two| *two != one) {
            for (kind, at, implied) in [
                ("H1", first.start, ["E1", "E3"]),
                ("H2", first.goal.unwrap(), ["E2", "E4"]),
            ] {
                let known = implied.iter().any(|kind| easy.contains(&(kind, one, two)));
                if !known && !transfers(scene, two, &[(one, at)]) {
                    found.push((kind, one, two));
                }
            }
        }
    }
    found
}

#[test]
fn each_isolates_its_constraint() {
    let none: &[Found] = &[];
    let swap: &[Found] = &[("E2", 0, 1), ("E3", 0, 1), ("E2", 1, 0), ("E3", 1, 0)];
    let table: &[(&str, &[Found], &[Found])] = &[
        ("e1", &[("E1", 0, 1)], none),
        ("e2", &[("E2", 0, 1)], none),
        ("e3", &[("E3", 0, 1)], none),
        ("e4", &[("E4", 0, 1)], none),
        ("h1", none, &[("H1", 0, 1)]),
        ("h2", none, &[("H2", 0, 1)]),
        ("blocked-approach", none, none),
        ("blocked-return", none, none),
        ("swap", swap, none),
        ("joint-blockers", none, none),
        ("head-on-corridor", none, none),
        ("lift-from-below", none, &[("H1", 0, 1)]),
        ("infeasible-e1-cycle", &[("E1", 0, 1), ("E1", 1, 0)], none),
        ("infeasible-e4-cycle", &[("E4", 0, 1), ("E4", 1, 0)], none),
    ];
    for (name, expected_easy, expected_hard) in table {
        let scene = load(name);
        assert_eq!(easy(&scene), *expected_easy, "{name}");
        assert_eq!(hard(&scene), *expected_hard, "{name}");
        assert_eq!(certificate(&scene), None, "{name}");
    }
}

#[test]
fn those_that_can_be_solved_carry_moves_that_do() {
    let small = |scenario: &&Builtin| !scenario.name.starts_with("paper-");
    for scenario in BUILTIN.iter().filter(small) {
        let scene = load(scenario.name);
        let solvable =
            !scenario.name.starts_with("infeasible") && scenario.name != "unreachable-goal";
        assert_eq!(!scene.certificate.is_empty(), solvable, "{}", scenario.name);
        if solvable {
            let checked = check_certificate(&scene, &scene.certificate);
            assert_eq!(checked, Ok(()), "{}", scenario.name);
        }
    }
}

#[test]
fn joint_blockers_block_together_only() {
    let scene = load("joint-blockers");
    let at = |object: usize| (object, scene.objects[object].start);
    assert!(transfers(&scene, 2, &[at(0)]));
    assert!(transfers(&scene, 2, &[at(1)]));
    assert!(!transfers(&scene, 2, &[at(0), at(1)]));
}

#[test]
fn the_order_matters_where_approach_or_return_is_blocked() {
    for name in ["blocked-approach", "blocked-return"] {
        let scene = load(name);
        let mut other_way = scene.certificate.clone();
        other_way.reverse();
        assert!(check_certificate(&scene, &other_way).is_err(), "{name}");
    }
}

#[test]
fn a_doorway_too_narrow_by_a_hand_is_proved_so() {
    let scene = load("unreachable-goal");
    let found = certificate(&scene).expect("no certificate");
    assert_eq!(
        found,
        Infeasible::Transfer {
            object: 0,
            exact: true
        }
    );
    assert!(
        found.to_string().contains("object 0 cannot be carried"),
        "{found}"
    );
}

#[test]
fn a_robot_under_its_object_is_told_from_one_beside_it() {
    assert!(load("lift-from-below").lifts_from_below(0));
    assert!(!load("e1").lifts_from_below(0));
}
