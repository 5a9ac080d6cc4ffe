//! The six constraints between two tasks (§III.B).

use shm_types::ConstraintKind;

/// Which test found a constraint between tasks 1 and 2, and so which edge it gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// Object 1 at its initial place overlaps a robot grasping 2 at its initial place:
    /// g1 < g2.
    E1,
    /// Object 1 at its goal overlaps a robot grasping 2 at its initial place: g2 < f1.
    E2,
    /// Object 1 at its initial place overlaps a robot grasping 2 at its goal: g1 < f2.
    E3,
    /// Object 1 at its goal overlaps a robot grasping 2 at its goal: f2 < f1.
    E4,
    /// No transfer path for 2 with object 1 at its initial place: g1 < f2.
    H1,
    /// No transfer path for 2 with object 1 at its goal: g2 < f1.
    H2,
}

impl Kind {
    /// The easy constraints: one polygon test each.
    pub const EASY: [Self; 4] = [Self::E1, Self::E2, Self::E3, Self::E4];
    /// The hard constraints: one path plan each.
    pub const HARD: [Self; 2] = [Self::H1, Self::H2];

    /// The easy constraint found where object 1 and the robot that grasps 2 stand at the initial
    /// place or the goal of their tasks.
    #[must_use]
    pub(crate) const fn easy(first_at_goal: bool, second_at_goal: bool) -> Self {
        match (first_at_goal, second_at_goal) {
            (false, false) => Self::E1,
            (true, false) => Self::E2,
            (false, true) => Self::E3,
            (true, true) => Self::E4,
        }
    }

    /// Whether object 1 stands at its goal in the test, not at its initial place.
    #[must_use]
    pub const fn first_at_goal(self) -> bool {
        matches!(self, Self::E2 | Self::E4 | Self::H2)
    }

    /// The edge that follows for tasks 1 and 2: what has to be completed before what is selected
    /// (rule 13).
    #[must_use]
    pub const fn edge(self, one: usize, two: usize) -> (usize, usize) {
        if self.first_at_goal() {
            (two, one)
        } else {
            (one, two)
        }
    }

    /// The code a hard constraint travels with; none for an easy one.
    #[must_use]
    pub const fn wire(self) -> Option<ConstraintKind> {
        match self {
            Self::H1 => Some(ConstraintKind::H1),
            Self::H2 => Some(ConstraintKind::H2),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_are_those_of_the_table() {
        let edges = [Kind::E1, Kind::E2, Kind::E3, Kind::E4, Kind::H1, Kind::H2]
            .map(|kind| kind.edge(1, 2));
        assert_eq!(edges, [(1, 2), (2, 1), (1, 2), (2, 1), (1, 2), (2, 1)]);
    }
}
