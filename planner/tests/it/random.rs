//! Random rooms of all sorts: shapes, grasps, lattices, clearances. Whatever does not fit is left
//! out.

use proptest::prelude::*;
use scene::{Connectivity, Draft, ObjectDraft, Scene, ShapeDraft, WallDraft};

/// Where something is, in parts of the room.
type At = (f64, f64);

/// One object that may be put into the room.
#[derive(Clone, Debug)]
struct Thing {
    shape: usize,
    grasp: usize,
    pass_under: bool,
    start: At,
    goal: At,
}

const SIZE: [f64; 2] = [3.6, 2.8];
/// The second is no part of any length: no lattice meets every place.
const PITCHES_M: [f64; 2] = [0.1, 0.0317];

fn thing() -> impl Strategy<Value = Thing> {
    let at = || (0.0..1.0, 0.0..1.0);
    (0_usize..6, 0_usize..5, any::<bool>(), at(), at()).prop_map(
        |(shape, grasp, pass_under, start, goal)| Thing {
            shape,
            grasp,
            pass_under,
            start,
            goal,
        },
    )
}

/// A room with at least two objects, at most `things`.
pub(crate) fn rooms(things: usize) -> impl Strategy<Value = Scene> {
    let wall = (0.0..1.0, 0.0..1.0, 0_usize..4, 0.2..0.7);
    (
        proptest::collection::vec(wall, 0..5),
        proptest::collection::vec(thing(), 2..=things),
        0_usize..2,
        any::<bool>(),
        any::<bool>(),
        prop_oneof![Just(0.0), Just(0.03)],
        0_usize..3,
    )
        .prop_filter_map(
            "fewer than two objects fit",
            |(walls, things, pitch, four, alike, clearance_m, robot)| {
                let pitch_m = PITCHES_M[pitch];
                let mut draft = Draft::room("random", [0.0, 0.0, SIZE[0], SIZE[1]]);
                draft.resolution_m = 0.1;
                draft.robot.clearance_m = clearance_m;
                // Boxes alone make a lattice that meets every place.
                draft.robot.shape = shape(if alike { 0 } else { robot * 2 }, 0.4);
                if four {
                    draft.connectivity = Connectivity::Four;
                }
                for (x, y, kind, part) in walls {
                    let kind = if alike { kind % 2 } else { kind };
                    draft.walls.push(partition((x, y, kind, part), pitch_m));
                }
                let home = [[0.3, 0.3], [SIZE[0] - 0.3, SIZE[1] - 0.3]];
                for home in home {
                    extend(&mut draft, |draft| draft.homes.push(home));
                }
                for thing in things {
                    let object = object(&thing, alike, pitch_m);
                    extend(&mut draft, |draft| draft.objects.push(object));
                }
                let enough = !draft.homes.is_empty() && draft.objects.len() >= 2;
                Scene::new(draft).ok().filter(|_| enough)
            },
        )
}

/// Changes a draft if it is still sound then; while nobody is at home, it cannot be.
fn extend(draft: &mut Draft, change: impl FnOnce(&mut Draft)) {
    let mut changed = draft.clone();
    change(&mut changed);
    if Scene::new(changed.clone()).is_ok() {
        *draft = changed;
    }
}

fn on(part: f64, length_m: f64, pitch_m: f64) -> f64 {
    (part * length_m / pitch_m).round() * pitch_m
}

/// A wall as thin as a pitch or thinner, or a slanted one.
fn partition((x, y, kind, part): (f64, f64, usize, f64), pitch_m: f64) -> WallDraft {
    let [x, y] = [on(x, SIZE[0], pitch_m), on(y, SIZE[1], pitch_m)];
    let [along, up] = SIZE.map(|length_m| on(part, length_m, pitch_m));
    match kind {
        0 => WallDraft::Box([x, y, x + 0.1, y + up]),
        1 => WallDraft::Box([x, y, x + along, y + 0.1]),
        2 => WallDraft::Box([x, 0.0, x + 0.02, on(0.6, SIZE[1], pitch_m)]),
        _ => WallDraft::Polygon(vec![[x, y], [x + 0.5, y + 0.3], [x + 0.5, y + 0.35]]),
    }
}

fn shape(kind: usize, size_m: f64) -> ShapeDraft {
    let half = size_m / 2.0;
    match kind {
        0 => ShapeDraft::Box([size_m, size_m]),
        1 => ShapeDraft::Box([0.1, 0.8]),
        2 => ShapeDraft::Circle(half),
        3 => ShapeDraft::Box([0.9, 0.06]),
        4 => ShapeDraft::Polygon(vec![[-half, -half], [half, -half], [0.0, half]]),
        _ => ShapeDraft::Box([size_m, size_m / 2.0]),
    }
}

fn object(thing: &Thing, alike: bool, pitch_m: f64) -> ObjectDraft {
    let at = |(x, y): At| [on(x, SIZE[0], pitch_m), on(y, SIZE[1], pitch_m)];
    let mut object = ObjectDraft::paper(at(thing.start), Some(at(thing.goal)));
    if !alike {
        object.shape = shape(thing.shape, 0.4);
        object.grasp = [[0.0, -0.6], [0.0, 0.6], [0.7, 0.0], [-0.7, 0.0], [0.0, 0.0]][thing.grasp];
        object.pass_under = thing.pass_under;
    }
    object
}
