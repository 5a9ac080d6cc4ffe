//! Proof that a scene cannot be solved.
use scene::Scene;

/// Why.
#[derive(Clone, Debug)]
pub enum Infeasible {}

/// Looks for a proof.
#[must_use]
pub fn certificate(_scene: &Scene) -> Option<Infeasible> {
    todo!()
}
