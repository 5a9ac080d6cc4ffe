//! First plans of random rooms, and rooms drawn by hand, for tests.

use scene::{Connectivity, Draft, GenerateOptions, ObjectDraft, RobotDraft, ShapeDraft, WallDraft};

use super::*;
use crate::anytime::publish::Script;

/// A room, and a first plan for it.
pub(in crate::anytime) fn planned(options: &GenerateOptions) -> (Scene, Solver, Time) {
    let scene = scene::generate(options).unwrap().scene;
    let (solver, makespan) = planned_for(&scene);
    (scene, solver, makespan)
}

/// A first plan for a room.
pub(in crate::anytime) fn planned_for(scene: &Scene) -> (Solver, Time) {
    let situation = Situation::at_start(scene);
    let mut solver = Solver::new(scene, &Settings::default(), &situation).unwrap();
    let makespan = (0..5).find_map(|attempt| solver.first(scene, attempt));
    (solver, makespan.unwrap())
}

/// The plan as it is published.
pub(in crate::anytime) fn written(scene: &Scene, solver: &mut Solver) -> Script {
    solver.restore().unwrap();
    let situation = Situation::at_start(scene);
    Script::of(scene, &solver.ground, &solver.plan, &situation)
}

/// A room of unit cells, from above: `#` is wall, robots are at home at `A`, `B`, ..., objects stand
/// at `a`, `b`, ... and are to go to `1`, `2`, ... in turn. All are as large as a cell and take as
/// long to grip as to step on. An object is carried above its robot, and others pass under it.
pub(in crate::anytime) fn cells(rows: &[&'static str]) -> Scene {
    let (width, height) = (rows[0].len(), rows.len());
    let mut draft = Draft::room("cells", [0.0, 0.0, width as f64, height as f64]);
    draft.resolution_m = 1.0;
    draft.connectivity = Connectivity::Four;
    draft.robot = RobotDraft {
        shape: ShapeDraft::Box([1.0, 1.0]),
        speed_m_per_s: 1.0,
        grasp_s: 1.0,
        release_s: 1.0,
        ..RobotDraft::paper()
    };
    let all = || {
        let row = |(y, row): (usize, &&'static str)| {
            row.char_indices().map(move |(x, what)| (what, x, y))
        };
        rows.iter().rev().enumerate().flat_map(row)
    };
    let middle = |(_, x, y): (char, usize, usize)| [x as f64 + 0.5, y as f64 + 0.5];
    let of = |first: char| {
        (first..).map_while(move |name| all().find(|cell| cell.0 == name).map(middle))
    };
    draft.walls = (all().filter(|cell| cell.0 == '#').map(middle))
        .map(|[x, y]| WallDraft::Box([x - 0.5, y - 0.5, x + 0.5, y + 0.5]))
        .collect();
    draft.homes = of('A').collect();
    draft.objects = (of('a').zip(of('1')))
        .map(|(start, goal)| ObjectDraft {
            shape: ShapeDraft::Box([1.0, 1.0]),
            grasp: [0.0, 0.0],
            pass_under: true,
            ..ObjectDraft::paper(start, Some(goal))
        })
        .collect();
    Scene::new(draft).unwrap_or_else(|problems| panic!("{problems:?}"))
}

/// Nothing planned yet.
pub(in crate::anytime) fn solver_of(scene: &Scene) -> Solver {
    Solver::new(scene, &Settings::default(), &Situation::at_start(scene)).unwrap()
}
