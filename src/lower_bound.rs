//! A time no plan on the scene's lattice can undercut (rule 32).
//!
//! Responsible for: the bound of the longest single task, and that of all work shared evenly.
//! Not responsible for: a tight bound; interference is not counted at all.
//!
//! Terms: a task's *legs* are home → grasp, the transfer, goal → home, each the shortest with the
//! walls alone.

use planner::DistanceField;
use scene::{Budget, ClassId, ROBOT_ALONE, Scene, Vec2};
use shm_types::Counters;

/// Objects times lattice points beyond which working it out would take longer than people wait.
const MOST_POINTS: usize = 50_000_000;
/// Distances read from a field are exact within this share of their length.
const EXACTNESS: f64 = 2e-6;

/// The bound, seconds of world time; nothing if there is nothing to bring anywhere, no path, or
/// the scene is too large.
pub(crate) fn lower_bound_s(scene: &Scene) -> Option<f64> {
    if scene.objects.len() * scene.lattice.len() > MOST_POINTS {
        return None;
    }
    let mut field = DistanceField::new(scene);
    let legs = (0..scene.objects.len())
        .filter_map(|object| Some((object, scene.objects[object].goal?)))
        .filter(|(object, goal)| (scene.objects[*object].start - goal).norm() > scene::CONTACT_M)
        .map(|(object, goal)| Legs::of(scene, &mut field, object, goal))
        .collect::<Option<Vec<_>>>()?;
    let grip_s = (scene.robot.grasp_ns + scene.robot.release_ns) as f64 / 1e9;
    let speed = scene.robot.speed_m_per_s;
    let longest_m = legs.iter().map(Legs::alone_m).reduce(f64::max)?;
    let all_m: f64 = legs.iter().map(Legs::shared_m).sum();
    let all_s = (all_m / speed + grip_s * legs.len() as f64) / scene.homes.len() as f64;
    let longest_s = longest_m / speed + grip_s;
    Some(longest_s.max(all_s) * (1.0 - EXACTNESS))
}

/// Lengths of one task, m.
struct Legs {
    /// From the nearest home.
    approach: f64,
    /// From the nearest home or goal: where a robot may be when it turns to this task.
    approach_shared: f64,
    transfer: f64,
    /// To the nearest home.
    leave: f64,
}

impl Legs {
    fn of(scene: &Scene, field: &mut DistanceField, object: usize, goal: Vec2) -> Option<Self> {
        let grasp = scene.grasp_at(object, scene.objects[object].start);
        let release = scene.grasp_at(object, goal);
        flood(field, scene, scene.objects[object].class, grasp);
        let transfer = field.distance(scene, release)?;
        flood(field, scene, ROBOT_ALONE, grasp);
        let approach = nearest(field, scene, scene.homes.iter().copied())?;
        let goals = scene.objects.iter().enumerate();
        let goals = goals.filter_map(|(other, spec)| Some(scene.grasp_at(other, spec.goal?)));
        let from_goal = nearest(field, scene, goals).unwrap_or(approach);
        flood(field, scene, ROBOT_ALONE, release);
        Some(Self {
            approach,
            approach_shared: approach.min(from_goal),
            transfer,
            leave: nearest(field, scene, scene.homes.iter().copied())?,
        })
    }

    /// Rule 32 (a): this task alone.
    fn alone_m(&self) -> f64 {
        self.approach + self.transfer + self.leave
    }

    /// Rule 32 (b), with each approach chosen for itself instead of by an assignment.
    fn shared_m(&self) -> f64 {
        self.approach_shared + self.transfer
    }
}

fn flood(field: &mut DistanceField, scene: &Scene, class: ClassId, from: Vec2) {
    field.occupancy().reset(scene, class);
    field.begin(scene, from);
    let mut counters = Counters::default();
    while field
        .advance(&mut Budget::new(u64::MAX), &mut counters)
        .is_pending()
    {}
}

fn nearest(
    field: &mut DistanceField,
    scene: &Scene,
    places: impl Iterator<Item = Vec2>,
) -> Option<f64> {
    places
        .filter_map(|place| field.distance(scene, place))
        .reduce(f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One object in an open room, robot against its −y side, everything in one column.
    const COLUMN: &str = r#"
        name = "column"
        [robot]
        shape = { box = [0.5, 0.5] }
        speed = 0.5
        grasp_s = 1.0
        release_s = 0.5
        [object]
        shape = { box = [0.4, 0.4] }
        grasp = [0.0, -0.45]
        [workspace]
        bounds = [0.0, 0.0, 2.0, 6.0]
        [[robots]]
        home = [1.0, 1.0]
        [[objects]]
        start = [1.0, 2.45]
        goal = [1.0, 4.45]
    "#;

    #[test]
    fn one_task_in_a_straight_line_is_bounded_exactly() {
        let scene = scene::parse(COLUMN, "column").unwrap();
        // 1 m to the grasp, 2 m of transfer, 3 m home, 1.5 s of gripping.
        let bound = lower_bound_s(&scene).unwrap();
        assert!((bound - (6.0 / 0.5 + 1.5)).abs() < 1e-3, "{bound}");
    }

    #[test]
    fn nothing_to_do_has_no_bound() {
        let text = COLUMN.replace("goal = [1.0, 4.45]", "");
        let scene = scene::parse(&text, "column").unwrap();
        assert_eq!(lower_bound_s(&scene), None);
    }
}
