//! What people are told about bad scenarios: each mistake its own message, with line and key.

use miette::Diagnostic;
use scene::{Draft, ObjectDraft, Scene, parse};

/// A sound scenario; the tests below break one thing each. Line numbers count from its first line.
const SOUND: &str = r#"name = "room"
resolution = 0.1
connectivity = 8
[robot]
shape = { box = [0.5, 0.5] }
speed = 0.5
clearance = 0.0
[object]
shape = { box = [0.4, 0.4] }
grasp = [0.0, -0.45]
[workspace]
bounds = [0.0, 0.0, 6.0, 4.0]
walls = [ { box = [2.9, 0.0, 3.0, 2.0] } ]
[[robots]]
home = [0.5, 0.5]
[[robots]]
home = [0.5, 3.5]
[[objects]]
start = [2.0, 1.0]
goal = [5.0, 1.0]
[[objects]]
start = [2.0, 3.0]
goal = [5.0, 3.0]
[[before]]
first = "0.finish"
then = "1.grasp"
"#;

/// All lines a broken scenario is reported with.
fn report(find: &str, replace: &str) -> String {
    assert!(SOUND.contains(find), "{find} is not in the sound scenario");
    report_of(&SOUND.replacen(find, replace, 1))
}

fn report_of(text: &str) -> String {
    match parse(text, "room.toml") {
        Ok(_) => panic!("accepted:\n{text}"),
        Err(error) => error.plain(),
    }
}

#[test]
fn the_sound_scenario_is_sound() {
    let scene = parse(SOUND, "room.toml").unwrap();
    assert_eq!((scene.homes.len(), scene.objects.len()), (2, 2));
}

#[test]
fn each_mistake_has_its_own_message() {
    // What is replaced, by what; the line and key that are named, and what is said.
    let table = [
        // Structure.
        (
            "speed = 0.5",
            "sped = 0.5",
            "room.toml:6",
            "unknown key `sped`",
        ),
        (
            "speed = 0.5",
            "speed = \"fast\"",
            "room.toml:6",
            "robot.speed: invalid type: string \"fast\"",
        ),
        ("speed = 0.5", "", "room.toml:4", "missing key `speed`"),
        (
            "name = \"room\"",
            "name = room",
            "room.toml:1",
            "string values must be quoted",
        ),
        (
            "{ box = [0.5, 0.5] }",
            "{ bax = [0.5, 0.5] }",
            "room.toml:5",
            "unknown kind `bax`",
        ),
        (
            "[0.5, 0.5] }",
            "[0.5, 0.5, 0.5] }",
            "room.toml:5",
            "robot.shape: takes 2 numbers, but 3 are given",
        ),
        (
            "home = [0.5, 3.5]",
            "home = [0.5]",
            "room.toml:17",
            "robots.home: takes 2 numbers, but 1 is given",
        ),
        (
            "connectivity = 8",
            "connectivity = 6",
            "room.toml:3: connectivity",
            "6 steps from a cell are not supported",
        ),
        (
            "[object]\nshape = { box = [0.4, 0.4] }",
            "[object]",
            "objects[0].shape",
            "has no shape",
        ),
        // Numbers.
        (
            "speed = 0.5",
            "speed = 0.0",
            "room.toml:6: robot.speed",
            "robots have to move",
        ),
        (
            "speed = 0.5",
            "speed = nan",
            "room.toml:6: robot.speed",
            "is not a finite number",
        ),
        (
            "speed = 0.5",
            "speed = 1e9",
            "room.toml:6: robot.speed",
            "must be from 0 to 1000 m/s",
        ),
        (
            "clearance = 0.0",
            "clearance = -0.1",
            "room.toml:7: robot.clearance",
            "must be from 0 to 10 m",
        ),
        (
            "clearance = 0.0",
            "grasp_s = inf",
            "room.toml:7: robot.grasp_s",
            "is not a finite number",
        ),
        (
            "clearance = 0.0",
            "release_s = -1",
            "room.toml:7: robot.release_s",
            "must be from 0 to 86400 s",
        ),
        (
            "start = [2.0, 1.0]",
            "start = [nan, 1.0]",
            "room.toml:19: objects[0].start",
            "is not a point of finite numbers",
        ),
        (
            "start = [2.0, 1.0]",
            "start = [2e7, 1.0]",
            "room.toml:19: objects[0].start",
            "more than 100000 m from the origin",
        ),
        (
            "goal = [5.0, 3.0]",
            "goal = [5.0, inf]",
            "room.toml:23: objects[1].goal",
            "is not a point of finite numbers",
        ),
        (
            "home = [0.5, 3.5]",
            "home = [-inf, 3.5]",
            "room.toml:17: robots[1].home",
            "is not a point of finite numbers",
        ),
        (
            "grasp = [0.0, -0.45]",
            "grasp = [0.0, nan]",
            "room.toml:10: objects[0].grasp",
            "is not a point of finite numbers",
        ),
        (
            "bounds = [0.0, 0.0, 6.0, 4.0]",
            "bounds = [0.0, 0.0, 6.0, nan]",
            "room.toml:12: workspace.bounds",
            "not a point of finite numbers",
        ),
        (
            "name = \"room\"",
            "name = \"\"",
            "room.toml:1: name",
            "1 to 128 bytes",
        ),
        // Resolution.
        (
            "resolution = 0.1",
            "resolution = 0",
            "room.toml:2: resolution",
            "a cell has a size",
        ),
        (
            "resolution = 0.1",
            "resolution = inf",
            "room.toml:2: resolution",
            "is not a finite number",
        ),
        (
            "resolution = 0.1",
            "resolution = 0.0001",
            "room.toml:2: resolution",
            "2400000000 in these bounds; 4000000 are the most",
        ),
        (
            "resolution = 0.1",
            "resolution = 0.45",
            "room.toml:2: resolution",
            "wider than the narrowest body (0.4 m)",
        ),
        // Shapes.
        (
            "{ box = [0.5, 0.5] }",
            "{ box = [0.0, 0.5] }",
            "room.toml:5: robot.shape",
            "is 0 m wide",
        ),
        (
            "{ box = [0.5, 0.5] }",
            "{ circle = -1 }",
            "room.toml:5: robot.shape",
            "is -2 m wide",
        ),
        (
            "{ box = [0.4, 0.4] }",
            "{ box = [0.4, nan] }",
            "room.toml:9: objects[0].shape",
            "not a finite number",
        ),
        (
            "{ box = [0.4, 0.4] }",
            "{ polygon = [] }",
            "room.toml:9: objects[0].shape",
            "polygon with 0 corners",
        ),
        (
            "{ box = [0.4, 0.4] }",
            "{ polygon = [[-0.2, -0.2], [0.2, -0.2], [0.0, 0.0], [0.2, 0.2], [-0.2, 0.2]] }",
            "room.toml:9: objects[0].shape",
            "not convex at corner 2",
        ),
        (
            "{ box = [0.4, 0.4] }",
            "{ polygon = [[1.0, 0.0], [2.0, 0.0], [1.0, 1.0]] }",
            "room.toml:9: objects[0].shape",
            "[0, 0] is not inside it",
        ),
        (
            "{ box = [2.9, 0.0, 3.0, 2.0] }",
            "{ box = [3.0, 0.0, 3.0, 2.0] }",
            "room.toml:13: workspace.walls[0]",
            "is 0 m wide",
        ),
        (
            "{ box = [2.9, 0.0, 3.0, 2.0] }",
            "{ polygon = [[3, 0], [4, 0]] }",
            "room.toml:13: workspace.walls[0]",
            "polygon with 2 corners",
        ),
        (
            "bounds = [0.0, 0.0, 6.0, 4.0]",
            "bounds = [6.0, 0.0, 0.0, 4.0]",
            "room.toml:12: workspace.bounds",
            "is -6 m wide",
        ),
        // Overlaps.
        (
            "start = [2.0, 3.0]",
            "start = [2.0, 1.3]",
            "room.toml:22: objects[1].start",
            "this and objects[0].start overlap at the start",
        ),
        (
            "start = [2.0, 3.0]",
            "start = [2.0, 1.0]",
            "room.toml:22: objects[1].start",
            "(they are the same place)",
        ),
        (
            "start = [2.0, 1.0]",
            "start = [2.8, 1.0]",
            "room.toml:19: objects[0].start",
            "the object stands in wall 0",
        ),
        (
            "start = [2.0, 1.0]",
            "start = [0.1, 2.0]",
            "room.toml:19: objects[0].start",
            "partly or wholly outside the bounds",
        ),
        (
            "goal = [5.0, 1.0]",
            "goal = [2.95, 1.9]",
            "room.toml:20: objects[0].goal",
            "the goal lies in wall 0",
        ),
        (
            "goal = [5.0, 1.0]",
            "goal = [5.0, 40.0]",
            "room.toml:20: objects[0].goal",
            "the goal lies partly or wholly outside the bounds",
        ),
        (
            "goal = [5.0, 3.0]",
            "goal = [5.0, 1.35]",
            "room.toml:23: objects[1].goal",
            "this and objects[0].goal have overlapping goals",
        ),
        (
            "home = [0.5, 0.5]",
            "home = [2.8, 0.5]",
            "room.toml:15: robots[0].home",
            "the home lies in wall 0",
        ),
        (
            "home = [0.5, 3.5]",
            "home = [0.5, 0.9]",
            "room.toml:17: robots[1].home",
            "this and robots[0].home are blocked by one another",
        ),
        (
            "home = [0.5, 3.5]",
            "home = [2.0, 2.6]",
            "room.toml:17: robots[1].home",
            "the robot's home is blocked by the object",
        ),
        (
            "home = [0.5, 3.5]",
            "home = [5.0, 2.6]",
            "room.toml:17: robots[1].home",
            "the run could never be complete",
        ),
        // The user's order.
        (
            "\"0.finish\"",
            "\"7.finish\"",
            "room.toml:25: before[0].first",
            "there is no task 7",
        ),
        (
            "\"0.finish\"",
            "\"0.end\"",
            "room.toml:25: before[0].first",
            "\"0.end\" names no event of a task",
        ),
        (
            "\"1.grasp\"",
            "\"grasp\"",
            "room.toml:26: before[0].then",
            "\"grasp\" names no event of a task",
        ),
        (
            "then = \"1.grasp\"\n",
            "then = \"1.grasp\"\n[[before]]\nfirst = \"1.finish\"\nthen = \"0.start\"\n",
            "before[0].first",
            "the order contradicts itself: 0.finish before 1.grasp before 1.finish before 0.start before 0.grasp before 0.finish",
        ),
        (
            "\"1.grasp\"",
            "\"0.start\"",
            "before[0].first",
            "the order contradicts itself: 0.finish before 0.start",
        ),
        // The certificate.
        (
            "[[before]]",
            "[[certificate]]\nobject = 5\nfrom = [2, 1]\nto = [5, 1]\n[[before]]",
            "room.toml:25: certificate[0]",
            "there is no object 5",
        ),
    ];
    let mut wrong = Vec::new();
    for (find, replace, place, what) in table {
        let report = report(find, replace);
        // Bounds of nan are bad as a point and as a box; two objects lack a shape.
        let twice = what == "has no shape"
            || place.ends_with("workspace.bounds") && what.contains("finite");
        if !report.contains(place)
            || !report.contains(what)
            || report.lines().count() != 1 + usize::from(twice)
        {
            wrong.push(format!(
                "{replace}\n  expected {place} … {what}\n  but got {report}"
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn all_mistakes_are_reported_at_once_and_point_at_both_ends() {
    let text = SOUND
        .replace("speed = 0.5", "speed = -1.0")
        .replace("goal = [5.0, 1.0]", "goal = [nan, 1.0]")
        .replace(
            "{ box = [2.9, 0.0, 3.0, 2.0] }",
            "{ box = [3.0, 0.0, 3.0, 2.0] }",
        );
    assert_eq!(report_of(&text).lines().count(), 3);
    let text = SOUND
        .replace("start = [2.0, 3.0]", "start = [2.0, 1.3]")
        .replace("goal = [5.0, 3.0]", "goal = [5.0, 1.3]");
    let error = parse(&text, "room.toml").unwrap_err();
    assert_eq!(error.problems.len(), 2);
    for problem in &error.problems {
        let labels: Vec<_> = problem.labels().unwrap().collect();
        assert_eq!(labels.len(), 2);
        let text_at = |i: usize| &text[labels[i].offset()..labels[i].offset() + labels[i].len()];
        assert!(
            text_at(0).contains("1.3") && text_at(1).contains("1.0"),
            "{problem}"
        );
    }
    assert!(
        error
            .to_string()
            .contains("room.toml is not a usable scenario (2 problems)")
    );
}

#[test]
fn a_clearance_that_is_the_only_obstacle_is_named() {
    let text = SOUND
        .replace("clearance = 0.0", "clearance = 0.3")
        .replace("home = [0.5, 0.5]", "home = [0.6, 0.5]");
    let error = parse(&text, "room.toml").unwrap_err();
    let help = error.problems[0].help().unwrap().to_string();
    assert_eq!(help, "without the clearance it would fit");
}

#[test]
fn counts_over_capacity_and_too_few_homes_are_refused() {
    let mut draft = Draft::room("many", [0.0, 0.0, 100.0, 100.0]);
    assert!(
        Scene::new(draft.clone())
            .unwrap_err()
            .to_string()
            .contains("no robot")
    );
    draft.homes = (0..129)
        .map(|i| [0.5 + f64::from(i % 60), 0.5 + f64::from(i / 60)])
        .collect();
    let said = Scene::new(draft.clone()).unwrap_err().to_string();
    assert!(
        said.contains("129 robots, over the capacity of 128"),
        "{said}"
    );
    draft.homes.truncate(2);
    draft.objects = (0..1025)
        .map(|i| ObjectDraft::paper([10.0 + f64::from(i % 60), 10.0 + f64::from(i / 60)], None))
        .collect();
    let said = Scene::new(draft.clone()).unwrap_err().to_string();
    assert!(
        said.contains("1025 objects, over the capacity of 1024"),
        "{said}"
    );
    draft.objects.truncate(3);
    let scene = Scene::new(draft).unwrap();
    let said = scene.with_robots(4).unwrap_err().to_string();
    assert!(
        said.contains("4 robots asked for, but the scenario has only 2 homes"),
        "{said}"
    );
    assert!(scene.with_robots(0).is_err());
    assert_eq!(scene.with_robots(1).unwrap().homes.len(), 1);
}

#[test]
fn clutter_takes_part_in_no_order() {
    let text = SOUND.replace("goal = [5.0, 1.0]\n", "");
    let said = report_of(&text);
    assert!(
        said.contains("object 0 has no goal, so there is no task 0"),
        "{said}"
    );
}

#[test]
fn whatever_the_bytes_reading_does_not_panic() {
    for end in 0..SOUND.len() {
        let _ = parse(&SOUND[..end], "cut.toml").map_err(|error| error.plain());
        let broken = format!("{}\u{0}\"[{}", &SOUND[..end], &SOUND[end..]);
        assert!(parse(&broken, "broken.toml").is_err());
    }
    let nested = format!("name = {}", "[".repeat(100_000));
    assert!(parse(&nested, "nested.toml").is_err());
}

#[test]
fn limits_are_themselves_allowed() {
    let most = [
        ("speed = 0.5", "speed = 1000.0"),
        ("speed = 0.5", "speed = 0.5\ngrasp_s = 86400.0"),
        ("speed = 0.5", "speed = 0.5\ngrasp_s = 0.0"),
    ];
    for (find, replace) in most {
        let text = SOUND.replacen(find, replace, 1);
        assert!(parse(&text, "room.toml").is_ok(), "{}", report_of(&text));
    }
    let over = report("speed = 0.5", "speed = 1000.5");
    assert!(over.contains("must be from 0 to 1000 m/s"), "{over}");
}

#[test]
fn objects_of_a_kind_have_to_be_alike() {
    // An order over objects of a kind would be another mistake.
    let (room, _) = SOUND.split_once("[[before]]").unwrap();
    let room = room.replace("start = ", "kind = \"crate\"\nstart = ");
    let of_kind = |second: &str| format!("{room}{second}\n");
    let alike = of_kind("");
    assert!(parse(&alike, "room.toml").is_ok(), "{}", report_of(&alike));
    let told = report_of(&of_kind("shape = { box = [0.4, 0.3] }"));
    assert!(told.contains("objects[1].kind"), "{told}");
    assert!(told.contains("is that of object 0 too"), "{told}");
}

#[test]
fn without_a_grasp_the_robot_is_centred_below_the_object() {
    // An object that reaches from 0.1 m left of its origin to 0.5 m right of it.
    let corners = "[[-0.1, -0.2], [0.5, -0.2], [0.5, 0.2], [-0.1, 0.2]]";
    let text = SOUND
        .replacen(
            "{ box = [0.4, 0.4] }",
            &format!("{{ polygon = {corners} }}"),
            1,
        )
        .replacen("grasp = [0.0, -0.45]", "", 1);
    let scene = parse(&text, "room.toml").unwrap_or_else(|error| panic!("{}", error.plain()));
    let grasp = scene.objects[0].grasp;
    assert!(
        (grasp - scene::Vec2::new(0.2, -0.45)).amax() < 1e-12,
        "{grasp}"
    );
}
