//! When events can happen at the earliest: longest paths through the graph of events (PERT).
//!
//! Responsible for: times of all events for given routes, or for none; noticing that events wait
//! for one another in a ring.
//! Not responsible for: choosing routes (`yardstick`).
//!
//! Terms: each task has two instants, numbered `2k` and `2k + 1` for the task with number k of
//! the model: a robot *begins to grasp*, and *begins to release*. What has to be before something
//! has to be over by then: a grasp when the object is lifted, a release when the robot is free.

use crate::event::{Event, Precedence};
use crate::legs::Legs;

/// All that times depend on, with tasks numbered from 0 without gaps. Durations in seconds,
/// infinite where there is no path.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    pub(crate) tasks: Vec<usize>,
    pub(crate) robots: usize,
    pub(crate) grasp_s: f64,
    pub(crate) release_s: f64,
    approach_s: Vec<f64>,
    transfer_s: Vec<f64>,
    turn_s: Vec<f64>,
    home_s: Vec<f64>,
    between_s: Vec<f64>,
    /// Pairs of instants: the grip that begins at the first is over before the second.
    pub(crate) before: Vec<(usize, usize)>,
}

/// Durations of ways, s, each table row by row: by robot and task, by task, by task and task, by
/// task and robot, by robot and robot.
pub(crate) struct Tables {
    pub(crate) approach_s: Vec<f64>,
    pub(crate) transfer_s: Vec<f64>,
    pub(crate) turn_s: Vec<f64>,
    pub(crate) home_s: Vec<f64>,
    pub(crate) between_s: Vec<f64>,
}

impl Model {
    /// None if there is no task, or a task that no robot can do at all.
    pub(crate) fn new(
        legs: &Legs,
        grips_s: (f64, f64),
        precedences: impl IntoIterator<Item = Precedence>,
    ) -> Option<Self> {
        let (tasks, robots) = (legs.tasks().to_vec(), legs.robots());
        let leg = |seconds: Option<f64>| seconds.unwrap_or(f64::INFINITY);
        let table = |rows: usize, columns: usize, of: &dyn Fn(usize, usize) -> Option<f64>| {
            let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
            cells
                .map(|(row, column)| leg(of(row, column)))
                .collect::<Vec<_>>()
        };
        let count = tasks.len();
        let tables = Tables {
            approach_s: table(robots, count, &|r, k| legs.approach_s(r, tasks[k])),
            transfer_s: table(1, count, &|_, k| legs.transfer_s(tasks[k])),
            turn_s: table(count, count, &|i, k| legs.turn_s(tasks[i], tasks[k])),
            home_s: table(count, robots, &|k, r| legs.home_s(tasks[k], r)),
            between_s: table(robots, robots, &|from, to| legs.between_s(from, to)),
        };
        Self::with(tasks, robots, grips_s, tables, precedences)
    }

    /// The same from tables, for tasks in ascending order.
    pub(crate) fn with(
        tasks: Vec<usize>,
        robots: usize,
        (grasp_s, release_s): (f64, f64),
        tables: Tables,
        precedences: impl IntoIterator<Item = Precedence>,
    ) -> Option<Self> {
        let count = tasks.len();
        let number = |event: Event| tasks.binary_search(&event.task()).ok();
        let instant = |event: Event| match event {
            Event::Grasp(_) => Some(2 * number(event)?),
            Event::Finish(_) => Some(2 * number(event)? + 1),
        };
        let mut before: Vec<_> = precedences
            .into_iter()
            .filter_map(|order| Some((instant(order.before)?, instant(order.after)?)))
            .collect();
        before.sort_unstable();
        before.dedup();
        let model = Self {
            robots,
            grasp_s,
            release_s,
            approach_s: tables.approach_s,
            transfer_s: tables.transfer_s,
            turn_s: tables.turn_s,
            home_s: tables.home_s,
            between_s: tables.between_s,
            before,
            tasks,
        };
        let can_do =
            |k| (model.least_approach_s(k) + model.busy_s(k) + model.least_home_s(k)).is_finite();
        (count > 0 && (0..count).all(can_do)).then_some(model)
    }

    /// Number of tasks.
    pub(crate) fn count(&self) -> usize {
        self.tasks.len()
    }

    pub(crate) fn approach_s(&self, robot: usize, k: usize) -> f64 {
        self.approach_s[robot * self.count() + k]
    }

    pub(crate) fn transfer_s(&self, k: usize) -> f64 {
        self.transfer_s[k]
    }

    pub(crate) fn turn_s(&self, from: usize, to: usize) -> f64 {
        self.turn_s[from * self.count() + to]
    }

    pub(crate) fn home_s(&self, k: usize, robot: usize) -> f64 {
        self.home_s[k * self.robots + robot]
    }

    pub(crate) fn between_s(&self, from: usize, to: usize) -> f64 {
        self.between_s[from * self.robots + to]
    }

    /// From where a robot begins to grasp to where it is free again.
    pub(crate) fn busy_s(&self, k: usize) -> f64 {
        self.grasp_s + self.transfer_s[k] + self.release_s
    }

    pub(crate) fn least_approach_s(&self, k: usize) -> f64 {
        let robots = (0..self.robots).map(|robot| self.approach_s(robot, k));
        robots.fold(f64::INFINITY, f64::min)
    }

    pub(crate) fn least_home_s(&self, k: usize) -> f64 {
        let robots = (0..self.robots).map(|robot| self.home_s(k, robot));
        robots.fold(f64::INFINITY, f64::min)
    }

    /// Duration of the grip that begins at an instant.
    pub(crate) fn grip_s(&self, instant: usize) -> f64 {
        if instant.is_multiple_of(2) {
            self.grasp_s
        } else {
            self.release_s
        }
    }
}

/// Earliest times for routes that may still grow. Memory is taken once.
#[derive(Clone, Debug)]
pub(crate) struct Timing {
    /// What each instant comes before, and how long after it that may begin at the earliest.
    later: Vec<Vec<(usize, f64)>>,
    /// The same for what the routes add: from each task to the next on its robot.
    next: Vec<Option<(usize, f64)>>,
    /// Earliest begin of each grasp that the routes or the homes allow by themselves, s.
    heads_s: Vec<f64>,
    least_heads_s: Vec<f64>,
    times_s: Vec<f64>,
    waits_for: Vec<u32>,
    ready: Vec<usize>,
}

impl Timing {
    /// With no routes: each grasp as early as some robot can be there.
    pub(crate) fn new(model: &Model) -> Self {
        let instants = 2 * model.count();
        let mut later = vec![Vec::new(); instants];
        for k in 0..model.count() {
            later[2 * k].push((2 * k + 1, model.grasp_s + model.transfer_s(k)));
        }
        for &(before, after) in &model.before {
            later[before].push((after, model.grip_s(before)));
        }
        let heads_s: Vec<_> = (0..model.count())
            .map(|k| model.least_approach_s(k))
            .collect();
        Self {
            later,
            next: vec![None; model.count()],
            least_heads_s: heads_s.clone(),
            heads_s,
            times_s: vec![0.0; instants],
            waits_for: vec![0; instants],
            ready: Vec::with_capacity(instants),
        }
    }

    /// Makes task `k` the first of a robot's route.
    pub(crate) fn begin_route(&mut self, model: &Model, robot: usize, k: usize) {
        self.heads_s[k] = model.approach_s(robot, k);
    }

    /// Takes [`Timing::begin_route`] back.
    pub(crate) fn unbegin_route(&mut self, k: usize) {
        self.heads_s[k] = self.least_heads_s[k];
    }

    /// Makes `to` follow `from` on a robot's route.
    pub(crate) fn link(&mut self, model: &Model, from: usize, to: usize) {
        self.next[from] = Some((to, model.release_s + model.turn_s(from, to)));
    }

    /// Takes [`Timing::link`] back.
    pub(crate) fn unlink(&mut self, from: usize) {
        self.next[from] = None;
    }

    /// Works out all times; false if events wait for one another in a ring.
    pub(crate) fn run(&mut self) -> bool {
        let Self {
            later,
            next,
            heads_s,
            times_s,
            waits_for,
            ready,
            ..
        } = self;
        waits_for.fill(0);
        for (after, _) in later.iter().flatten() {
            waits_for[*after] += 1;
        }
        for (to, _) in next.iter().flatten() {
            waits_for[2 * to] += 1;
        }
        for (k, head_s) in heads_s.iter().enumerate() {
            times_s[2 * k] = *head_s;
            times_s[2 * k + 1] = 0.0;
        }
        ready.clear();
        ready.extend((0..waits_for.len()).filter(|&instant| waits_for[instant] == 0));
        let mut done = 0;
        while let Some(&instant) = ready.get(done) {
            done += 1;
            let now_s = times_s[instant];
            let follows = (instant % 2 == 1)
                .then(|| next[instant / 2].map(|(to, after_s)| (2 * to, after_s)))
                .flatten();
            for (after, lag_s) in later[instant].iter().copied().chain(follows) {
                times_s[after] = times_s[after].max(now_s + lag_s);
                waits_for[after] -= 1;
                if waits_for[after] == 0 {
                    ready.push(after);
                }
            }
        }
        done == waits_for.len()
    }

    /// When the robot that does task `k` is free again, s.
    pub(crate) fn free_s(&self, model: &Model, k: usize) -> f64 {
        self.times_s[2 * k + 1] + model.release_s
    }
}
