//! The planner of schedules: a first plan, then better ones.
//!
//! Responsible for: first plans, carrying out an order, which plan is the best so far.
//! Not responsible for: what is tried to make it better (`improve`), while robots follow it
//! (`under_way`), plans out of joint configurations (`joint_plans`) or of runs of other methods
//! (`runs`), committing (`plan`), what is published (`publish`).

mod joint_plans;
mod runs;
#[cfg(test)]
pub(super) mod testing;
#[cfg(test)]
mod tests;
mod under_way;

use std::rc::Rc;

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use scene::{ROBOT_ALONE, Scene, Settings};
use shm_types::Counters;

use crate::anytime::cuts::Cuts;
use crate::anytime::greedy::Offers;
use crate::anytime::ground::{EVER, Ground, Time};
use crate::anytime::joint::Joint;
use crate::anytime::known::Known;
use crate::anytime::order::{Hops, Item};
use crate::anytime::plan::Plan;
use crate::anytime::route::Router;
use crate::anytime::sequence::{Sequencer, Step};
use crate::anytime::shortest::Shortest;
use crate::anytime::situation::Situation;
use crate::anytime::track::{Ends, Move, Place, Start, Track};
use crate::anytime::tried::Tried;
use crate::anytime::{
    UNITS_PER_CONFIGURATION, UNITS_PER_INTERVAL, UNITS_PER_PIECE, UNITS_PER_SMALL_CONFIGURATION,
};

/// Most distances that are kept: one for each lattice point and place that somebody goes to, 4
/// bytes each.
const MOST_DISTANCES: usize = 1 << 28;

/// Moves, and an order of them.
pub(super) type Source = (Rc<Hops>, Vec<Item>);

/// A plan.
#[derive(Clone)]
pub(super) struct Best {
    pub(super) makespan: Time,
    /// What it came from; none if it is the complete search's own.
    pub(super) source: Option<Source>,
    tracks: Vec<Track>,
}

/// How moves are committed.
#[derive(Clone, Copy, Debug)]
struct Mode {
    /// Strictly in the order of the sequence.
    in_turn: bool,
    /// Robots that are parked in the way go elsewhere.
    makes_room: bool,
    /// A robot may end elsewhere than at home, until the last move is made.
    leaves_away: bool,
    /// Robots go home before the first move is made, where they can: what is put down may leave them
    /// no way. Who gets a move does not go.
    home_first: bool,
    /// A robot that has more to do does not go home before that.
    goes_on: bool,
}

const PLAIN: Mode = Mode {
    in_turn: false,
    makes_room: false,
    leaves_away: false,
    home_first: false,
    goes_on: false,
};
const PATIENT: Mode = Mode {
    in_turn: true,
    makes_room: true,
    ..PLAIN
};

/// The ways to make a first plan, in the order in which they are tried.
const MODES: [Mode; 6] = [
    PLAIN,
    PATIENT,
    Mode {
        leaves_away: true,
        ..PLAIN
    },
    Mode {
        leaves_away: true,
        ..PATIENT
    },
    Mode {
        home_first: true,
        ..PLAIN
    },
    Mode {
        leaves_away: true,
        home_first: true,
        ..PATIENT
    },
];

/// Makes plans for one scene.
pub(crate) struct Solver {
    pub(crate) ground: Ground,
    router: Router,
    pub(crate) plan: Plan,
    pub(super) start: Start,
    pub(super) homes: Vec<u32>,
    goals: Vec<Option<Rc<Place>>>,
    sequencer: Sequencer,
    joint: Option<Box<Joint>>,
    /// Configurations that the complete search has seen.
    configurations: u64,
    shortest: Option<Box<Shortest>>,
    /// Configurations that the search for a shortest plan has seen.
    small_configurations: u64,
    pub(super) random: ChaCha8Rng,
    pub(super) best: Option<Best>,
    /// The one that robots follow.
    followed: Option<Best>,
    /// Where orders are looked for: near this one.
    pub(super) current: Option<Source>,
    /// How often in a row nothing was left to try nearby.
    pub(super) misses: u32,
    /// How often improving was tried.
    pub(super) turn: u32,
    pub(super) tried: Tried,
    pub(crate) decoded: u64,
    /// Units spent on looking at orders, and on making moves again that were found before.
    pub(super) weighing: u64,
    /// Ways of the moves of orders tried before, from the present start and as `mode` says.
    known: Known,
    mode: Mode,
    /// Why moves had no way.
    pub(super) cuts: Cuts,
    /// Whether the plan begins where the scene does.
    pub(crate) is_start: bool,
    /// Whether some robot is gone.
    pub(crate) is_short: bool,
}

impl Solver {
    /// None if some home cannot be joined to the lattice, or distances would take too much memory.
    pub(crate) fn new(scene: &Scene, settings: &Settings, situation: &Situation) -> Option<Self> {
        let places = 2 * scene.objects.len() + scene.homes.len();
        if places * scene.lattice.len() > MOST_DISTANCES {
            return None;
        }
        let mut ground = Ground::new(scene, settings, situation.obstacles(scene));
        if situation.needs_margins {
            ground.leave_margins();
        }
        let mut start = Start::new(scene, &ground, situation)?;
        let homes = homes(scene, &mut ground, &mut start, situation.is_short())?;
        let goals: Vec<Option<Rc<Place>>> = (scene.objects.iter().zip(&situation.objects))
            .enumerate()
            .map(|(object, (spec, state))| {
                let goal = spec.goal.filter(|_| state.is_movable)?;
                Some(Place::of(scene, &ground, object, goal))
            })
            .collect();
        // Robots come from where they are, and go home.
        let live = start
            .robots
            .iter()
            .zip(&homes)
            .filter(|(track, _)| !track.is_gone);
        let mut bases: Vec<u32> = live
            .flat_map(|(track, &home)| [track.free.0, home])
            .collect();
        bases.sort_unstable();
        bases.dedup();
        Some(Self {
            router: Router::new(&ground),
            plan: Plan::new(&ground, homes.clone()),
            sequencer: Sequencer::new(scene, &ground, &bases, &goals),
            ground,
            start,
            homes,
            goals,
            joint: None,
            configurations: 0,
            shortest: None,
            small_configurations: 0,
            random: ChaCha8Rng::seed_from_u64(1),
            best: None,
            followed: None,
            current: None,
            misses: 0,
            turn: 0,
            tried: Tried::default(),
            decoded: 0,
            weighing: 0,
            known: Known::default(),
            cuts: Cuts::default(),
            mode: MODES[0],
            is_start: situation.is_start,
            is_short: situation.is_short(),
        })
    }

    /// What was done so far.
    pub(crate) fn work(&self) -> Counters {
        Counters {
            path_plans: self.router.searches + self.sequencer.floods,
            cells_expanded: self.router.expanded + self.ground.flooded() + self.sequencer.cells,
            units: self.units(),
            ..Counters::default()
        }
    }

    /// Work done so far, units.
    pub(crate) fn units(&self) -> u64 {
        let floods = self.ground.flooded() + self.sequencer.cells;
        self.router.expanded * UNITS_PER_INTERVAL
            + floods
            + self.weighing
            + self.configurations * UNITS_PER_CONFIGURATION
            + self.small_configurations * UNITS_PER_SMALL_CONFIGURATION
    }

    /// A first plan: a sequence, then its moves by whoever can make them soonest. Other attempts
    /// find other sequences.
    pub(crate) fn first(&mut self, scene: &Scene, attempt: u64) -> Option<Time> {
        self.assign_goals(scene, attempt);
        let rests = self.start.rests().into_iter().map(|rest| rest.place);
        let objects: Vec<Rc<Place>> = rests.collect();
        let sequence = (self.sequencer).find(scene, &self.ground, &objects, attempt)?;
        self.begin_with(scene, &sequence)
    }

    /// A plan that brings as many objects to their goals as any sequence looked at.
    pub(crate) fn most(&mut self, scene: &Scene) -> Option<Time> {
        let sequence = self.sequencer.most();
        self.begin_with(scene, &sequence)
    }

    /// Goals of interchangeable objects: as the scene has them, then as the dice fall, in turn;
    /// each time for twice as many attempts, since these go on from one another.
    fn assign_goals(&mut self, scene: &Scene, attempt: u64) {
        let mut goals = self.goals.clone();
        let kinds = scene.objects.iter().filter_map(|object| object.kind);
        let count = kinds.max().map_or(0, |last| last + 1);
        if count == 0 || attempt > 0 && !attempt.is_power_of_two() {
            return;
        }
        let is_dealt = attempt > 0 && attempt.ilog2().is_multiple_of(2);
        for kind in (0..count).filter(|_| is_dealt) {
            let of_kind = |object: &usize| scene.objects[*object].kind == Some(kind);
            let members: Vec<usize> = (0..goals.len()).filter(of_kind).collect();
            let mut dealt: Vec<_> = members
                .iter()
                .map(|&object| goals[object].clone())
                .collect();
            dealt.shuffle(&mut self.random);
            for (&object, goal) in members.iter().zip(dealt) {
                goals[object] = goal;
            }
        }
        self.sequencer.aim(goals);
    }

    /// A first plan out of a sequence.
    fn begin_with(&mut self, scene: &Scene, sequence: &[Step]) -> Option<Time> {
        let hops = Hops::new(scene, &mut self.ground, &self.start, &self.homes, sequence)?;
        let objects: Vec<u32> = sequence.iter().map(|(object, _)| *object as u32).collect();
        let mut found = None;
        let is_away = |(track, home): (&Track, &u32)| !track.is_gone && track.free.0 != *home;
        let is_any_away = self.start.robots.iter().zip(&self.homes).any(is_away);
        self.router.is_hasty = true;
        self.plan.grasps_late = true;
        for mode in MODES {
            if mode.home_first && !is_any_away {
                break;
            }
            self.mode = mode;
            self.known.clear();
            found = self.greedy(scene, &hops, &objects);
            if found.is_some() {
                break;
            }
        }
        self.router.is_hasty = false;
        self.plan.grasps_late = false;
        self.known.clear();
        let (makespan, order) = found?;
        self.current = Some((Rc::new(hops), order));
        let source = self.current.clone();
        Some(self.keep(makespan, source))
    }

    /// How long the best plan takes, s.
    pub(super) fn best_s(&self) -> Option<f64> {
        let best = self.best.as_ref()?;
        Some(self.ground.seconds(best.makespan))
    }

    /// Keeps the plan as the best one.
    pub(super) fn keep(&mut self, makespan: Time, source: Option<Source>) -> Time {
        let tracks = self.plan.tracks().to_vec();
        self.best = Some(Best {
            makespan,
            source,
            tracks,
        });
        makespan
    }

    /// Commits the moves of a sequence, each by the robot that is done with it soonest.
    fn greedy(
        &mut self,
        scene: &Scene,
        hops: &Hops,
        sequence: &[u32],
    ) -> Option<(Time, Vec<Item>)> {
        self.begin();
        let mut offers = Offers::new(hops, sequence, self.homes.len(), self.mode.in_turn);
        let mut order: Vec<Item> = Vec::new();
        let ends = if self.mode.leaves_away {
            Ends::AtHomeIfPossible
        } else {
            Ends::AtHome
        };
        while order.len() < sequence.len() {
            let mut commits = |item| self.commit(scene, hops, &order, item, (EVER, ends));
            let item = offers.take_soonest(&mut commits)?;
            order.push(item);
        }
        Some((self.send_all_home()?, order))
    }

    /// Nothing committed.
    fn begin(&mut self) {
        self.decoded += 1;
        self.plan.begin(&self.ground, &self.start);
        if self.mode.home_first {
            self.send_all_home();
        }
        if !self.mode.makes_room {
            self.known.begin();
        }
    }

    /// Commits the next move of an object, after those of `order`; whether there is a way.
    fn commit(
        &mut self,
        scene: &Scene,
        hops: &Hops,
        order: &[Item],
        (object, robot): Item,
        (home_by, ends): (Time, Ends),
    ) -> bool {
        let made = order.iter().filter(|item| item.0 == object).count();
        let hop = &hops.list[hops.of[object as usize].0 + made];
        let wanted = Move {
            robot: robot as usize,
            object: object as usize,
            to: Rc::clone(&hop.to),
            after: self.plan.user_order(scene, object as usize, hop.to.at),
            home_by,
            ends,
        };
        let (plan, ground, router) = (&mut self.plan, &mut self.ground, &mut self.router);
        if self.mode.makes_room {
            let done = plan.commit_making_room(ground, router, &wanted);
            return done.is_some();
        }
        let known = self.known.way(&wanted);
        let done = match &known {
            Some(way) => {
                self.weighing += way.len() as u64 * UNITS_PER_PIECE;
                plan.commit_known(ground, &wanted, way)
            }
            None => plan.commit(ground, router, &wanted),
        };
        if done.is_some() {
            self.known.commit(&wanted, plan.way());
        }
        done.is_some()
    }

    /// Carries an order out in the plan; how long it takes, if all its moves are made in time for less
    /// than `limit`. Who is parked in the way and has to go elsewhere may be home later than that.
    pub(super) fn decode(
        &mut self,
        scene: &Scene,
        hops: &Hops,
        order: &[Item],
        limit: Time,
    ) -> Option<Time> {
        self.begin();
        let home_by = hops.home_by(order, limit);
        for (place, &item) in order.iter().enumerate() {
            let (before, home_by) = (&order[..place], home_by[place]);
            let ends = self.ends(hops, order, place);
            let mut is_made = self.commit(scene, hops, before, item, (home_by, ends));
            if !is_made {
                let (ground, sequencer) = (&self.ground, &mut self.sequencer);
                (self.cuts).learn(ground, sequencer, hops, before, item);
                let now = self.ends(hops, order, place);
                is_made = now != ends && self.commit(scene, hops, before, item, (home_by, now));
            }
            if !is_made {
                self.tried.fail(hops, &order[..=place], home_by);
                return None;
            }
        }
        self.send_all_home()
    }

    /// Where a robot is to be after a move of an order: at home, unless it is not the last one and
    /// the robot is known to have no way home yet.
    fn ends(&self, hops: &Hops, order: &[Item], place: usize) -> Ends {
        let (robot, later) = (order[place].1, &order[place + 1..]);
        if self.mode.goes_on && later.iter().any(|item| item.1 == robot) {
            return Ends::Anywhere;
        }
        let is_last = later.is_empty();
        if !is_last && self.cuts.shut_in(hops, &order[..place], order[place]) {
            Ends::Anywhere
        } else {
            Ends::AtHome
        }
    }

    /// Sends everybody home, as the last part of a plan. Where a robot is gone, the others may
    /// have no way home.
    fn send_all_home(&mut self) -> Option<Time> {
        let (plan, ground, router) = (&mut self.plan, &mut self.ground, &mut self.router);
        let done = plan.send_all_home(ground, router);
        done.or_else(|| self.is_short.then(|| self.plan.makespan()))
    }

    /// Puts the best plan in place, to be published; how long it takes.
    pub(crate) fn restore(&mut self) -> Option<Time> {
        let best = self.best.as_ref()?;
        let tracks = best.tracks.clone();
        self.plan.take_over(&self.ground, &self.start, tracks);
        self.followed.get_or_insert_with(|| best.clone());
        Some(best.makespan)
    }
}

/// The lattice points of homes; none if some home cannot be joined to the lattice. If some robot is
/// gone, others may have no way home: they end where they begin.
fn homes(
    scene: &Scene,
    ground: &mut Ground,
    start: &mut Start,
    is_short: bool,
) -> Option<Vec<u32>> {
    let alone = ROBOT_ALONE.0;
    let tracks = start.robots.iter_mut().zip(&scene.homes);
    let homes = tracks.map(|(track, &home)| {
        if track.is_gone {
            return Some(track.start);
        }
        let home = ground.entry(scene, &[alone], home, &[]);
        if !is_short {
            return home;
        }
        let free = track.free.0;
        let home = home.filter(|&home| ground.field(alone, home).time(free).is_some());
        track.is_cut_off = home.is_none();
        Some(home.unwrap_or(free))
    });
    homes.collect()
}
