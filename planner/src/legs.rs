//! The lengths of all legs that plans are put together from, walls only, in seconds (rule 32).
//!
//! Responsible for: robot's start → grasp, transfer, release → next grasp, release → home, each
//! the shortest on the lattice with nobody and no object in the way; with as few floods as that
//! takes.
//! Not responsible for: grips (`scene.robot` has their durations), interference, performance
//! values (`lengths`).
//!
//! Terms: the *grasp* of a task is where a robot's centre is when it takes the object up at its
//! initial place; its *release* where it is when it puts it down at the goal. A *turn* leads from
//! one task's release to another's grasp.
//!
//! How: motion is reversible, so one flood from each home answers approaches and ways home, and
//! one from each grasp all turns to it; a transfer is one path search. That is m + n floods and n
//! searches for m robots and n tasks, and m floods more where robots do not start from home.

use std::task::Poll;

use scene::{Budget, ROBOT_ALONE, Scene, UNITS_PER_RESET, Vec2};
use shm_types::Counters;

use crate::field::DistanceField;
use crate::meter::Meter;
use crate::places::Places;
use crate::search::PathSearch;

/// Distances read from a flood are exact within this share of their length.
pub const LEG_EXACTNESS: f64 = 2e-6;

/// Ends of floods that are looked up for one unit.
const LOOKUPS_PER_UNIT: u64 = 4;

/// All legs' durations, s. Tasks are numbered as their objects; whatever has no path is none.
#[derive(Clone, Debug, PartialEq)]
pub struct Legs {
    tasks: Vec<usize>,
    objects: usize,
    robots: usize,
    approach_s: Vec<f64>,
    transfer_s: Vec<f64>,
    turn_s: Vec<f64>,
    home_s: Vec<f64>,
    between_s: Vec<f64>,
}

impl Legs {
    /// The legs of a run from its beginning: objects at their starts, robots at home.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let mut search = LegSearch::new(scene, Places::at_start(scene), &scene.homes);
        let mut budget = Budget::new(u64::MAX);
        while search
            .advance(scene, &mut budget, &mut Counters::default())
            .is_pending()
        {}
        search.legs
    }

    /// Straight ways at 1 m/s between points of an open plane, for tests: robots start from
    /// `homes`, each task has a grasp and a release, m.
    #[cfg(test)]
    pub(crate) fn in_the_open(homes: &[Vec2], tasks: &[(Vec2, Vec2)]) -> Self {
        let ways = |from: Vec<Vec2>, to: Vec<Vec2>| -> Vec<f64> {
            let pairs = from.iter().flat_map(|a| to.iter().map(move |b| (a, b)));
            pairs.map(|(a, b)| (a - b).norm()).collect()
        };
        let grasps = || tasks.iter().map(|task| task.0).collect();
        let releases = || tasks.iter().map(|task| task.1).collect();
        Self {
            tasks: (0..tasks.len()).collect(),
            objects: tasks.len(),
            robots: homes.len(),
            approach_s: ways(homes.to_vec(), grasps()),
            transfer_s: tasks.iter().map(|(a, b)| (a - b).norm()).collect(),
            turn_s: ways(releases(), grasps()),
            home_s: ways(releases(), homes.to_vec()),
            between_s: ways(homes.to_vec(), homes.to_vec()),
        }
    }

    /// The tasks they are about, ascending: objects with a goal that are not there yet.
    #[must_use]
    pub fn tasks(&self) -> &[usize] {
        &self.tasks
    }

    /// Number of robots.
    #[must_use]
    pub const fn robots(&self) -> usize {
        self.robots
    }

    /// From where `robot` starts to the grasp of `task`.
    #[must_use]
    pub fn approach_s(&self, robot: usize, task: usize) -> Option<f64> {
        known(self.approach_s[robot * self.objects + task])
    }

    /// From the grasp of `task` to its release, carrying it.
    #[must_use]
    pub fn transfer_s(&self, task: usize) -> Option<f64> {
        known(self.transfer_s[task])
    }

    /// From the release of task `from` to the grasp of task `to`; of its own, too: nobody goes
    /// there, but bounds ask for it.
    #[must_use]
    pub fn turn_s(&self, from: usize, to: usize) -> Option<f64> {
        known(self.turn_s[from * self.objects + to])
    }

    /// From the release of `task` to the home of `robot`.
    #[must_use]
    pub fn home_s(&self, task: usize, robot: usize) -> Option<f64> {
        known(self.home_s[task * self.robots + robot])
    }

    /// From where robot `from` starts to the home of robot `to`.
    #[must_use]
    pub fn between_s(&self, from: usize, to: usize) -> Option<f64> {
        known(self.between_s[from * self.robots + to])
    }

    /// The least of [`Legs::approach_s`] over the robots.
    #[must_use]
    pub fn least_approach_s(&self, task: usize) -> Option<f64> {
        least((0..self.robots).map(|robot| self.approach_s[robot * self.objects + task]))
    }

    /// The least of [`Legs::home_s`] over the robots.
    #[must_use]
    pub fn least_home_s(&self, task: usize) -> Option<f64> {
        least((0..self.robots).map(|robot| self.home_s[task * self.robots + robot]))
    }
}

fn known(seconds: f64) -> Option<f64> {
    seconds.is_finite().then_some(seconds)
}

fn least(seconds: impl Iterator<Item = f64>) -> Option<f64> {
    known(seconds.fold(f64::INFINITY, f64::min))
}

/// A step of the computation, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// The flood from this robot's home.
    Home(usize),
    /// The flood from where this robot starts, if that is elsewhere.
    Start(usize),
    /// The flood from the grasp of this task, by its place in the list.
    Grasp(usize),
    /// The transfer of this task, by its place in the list.
    Transfer(usize),
    /// All is known.
    Ready,
}

/// Works the legs out, resumable within a budget. After construction nothing allocates.
#[derive(Clone, Debug)]
pub struct LegSearch {
    legs: Legs,
    places: Vec<Option<Places>>,
    starts: Vec<Vec2>,
    speed_m_per_s: f64,
    field: DistanceField,
    search: PathSearch,
    stage: Stage,
    /// Whether the stage's flood or search has begun.
    begun: bool,
    meter: Meter,
}

impl LegSearch {
    /// Begins with the open tasks' places, one item an object, none for those that are no task
    /// or finished; objects that are at their goals already are no tasks either. `starts` is
    /// where each robot starts, m.
    #[must_use]
    pub fn new(
        scene: &Scene,
        places: impl IntoIterator<Item = Option<Places>>,
        starts: &[Vec2],
    ) -> Self {
        let mut places: Vec<_> = places
            .into_iter()
            .map(|places| places.filter(Places::is_open))
            .collect();
        places.resize(scene.objects.len(), None);
        let tasks = (0..places.len()).filter(|&task| places[task].is_some());
        let (objects, robots) = (places.len(), scene.homes.len());
        let unknown = |count: usize| vec![f64::INFINITY; count];
        let legs = Legs {
            tasks: tasks.collect(),
            objects,
            robots,
            approach_s: unknown(robots * objects),
            transfer_s: unknown(objects),
            turn_s: unknown(objects * objects),
            home_s: unknown(objects * robots),
            between_s: unknown(robots * robots),
        };
        Self {
            legs,
            places,
            starts: starts.to_vec(),
            speed_m_per_s: scene.robot.speed_m_per_s,
            field: DistanceField::new(scene),
            search: PathSearch::new(scene),
            stage: Stage::Home(0),
            begun: false,
            meter: Meter::default(),
        }
    }

    /// Goes on within `budget`; ready when all legs are known.
    pub fn advance(
        &mut self,
        scene: &Scene,
        budget: &mut Budget,
        counters: &mut Counters,
    ) -> Poll<()> {
        while self.stage != Stage::Ready {
            if !self.meter.settle(budget) {
                return Poll::Pending;
            }
            let next = if self.begun {
                match self.go_on(scene, budget, counters) {
                    Poll::Pending => return Poll::Pending,
                    Poll::Ready(()) => self.following(),
                }
            } else {
                self.begin(scene)
            };
            self.begun = next == self.stage;
            self.stage = next;
        }
        Poll::Ready(())
    }

    /// What was found; complete once [`LegSearch::advance`] was ready.
    #[must_use]
    pub const fn legs(&self) -> &Legs {
        &self.legs
    }

    /// Begins the stage's flood or search; the next stage where it needs none.
    fn begin(&mut self, scene: &Scene) -> Stage {
        let from = match self.stage {
            Stage::Home(robot) => scene.homes.get(robot).copied(),
            Stage::Start(robot) => self.starts.get(robot).copied(),
            Stage::Grasp(index) => self.task(index).map(|task| self.grasp(scene, task)),
            Stage::Transfer(index) => self.task(index).map(|task| self.grasp(scene, task)),
            Stage::Ready => None,
        };
        let Some(from) = from else {
            return self.after_all();
        };
        match self.stage {
            Stage::Start(robot) if scene.homes.get(robot) == Some(&from) => {
                return self.following();
            }
            Stage::Transfer(index) => {
                let task = self.legs.tasks[index];
                let to = self.release(scene, task);
                self.search
                    .occupancy()
                    .reset(scene, scene.objects[task].class);
                self.search.charge(UNITS_PER_RESET);
                self.search.begin(scene, from, to);
            }
            _ => {
                self.field.occupancy().reset(scene, ROBOT_ALONE);
                self.meter.charge(UNITS_PER_RESET);
                self.field.begin(scene, from);
            }
        }
        self.stage
    }

    fn go_on(&mut self, scene: &Scene, budget: &mut Budget, counters: &mut Counters) -> Poll<()> {
        if let Stage::Transfer(index) = self.stage {
            let Poll::Ready(length_m) = self.search.advance(scene, budget, counters) else {
                return Poll::Pending;
            };
            let task = self.legs.tasks[index];
            self.legs.transfer_s[task] = self.seconds(length_m);
            return Poll::Ready(());
        }
        if self.field.advance(budget, counters).is_pending() {
            return Poll::Pending;
        }
        match self.stage {
            Stage::Home(robot) => self.read_home(scene, robot),
            Stage::Start(robot) => self.read_start(scene, robot),
            Stage::Grasp(index) => self.read_grasp(scene, self.legs.tasks[index]),
            Stage::Transfer(_) | Stage::Ready => {}
        }
        Poll::Ready(())
    }

    fn following(&self) -> Stage {
        match self.stage {
            Stage::Home(robot) => Stage::Home(robot + 1),
            Stage::Start(robot) => Stage::Start(robot + 1),
            Stage::Grasp(index) => Stage::Grasp(index + 1),
            Stage::Transfer(index) => Stage::Transfer(index + 1),
            Stage::Ready => Stage::Ready,
        }
    }

    fn after_all(&self) -> Stage {
        match self.stage {
            Stage::Home(_) => Stage::Start(0),
            Stage::Start(_) => Stage::Grasp(0),
            Stage::Grasp(_) => Stage::Transfer(0),
            Stage::Transfer(_) | Stage::Ready => Stage::Ready,
        }
    }

    fn read_home(&mut self, scene: &Scene, home: usize) {
        let (robots, objects) = (self.legs.robots, self.legs.objects);
        let starts_here = self.starts.get(home) == Some(&scene.homes[home]);
        for index in 0..self.legs.tasks.len() {
            let task = self.legs.tasks[index];
            let release = self.release(scene, task);
            self.legs.home_s[task * robots + home] = self.read(scene, release);
            if starts_here {
                let grasp = self.grasp(scene, task);
                self.legs.approach_s[home * objects + task] = self.read(scene, grasp);
            }
        }
        for robot in 0..self.starts.len().min(robots) {
            self.legs.between_s[robot * robots + home] = self.read(scene, self.starts[robot]);
        }
        self.charge(2 * self.legs.tasks.len() + robots);
    }

    fn read_start(&mut self, scene: &Scene, robot: usize) {
        for index in 0..self.legs.tasks.len() {
            let task = self.legs.tasks[index];
            let grasp = self.grasp(scene, task);
            self.legs.approach_s[robot * self.legs.objects + task] = self.read(scene, grasp);
        }
        self.charge(self.legs.tasks.len());
    }

    fn read_grasp(&mut self, scene: &Scene, to: usize) {
        for index in 0..self.legs.tasks.len() {
            let from = self.legs.tasks[index];
            let release = self.release(scene, from);
            self.legs.turn_s[from * self.legs.objects + to] = self.read(scene, release);
        }
        self.charge(self.legs.tasks.len());
    }

    fn read(&mut self, scene: &Scene, to: Vec2) -> f64 {
        let length_m = self.field.distance(scene, to);
        self.seconds(length_m)
    }

    fn seconds(&self, length_m: Option<f64>) -> f64 {
        length_m.map_or(f64::INFINITY, |length_m| length_m / self.speed_m_per_s)
    }

    fn charge(&mut self, lookups: usize) {
        self.meter
            .charge((lookups as u64).div_ceil(LOOKUPS_PER_UNIT));
    }

    fn task(&self, index: usize) -> Option<usize> {
        self.legs.tasks.get(index).copied()
    }

    fn grasp(&self, scene: &Scene, task: usize) -> Vec2 {
        self.places[task].map_or(Vec2::zeros(), |at| scene.grasp_at(task, at.initial))
    }

    fn release(&self, scene: &Scene, task: usize) -> Vec2 {
        self.places[task].map_or(Vec2::zeros(), |at| scene.grasp_at(task, at.goal))
    }
}
