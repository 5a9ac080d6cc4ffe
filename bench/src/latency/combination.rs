//! What is measured: which robots and objects, clocks, waits and priorities go together.
//!
//! Responsible for: the default subset, the full product, how long each is measured, and why one
//! cannot run.
//! Not responsible for: running it (`measure`).

use std::time::Duration;

use node::options::processes;
use node::{Clock, RunOptions, Wait};
use scene::{Method, Scene, Settings};
use shm_types::{ObjectState, RobotState, SnapshotHeader};

use crate::latency::{Options, room};

/// Ticks a second in real time.
const RATE_HZ: u32 = 1_000;
/// World seconds per wall second in real time: a tick lasts as long as in lockstep.
const SPEED: f64 = 10.0;
/// Wall time of a lockstep tick for each process, about, ns.
const TICK_PER_PROCESS_NS: f64 = 15_000.0;
/// And besides, where everybody has to be woken, ns.
const TICK_OF_WAKING_NS: f64 = 80_000.0;
/// Fewest and most ticks measured.
const TICKS: (u64, u64) = (200, 50_000);
/// One tick in so many more is warm-up.
const WARM_UP_SHARE: u64 = 5;
/// Ticks within which every task of the dead ends has failed that will.
const DEAD_END_TICKS: u64 = 3_000;
/// Most robots in dead ends: with more, working out constraints takes longer than is measured.
const DEAD_END_ROBOTS: usize = 16;
/// Set-up and end of a run: for all, and for each process, s.
const SET_UP_S: (f64, f64) = (0.15, 0.02);

/// Which room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Every robot carries an object along a lane of its own.
    Lanes,
    /// Every robot fails again and again, and asks for hard constraints.
    DeadEnds,
}

/// One thing that is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Combination {
    /// Where.
    pub place: Place,
    /// Robots.
    pub robots: usize,
    /// Objects.
    pub objects: usize,
    /// Virtual time, or 1 kHz.
    pub is_real: bool,
    /// How processes wait in lockstep.
    pub wait: Wait,
    /// Whether each is bound to a core.
    pub pin: bool,
    /// Whether they ask for `SCHED_FIFO`.
    pub fifo: bool,
}

impl Combination {
    const fn new(robots: usize, objects: usize, wait: Wait) -> Self {
        Self {
            place: Place::Lanes,
            robots,
            objects,
            is_real: false,
            wait,
            pin: false,
            fifo: false,
        }
    }

    /// Everything that `options` ask for, in the order in which it is measured.
    #[must_use]
    pub fn all(options: &Options) -> Vec<Self> {
        let mut all = Vec::new();
        let typical = options.typical_objects();
        for &robots in &options.robots {
            let plain = |wait| Self::new(robots, typical.max(robots), wait);
            for &wait in &options.waits {
                all.push(plain(wait));
            }
            let real = Self {
                is_real: true,
                ..plain(Wait::Block)
            };
            all.push(real.clone());
            if options.full {
                all.extend(variants(
                    options.waits.iter().map(|wait| plain(*wait)).chain([real]),
                ));
            } else {
                all.extend(subset(options, &plain, real));
            }
            let dead_ends = Self {
                place: Place::DeadEnds,
                objects: robots * room::ROW,
                ..plain(Wait::Hybrid)
            };
            if !options.quick || robots == options.robots[0] {
                all.push(dead_ends);
            }
        }
        // How it grows with the objects, where the robots disturb least.
        if let (Some(&robots), true) = (options.robots.iter().min(), options.objects.len() > 1) {
            for &objects in options
                .objects
                .iter()
                .filter(|objects| **objects != typical)
            {
                all.push(Self {
                    pin: true,
                    ..Self::new(robots, objects, Wait::Hybrid)
                });
            }
            let pinned = Self {
                pin: true,
                ..Self::new(robots, typical, Wait::Hybrid)
            };
            if !all.contains(&pinned) {
                all.push(pinned);
            }
        }
        all
    }

    /// Why it cannot run here, if it cannot.
    #[must_use]
    pub fn refusal(&self, options: &RunOptions, scene: &Scene, cores: usize) -> Option<String> {
        options
            .check(scene.counts(), cores)
            .err()
            .map(|error| error.to_string())
    }

    /// Why there is no room for it, if there is none.
    #[must_use]
    pub fn contradiction(&self) -> Option<String> {
        match self.place {
            Place::Lanes if self.objects < self.robots => Some(format!(
                "each robot needs an object, but there are {} for {} robots",
                self.objects, self.robots
            )),
            Place::DeadEnds if self.robots > DEAD_END_ROBOTS => Some(format!(
                "with more than {DEAD_END_ROBOTS} robots the constraints take longer to work out \
                 than is measured"
            )),
            _ => None,
        }
    }

    /// Ticks of warm-up, and ticks measured.
    #[must_use]
    pub fn ticks(&self, measured: Duration) -> (u64, u64) {
        if self.place == Place::DeadEnds {
            return (0, DEAD_END_TICKS);
        }
        let waking_ns = if self.wait == Wait::Block {
            TICK_OF_WAKING_NS
        } else {
            0.0
        };
        let tick_ns = if self.is_real {
            1e9 / f64::from(RATE_HZ)
        } else {
            (self.robots + 3) as f64 * TICK_PER_PROCESS_NS + waking_ns
        };
        let ticks = (measured.as_nanos() as f64 / tick_ns) as u64;
        let ticks = ticks.clamp(TICKS.0, TICKS.1);
        (ticks / WARM_UP_SHARE, ticks)
    }

    /// Wall time of one run, with its reference or without, about.
    #[must_use]
    pub fn estimate(&self, measured: Duration) -> f64 {
        if self.contradiction().is_some() {
            return 0.0;
        }
        let processes = (self.robots + 3) as f64;
        let run_s = SET_UP_S.0 + SET_UP_S.1 * processes + measured.as_secs_f64() * 1.2;
        match self.place {
            Place::Lanes => 2.0 * run_s,
            Place::DeadEnds => run_s,
        }
    }

    /// The room.
    ///
    /// # Errors
    /// There is none of this size.
    pub fn scene(&self, measured: Duration) -> Result<Scene, String> {
        let (warm_up, ticks) = self.ticks(measured);
        let seconds = (warm_up + ticks) as f64 * Settings::default().tick_ns as f64 * 1e-9;
        match self.place {
            Place::Lanes => room::lanes(self.robots, self.objects, seconds),
            Place::DeadEnds => room::dead_ends(self.robots),
        }
        .map_err(|problems| problems.to_string())
    }

    /// What the run is told.
    #[must_use]
    pub fn options(&self, measured: Duration) -> RunOptions {
        let (warm_up, ticks) = self.ticks(measured);
        let defaults = Settings::default();
        let settings = Settings {
            method: match self.place {
                Place::Lanes => Method::NoAction,
                Place::DeadEnds => Method::Restricted,
            },
            time_limit_ns: (warm_up + ticks) * defaults.tick_ns,
            ..defaults
        };
        let clock = if self.is_real {
            Clock::Real {
                rate_hz: RATE_HZ,
                speed: SPEED,
            }
        } else {
            Clock::Lockstep
        };
        RunOptions {
            clock,
            wait: self.wait,
            pin: self.pin,
            realtime_scheduling: self.fifo,
            warm_up_ticks: warm_up,
            ..RunOptions::new(settings)
        }
    }

    /// Processes that work in every tick.
    #[must_use]
    pub fn processes(&self) -> usize {
        processes(shm_types::Counts {
            robots: self.robots as u32,
            objects: self.objects as u32,
        })
    }

    /// Live bytes of a snapshot.
    #[must_use]
    pub const fn payload(&self) -> usize {
        size_of::<SnapshotHeader>()
            + self.robots * size_of::<RobotState>()
            + self.objects * size_of::<ObjectState>()
    }

    /// Its words: clock, wait, pinned, priority.
    #[must_use]
    pub const fn words(&self) -> [&'static str; 4] {
        let (clock, wait) = match (self.is_real, self.wait) {
            (true, _) => ("1 kHz", "deadline"),
            (false, Wait::Spin) => ("lockstep", "spin"),
            (false, Wait::Hybrid) => ("lockstep", "hybrid"),
            (false, Wait::Block) => ("lockstep", "block"),
        };
        let pin = if self.pin { "pinned" } else { "free" };
        let fifo = if self.fifo { "fifo" } else { "normal" };
        [clock, wait, pin, fifo]
    }
}

/// Beside every wait: bound to cores, and with `SCHED_FIFO`, each once.
fn subset(
    options: &Options,
    plain: &impl Fn(Wait) -> Combination,
    real: Combination,
) -> Vec<Combination> {
    let mut all = Vec::new();
    if options.waits.contains(&Wait::Hybrid) {
        all.push(Combination {
            pin: true,
            ..plain(Wait::Hybrid)
        });
    }
    if options.quick {
        return all;
    }
    if options.waits.contains(&Wait::Block) {
        all.push(Combination {
            fifo: true,
            ..plain(Wait::Block)
        });
    }
    all.push(Combination { fifo: true, ..real });
    all
}

/// Every way but the plain one to pin and to prioritise.
fn variants(plain: impl Iterator<Item = Combination>) -> impl Iterator<Item = Combination> {
    plain.flat_map(|one| {
        [(true, false), (false, true), (true, true)].map(|(pin, fifo)| Combination {
            pin,
            fifo,
            ..one.clone()
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options() -> Options {
        Options {
            robots: vec![1, 4],
            ..Options::default()
        }
    }

    #[test]
    fn every_wait_and_priority_is_there_and_nothing_twice() {
        for full in [false, true] {
            let all = Combination::all(&Options { full, ..options() });
            for (index, one) in all.iter().enumerate() {
                assert!(!all[..index].contains(one), "{one:?} twice");
            }
            let words = |place: usize| {
                let mut words: Vec<_> = all.iter().map(|one| one.words()[place]).collect();
                words.sort_unstable();
                words.dedup();
                words
            };
            assert_eq!(words(0), ["1 kHz", "lockstep"]);
            assert_eq!(words(1), ["block", "deadline", "hybrid", "spin"]);
            assert_eq!(words(2), ["free", "pinned"]);
            assert_eq!(words(3), ["fifo", "normal"]);
        }
    }

    #[test]
    fn what_cannot_run_says_why() {
        let many = Combination {
            place: Place::Lanes,
            robots: 64,
            objects: 100,
            is_real: false,
            wait: Wait::Spin,
            pin: false,
            fifo: false,
        };
        let measured = Duration::from_millis(10);
        let scene = many.scene(measured).unwrap();
        let refusal = many.refusal(&many.options(measured), &scene, 2).unwrap();
        assert!(refusal.contains("67 processes") && refusal.contains("2 cores"));
        let few = Combination {
            objects: 10,
            ..many
        };
        assert!(few.contradiction().unwrap().contains("64 robots"));
    }

    #[test]
    fn a_payload_has_all_that_lives() {
        let one = &Combination::all(&options())[0];
        assert_eq!((one.robots, one.objects), (1, 100));
        assert_eq!(one.payload(), size_of::<SnapshotHeader>() + 608 + 100 * 112);
    }
}
