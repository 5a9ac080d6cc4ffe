//! What `docs/guarantees.md` promises of small rooms, against a brute force that shares no code
//! with the planner: all joint configurations of a room of unit cells, all robots moving at once.

use std::collections::HashSet;
use std::fmt::Write as _;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::{Method, Scene, Settings};
use shm_types::{Outcome, Verdict};
use sim::Simulation;

/// Width of a cell, m.
const CELL_M: f64 = 0.5;
/// Configurations beyond which a room is left out.
const MOST_STATES: usize = 200_000;

type Cell = (i32, i32);

/// A room of unit cells; bodies are as large as a cell.
#[derive(Debug)]
struct Room {
    size: Cell,
    walls: HashSet<Cell>,
    homes: Vec<Cell>,
    objects: Vec<(Cell, Option<Cell>)>,
    /// From the object's cell to its robot's.
    grasp: Cell,
}

/// Who is where: robots and what they hold, objects on the ground.
#[derive(Clone, PartialEq, Eq, Hash)]
struct State {
    robots: Vec<(Cell, Option<usize>)>,
    objects: Vec<Option<Cell>>,
}

impl Room {
    fn random(rng: &mut ChaCha8Rng, robots: usize) -> Option<Self> {
        let size = (rng.random_range(2..=4), rng.random_range(3..=4));
        let mut cells: Vec<Cell> = (0..size.0)
            .flat_map(|x| (0..size.1).map(move |y| (x, y)))
            .collect();
        let take = |rng: &mut ChaCha8Rng, cells: &mut Vec<Cell>| {
            (!cells.is_empty()).then(|| {
                let index = rng.random_range(0..cells.len());
                cells.swap_remove(index)
            })
        };
        let count = rng.random_range(0..=3);
        let walls = (0..count)
            .map(|_| take(rng, &mut cells))
            .collect::<Option<_>>()?;
        let homes = (0..robots)
            .map(|_| take(rng, &mut cells))
            .collect::<Option<_>>()?;
        let count = rng.random_range(1..=3 - robots.min(2) + 1);
        let mut goals = cells.clone();
        let mut objects = Vec::new();
        for _ in 0..count {
            let goal = if rng.random_range(0..5) == 0 {
                None
            } else {
                Some(take(rng, &mut goals)?)
            };
            objects.push((take(rng, &mut cells)?, goal));
        }
        let grasp = if rng.random_range(0..3) == 0 {
            (0, 0)
        } else {
            (0, -1)
        };
        Some(Self {
            size,
            walls,
            homes,
            objects,
            grasp,
        })
    }

    fn text(&self) -> String {
        let at = |(x, y): Cell| {
            let centre = |index: i32| (f64::from(index) + 0.5) * CELL_M;
            format!("[{}, {}]", centre(x), centre(y))
        };
        let mut walls: Vec<_> = self.walls.iter().copied().collect();
        walls.sort_unstable();
        let boxes: Vec<String> = walls
            .iter()
            .map(|&(x, y)| {
                let edge = |index: i32| f64::from(index) * CELL_M;
                let (x0, y0, x1, y1) = (edge(x), edge(y), edge(x + 1), edge(y + 1));
                format!("{{ box = [{x0}, {y0}, {x1}, {y1}] }}")
            })
            .collect();
        let mut text = format!(
            "name = \"cells\"\nresolution = {CELL_M}\nconnectivity = 4\n[robot]\nshape = {{ box = \
             [{CELL_M}, {CELL_M}] }}\nspeed = 0.5\n[object]\nshape = {{ box = [{CELL_M}, {CELL_M}] \
             }}\ngrasp = [{}, {}]\npass_under = {}\n[workspace]\nbounds = [0.0, 0.0, {}, {}]\nwalls \
             = [{}]\n",
            f64::from(self.grasp.0) * CELL_M,
            f64::from(self.grasp.1) * CELL_M,
            self.grasp == (0, 0),
            f64::from(self.size.0) * CELL_M,
            f64::from(self.size.1) * CELL_M,
            boxes.join(", "),
        );
        for home in &self.homes {
            writeln!(text, "[[robots]]\nhome = {}", at(*home)).unwrap();
        }
        for (start, goal) in &self.objects {
            writeln!(text, "[[objects]]\nstart = {}", at(*start)).unwrap();
            if let Some(goal) = goal {
                writeln!(text, "goal = {}", at(*goal)).unwrap();
            }
        }
        text
    }

    fn first(&self) -> State {
        State {
            robots: self.homes.iter().map(|&home| (home, None)).collect(),
            objects: self.objects.iter().map(|(start, _)| Some(*start)).collect(),
        }
    }

    fn is_solved(&self, state: &State) -> bool {
        let home = |(robot, home): (&(Cell, Option<usize>), &Cell)| *robot == (*home, None);
        let done = |(at, (_, goal)): (&Option<Cell>, &(Cell, Option<Cell>))| {
            at.is_some() && goal.is_none_or(|goal| *at == Some(goal))
        };
        state.robots.iter().zip(&self.homes).all(home)
            && state.objects.iter().zip(&self.objects).all(done)
    }

    /// Cells of a robot and what it holds.
    fn parts(&self, (at, held): (Cell, Option<usize>)) -> Vec<Cell> {
        let mut parts = vec![at];
        if held.is_some() && self.grasp != (0, 0) {
            parts.push((at.0 - self.grasp.0, at.1 - self.grasp.1));
        }
        parts
    }

    fn is_free(&self, state: &State, robot: (Cell, Option<usize>)) -> bool {
        let passes_under = robot.1.is_none() && self.grasp == (0, 0);
        self.parts(robot).into_iter().all(|(x, y)| {
            (0..self.size.0).contains(&x)
                && (0..self.size.1).contains(&y)
                && !self.walls.contains(&(x, y))
                && (passes_under || !state.objects.contains(&Some((x, y))))
        })
    }

    /// Whether two robots that step at the same time meet on the way.
    fn clash(
        &self,
        a: (Cell, Option<usize>),
        va: Cell,
        b: (Cell, Option<usize>),
        vb: Cell,
    ) -> bool {
        let meets = |p: Cell, q: Cell| {
            let mut span = (0.0_f64, 1.0_f64);
            for (d, r) in [(p.0 - q.0, va.0 - vb.0), (p.1 - q.1, va.1 - vb.1)] {
                let (d, r) = (f64::from(d), f64::from(r));
                if r == 0.0 {
                    if d.abs() >= 1.0 {
                        return false;
                    }
                    continue;
                }
                let (one, other) = ((-1.0 - d) / r, (1.0 - d) / r);
                span = (span.0.max(one.min(other)), span.1.min(one.max(other)));
            }
            span.0 < span.1 - 1e-9
        };
        let theirs = self.parts(b);
        self.parts(a)
            .into_iter()
            .any(|p| theirs.iter().any(|&q| meets(p, q)))
    }

    fn neighbours(&self, state: &State) -> Vec<State> {
        let mut found = Vec::new();
        let ways = [(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1)];
        let robots = state.robots.len();
        for code in 0..ways.len().pow(robots as u32) {
            let way = |robot: usize| ways[code / ways.len().pow(robot as u32) % ways.len()];
            let mut next = state.clone();
            for (robot, place) in next.robots.iter_mut().enumerate() {
                place.0 = (place.0.0 + way(robot).0, place.0.1 + way(robot).1);
            }
            let legal = (0..robots).all(|i| {
                self.is_free(state, next.robots[i])
                    && (0..i).all(|j| !self.clash(state.robots[i], way(i), state.robots[j], way(j)))
            });
            if legal {
                found.push(next);
            }
        }
        for robot in 0..robots {
            let (at, held) = state.robots[robot];
            let there = (at.0 - self.grasp.0, at.1 - self.grasp.1);
            let mut next = state.clone();
            match held {
                Some(object) => {
                    next.robots[robot].1 = None;
                    next.objects[object] = Some(there);
                    found.push(next);
                }
                None => {
                    let here = state.objects.iter().position(|at| *at == Some(there));
                    let Some(object) = here else { continue };
                    next.robots[robot].1 = Some(object);
                    next.objects[object] = None;
                    found.push(next);
                }
            }
        }
        found
    }

    /// Whether some joint motion solves the room; nothing if that is too much to ask.
    fn is_solvable(&self) -> Option<bool> {
        let mut seen = HashSet::from([self.first()]);
        let mut open = vec![self.first()];
        while let Some(state) = open.pop() {
            if self.is_solved(&state) {
                return Some(true);
            }
            if seen.len() > MOST_STATES {
                return None;
            }
            for next in self.neighbours(&state) {
                if seen.insert(next.clone()) {
                    open.push(next);
                }
            }
        }
        Some(false)
    }
}

/// How a run of the scene ends.
fn run(scene: &Scene) -> (Outcome, Verdict) {
    let settings = Settings {
        method: Method::Anytime,
        ..Settings::default()
    };
    let mut watch = |_: &_, _: &_| std::ops::ControlFlow::Continue(());
    let report = Simulation::new(scene, &settings, 1).run(&mut watch);
    assert_eq!(report.world.violations, 0);
    (report.outcome, report.verdict)
}

/// Compares random rooms; how many could be solved and how many not.
fn compare(rooms: u64, robots: usize) -> (usize, usize) {
    let (mut solvable, mut not) = (0, 0);
    for seed in 0..rooms {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let Some(room) = Room::random(&mut rng, robots) else {
            continue;
        };
        let Ok(scene) = scene::parse(&room.text(), "cells") else {
            continue;
        };
        assert!(scene.lattice.exact && scene.lattice.pitch_m == CELL_M);
        let Some(expected) = room.is_solvable() else {
            continue;
        };
        let (outcome, verdict) = run(&scene);
        if expected {
            solvable += 1;
            assert_eq!(
                outcome,
                Outcome::Solved,
                "seed {seed}: {verdict:?}\n{}",
                room.text()
            );
        } else {
            not += 1;
            let is_proved = [Verdict::Proved, Verdict::Exhausted].contains(&verdict);
            assert!(
                outcome == Outcome::Stuck && is_proved,
                "seed {seed}: {outcome:?}, {verdict:?}\n{}",
                room.text()
            );
        }
    }
    (solvable, not)
}

#[test]
fn what_brute_force_solves_with_one_robot_is_solved_and_all_else_proved_infeasible() {
    let (solvable, not) = compare(2_000, 1);
    assert!(solvable > 300 && not > 300, "{solvable} and {not}");
}

#[test]
fn what_brute_force_solves_with_two_robots_is_solved_and_all_else_proved_infeasible() {
    let (solvable, not) = compare(600, 2);
    assert!(solvable > 100 && not > 60, "{solvable} and {not}");
}
