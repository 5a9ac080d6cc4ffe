//! Canonical text, hash, schema and generator.

use proptest::prelude::*;
use scene::{
    Connectivity, Draft, Event, GenerateError, GenerateOptions, ObjectDraft, Scene, ShapeDraft,
    UserOrder, WallDraft, check_certificate, generate, json_schema, parse, to_canonical_toml,
};

fn shape() -> impl Strategy<Value = ShapeDraft> {
    prop_oneof![
        (0.1..0.9f64, 0.1..0.9f64).prop_map(|(x, y)| ShapeDraft::Box([x, y])),
        (0.1..0.5f64).prop_map(ShapeDraft::Circle),
        (0.1..0.4f64).prop_map(|r| ShapeDraft::Polygon(vec![[r, -r], [0.0, r], [-r, -r]])),
    ]
}

/// Drafts with every kind of entry; objects and homes stand on a loose grid, so most are sound.
fn draft() -> impl Strategy<Value = Draft> {
    let object = (shape(), -1.0..1.0f64, any::<bool>(), any::<bool>());
    (
        "[ -~é]{1,20}",
        prop_oneof![Just(0.1), 0.05..0.1f64],
        prop_oneof![Just(Connectivity::Four), Just(Connectivity::Eight)],
        (shape(), 0.1..5.0f64, 0.0..0.2f64, 0.0..3.0f64),
        prop::collection::vec(object, 1..5),
        prop::collection::vec((0.0..9.0f64, 0.1..0.4f64), 0..4),
    )
        .prop_map(
            |(name, resolution_m, connectivity, robot, objects, walls)| {
                let mut draft = Draft::room(&name, [-2.0, -1.0, 12.0, 9.0]);
                draft.resolution_m = resolution_m;
                draft.connectivity = connectivity;
                (draft.robot.shape, draft.robot.speed_m_per_s) = (robot.0, robot.1);
                (draft.robot.clearance_m, draft.robot.grasp_s) = (robot.2, robot.3);
                draft.homes = vec![[0.0, 0.5], [1.5, 0.5]];
                for (i, (shape, grasp, pass_under, has_goal)) in objects.into_iter().enumerate() {
                    let x = 1.5 * i as f64;
                    draft.objects.push(ObjectDraft {
                        shape,
                        grasp: [grasp, -0.0],
                        other_grasps: vec![[grasp, 0.75]; usize::from(has_goal)],
                        pass_under,
                        kind: has_goal.then(|| format!("no. \"{i}\"")),
                        start: [x, 3.0],
                        goal: (has_goal || i == 0).then_some([x + 0.1, 5.0]),
                    });
                }
                draft.walls = walls
                    .into_iter()
                    .map(|(x, size)| WallDraft::Box([x, 7.0, x + size, 7.0 + size]))
                    .chain([WallDraft::Polygon(vec![
                        [10.0, 8.0],
                        [11.0, 8.1],
                        [10.3, 8.9],
                    ])])
                    .collect();
                draft.before = vec![UserOrder {
                    first: (0, Event::Grasp),
                    then: (0, Event::Finish),
                }];
                draft
            },
        )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn the_canonical_text_reads_back_as_the_same_scene(draft in draft()) {
        let made = Scene::new(draft);
        prop_assume!(made.is_ok());
        let made = made.unwrap();
        let text = to_canonical_toml(&made);
        let read = parse(&text, "canonical").map_err(|error| TestCaseError::fail(error.plain()))?;
        prop_assert_eq!(to_canonical_toml(&read), text);
        prop_assert_eq!(read.hash, made.hash);
        prop_assert_eq!(read.lattice.len(), made.lattice.len());
        prop_assert_eq!(read.lattice.origin, made.lattice.origin);
        // Fewer robots make another scenario, which reads back as itself too.
        let fewer = made.with_robots(1).unwrap();
        prop_assert_ne!(fewer.hash, made.hash);
        prop_assert_eq!(fewer.homes.len(), 1);
        prop_assert_eq!(parse(&to_canonical_toml(&fewer), "fewer").unwrap().hash, fewer.hash);
    }
}

#[test]
fn spelling_does_not_change_the_hash_but_meaning_does() {
    let text = scene::builtin("e1").unwrap().text;
    let hash = parse(text, "e1").unwrap().hash;
    let respelt = text
        .replace("grasp = [0.0, -0.45]", "grasp = [-0, -4.5e-1]")
        .replace("bounds = [0.0, 0.0, 6.0, 4.0]", "bounds = [0, 0, 6, 4]")
        .replace("speed = 0.5", "speed = 0.50\nclearance = 0");
    assert_eq!(parse(&respelt, "e1").unwrap().hash, hash);
    let moved = text.replace("goal = [5.0, 1.0]", "goal = [5.0, 1.05]");
    assert_ne!(parse(&moved, "e1").unwrap().hash, hash);
    let no_grasp = text.replace("grasp = [0.0, -0.45]\n", "");
    assert_eq!(
        parse(&no_grasp, "e1").unwrap().hash,
        hash,
        "the default grasp is another"
    );
}

#[test]
fn the_schema_describes_every_key() {
    let schema: serde_json::Value = serde_json::from_str(&json_schema()).unwrap();
    let keys = |path: &str| -> Vec<String> {
        let object = schema.pointer(path).unwrap_or_else(|| panic!("no {path}"));
        object.as_object().unwrap().keys().cloned().collect()
    };
    assert_eq!(
        keys("/properties"),
        [
            "before",
            "certificate",
            "connectivity",
            "name",
            "object",
            "objects",
            "resolution",
            "robot",
            "robots",
            "workspace"
        ]
    );
    assert_eq!(
        keys("/$defs/RobotTable/properties"),
        ["clearance", "grasp_s", "release_s", "shape", "speed"]
    );
    assert_eq!(schema["additionalProperties"], false);
    assert_eq!(
        schema["required"],
        serde_json::json!(["name", "robot", "workspace"])
    );
}

#[test]
fn every_generated_scenario_reads_back_and_its_certificate_checks() {
    for seed in 0..6 {
        let options = GenerateOptions {
            seed,
            objects: 3 + seed as usize % 4,
            robots: 1 + seed as usize % 4,
            area_m2: [17.0, 24.5, 41.5][seed as usize % 3],
            walls: 2 + seed as usize % 3,
            crowding: 0.2 * seed as f64 % 1.0,
            extra_moves: 2 * (seed as usize % 2),
        };
        let generated = generate(&options).unwrap();
        assert_eq!(generate(&options).unwrap().text, generated.text);
        let scene = parse(&generated.text, "generated").unwrap_or_else(|e| panic!("{}", e.plain()));
        assert_eq!(scene.hash, generated.scene.hash);
        assert_eq!(scene.certificate, generated.certificate);
        assert_eq!(check_certificate(&scene, &scene.certificate), Ok(()));
        assert_eq!(
            (scene.objects.len(), scene.homes.len()),
            (options.objects, options.robots)
        );
        assert!(scene.lattice.exact && scene.lattice.pitch_m <= 0.05 + 1e-12);
        assert_eq!(scene::certificate(&scene), None);
        // One move short, or one object twice over, solves nothing.
        let short = &scene.certificate[1..];
        assert!(check_certificate(&scene, short).is_err(), "seed {seed}");
        if options.extra_moves == 0 {
            assert_eq!(scene.certificate.len(), options.objects);
        }
    }
}

#[test]
fn other_seeds_make_other_rooms() {
    let room = |seed| {
        let options = GenerateOptions {
            seed,
            objects: 2,
            robots: 1,
            ..Default::default()
        };
        generate(&options).unwrap().scene.draft().walls.clone()
    };
    assert_ne!(room(1), room(2));
}

#[test]
fn options_out_of_range_are_refused_and_impossible_ones_given_up() {
    let refused = |change: fn(&mut GenerateOptions)| {
        let mut options = GenerateOptions::default();
        change(&mut options);
        generate(&options).unwrap_err().to_string()
    };
    for (said, expected) in [
        (
            refused(|o| o.objects = 0),
            "the number of objects is 0, but must be from 1 to 1024",
        ),
        (
            refused(|o| o.robots = 129),
            "the number of robots is 129, but must be from 1 to 128",
        ),
        (
            refused(|o| o.area_m2 = f64::NAN),
            "the area is NaN m², but must be from 1 to 10000 m²",
        ),
        (
            refused(|o| o.area_m2 = 17.001),
            "must be a multiple of 0.0025 m²",
        ),
        (
            refused(|o| o.crowding = 1.5),
            "the crowding is 1.5, but must be from 0 to 1",
        ),
    ] {
        assert!(said.contains(expected), "{said}");
    }
    let crammed = GenerateOptions {
        objects: 60,
        area_m2: 17.0,
        ..Default::default()
    };
    assert!(matches!(
        generate(&crammed),
        Err(GenerateError::GaveUp { .. })
    ));
}
