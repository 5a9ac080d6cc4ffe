//! One seed: a room, a method and a plan of faults; run undisturbed, then disturbed.
//!
//! Responsible for: which room and which method a seed stands for, when faults end, by when the
//! run must have ended after that, and what is a finding. Not responsible for: making a failing
//! one small (`shrink.rs`).

#[cfg(test)]
mod tests;

use std::fmt;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::{GenerateOptions, Method, Problems, Scene, Settings};
use shm_types::{Outcome, Verdict};
use world::{Guard, World};

use super::driver::Disturbed;
use super::fault::{Fault, Kind, Terms, draw};
use crate::simulation::Simulation;

/// Work units in a second of world time: slow computers, so that computing takes many ticks, and
/// the simulation of it little time.
const UNITS_PER_SECOND: u64 = 2_000_000;
/// One fault for so many ticks of the undisturbed run.
const TICKS_PER_FAULT: u64 = 8;
/// Ticks beyond those of the undisturbed run within which faults begin: disturbed ones are slower.
const LONGER_TICKS: u64 = 200;
/// Ticks that the rest of a run may take once faults have ended, beside three times those of the
/// undisturbed one: two minutes of world time.
const LIVE_TICKS: u64 = 12_000;
/// How often the world is saved, to begin anew from there, ticks.
const SAVE_TICKS: u64 = 50;
/// Ticks of an undisturbed run: one that takes longer is given up.
const MOST_TICKS: u64 = 60_000;
/// Seeds of rooms tried for one seed of a trial.
const ROOMS_TRIED: u64 = 50;

/// What a trial is cut down to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cut {
    /// Only the first so many robots.
    pub robots: Option<usize>,
    /// Only the first so many objects.
    pub objects: Option<usize>,
}

/// Runs in which robots only move now faster, now slower: where one of the paper's methods gets
/// stuck in one of them, its outcome in that room hangs on who happens to be where first.
const SLOW_RUNS: u64 = 32;

/// A seed's room, method and plan.
pub struct Trial {
    /// The seed.
    pub seed: u64,
    /// The room.
    pub scene: Scene,
    /// The method, and all else at its default.
    pub settings: Settings,
    /// What happens to it if nothing goes wrong.
    pub undisturbed: Undisturbed,
}

/// An undisturbed run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Undisturbed {
    /// How it ended; [`Outcome::Running`] if it was given up.
    pub outcome: Outcome,
    /// Its ticks.
    pub ticks: u64,
}

/// What was not as it should be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Finding {
    /// Something that must never be.
    Unsafe(String),
    /// The run did not end solved after the faults had ended.
    NotLive(String),
    /// A machine panicked.
    Panicked(String),
}

impl Finding {
    /// Whether `other` is one of the same sort.
    #[must_use]
    pub const fn is_like(&self, other: &Self) -> bool {
        matches!(
            (self, other),
            (Self::Unsafe(_), Self::Unsafe(_))
                | (Self::NotLive(_), Self::NotLive(_))
                | (Self::Panicked(_), Self::Panicked(_))
        )
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unsafe(what) => write!(f, "unsafe: {what}"),
            Self::NotLive(what) => write!(f, "not live: {what}"),
            Self::Panicked(what) => write!(f, "panicked: {what}"),
        }
    }
}

/// How a disturbed run went.
#[derive(Clone, Debug)]
pub struct Ended {
    /// The faults that altered something while a task was open.
    pub counted: Vec<Fault>,
    /// Its ticks.
    pub ticks: u64,
    /// How it ended.
    pub outcome: Outcome,
    /// The hash of everybody's state at every tick, chained.
    pub state_hash: u64,
    /// What the planner said of its end.
    pub verdict: Verdict,
    /// Of a run that was not live: whether processes that were all started anew within a second of
    /// its end would have solved what was left.
    pub is_solved_afresh: bool,
    /// What was not as it should be, if anything.
    pub finding: Option<Finding>,
}

/// The world as it was some ticks ago.
#[derive(Default)]
struct Saved {
    before: Vec<u8>,
    newest: Vec<u8>,
}

impl Saved {
    fn keep(&mut self, world: &World) {
        if world.tick().is_multiple_of(SAVE_TICKS) {
            std::mem::swap(&mut self.before, &mut self.newest);
            self.newest.clear();
            world.save(&mut self.newest);
            if self.before.is_empty() {
                self.before.clone_from(&self.newest);
            }
        }
    }
}

/// Looks at a disturbed run after each tick, beside the run's own watch: what it has found, if
/// anything.
pub trait Onlooker {
    /// A tick is over.
    fn look(&mut self, run: &Disturbed<'_>) -> Option<String>;
    /// The run is over.
    fn close(&mut self, run: &Disturbed<'_>) -> Option<String>;
}

impl Onlooker for () {
    fn look(&mut self, _run: &Disturbed<'_>) -> Option<String> {
        None
    }

    fn close(&mut self, _run: &Disturbed<'_>) -> Option<String> {
        None
    }
}

impl Trial {
    /// A seeded room, cut down to `cut`, with `method` or one that the seed stands for. `None`
    /// where no room is found.
    #[must_use]
    pub fn random(seed: u64, cut: Cut, method: Option<Method>) -> Option<Self> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let generated = (0..ROOMS_TRIED).find_map(|_| {
            scene::generate(&GenerateOptions {
                seed: rng.random_range(0..u64::from(u32::MAX)),
                objects: rng.random_range(1..=5),
                robots: rng.random_range(1..=4),
                area_m2: f64::from(rng.random_range(16..=44_u32)) * 0.5,
                walls: rng.random_range(0..=3),
                crowding: f64::from(rng.random_range(0..=5_u32)) * 0.1,
                extra_moves: 0,
            })
            .ok()
        })?;
        Self::of(&generated.scene, seed, cut, method).ok()
    }

    /// A room of the caller's, likewise.
    ///
    /// # Errors
    /// It cannot be cut down like that.
    pub fn of(
        scene: &Scene,
        seed: u64,
        cut: Cut,
        method: Option<Method>,
    ) -> Result<Self, Problems> {
        let scene = cut_down(scene, cut)?;
        let turns = [
            Method::Anytime,
            Method::GraspingAndRestricted,
            Method::Restricted,
            Method::All,
        ];
        let turn = (seed % turns.len() as u64) as usize;
        let settings = Settings {
            method: method.unwrap_or(turns[turn]),
            units_per_second: UNITS_PER_SECOND,
            ..Settings::default()
        };
        let mut run = Simulation::new(&scene, &settings, 0);
        while run.outcome() == Outcome::Running && run.snapshot().header.tick < MOST_TICKS {
            run.tick();
        }
        let undisturbed = Undisturbed {
            outcome: run.outcome(),
            ticks: run.snapshot().header.tick,
        };
        drop(run);
        Ok(Self {
            seed,
            scene,
            settings,
            undisturbed,
        })
    }

    /// Tick from which on nothing goes wrong any more.
    #[must_use]
    pub const fn faults_end(&self) -> u64 {
        self.undisturbed.ticks + LONGER_TICKS
    }

    /// The seed's plan of faults.
    #[must_use]
    pub fn plan(&self) -> Vec<Fault> {
        draw(&self.terms())
    }

    fn terms(&self) -> Terms {
        let ticks = self.faults_end();
        Terms {
            seed: self.seed,
            robots: self.scene.homes.len(),
            plans_ahead: self.settings.method.plans_ahead(),
            ticks,
            count: (ticks / TICKS_PER_FAULT) as usize,
        }
    }

    /// Runs it with the faults of `plan`.
    pub fn run(&self, plan: Vec<Fault>, onlooker: &mut dyn Onlooker) -> Ended {
        self.run_without(plan, onlooker, None)
    }

    /// As [`Self::run`], in a world that makes all its checks but this one.
    pub fn run_without(
        &self,
        plan: Vec<Fault>,
        onlooker: &mut dyn Onlooker,
        guard: Option<Guard>,
    ) -> Ended {
        let end = self.faults_end();
        let mut run = Disturbed::without(&self.scene, &self.settings, plan, end, guard);
        let mut finding = None;
        let mut saved = Saved::default();
        while finding.is_none() && run.world().outcome() == Outcome::Running {
            saved.keep(run.world());
            if let ControlFlow::Break(found) = self.tick(&mut run, onlooker) {
                finding = Some(found);
            }
        }
        let outcome = run.world().outcome();
        let closing = if finding.is_none() {
            onlooker.close(&run)
        } else {
            None
        };
        let finding = finding
            .or_else(|| closing.map(Finding::Unsafe))
            .or_else(|| self.judge(&run));
        Ended {
            counted: run.counted().copied().collect(),
            ticks: run.snapshot().header.tick,
            outcome,
            state_hash: run.world().state_hash(),
            verdict: run.world().verdict(),
            is_solved_afresh: match &finding {
                Some(Finding::NotLive(_)) => self.is_solved_from(&saved),
                _ => false,
            },
            finding,
        }
    }

    /// Whether processes that are all started anew solve what was left of a run.
    fn is_solved_from(&self, saved: &Saved) -> bool {
        let world = World::restore(&self.scene, self.settings.clone(), &saved.before);
        world.is_ok_and(|world| {
            let mut run = Disturbed::afresh(&self.scene, &self.settings, world);
            let latest = run.snapshot().header.tick + self.undisturbed.ticks + LIVE_TICKS;
            while run.world().outcome() == Outcome::Running && run.snapshot().header.tick < latest {
                run.tick();
            }
            run.world().outcome() == Outcome::Solved
        })
    }

    /// Whether the method cannot be held to having solved a run: it does not solve the room
    /// undisturbed; one that plans ahead says that it has found no plan within its limits; one of
    /// the paper's is not robust there, or can do nothing with what was left, started anew.
    #[must_use]
    pub fn is_beyond(&self, ended: &Ended) -> bool {
        let is_lost = || {
            if self.settings.method.plans_ahead() {
                ended.verdict == Verdict::NotFound
            } else {
                !ended.is_solved_afresh || !self.is_robust()
            }
        };
        matches!(ended.finding, Some(Finding::NotLive(_)))
            && (self.undisturbed.outcome != Outcome::Solved || is_lost())
    }

    /// Whether the method solves the room whoever happens to be where first, as far as can be seen
    /// from runs in which robots only move now faster, now slower. The paper's methods need not:
    /// they never move an object out of the way again.
    fn is_robust(&self) -> bool {
        let is_slow = |fault: &Fault| matches!(fault.kind, Kind::Slip | Kind::Stop);
        (1..=SLOW_RUNS).all(|turn| {
            let mut plan = draw(&Terms {
                seed: self.seed.wrapping_add(turn << 32),
                ..self.terms()
            });
            plan.retain(is_slow);
            let ended = self.run(plan, &mut ());
            ended.finding.is_none()
        })
    }

    fn tick(&self, run: &mut Disturbed<'_>, onlooker: &mut dyn Onlooker) -> ControlFlow<Finding> {
        let ticked = catch_unwind(AssertUnwindSafe(|| run.tick()));
        let found = match ticked {
            Err(why) => Some(Finding::Panicked(words(&*why))),
            Ok(()) => run
                .finding()
                .map(str::to_owned)
                .or_else(|| onlooker.look(run))
                .map(Finding::Unsafe),
        };
        if let Some(found) = found {
            return ControlFlow::Break(found);
        }
        let latest = self.faults_end() + 3 * self.undisturbed.ticks + LIVE_TICKS;
        if run.snapshot().header.tick < latest {
            return ControlFlow::Continue(());
        }
        let why = format!("it has not ended by tick {latest}");
        ControlFlow::Break(Finding::NotLive(why))
    }

    /// What speaks against how it ended.
    fn judge(&self, run: &Disturbed<'_>) -> Option<Finding> {
        let outcome = run.world().outcome();
        if outcome == Outcome::Solved || self.undisturbed.outcome != Outcome::Solved {
            return None;
        }
        let reason = run.world().reason(&self.scene).unwrap_or_default();
        let tick = run.snapshot().header.tick;
        let why = format!("it has ended {outcome:?} at tick {tick}: {reason}");
        Some(Finding::NotLive(why))
    }
}

/// What a panic said.
fn words(why: &(dyn std::any::Any + Send)) -> String {
    let words = why.downcast_ref::<String>().map(String::as_str);
    let words = words.or_else(|| why.downcast_ref::<&str>().copied());
    words.unwrap_or("without words").to_owned()
}

fn cut_down(scene: &Scene, cut: Cut) -> Result<Scene, Problems> {
    let mut draft = scene.draft().clone();
    draft
        .homes
        .truncate(cut.robots.unwrap_or(usize::MAX).max(1));
    draft
        .objects
        .truncate(cut.objects.unwrap_or(usize::MAX).max(1));
    let (robots, objects) = (draft.homes.len(), draft.objects.len());
    if (robots, objects) == (scene.homes.len(), scene.objects.len()) {
        return Ok(scene.clone());
    }
    let known = |task: usize| task < objects;
    draft
        .before
        .retain(|order| known(order.first.0) && known(order.then.0));
    draft.certificate.clear();
    Scene::new(draft)
}
