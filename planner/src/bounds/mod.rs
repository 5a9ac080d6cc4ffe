//! How fast a scene could be solved at best (rule 32).
//!
//! Responsible for: lower bounds that hold for every plan, and the yardstick R.
//! Not responsible for: interference, which none of them counts.
//!
//! For which plans each holds:
//! - (a) the longest task, (b) all work shared evenly and (c) the critical path hold for **every**
//!   plan on the scene's lattice, also for one that moves objects several times, hands them over
//!   or sets aside what needs no transport. By the triangle inequality: whatever way an object
//!   takes is no shorter than its transfer, and what robots do between carrying can be put
//!   together to ways from homes and goals to grasps and homes, each used once. The events of (c)
//!   are first grasps and last releases, and the constraints between those are necessary.
//! - R ([`Yardstick`]) holds for plans that move each object **once**. Others may be faster. It is
//!   a yardstick, not a bound.
//!
//! - Where an object has several grasps, or a goal can be filled by any of a kind, both are the
//!   least over what can be chosen (`choices`).
//!
//! Source: rule 32; (b)'s assignment by the Hungarian method.

mod choices;
mod routes;
mod timing;
mod yardstick;

use scene::{Scene, least_assignment};

use crate::bounds::timing::{Model, Timing};
use crate::bounds::yardstick::longest_s;
use crate::legs::{LEG_EXACTNESS, Legs};
use crate::store::Store;

pub use yardstick::{MOST_ROBOTS, MOST_TASKS, Yardstick};

/// Most tasks and robots together that (b) makes an assignment for; beyond, each way is chosen by
/// itself.
const MOST_ASSIGNED: usize = 400;

/// How much work bounds are worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoundLimits {
    /// Lattice points, over all floods, beyond which nothing is worked out.
    pub points: usize,
    /// Path searches for constraints; with fewer known all bounds are lower, and R is lower too.
    pub searches: u64,
    /// Partial plans that are looked at for R.
    pub nodes: u64,
}

impl Default for BoundLimits {
    fn default() -> Self {
        Self {
            points: 50_000_000,
            searches: 5_000,
            nodes: 250_000,
        }
    }
}

/// What is known of the makespan of a scene's plans, s.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    /// (a): the longest task by itself, from the nearest home and to the nearest.
    pub longest_task_s: f64,
    /// (b): all transfers, and the least ways between them, shared evenly by all robots
    /// that can get anywhere.
    pub shared_s: f64,
    /// (c): the longest chain of events, with the way to the first and from the last.
    pub critical_path_s: f64,
    /// R, or what is known of it.
    pub yardstick: Yardstick,
}

impl Bounds {
    /// The bounds of a scene at its beginning. None if there is nothing to bring anywhere, some
    /// task has no path, events wait for one another in a ring, or the scene is beyond the limits.
    #[must_use]
    pub fn of(scene: &Scene, limits: BoundLimits) -> Option<Self> {
        let floods = scene.homes.len() + 4 * scene.objects.len();
        let is_plain = (0..scene.objects.len()).all(|object| scene.is_plain(object));
        if !is_plain {
            return choices::bounds(scene, limits);
        }
        if floods.saturating_mul(scene.lattice.len()) > limits.points {
            return None;
        }
        let grips_s = [scene.robot.grasp_ns, scene.robot.release_ns].map(|ns| ns as f64 / 1e9);
        let store = Store::of(scene, limits.searches);
        let model = Model::new(&Legs::of(scene), grips_s.into(), store.precedences())?;
        Self::of_model(&model, limits.nodes)
    }

    /// The best lower bound that holds for every plan, s.
    #[must_use]
    pub const fn best_s(&self) -> f64 {
        self.longest_task_s
            .max(self.shared_s)
            .max(self.critical_path_s)
    }

    /// R, s, where it is known: exact within [`LEG_EXACTNESS`].
    #[must_use]
    pub const fn r_s(&self) -> Option<f64> {
        self.yardstick.exact_s()
    }

    fn of_model(model: &Model, nodes: u64) -> Option<Self> {
        let mut timing = Timing::new(model);
        if !timing.run() {
            return None;
        }
        let count = model.count();
        let alone =
            (0..count).map(|k| model.least_approach_s(k) + model.busy_s(k) + model.least_home_s(k));
        let path_s = longest_s(model, &timing, (0..count).map(|k| (k, None)));
        let below = 1.0 - LEG_EXACTNESS;
        Some(Self {
            longest_task_s: alone.fold(0.0, f64::max) * below,
            shared_s: shared_s(model)? * below,
            critical_path_s: path_s * below,
            yardstick: Yardstick::of_model(model, nodes),
        })
    }
}

/// The least ways from where robots become free to where they go next: rows are their starts and
/// `count` releases, columns as many grasps and the robots' homes.
fn ways_s(count: usize, robots: usize, way_s: impl Fn(usize, usize) -> f64) -> Option<f64> {
    let size = count + robots;
    if size <= MOST_ASSIGNED {
        return least_assignment(size, way_s);
    }
    let to_grasp = |column| {
        (0..size)
            .map(|row| way_s(row, column))
            .fold(f64::INFINITY, f64::min)
    };
    Some((0..count).map(to_grasp).sum())
}

/// Rule 32 (b).
fn shared_s(model: &Model) -> Option<f64> {
    let (count, robots) = (model.count(), model.robots);
    // Rows are where a robot is free: its start, a release. Columns are where it goes next: a
    // grasp, a home.
    let way_s =
        |row: usize, column: usize| match (row.checked_sub(robots), column.checked_sub(count)) {
            (None, None) => model.approach_s(row, column),
            (None, Some(home)) => model.between_s(row, home),
            (Some(from), None) => model.turn_s(from, column),
            (Some(from), Some(home)) => model.home_s(from, home),
        };
    let ways_s = ways_s(count, robots, way_s)?;
    let busy_s: f64 = (0..count).map(|k| model.busy_s(k)).sum();
    // Robots that are walled in take no share.
    let reaches = |robot: &usize| (0..count).any(|k| model.approach_s(*robot, k).is_finite());
    let shares = (0..robots).filter(reaches).count();
    Some((ways_s + busy_s) / shares.max(1) as f64)
}
