//! First plans of random rooms, for tests.

use scene::GenerateOptions;

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
