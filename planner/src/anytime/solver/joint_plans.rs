//! Plans out of searches over joint configurations: where there is no other plan, and shortest ones.
//!
//! Responsible for: going on with these searches slice by slice, and taking their plans over.
//! Not responsible for: the searches (`joint`, `shortest`).

use scene::Scene;
use shm_types::Verdict;

use crate::anytime::ground::Time;
use crate::anytime::joint::{Found, Joint, JointMove};
use crate::anytime::shortest::{JointStep, Least, Shortest};
use crate::anytime::solver::Solver;
use crate::anytime::track::Place;

/// Configurations that a search looks at in one go.
const CONFIGURATIONS_PER_SLICE: usize = 5_000;

impl Solver {
    /// A first plan by the complete search, a slice of it: nothing while it goes on, then whether
    /// there is a plan, or that there is none.
    pub(crate) fn search(&mut self, scene: &Scene) -> Option<Result<Time, Verdict>> {
        if self.is_short {
            return Some(Err(Verdict::NotFound));
        }
        let mut joint = match self.joint.take() {
            Some(joint) => joint,
            None => {
                let (start, homes) = (&self.start, &self.homes);
                match Joint::new(scene, &mut self.ground, start, homes, &self.goals) {
                    Some(joint) => Box::new(joint),
                    None => return Some(Err(Verdict::NotFound)),
                }
            }
        };
        let found = joint.advance(&self.ground, CONFIGURATIONS_PER_SLICE);
        self.configurations = joint.seen() as u64;
        match found {
            Found::Open => {
                self.joint = Some(joint);
                None
            }
            Found::TooMany => Some(Err(Verdict::NotFound)),
            Found::Exhausted if self.is_start => Some(Err(Verdict::Exhausted)),
            Found::Exhausted => Some(Err(Verdict::NotFound)),
            Found::Plan(moves) => Some(Ok(self.adopt(scene, moves))),
        }
    }

    /// Takes moves of single robots over: as a sequence that robots may carry out side by side, or
    /// else as they are.
    fn adopt(&mut self, scene: &Scene, moves: Vec<(usize, JointMove)>) -> Time {
        let start = self.start.robots.iter().map(|track| track.free.0);
        let mut cells: Vec<u32> = start.collect();
        let mut sequence = Vec::new();
        for &(robot, made) in &moves {
            match made {
                JointMove::Step(direction) => {
                    let offset = self.ground.offsets[direction as usize];
                    cells[robot] = cells[robot].wrapping_add_signed(offset);
                }
                JointMove::Grasp(_) => {}
                JointMove::Release(object) => {
                    let object = usize::from(object);
                    let at = scene.lattice.at(cells[robot]) - scene.objects[object].grasp;
                    sequence.push((object, Place::of(scene, &self.ground, object, at)));
                }
            }
        }
        if let Some(makespan) = self.begin_with(scene, &sequence) {
            return makespan;
        }
        let steps = moves.into_iter().map(|made| vec![made]);
        let steps: Vec<JointStep> = steps.collect();
        self.plan.replay(scene, &self.ground, &self.start, &steps);
        self.keep(self.plan.makespan(), None)
    }

    /// Looks for a plan with fewer steps than the best one, a slice of the search. False once it is
    /// over, or if the room is none that it can be made for.
    pub(crate) fn shorten(&mut self, scene: &Scene) -> bool {
        let Some(best) = &self.best else { return false };
        let shortest = self.shortest.take().or_else(|| {
            let (ground, start, homes) = (&self.ground, &self.start, &self.homes);
            let found = Shortest::new(scene, ground, start, homes, &self.goals, best.makespan);
            found.map(Box::new)
        });
        let Some(mut shortest) = shortest else {
            return false;
        };
        let found = shortest.advance(&self.ground, CONFIGURATIONS_PER_SLICE);
        self.small_configurations = shortest.seen() as u64;
        match found {
            Least::Open => {
                self.shortest = Some(shortest);
                return true;
            }
            Least::NoneShorter | Least::TooMany => {}
            Least::Plan(steps) => {
                self.plan.replay(scene, &self.ground, &self.start, &steps);
                self.keep(self.plan.makespan(), None);
            }
        }
        false
    }

    /// Whether the room is one of those that a plan of the fewest steps is looked for.
    pub(crate) const fn is_small(&self) -> bool {
        self.small_configurations > 0
    }
}
