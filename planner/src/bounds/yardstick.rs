//! R, the yardstick: the exact optimum if nothing were ever in anybody's way (rule 32).
//!
//! Responsible for: the least makespan over all assignments and orders in which each object is
//! moved once, by one robot, along the shortest way among the walls, and necessary constraints
//! between events are kept, robots waiting for one another where they have to.
//! Not responsible for: whether such a plan can be carried out. R is no lower bound on plans that
//! move an object twice or hand it over: a swap may be faster that way, or possible at all.
//!
//! How: branch and bound. Routes grow robot by robot, task by task; times come from longest paths
//! through the events of all robots (`timing`). What is left is bounded by subset dynamic
//! programming as if robots never waited (`routes`), which is tight where they need not.

use crate::bounds::routes::{Routes, members, subsets};
use crate::bounds::timing::{Model, Timing};
use crate::event::Precedence;
use crate::legs::Legs;

/// Most tasks that R is worked out for.
pub const MOST_TASKS: usize = 12;
/// Most robots that R is worked out for.
pub const MOST_ROBOTS: usize = 16;
/// Makespans this close are the same, s.
const SAME_S: f64 = 1e-9;

/// What is known of R.
#[derive(Clone, Debug, PartialEq)]
pub enum Yardstick {
    /// R, and a plan that takes so long: which tasks each robot does, in order.
    Exact {
        /// R, s.
        makespan_s: f64,
        /// Tasks of each robot.
        routes: Vec<Vec<usize>>,
    },
    /// The work limit was reached, or there are too many tasks or robots: a bound, not R.
    AtLeast {
        /// R is no less than this, s.
        makespan_s: f64,
    },
    /// No plan moves each object once.
    Impossible,
}

impl Yardstick {
    /// R, s; none if it is not known or there is none.
    #[must_use]
    pub const fn exact_s(&self) -> Option<f64> {
        match self {
            Self::Exact { makespan_s, .. } => Some(*makespan_s),
            Self::AtLeast { .. } | Self::Impossible => None,
        }
    }

    /// Works R out for tasks with these legs, the durations of a grasp and a release, s, and the
    /// order of events that has to be kept, looking at `nodes` partial plans at most. None if
    /// there is nothing to do, or a task that no robot can do.
    #[must_use]
    pub fn of(
        legs: &Legs,
        grips_s: (f64, f64),
        precedences: impl IntoIterator<Item = Precedence>,
        nodes: u64,
    ) -> Option<Self> {
        Some(Self::of_model(
            &Model::new(legs, grips_s, precedences)?,
            nodes,
        ))
    }

    pub(crate) fn of_model(model: &Model, nodes: u64) -> Self {
        let mut timing = Timing::new(model);
        if !timing.run() {
            return Self::Impossible;
        }
        let path_s = longest_s(model, &timing, (0..model.count()).map(|k| (k, None)));
        if model.count() > MOST_TASKS || model.robots > MOST_ROBOTS {
            return Self::AtLeast { makespan_s: path_s };
        }
        let routes = Routes::new(model);
        let all = (1 << model.count()) - 1;
        let least_s = path_s.max(routes.shared_s(0, all));
        let mut search = Search {
            model,
            routes,
            timing,
            least_s,
            growing: vec![Vec::new(); model.robots],
            best: None,
            nodes,
        };
        search.grow(0, all);
        match (search.best, search.nodes) {
            (Some((best_s, _)), 0) if best_s > least_s + SAME_S => Self::AtLeast {
                makespan_s: least_s,
            },
            (None, 0) => Self::AtLeast {
                makespan_s: least_s,
            },
            (None, _) => Self::Impossible,
            (Some((makespan_s, mut routes)), _) => {
                for task in routes.iter_mut().flatten() {
                    *task = model.tasks[*task];
                }
                Self::Exact { makespan_s, routes }
            }
        }
    }
}

/// When the last of these tasks' robots is home: its own home, or the nearest.
pub(crate) fn longest_s(
    model: &Model,
    timing: &Timing,
    tasks: impl Iterator<Item = (usize, Option<usize>)>,
) -> f64 {
    tasks
        .map(|(k, robot)| {
            let home_s =
                robot.map_or_else(|| model.least_home_s(k), |robot| model.home_s(k, robot));
            timing.free_s(model, k) + home_s
        })
        .fold(0.0, f64::max)
}

struct Search<'a> {
    model: &'a Model,
    routes: Routes,
    timing: Timing,
    /// No plan is shorter, s.
    least_s: f64,
    growing: Vec<Vec<usize>>,
    /// The best plan so far: its makespan, s, and its routes.
    best: Option<(f64, Vec<Vec<usize>>)>,
    /// Partial plans that may still be looked at.
    nodes: u64,
}

impl Search<'_> {
    /// Tries all ways to go on with the route of `robot` and those after it, `left` being the
    /// tasks that are on no route.
    fn grow(&mut self, robot: usize, left: usize) {
        if robot == self.model.robots || left == 0 {
            self.finish(left);
            return;
        }
        let mut choices: Vec<(f64, Option<usize>)> = Vec::with_capacity(members(left).count() + 1);
        if robot + 1 < self.model.robots {
            choices.extend(self.bound_s(robot + 1, left).map(|bound_s| (bound_s, None)));
        }
        for k in members(left) {
            self.append(robot, k);
            let bound_s = self.bound_s(robot, left & !(1 << k));
            self.take_off(robot);
            choices.extend(bound_s.map(|bound_s| (bound_s, Some(k))));
        }
        choices.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (bound_s, choice) in choices {
            if self.nodes == 0 || !self.is_better(bound_s) {
                return;
            }
            self.nodes -= 1;
            match choice {
                None => self.grow(robot + 1, left),
                Some(k) => {
                    self.append(robot, k);
                    self.grow(robot, left & !(1 << k));
                    self.take_off(robot);
                }
            }
        }
    }

    /// Whether a plan no longer than this would be worth finding.
    fn is_better(&self, makespan_s: f64) -> bool {
        let best_s = self
            .best
            .as_ref()
            .map_or(f64::INFINITY, |(best_s, _)| *best_s);
        // Nothing is better than the least.
        makespan_s < best_s - SAME_S && best_s > self.least_s + SAME_S
    }

    /// Takes the plan over if it is complete and better.
    fn finish(&mut self, left: usize) {
        if left != 0 || !self.timing.run() {
            return;
        }
        let makespan_s = self.closed_s(self.model.robots);
        if self.is_better(makespan_s) {
            self.best = Some((makespan_s, self.growing.clone()));
        }
    }

    /// No plan that goes on from here is shorter, `robot` being the one whose route still grows.
    /// None if there is none.
    fn bound_s(&mut self, robot: usize, left: usize) -> Option<f64> {
        if !self.timing.run() {
            return None;
        }
        let closed_s = self.closed_s(robot);
        let waiting = members(left).map(|k| (k, None));
        let waiting_s = longest_s(self.model, &self.timing, waiting);
        let last = self.growing[robot].last().copied();
        let free_s = last.map_or(0.0, |k| self.timing.free_s(self.model, k));
        let open_s = subsets(left)
            .map(|part| {
                let own_s = match last {
                    Some(k) => free_s + self.routes.rest_s(robot, k, part),
                    None => self.routes.whole_s(robot, part),
                };
                own_s.max(self.routes.shared_s(robot + 1, left & !part))
            })
            .fold(f64::INFINITY, f64::min);
        let bound_s = closed_s.max(waiting_s).max(open_s);
        bound_s.is_finite().then_some(bound_s)
    }

    /// When the last robot before `robot` is home, as far as is known.
    fn closed_s(&self, robot: usize) -> f64 {
        let idle = (0..robot).filter(|&idle| self.growing[idle].is_empty());
        let idle_s = idle
            .map(|idle| self.model.between_s(idle, idle))
            .fold(0.0, f64::max);
        let ends = (0..robot).filter_map(|done| Some((*self.growing[done].last()?, Some(done))));
        longest_s(self.model, &self.timing, ends).max(idle_s)
    }

    fn append(&mut self, robot: usize, k: usize) {
        match self.growing[robot].last() {
            Some(&from) => self.timing.link(self.model, from, k),
            None => self.timing.begin_route(self.model, robot, k),
        }
        self.growing[robot].push(k);
    }

    fn take_off(&mut self, robot: usize) {
        let Some(k) = self.growing[robot].pop() else {
            return;
        };
        match self.growing[robot].last() {
            Some(&from) => self.timing.unlink(from),
            None => self.timing.unbegin_route(k),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bounds::Bounds;
    use crate::event::Event;
    use proptest::prelude::*;
    use scene::Vec2;

    const PLENTY: u64 = 1_000_000;

    /// An instance as all rules see it: legs, grips, order.
    type Instance = (Legs, (f64, f64), Vec<Precedence>);

    fn instances(tasks: usize, robots: usize) -> impl Strategy<Value = Instance> {
        let point = || (0.0..10.0, 0.0..10.0).prop_map(|(x, y)| Vec2::new(x, y));
        let task = (point(), point());
        let order = (any::<[prop::sample::Index; 2]>(), 0_usize..3);
        (
            proptest::collection::vec(point(), 1..=robots),
            proptest::collection::vec(task, 1..=tasks),
            (0.1..2.0, 0.1..2.0),
            proptest::collection::vec(order, 0..5),
        )
            .prop_map(|(homes, tasks, grips_s, orders)| {
                let orders = orders.iter().filter_map(|(ends, kind)| {
                    let [one, two] = ends.map(|end| end.index(tasks.len()));
                    let (before, after) = match kind {
                        0 => (Event::Grasp(one), Event::Grasp(two)),
                        1 => (Event::Grasp(one), Event::Finish(two)),
                        _ => (Event::Finish(one), Event::Finish(two)),
                    };
                    (one != two).then_some(Precedence { before, after })
                });
                let orders = orders.collect();
                (Legs::in_the_open(&homes, &tasks), grips_s, orders)
            })
    }

    /// Every order of the tasks, cut into every sequence of routes.
    fn brute_s(instance: &Instance) -> Option<f64> {
        fn place(instance: &Instance, routes: &mut Vec<Vec<usize>>, task: usize) -> f64 {
            if task == instance.0.tasks().len() {
                return makespan_s(instance, routes).unwrap_or(f64::INFINITY);
            }
            let mut best_s = f64::INFINITY;
            for robot in 0..routes.len() {
                for at in 0..=routes[robot].len() {
                    routes[robot].insert(at, task);
                    best_s = best_s.min(place(instance, routes, task + 1));
                    routes[robot].remove(at);
                }
            }
            best_s
        }
        let best_s = place(instance, &mut vec![Vec::new(); instance.0.robots()], 0);
        best_s.is_finite().then_some(best_s)
    }

    /// Times by going over everything again and again; none if they never settle.
    fn makespan_s(
        (legs, (grasp_s, release_s), orders): &Instance,
        routes: &[Vec<usize>],
    ) -> Option<f64> {
        let tasks = legs.tasks().len();
        let mut lifted_s = vec![0.0_f64; tasks];
        let mut freed_s = vec![0.0_f64; tasks];
        for _ in 0..=2 * tasks {
            let (old_lifted_s, old_freed_s) = (lifted_s.clone(), freed_s.clone());
            let over_s = |event: Event| match event {
                Event::Grasp(task) => old_lifted_s[task],
                Event::Finish(task) => old_freed_s[task],
            };
            let held_up_s = |event: Event| {
                let orders = orders.iter().filter(move |order| order.after == event);
                orders.map(|order| over_s(order.before)).fold(0.0, f64::max)
            };
            let mut ends_s = Vec::new();
            for (robot, route) in routes.iter().enumerate() {
                let mut last = None;
                for &task in route {
                    let there_s = match last {
                        None => legs.approach_s(robot, task).unwrap(),
                        Some(from) => old_freed_s[from] + legs.turn_s(from, task).unwrap(),
                    };
                    lifted_s[task] = there_s.max(held_up_s(Event::Grasp(task))) + grasp_s;
                    let there_s = old_lifted_s[task] + legs.transfer_s(task).unwrap();
                    freed_s[task] = there_s.max(held_up_s(Event::Finish(task))) + release_s;
                    last = Some(task);
                }
                ends_s.extend(last.map(|task| freed_s[task] + legs.home_s(task, robot).unwrap()));
            }
            if old_lifted_s == lifted_s && old_freed_s == freed_s {
                return ends_s.into_iter().reduce(f64::max);
            }
        }
        None
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        #[test]
        fn r_is_what_trying_everything_finds(instance in instances(4, 3)) {
            let (legs, grips_s, orders) = instance.clone();
            let found = Yardstick::of(&legs, grips_s, orders, PLENTY).unwrap();
            match (&found, brute_s(&instance)) {
                (Yardstick::Exact { makespan_s: found_s, routes }, Some(best_s)) => {
                    prop_assert!((found_s - best_s).abs() < 1e-6, "{found_s} {best_s}");
                    let told_s = makespan_s(&instance, routes).unwrap();
                    prop_assert!((found_s - told_s).abs() < 1e-6, "{found_s} {told_s}");
                }
                (found, best_s) => prop_assert_eq!((found, best_s), (&Yardstick::Impossible, None)),
            }
        }

        #[test]
        fn no_bound_is_above_r_nor_r_below_its_own_bound(instance in instances(6, 3), nodes in 0_u64..50) {
            let (legs, grips_s, orders) = instance;
            let model = Model::new(&legs, grips_s, orders).unwrap();
            let Some(bounds) = Bounds::of_model(&model, PLENTY) else {
                return Ok(());
            };
            prop_assert!(bounds.longest_task_s <= bounds.critical_path_s + 1e-9);
            let Some(r_s) = bounds.r_s() else {
                prop_assert_eq!(bounds.yardstick, Yardstick::Impossible);
                return Ok(());
            };
            prop_assert!(bounds.best_s() <= r_s + 1e-9, "{bounds:?}");
            match Yardstick::of_model(&model, nodes) {
                Yardstick::AtLeast { makespan_s } => prop_assert!(makespan_s <= r_s + 1e-9),
                other => prop_assert!((other.exact_s().unwrap() - r_s).abs() < 1e-9),
            }
        }
    }

    /// Two tasks in a row, at 0 → 1 and 2 → 3 on a line, the robots at home at 0 and 3.
    fn line() -> Legs {
        let at = |x: f64| Vec2::new(x, 0.0);
        Legs::in_the_open(
            &[at(0.0), at(3.0)],
            &[(at(0.0), at(1.0)), (at(2.0), at(3.0))],
        )
    }

    fn order(before: Event, after: Event) -> Precedence {
        Precedence { before, after }
    }

    #[test]
    fn a_robot_waits_for_what_another_does() {
        use Event::{Finish, Grasp};
        let r_s = |orders: &[Precedence]| {
            let yardstick = Yardstick::of(&line(), (0.0, 0.0), orders.iter().copied(), PLENTY);
            yardstick.unwrap().exact_s()
        };
        // Each robot does what is next to it and goes back: 1 there, 1 back.
        assert_eq!(r_s(&[]), Some(2.0));
        // Robot 1 is at its grasp at 1, and that is when object 0 is put down.
        assert_eq!(r_s(&[order(Finish(0), Grasp(1))]), Some(2.0));
        // Object 0 may be put down only once object 1 is, at 2; then 1 back.
        assert_eq!(r_s(&[order(Finish(1), Finish(0))]), Some(3.0));
        // Both: in a ring.
        assert_eq!(
            r_s(&[order(Finish(1), Finish(0)), order(Finish(0), Grasp(1))]),
            None
        );
    }

    #[test]
    fn routes_are_sums_of_their_legs() {
        let model = Model::new(&line(), (0.0, 0.0), []).unwrap();
        let routes = Routes::new(&model);
        let (first, second, both) = (0b01, 0b10, 0b11);
        // From 0 to 1 and back; to 2, to 3 and back; one after the other.
        assert_eq!(routes.whole_s(0, first), 2.0);
        assert_eq!(routes.whole_s(0, second), 6.0);
        assert_eq!(routes.whole_s(0, both), 6.0);
        // From 1 to 2, to 3 and back.
        assert_eq!(routes.rest_s(0, 0, second), 5.0);
        assert_eq!(routes.shared_s(0, both), 2.0);
    }

    /// A robot that has one object cannot grasp another before it has put that down.
    #[test]
    fn on_one_robot_what_comes_before_a_finish_comes_before_the_whole_task() {
        use Event::{Finish, Grasp};
        for before in [Grasp(1), Finish(1)] {
            let model = Model::new(&line(), (0.0, 0.0), [order(before, Finish(0))]).unwrap();
            let routes = Routes::new(&model);
            // Robot 0: to 2 and 3, back to 0, to 1 and home.
            assert_eq!(routes.whole_s(0, 0b11), 8.0, "{before:?}");
            // Nothing comes after task 0, and task 1 not.
            assert_eq!(routes.rest_s(0, 0, 0b10), 5.0);
            assert_eq!(routes.rest_s(0, 1, 0b01), 5.0);
        }
    }

    #[test]
    fn a_small_room_is_searched_as_a_large_one_is() {
        let at = |x: f64| Vec2::new(x / 64.0, 0.0);
        let tasks = [(at(0.0), at(1.0)), (at(2.0), at(3.0))];
        let legs = Legs::in_the_open(&[at(0.0), at(3.0)], &tasks);
        let yardstick = Yardstick::of(&legs, (0.0, 0.0), [], PLENTY).unwrap();
        // As on the line, where it is 2.
        assert_eq!(yardstick.exact_s(), Some(2.0 / 64.0));
    }

    #[test]
    fn a_swap_takes_two_robots_that_hold() {
        use Event::{Finish, Grasp};
        let orders = [order(Grasp(0), Finish(1)), order(Grasp(1), Finish(0))];
        let two = Yardstick::of(&line(), (0.0, 0.0), orders, PLENTY).unwrap();
        assert_eq!(two.exact_s(), Some(2.0));
        let at = |x: f64| Vec2::new(x, 0.0);
        let one = Legs::in_the_open(&[at(0.0)], &[(at(0.0), at(1.0)), (at(2.0), at(3.0))]);
        let one = Yardstick::of(&one, (0.0, 0.0), orders, PLENTY);
        assert_eq!(one, Some(Yardstick::Impossible));
    }

    #[test]
    fn beyond_what_is_exact_it_is_a_bound_and_says_so() {
        let at = |x: f64| Vec2::new(x, 0.0);
        let tasks = vec![(at(1.0), at(2.0)); MOST_TASKS + 1];
        let many = Yardstick::of(
            &Legs::in_the_open(&[at(0.0)], &tasks),
            (0.0, 0.0),
            [],
            PLENTY,
        );
        assert_eq!(many, Some(Yardstick::AtLeast { makespan_s: 4.0 }));
    }
}
