//! The shortest plan of a room of unit cells, by looking at everything.
//!
//! Responsible for: the model, and the least number of steps in it.
//! Not responsible for: making rooms (`cells`). It shares no code with the planner.
//!
//! The model: in each step each robot stays, moves to one of four neighbours, grasps the object
//! above it, or releases the one it holds. A robot without an object passes under objects at rest,
//! one with an object does not. Nobody enters a cell that another one leaves, but straight behind
//! it; so nobody swaps.
//!
//! How: breadth first over joint configurations from both ends. Every step can be made backwards,
//! so both use the same steps.
//!
//! Source: rule 34.

use std::collections::HashSet;

/// A cell: its number, row by row.
pub type Cell = u8;

/// A room of unit cells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cells {
    /// Cells in a row.
    pub width: usize,
    /// By cell, whether nobody can be there.
    pub walls: Vec<bool>,
    /// Where robots start and end.
    pub homes: Vec<Cell>,
    /// Where each object starts, and ends.
    pub objects: Vec<(Cell, Cell)>,
}

/// What came of looking.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Optimum {
    /// The least number of steps.
    Steps(u32),
    /// There is no plan.
    Infeasible,
    /// There are too many configurations.
    TooMany,
}

/// No object; no cell.
const NONE: u8 = u8::MAX;
/// Most robots and objects together, each two bytes and one byte of a configuration.
const BYTES: usize = 16;

/// What a robot does in a step; less is a direction.
const STAYS: usize = 4;
const GRIPS: usize = 5;

/// By robot its cell and what it holds, then by object its cell, or none while it is held.
type Configuration = [u8; BYTES];

impl Cells {
    /// The least number of steps to the goals and homes, looking at `most` configurations.
    ///
    /// # Panics
    /// The room has more robots and objects than a configuration has room for.
    #[must_use]
    pub fn optimum(&self, most: usize) -> Optimum {
        let start = self.configuration(|(start, _)| start);
        let end = self.configuration(|(_, goal)| goal);
        if start == end {
            return Optimum::Steps(0);
        }
        let mut seen = [HashSet::from([start]), HashSet::from([end])];
        let mut edges = [vec![start], vec![end]];
        let mut steps = 0;
        loop {
            // The side with less to do.
            let side = usize::from(edges[1].len() < edges[0].len());
            let mut next = Vec::new();
            steps += 1;
            for at in std::mem::take(&mut edges[side]) {
                let mut is_met = false;
                self.for_each_next(&at, &mut |then| {
                    is_met |= seen[1 - side].contains(then);
                    if seen[side].insert(*then) {
                        next.push(*then);
                    }
                });
                if is_met {
                    return Optimum::Steps(steps);
                }
            }
            if next.is_empty() {
                return Optimum::Infeasible;
            }
            if seen[0].len() + seen[1].len() > most {
                return Optimum::TooMany;
            }
            edges[side] = next;
        }
    }

    fn configuration(&self, place: impl Fn((Cell, Cell)) -> Cell) -> Configuration {
        let mut at = [NONE; BYTES];
        for (robot, home) in self.homes.iter().enumerate() {
            at[2 * robot] = *home;
        }
        for (object, ends) in self.objects.iter().enumerate() {
            at[2 * self.homes.len() + object] = place(*ends);
        }
        at
    }

    fn neighbour(&self, cell: Cell, way: usize) -> Option<Cell> {
        let (x, y) = (
            usize::from(cell) % self.width,
            usize::from(cell) / self.width,
        );
        let height = self.walls.len() / self.width;
        let (x, y) = match way {
            0 => (x + 1, y),
            1 => (x, y + 1),
            2 => (x.checked_sub(1)?, y),
            _ => (x, y.checked_sub(1)?),
        };
        let is_in = x < self.width && y < height && !self.walls[y * self.width + x];
        is_in.then_some((y * self.width + x) as Cell)
    }

    /// Calls `visit` with every configuration one step on.
    fn for_each_next(&self, at: &Configuration, visit: &mut impl FnMut(&Configuration)) {
        self.choose(at, at, 0, &mut [STAYS; BYTES], visit);
    }

    /// Chooses what `robot` and those after it do.
    fn choose(
        &self,
        at: &Configuration,
        then: &Configuration,
        robot: usize,
        ways: &mut [usize; BYTES],
        visit: &mut impl FnMut(&Configuration),
    ) {
        let robots = self.homes.len();
        if robot == robots {
            visit(then);
            return;
        }
        let (cell, held) = (at[2 * robot], at[2 * robot + 1]);
        for way in 0..=GRIPS {
            let mut next = *then;
            match way {
                STAYS => {}
                GRIPS if held != NONE => {
                    next[2 * robot + 1] = NONE;
                    next[2 * robots + usize::from(held)] = cell;
                }
                GRIPS => {
                    let objects = &at[2 * robots..2 * robots + self.objects.len()];
                    let Some(object) = objects.iter().position(|&there| there == cell) else {
                        continue;
                    };
                    next[2 * robot + 1] = object as u8;
                    next[2 * robots + object] = NONE;
                }
                _ => {
                    let Some(to) = self.neighbour(cell, way) else {
                        continue;
                    };
                    if held != NONE && at[2 * robots..].contains(&to) {
                        continue;
                    }
                    next[2 * robot] = to;
                }
            }
            ways[robot] = way;
            let is_clear = (0..robot).all(|other| {
                let follows = |behind: usize, ahead: usize| {
                    next[2 * behind] != at[2 * ahead] || ways[behind] == ways[ahead]
                };
                next[2 * robot] != next[2 * other] && follows(robot, other) && follows(other, robot)
            });
            if is_clear {
                self.choose(at, &next, robot + 1, ways, visit);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn room(rows: &[&str], homes: &[Cell], objects: &[(Cell, Cell)]) -> Cells {
        Cells {
            width: rows[0].len(),
            walls: rows.concat().chars().map(|c| c == '#').collect(),
            homes: homes.to_vec(),
            objects: objects.to_vec(),
        }
    }

    #[test]
    fn one_robot_goes_there_and_back() {
        // 1 to the object, grasp, 2 with it, release, 3 back.
        let line = room(&["...."], &[0], &[(1, 3)]);
        assert_eq!(line.optimum(1_000), Optimum::Steps(8));
    }

    #[test]
    fn who_follows_in_line_loses_nothing() {
        // In line: the one behind loses nothing. Object 1 is taken by the front robot, two cells
        // on; object 0 by the one behind.
        let line = room(&["....."], &[0, 1], &[(1, 2), (2, 3)]);
        // Behind: 1, grasp, 1, release, 2 back, at the same time as the one in front.
        assert_eq!(line.optimum(100_000), Optimum::Steps(6));
    }

    #[test]
    fn objects_that_block_each_other_in_a_dead_end_have_no_plan() {
        let line = room(&["..."], &[0], &[(1, 2), (2, 1)]);
        assert_eq!(line.optimum(100_000), Optimum::Infeasible);
        assert_eq!(line.optimum(2), Optimum::TooMany);
    }

    #[test]
    fn nobody_enters_a_cell_that_another_one_leaves_to_the_side() {
        let corner = room(&["..", "#."], &[0, 1], &[]);
        let mut found = Vec::new();
        let at = corner.configuration(|(start, _)| start);
        corner.for_each_next(&at, &mut |then| found.push((then[0], then[2])));
        assert!(found.contains(&(0, 3)), "{found:?}");
        assert!(
            !found.contains(&(1, 3)) && !found.contains(&(1, 0)),
            "{found:?}"
        );
        let line = room(&["..."], &[0, 1], &[]);
        found.clear();
        let at = line.configuration(|(start, _)| start);
        line.for_each_next(&at, &mut |then| found.push((then[0], then[2])));
        assert!(found.contains(&(1, 2)), "in line: {found:?}");
    }
}
