//! The shortest route of one robot through each set of tasks, and the best division of all tasks
//! among robots, as if robots never waited: dynamic programming over subsets.
//!
//! Responsible for: exact values of this relaxation, for every subset.
//! Not responsible for: what robots owe one another (`yardstick`, by `timing`).
//!
//! Terms: a *set* of tasks is a bit mask. On one robot, a task of which any event comes before an
//! event of another comes before it whole: none of the constraints is f < g.

use crate::bounds::timing::Model;

/// Durations of routes, s; infinite where there is none.
#[derive(Clone, Debug)]
pub(crate) struct Routes {
    tasks: usize,
    sets: usize,
    /// From the release of a task through a set to a robot's home, by robot, task, set.
    rest_s: Vec<f64>,
    /// From a robot's start through a set to its home, by robot, set.
    whole_s: Vec<f64>,
    /// The least longest route when robots from this one on share a set, by robot, set.
    shared_s: Vec<f64>,
}

impl Routes {
    /// For at most 16 tasks; memory and time grow with 2^tasks and 3^tasks.
    pub(crate) fn new(model: &Model) -> Self {
        let (tasks, robots) = (model.count(), model.robots);
        let sets = 1 << tasks;
        let mut routes = Self {
            tasks,
            sets,
            rest_s: vec![f64::INFINITY; robots * tasks * sets],
            whole_s: vec![f64::INFINITY; robots * sets],
            shared_s: vec![f64::INFINITY; (robots + 1) * sets],
        };
        let earlier = earlier(model);
        for robot in 0..robots {
            for set in 0..sets {
                routes.find_rest(model, &earlier, robot, set);
            }
            for set in 0..sets {
                let whole_s =
                    routes.first_of(&earlier, robot, set, |k| model.approach_s(robot, k), model);
                routes.whole_s[robot * sets + set] = if set == 0 {
                    model.between_s(robot, robot)
                } else {
                    whole_s
                };
            }
        }
        routes.share(robots);
        routes
    }

    /// From the release of task `k`, not in `set`, through `set` to the home of `robot`.
    pub(crate) fn rest_s(&self, robot: usize, k: usize, set: usize) -> f64 {
        self.rest_s[(robot * self.tasks + k) * self.sets + set]
    }

    /// From where `robot` starts through `set` to its home.
    pub(crate) fn whole_s(&self, robot: usize, set: usize) -> f64 {
        self.whole_s[robot * self.sets + set]
    }

    /// The least longest route when `robot` and those after it share `set`.
    pub(crate) fn shared_s(&self, robot: usize, set: usize) -> f64 {
        self.shared_s[robot * self.sets + set]
    }

    fn find_rest(&mut self, model: &Model, earlier: &[usize], robot: usize, set: usize) {
        for from in (0..self.tasks).filter(|from| set >> from & 1 == 0) {
            let rest_s = if set == 0 {
                model.home_s(from, robot)
            } else {
                self.first_of(earlier, robot, set, |k| model.turn_s(from, k), model)
            };
            self.rest_s[(robot * self.tasks + from) * self.sets + set] = rest_s;
        }
    }

    /// The best choice of the first task of a set, which it takes `reach_s` to get to.
    fn first_of(
        &self,
        earlier: &[usize],
        robot: usize,
        set: usize,
        reach_s: impl Fn(usize) -> f64,
        model: &Model,
    ) -> f64 {
        members(set)
            .filter(|&k| earlier[k] & set == 0)
            .map(|k| reach_s(k) + model.busy_s(k) + self.rest_s(robot, k, set & !(1 << k)))
            .fold(f64::INFINITY, f64::min)
    }

    fn share(&mut self, robots: usize) {
        self.shared_s[robots * self.sets] = 0.0;
        for robot in (0..robots).rev() {
            for set in 0..self.sets {
                let best_s = subsets(set)
                    .map(|part| {
                        let others_s = self.shared_s(robot + 1, set & !part);
                        self.whole_s(robot, part).max(others_s)
                    })
                    .fold(f64::INFINITY, f64::min);
                self.shared_s[robot * self.sets + set] = best_s;
            }
        }
    }
}

/// For each task the set of those that come before it on the same robot.
fn earlier(model: &Model) -> Vec<usize> {
    let instants = 2 * model.count();
    // Instants that lead to each instant, as masks: closed by squaring until nothing changes.
    let mut from: Vec<u64> = vec![0; instants];
    for k in 0..model.count() {
        from[2 * k + 1] |= 1 << (2 * k);
    }
    for &(before, after) in &model.before {
        from[after] |= 1 << before;
    }
    let mut changed = true;
    while changed {
        changed = false;
        for instant in 0..instants {
            let further = members(from[instant] as usize).fold(0, |mask, at| mask | from[at]);
            changed |= further & !from[instant] != 0;
            from[instant] |= further;
        }
    }
    let tasks_of = |mask: u64| members(mask as usize).fold(0, |set, at| set | 1 << (at / 2));
    (0..model.count())
        .map(|k| tasks_of(from[2 * k] | from[2 * k + 1]) & !(1_usize << k))
        .collect()
}

/// The members of a set, ascending.
pub(crate) fn members(set: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(set), |left| Some(left & left.wrapping_sub(1)))
        .take_while(|left| *left != 0)
        .map(|left| left.trailing_zeros() as usize)
}

/// All subsets of a set, the empty one last.
pub(crate) fn subsets(set: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(set), move |part| {
        (*part != 0).then(|| (part - 1) & set)
    })
}
