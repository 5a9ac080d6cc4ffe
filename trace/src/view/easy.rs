//! The easy constraints of a room, as a viewer shows them (rule 9).
//!
//! Responsible for: E1–E4 between every ordered pair of tasks, with objects where they stand at
//! the start. Each robot works them out for itself, so a trace does not tell them.
//! Not responsible for: those of objects put down on the way; which of them a run has used.
//!
//! The geometry is the checker's, not the one the run was planned with.

use crate::check::geometry::{Meeting, Solid, Vector};
use crate::record::{Place, SceneRecord};
use crate::view::page::Constraint;
use crate::view::waits::{depth, near};

/// The paper's names and whether object 1 stands at its goal, whether 2 is grasped at its goal.
const KINDS: [(&str, bool, bool); 4] = [
    ("E1", false, false),
    ("E2", true, false),
    ("E3", false, true),
    ("E4", true, true),
];

/// All easy constraints between tasks, by pairs in ascending order.
pub(crate) fn constraints(scene: &SceneRecord) -> Vec<Constraint> {
    let robot = Solid::from(&scene.robot.shape);
    let objects: Vec<Solid> = scene
        .objects
        .iter()
        .map(|object| Solid::from(&object.shape))
        .collect();
    let depth = depth(scene);
    let mut found = Vec::new();
    for one in 0..objects.len() {
        for two in (0..objects.len()).filter(|two| *two != one) {
            for (kind, at_goal, grasped_at_goal) in KINDS {
                let (Some(obstacle), Some(carried)) = (
                    place(scene, one, at_goal),
                    place(scene, two, grasped_at_goal),
                ) else {
                    continue;
                };
                let centre = carried + Vector::from(scene.objects[two].grasp);
                let meets = |moving: &Solid, at: Vector| {
                    let at = at - obstacle;
                    near(moving, at, at, &objects[one], depth)
                        && Meeting::of(moving, &objects[one])
                            .nearer_than(depth, at, at)
                            .is_some()
                };
                if meets(&robot, centre) || meets(&objects[two], carried) {
                    // E1 and E3 put 1 first, E2 and E4 put 2 first.
                    let (before, after) = if at_goal { (two, one) } else { (one, two) };
                    found.push(Constraint {
                        before,
                        after,
                        kind,
                        since_ns: 0,
                    });
                }
            }
        }
    }
    found
}

/// Where an object stands; none for the goal of clutter, which has no task either.
fn place(scene: &SceneRecord, object: usize, at_goal: bool) -> Option<Vector> {
    let object = &scene.objects[object];
    let goal: Place = object.goal?;
    Some(if at_goal { goal } else { object.start }.into())
}
