//! Path lengths that performance values are made of (rule 16): walls only, no other object, no
//! robot.
//!
//! Responsible for: transit from where each free robot is to each grasp, transfer from there to
//! the goal; each computed once and kept while the object stays where it is.
//! Not responsible for: comparing them (`selection`).
//!
//! Transit lengths come from one distance field per object. Where so many fields would take too
//! much memory ([`MAX_KEPT_POINTS`]), lengths are those of straight lines instead: which robot
//! takes which task is then decided as if there were no walls, and a task that no path leads to is
//! found out when it is tried.

use std::task::Poll;

use scene::{Budget, Performance, ROBOT_ALONE, Scene, Settings, UNITS_PER_RESET, Vec2};
use shm_types::Counters;

use crate::field::DistanceField;
use crate::meter::Meter;
use crate::places::Places;
use crate::search::PathSearch;

/// Most lattice points, over all fields, that are kept: 4 bytes each.
const MAX_KEPT_POINTS: usize = 1 << 24;

/// Pairs of a robot and a task whose transit length is looked up for one unit.
const LOOKUPS_PER_UNIT: u64 = 4;

/// Where lengths come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    /// Transfers from paths; transit does not count.
    TransferAlone,
    /// Transfers from paths, transits from one flood per object, kept.
    Floods,
    /// Straight lines.
    Lines,
}

/// A step of the computation, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Straight lines come next.
    Lines,
    /// The transfer of this task, or of a later one, comes next.
    Transfer(usize),
    /// The transfer of this task is being searched.
    TransferSearch(usize),
    /// The flood from this object's grasp or this robot, or a later one, comes next.
    Flood(usize),
    /// That flood goes on.
    FloodGrowing(usize),
    /// All is known.
    Ready,
}

/// Lengths from one selection to the next.
#[derive(Clone, Debug)]
pub(crate) struct Lengths {
    robots: usize,
    points: usize,
    source: Source,
    /// Whether performance is about transit too.
    transit_counts: bool,
    search: PathSearch,
    field: DistanceField,
    /// Transfer of each task for the places it was computed for, m; infinite if there is none.
    transfers: Vec<Option<(Places, f64)>>,
    /// Grasp each kept field was flooded from.
    flooded: Vec<Option<Vec2>>,
    /// Kept fields, one after the other. All zero until used, so memory is taken as it is needed.
    kept: Vec<u32>,
    /// Transit, robots within tasks, m; infinite if there is none.
    transits: Vec<f64>,
    stage: Stage,
    meter: Meter,
}

/// What a computation of lengths is about.
pub(crate) struct Asked<'a> {
    /// Places of the tasks in question, none for the others.
    pub(crate) tasks: &'a [Option<Places>],
    /// Where the free robots are, m; none for the others.
    pub(crate) robots: &'a [Option<Vec2>],
}

impl Lengths {
    pub(crate) fn new(scene: &Scene, settings: &Settings) -> Self {
        let (tasks, robots) = (scene.objects.len(), scene.homes.len());
        let points = scene.lattice.len();
        let source = match settings.performance {
            _ if tasks.saturating_mul(points) > MAX_KEPT_POINTS => Source::Lines,
            Performance::Transfer => Source::TransferAlone,
            Performance::TransitAndTransfer => Source::Floods,
        };
        let kept = if source == Source::Floods {
            tasks * points
        } else {
            0
        };
        Self {
            robots,
            points,
            source,
            transit_counts: settings.performance != Performance::Transfer,
            search: PathSearch::new(scene),
            field: DistanceField::new(scene),
            transfers: vec![None; tasks],
            flooded: vec![None; tasks],
            kept: vec![0; kept],
            transits: vec![0.0; tasks * robots],
            stage: Stage::Ready,
            meter: Meter::default(),
        }
    }

    /// Begins with the same questions that every [`Lengths::advance`] has to be given.
    pub(crate) fn begin(&mut self) {
        self.stage = match self.source {
            Source::Lines => Stage::Lines,
            _ => Stage::Transfer(0),
        };
        self.meter.reset();
    }

    /// Goes on within `budget`.
    pub(crate) fn advance(
        &mut self,
        scene: &Scene,
        asked: &Asked,
        budget: &mut Budget,
        counters: &mut Counters,
    ) -> Poll<()> {
        while self.stage != Stage::Ready {
            if !self.meter.settle(budget) {
                return Poll::Pending;
            }
            self.stage = match self.stage {
                Stage::Lines => self.draw_lines(scene, asked),
                Stage::Transfer(task) => self.begin_transfer(scene, asked, task),
                Stage::TransferSearch(task) => match self.search.advance(scene, budget, counters) {
                    Poll::Pending => return Poll::Pending,
                    Poll::Ready(length) => self.end_transfer(asked, task, length),
                },
                Stage::Flood(source) => self.begin_flood(scene, asked, source),
                Stage::FloodGrowing(source) => match self.field.advance(budget, counters) {
                    Poll::Pending => return Poll::Pending,
                    Poll::Ready(()) => self.end_flood(scene, asked, source),
                },
                Stage::Ready => Stage::Ready,
            };
        }
        Poll::Ready(())
    }

    /// Length that the performance value of `task` for `robot` is the inverse of, m; infinite
    /// where no path leads. Both have to be among those asked for.
    pub(crate) fn length(&self, task: usize, robot: usize) -> f64 {
        let transfer = self.transfers[task].map_or(f64::INFINITY, |(_, length)| length);
        self.transits[task * self.robots + robot] + transfer
    }

    fn begin_transfer(&mut self, scene: &Scene, asked: &Asked, first: usize) -> Stage {
        let stale = (first..asked.tasks.len()).find_map(|task| {
            let places = asked.tasks[task]?;
            let known = self.transfers[task].is_some_and(|(old, _)| old == places);
            (!known).then_some((task, places))
        });
        let Some((task, places)) = stale else {
            return Stage::Flood(0);
        };
        let spec = &scene.objects[task];
        self.search.occupancy().reset(scene, spec.class);
        self.search.charge(UNITS_PER_RESET);
        self.search
            .begin(scene, places.initial + spec.grasp, places.goal + spec.grasp);
        Stage::TransferSearch(task)
    }

    fn end_transfer(&mut self, asked: &Asked, task: usize, length: Option<f64>) -> Stage {
        let length = length.unwrap_or(f64::INFINITY);
        self.transfers[task] = asked.tasks[task].map(|places| (places, length));
        Stage::Transfer(task + 1)
    }

    fn begin_flood(&mut self, scene: &Scene, asked: &Asked, first: usize) -> Stage {
        let source = match self.source {
            Source::Floods => self.next_object(scene, asked, first),
            Source::TransferAlone | Source::Lines => None,
        };
        let Some((source, from)) = source else {
            return Stage::Ready;
        };
        self.field.occupancy().reset(scene, ROBOT_ALONE);
        self.meter.charge(UNITS_PER_RESET);
        self.field.begin(scene, from);
        Stage::FloodGrowing(source)
    }

    /// The next object whose field is out of date. Those before it have theirs: their transits
    /// are looked up on the way.
    fn next_object(&mut self, scene: &Scene, asked: &Asked, first: usize) -> Option<(usize, Vec2)> {
        for task in first..asked.tasks.len() {
            let Some(places) = asked.tasks[task] else {
                continue;
            };
            let grasp = places.initial + scene.objects[task].grasp;
            if self.flooded[task] != Some(grasp) {
                return Some((task, grasp));
            }
            self.look_up_kept(scene, asked, task, grasp);
        }
        None
    }

    fn end_flood(&mut self, scene: &Scene, asked: &Asked, source: usize) -> Stage {
        let range = source * self.points..(source + 1) * self.points;
        self.field.keep(&mut self.kept[range]);
        self.flooded[source] =
            asked.tasks[source].map(|places| places.initial + scene.objects[source].grasp);
        // Its transits are looked up when the search for the next object passes it.
        Stage::Flood(source)
    }

    fn look_up_kept(&mut self, scene: &Scene, asked: &Asked, task: usize, grasp: Vec2) {
        let costs = &self.kept[task * self.points..(task + 1) * self.points];
        for (robot, place) in asked.robots.iter().enumerate() {
            if let Some(place) = *place {
                let length = self.field.kept_distance(scene, costs, grasp, place);
                self.transits[task * self.robots + robot] = length.unwrap_or(f64::INFINITY);
            }
        }
        self.meter
            .charge((asked.robots.len() as u64).div_ceil(LOOKUPS_PER_UNIT));
    }

    /// All lengths as if nothing stood in the way.
    fn draw_lines(&mut self, scene: &Scene, asked: &Asked) -> Stage {
        for (task, places) in asked.tasks.iter().enumerate() {
            let Some(places) = *places else { continue };
            let length = (places.goal - places.initial).norm();
            self.transfers[task] = Some((places, length));
            let grasp = places.initial + scene.objects[task].grasp;
            for (robot, place) in asked.robots.iter().enumerate() {
                if let Some(place) = place.filter(|_| self.transit_counts) {
                    self.transits[task * self.robots + robot] = (grasp - place).norm();
                }
            }
        }
        let pairs = asked.tasks.len() as u64 * asked.robots.len() as u64;
        self.meter.charge(pairs.div_ceil(LOOKUPS_PER_UNIT));
        // What that took is paid there; nothing is flooded.
        Stage::Flood(0)
    }
}
