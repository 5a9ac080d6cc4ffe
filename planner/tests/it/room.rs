//! Rooms and snapshots to try the planner in.

use scene::{CONTACT_M, Draft, ObjectDraft, Scene, WallDraft, vec};
use shm_types::{
    Checked, ConstraintTable, ObjectState, Point, RobotState, SnapshotHeader, TaskStatus,
    WorldSnapshot, zeroed,
};

/// Start and goal of an object's centre, m.
pub(crate) type Trip = ([f64; 2], Option<[f64; 2]>);

/// A draft with the paper's robots and objects, `x0, y0, x1, y1` in metres.
pub(crate) fn draft(
    bounds: [f64; 4],
    walls: &[[f64; 4]],
    homes: &[[f64; 2]],
    trips: &[Trip],
) -> Draft {
    let mut draft = Draft::room("test", bounds);
    draft.walls = walls.iter().map(|wall| WallDraft::Box(*wall)).collect();
    draft.homes = homes.to_vec();
    draft.objects = trips
        .iter()
        .map(|(start, goal)| ObjectDraft::paper(*start, *goal))
        .collect();
    draft
}

/// The scene of a draft that is expected to be sound.
pub(crate) fn scene_of(draft: Draft) -> Scene {
    Scene::new(draft).unwrap_or_else(|problems| panic!("{problems:?}"))
}

/// A room with the paper's robots and objects.
pub(crate) fn room(
    bounds: [f64; 4],
    walls: &[[f64; 4]],
    homes: &[[f64; 2]],
    trips: &[Trip],
) -> Scene {
    scene_of(draft(bounds, walls, homes, trips))
}

/// A scenario that is shipped.
pub(crate) fn shipped(name: &str) -> Scene {
    let path = format!("{}/../scenarios/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    scene::parse(&text, &path).unwrap_or_else(|error| panic!("{}", error.plain()))
}

/// The world at the start of a run.
pub(crate) fn start(scene: &Scene) -> Box<WorldSnapshot> {
    let mut world = zeroed::<WorldSnapshot>();
    world.header = SnapshotHeader {
        epoch: 1,
        robot_count: scene.counts().robots,
        object_count: scene.counts().objects,
        ..SnapshotHeader::default()
    };
    for (state, home) in world.robots.iter_mut().zip(&scene.homes) {
        let position = scene::point(*home);
        *state = RobotState {
            position,
            epoch_position: position,
            epoch_free: 1,
            live: 1,
            ..RobotState::default()
        };
    }
    for (state, spec) in world.objects.iter_mut().zip(&scene.objects) {
        *state = ObjectState {
            goal: spec.goal.map(scene::point).unwrap_or_default(),
            has_goal: u32::from(spec.goal.is_some()),
            ..ObjectState::default()
        };
        put(state, scene::point(spec.start));
    }
    world
}

/// Puts an object down; its task is done if that is its goal, or if it has none.
pub(crate) fn put(object: &mut ObjectState, at: Point) {
    object.position = at;
    object.rest = at;
    let left = (vec(object.goal) - vec(at)).amax();
    let done = object.has_goal == 0 || left <= CONTACT_M;
    let status = if done {
        TaskStatus::Done
    } else {
        TaskStatus::Waiting
    };
    object.status = status.code();
    object.epoch_status = status.code();
}

/// A snapshot as the planner accepts it.
pub(crate) fn checked<'a>(scene: &Scene, world: &'a WorldSnapshot) -> Checked<'a, WorldSnapshot> {
    Checked::new(world, scene.counts()).unwrap_or_else(|error| panic!("{error}"))
}

/// The table of no constraint.
pub(crate) fn no_constraints() -> Box<ConstraintTable> {
    let mut table = zeroed::<ConstraintTable>();
    table.complete_for_events = u64::MAX;
    table
}
