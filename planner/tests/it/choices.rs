//! Bounds of rooms where there is something to choose, held against trying everything: tiny rooms
//! of unit cells, objects with several grasps, objects of one kind.
//!
//! The brute force knows cells, walls, steps and grips, and shares nothing with the planner. All
//! robots step at once, grips take no time. With solid bodies no two are in one cell, nor do two
//! robots change places; that forbids no more than the world does.

use std::collections::HashSet;

use planner::{BoundLimits, Bounds, Yardstick};
use proptest::prelude::*;
use scene::{Connectivity, Draft, ObjectDraft, RobotDraft, Scene, ShapeDraft, WallDraft};

/// Longest plan looked for, steps.
const MOST_STEPS: usize = 24;

type Cell = (i8, i8);

/// A room of unit cells.
#[derive(Clone, Debug)]
struct Room {
    size: (i8, i8),
    walls: Vec<Cell>,
    homes: Vec<Cell>,
    /// Robot minus object.
    grasps: Vec<Cell>,
    starts: Vec<Cell>,
    /// One for each of the first objects.
    goals: Vec<Cell>,
    /// Whether any object may go to any goal.
    kind: bool,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct State {
    /// Where each robot is, and what it holds, by which grasp.
    robots: Vec<(Cell, Option<(usize, usize)>)>,
    /// Where each object is.
    objects: Vec<Cell>,
}

fn sum(a: Cell, b: Cell) -> Cell {
    (a.0 + b.0, a.1 + b.1)
}

fn difference(a: Cell, b: Cell) -> Cell {
    (a.0 - b.0, a.1 - b.1)
}

fn middle(cell: Cell) -> [f64; 2] {
    [f64::from(cell.0) + 0.5, f64::from(cell.1) + 0.5]
}

impl Room {
    fn scene(&self) -> Option<Scene> {
        let (width, height) = (f64::from(self.size.0), f64::from(self.size.1));
        let mut draft = Draft::room("cells", [0.0, 0.0, width, height]);
        draft.resolution_m = 1.0;
        draft.connectivity = Connectivity::Four;
        let corner = |cell: &Cell| (f64::from(cell.0), f64::from(cell.1));
        draft.walls = (self.walls.iter().map(corner))
            .map(|(x, y)| WallDraft::Box([x, y, x + 1.0, y + 1.0]))
            .collect();
        draft.robot = RobotDraft {
            shape: ShapeDraft::Box([1.0, 1.0]),
            speed_m_per_s: 1.0,
            ..RobotDraft::paper()
        };
        draft.homes = self.homes.iter().map(|&home| middle(home)).collect();
        let offset = |grasp: &Cell| [f64::from(grasp.0), f64::from(grasp.1)];
        let objects = self
            .starts
            .iter()
            .enumerate()
            .map(|(i, &start)| ObjectDraft {
                shape: ShapeDraft::Box([1.0, 1.0]),
                grasp: offset(&self.grasps[0]),
                other_grasps: self.grasps[1..].iter().map(offset).collect(),
                kind: self.kind.then(|| "one".to_owned()),
                pass_under: true,
                ..ObjectDraft::paper(middle(start), self.goals.get(i).map(|&goal| middle(goal)))
            });
        draft.objects = objects.collect();
        Scene::new(draft).ok()
    }

    fn is_free(&self, (x, y): Cell) -> bool {
        let inside = (0..self.size.0).contains(&x) && (0..self.size.1).contains(&y);
        inside && !self.walls.contains(&(x, y))
    }

    fn is_solved(&self, state: &State) -> bool {
        let at_home = |(robot, home): (&(Cell, Option<_>), &Cell)| robot.0 == *home;
        let filled = self.goals.iter().enumerate().all(|(i, goal)| {
            if self.kind {
                state.objects.contains(goal)
            } else {
                state.objects[i] == *goal
            }
        });
        filled
            && state.robots.iter().zip(&self.homes).all(at_home)
            && state.robots.iter().all(|robot| robot.1.is_none())
    }

    /// Whether no two bodies are in one another's way.
    fn is_apart(&self, state: &State) -> bool {
        let held = |object: usize| {
            (state.robots.iter()).position(|robot| robot.1.is_some_and(|(held, _)| held == object))
        };
        let objects = &state.objects;
        let robots = (0..state.robots.len()).all(|i| {
            let (at, hand) = state.robots[i];
            let others = state.robots[..i].iter().all(|other| other.0 != at);
            others
                && objects.iter().enumerate().all(|(object, &there)| {
                    // Robots that carry nothing pass under what stands on the ground.
                    let free = held(object).is_none() && hand.is_none();
                    there != at || free || held(object) == Some(i)
                })
        });
        robots && (0..objects.len()).all(|i| !objects[..i].contains(&objects[i]))
    }

    /// All states that grips alone lead to.
    fn after_grips(&self, state: State, seen: &mut HashSet<State>, solid: bool) {
        if (solid && !self.is_apart(&state)) || !seen.insert(state.clone()) {
            return;
        }
        for i in 0..state.robots.len() {
            let (at, hand) = state.robots[i];
            if hand.is_some() {
                let mut next = state.clone();
                next.robots[i].1 = None;
                self.after_grips(next, seen, solid);
                continue;
            }
            for object in 0..state.objects.len() {
                let is_held = |robot: &(Cell, Option<(usize, usize)>)| {
                    robot.1.is_some_and(|(held, _)| held == object)
                };
                let offset = difference(at, state.objects[object]);
                let by = self.grasps.iter().position(|grasp| *grasp == offset);
                if let Some(by) = by.filter(|_| !state.robots.iter().any(is_held)) {
                    let mut next = state.clone();
                    next.robots[i].1 = Some((object, by));
                    self.after_grips(next, seen, solid);
                }
            }
        }
    }

    /// All states after one step of robots from `i` on.
    fn steps(&self, before: &State, next: &mut State, i: usize, visit: &mut dyn FnMut(&State)) {
        if i == before.robots.len() {
            visit(next);
            return;
        }
        let (at, hand) = before.robots[i];
        for step in [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)] {
            let to = sum(at, step);
            let carried = hand.map(|(object, by)| (object, difference(to, self.grasps[by])));
            if !self.is_free(to) || carried.is_some_and(|(_, cell)| !self.is_free(cell)) {
                continue;
            }
            next.robots[i].0 = to;
            if let Some((object, cell)) = carried {
                next.objects[object] = cell;
            }
            self.steps(before, next, i + 1, visit);
        }
        next.robots[i].0 = at;
        if let Some((object, _)) = hand {
            next.objects[object] = before.objects[object];
        }
    }

    /// The least number of steps; none if there is no plan that is not too long.
    fn least_steps(&self, solid: bool) -> Option<usize> {
        let start = State {
            robots: self.homes.iter().map(|&home| (home, None)).collect(),
            objects: self.starts.clone(),
        };
        let mut seen = HashSet::new();
        self.after_grips(start, &mut seen, solid);
        let mut layer: Vec<State> = seen.iter().cloned().collect();
        for steps in 0..=MOST_STEPS {
            if layer.iter().any(|state| self.is_solved(state)) {
                return Some(steps);
            }
            let mut further = HashSet::new();
            for state in &layer {
                self.steps(state, &mut state.clone(), 0, &mut |next| {
                    let swaps = (0..next.robots.len()).any(|i| {
                        (0..i).any(|k| {
                            next.robots[i].0 == state.robots[k].0
                                && next.robots[k].0 == state.robots[i].0
                        })
                    });
                    if !(seen.contains(next) || solid && swaps) {
                        self.after_grips(next.clone(), &mut further, solid);
                    }
                });
            }
            layer = further
                .into_iter()
                .filter(|state| !seen.contains(state))
                .collect();
            seen.extend(layer.iter().cloned());
        }
        None
    }
}

fn rooms() -> impl Strategy<Value = Room> {
    let cell = || (0_i8..4, 0_i8..3);
    let grasp = prop::sample::subsequence(vec![(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)], 1..=3);
    let cells = |count| proptest::collection::vec(cell(), count);
    (
        cells(0..4),
        cells(1..3),
        grasp.prop_shuffle(),
        cells(1..3),
        cells(2..3),
        any::<bool>(),
        1_usize..3,
    )
        .prop_map(|(walls, homes, grasps, starts, goals, kind, count)| Room {
            size: (4, 3),
            walls,
            homes,
            grasps,
            goals: goals[..count.min(starts.len())].to_vec(),
            starts,
            kind,
        })
}

fn check(room: &Room) -> Result<(), TestCaseError> {
    let Some(scene) = room.scene() else {
        return Err(TestCaseError::reject("no scene"));
    };
    prop_assert!(scene.lattice.exact && scene.lattice.pitch_m == 1.0);
    let alone = room.least_steps(false);
    let Some(alone) = alone.filter(|steps| *steps > 0) else {
        return Err(TestCaseError::reject("nothing to do, or no way"));
    };
    let Some(bounds) = Bounds::of(&scene, BoundLimits::default()) else {
        // Events that wait for one another in a ring.
        prop_assert_eq!(room.least_steps(true), None);
        return Ok(());
    };
    let alone_s = alone as f64 + 1e-3;
    prop_assert!(bounds.longest_task_s <= alone_s, "{alone} {bounds:?}");
    prop_assert!(bounds.shared_s <= alone_s, "{alone} {bounds:?}");
    if let Some(r_s) = bounds.r_s() {
        prop_assert!(alone as f64 <= r_s + 1e-3, "{alone} {bounds:?}");
    }
    if let Some(steps) = room.least_steps(true) {
        prop_assert!(bounds.best_s() <= steps as f64 + 1e-3, "{steps} {bounds:?}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig {
        max_global_rejects: 100_000,
        ..ProptestConfig::with_cases(300)
    })]

    #[test]
    fn no_bound_is_above_what_trying_everything_finds(room in rooms()) {
        check(&room)?;
    }
}

/// A corridor of six cells with the robot's home in the middle.
fn corridor(grasps: &[Cell], starts: &[Cell], goals: &[Cell], kind: bool) -> Room {
    Room {
        size: (6, 1),
        walls: Vec::new(),
        homes: vec![(2, 0)],
        grasps: grasps.to_vec(),
        starts: starts.to_vec(),
        goals: goals.to_vec(),
        kind,
    }
}

fn bounds(room: &Room) -> Bounds {
    Bounds::of(&room.scene().unwrap(), BoundLimits::default()).unwrap()
}

#[test]
fn the_best_of_several_grasps_is_what_bounds_and_r_take() {
    // From below alone the robot goes to the object; from the left it need not go so far.
    let room = corridor(&[(0, 0), (-1, 0)], &[(4, 0)], &[(5, 0)], false);
    let found = bounds(&room);
    assert_eq!(room.least_steps(true), Some(4));
    for bound_s in [found.longest_task_s, found.best_s(), found.r_s().unwrap()] {
        assert!((bound_s - 4.0).abs() < 1e-3, "{found:?}");
    }
    let below = bounds(&corridor(&[(0, 0)], &[(4, 0)], &[(5, 0)], false));
    assert!((below.r_s().unwrap() - 6.0).abs() < 1e-3, "{below:?}");
}

#[test]
fn what_is_handed_over_from_side_to_side_is_bounded_too() {
    // One robot pushes it from the left for a cell, the other pulls it home from the right.
    let room = Room {
        homes: vec![(0, 0), (4, 0)],
        ..corridor(&[(-1, 0), (1, 0)], &[(1, 0)], &[(3, 0)], false)
    };
    assert_eq!(room.least_steps(true), Some(2));
    let found = bounds(&room);
    assert!((found.best_s() - 2.0).abs() < 1e-3, "{found:?}");
    // One robot by itself, by one grasp: two cells, and back.
    assert!((found.r_s().unwrap() - 4.0).abs() < 1e-3, "{found:?}");
}

#[test]
fn any_of_a_kind_may_fill_a_goal_but_each_only_one() {
    // The nearer object is nearer to both goals, but there is only one of it.
    let room = corridor(&[(0, 0)], &[(3, 0), (1, 0)], &[(4, 0), (5, 0)], true);
    let (found, steps) = (bounds(&room), room.least_steps(true).unwrap());
    // Five cells with objects, whichever goes where, and five without.
    assert!((found.shared_s - 10.0).abs() < 1e-3, "{found:?}");
    assert!(found.best_s() <= steps as f64 + 1e-3, "{steps} {found:?}");
    assert!(found.r_s().unwrap() >= room.least_steps(false).unwrap() as f64 - 1e-3);
    // One that stands at a goal of its kind may stay there.
    let there = corridor(&[(0, 0)], &[(4, 0), (1, 0)], &[(5, 0), (4, 0)], true);
    let found = bounds(&there);
    assert!(matches!(found.yardstick, Yardstick::Exact { .. }));
    assert!(found.best_s() <= there.least_steps(true).unwrap() as f64 + 1e-3);
}
