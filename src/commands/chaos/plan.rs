//! What is struck, how: the part of chaos that a seed reproduces.
//!
//! Responsible for: for each role and phase a sequence of blows, with the same share for each.
//! Not responsible for: when a process of that role is there to be struck (`victim`); so the order
//! between roles, and the exact instant, are not the same twice.

use std::collections::VecDeque;

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::cli::{ChaosArgs, Phase, Target};

/// One in so many blows is a stall, and one a whole set of processes at once.
const ONE_STALL_IN: u32 = 8;
const ONE_SET_IN: u32 = 25;

/// A blow that came too late falls after this share of its wait the next time.
const SOONER: f64 = 0.8;

/// What is done to a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum How {
    /// SIGKILL.
    Kill,
    /// SIGSTOP, and SIGCONT after a while, if it is there then.
    Stall,
    /// SIGKILL to it and to all others of its set.
    Set,
}

/// One blow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Blow {
    pub(crate) how: How,
    /// Where in the set-up, or in the wait before a blow in steady state, from 0 to 1.
    pub(crate) at: f64,
    /// Which robot, from 0 to 1 of all.
    pub(crate) which: f64,
}

/// All blows that are to be dealt.
pub(crate) struct Plan {
    pub(crate) phases: Vec<Phase>,
    pub(crate) targets: Vec<Target>,
    /// By phase and target.
    queues: Vec<VecDeque<Blow>>,
}

impl Plan {
    pub(crate) fn new(args: &ChaosArgs) -> Self {
        let (mut phases, mut targets) = (args.during.clone(), args.targets.clone());
        phases.sort_unstable();
        phases.dedup();
        targets.sort_unstable();
        targets.dedup();
        let count = phases.len() * targets.len();
        let queues = (0..count).map(|queue| {
            // As even as can be: the first ones get what is left over.
            let kills = args.kills / count + usize::from(queue < args.kills % count);
            let mut rng = ChaCha8Rng::seed_from_u64(args.seed);
            rng.set_stream(queue as u64);
            blows(kills, &mut rng)
        });
        Self {
            queues: queues.collect(),
            phases,
            targets,
        }
    }

    fn queue(&mut self, phase: Phase, target: Target) -> Option<&mut VecDeque<Blow>> {
        let phase = self.phases.iter().position(|other| *other == phase)?;
        let target = self.targets.iter().position(|other| *other == target)?;
        self.queues.get_mut(phase * self.targets.len() + target)
    }

    /// The next blow of this kind.
    pub(crate) fn next(&mut self, phase: Phase, target: Target) -> Option<Blow> {
        self.queue(phase, target)?.pop_front()
    }

    /// A blow that was not dealt, or did not count.
    pub(crate) fn give_back(&mut self, phase: Phase, target: Target, blow: Blow) {
        if let Some(queue) = self.queue(phase, target) {
            queue.push_front(blow);
        }
    }

    /// A blow that came too late, after the set-up in which it was to fall.
    pub(crate) fn bring_forward(&mut self, phase: Phase, target: Target, mut blow: Blow) {
        blow.at *= SOONER;
        self.give_back(phase, target, blow);
    }

    /// Whether any is left.
    pub(crate) fn is_open(&self) -> bool {
        self.left() > 0
    }

    /// How many are left.
    pub(crate) fn left(&self) -> usize {
        self.queues.iter().map(VecDeque::len).sum()
    }
}

/// So many kills, with stalls among them, spread evenly.
fn blows(kills: usize, rng: &mut ChaCha8Rng) -> VecDeque<Blow> {
    // Each part of the set-up gets its share, in any order.
    let mut places: Vec<usize> = (0..kills).collect();
    places.shuffle(rng);
    let mut blows = VecDeque::new();
    for place in places {
        let at = (place as f64 + rng.random::<f64>()) / kills as f64;
        let mut blow = |how| Blow {
            how,
            at,
            which: rng.random(),
        };
        let (stall, set) = (blow(How::Stall), blow(How::Set));
        let kill = blow(How::Kill);
        if rng.random_ratio(1, ONE_STALL_IN) {
            blows.push_back(stall);
        }
        blows.push_back(if rng.random_ratio(1, ONE_SET_IN) {
            set
        } else {
            kill
        });
    }
    blows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_gives_the_same_blows_spread_over_the_whole_of_set_up() {
        let blows_of = |seed| blows(1_000, &mut ChaCha8Rng::seed_from_u64(seed));
        let one = blows_of(1);
        assert_eq!(one, blows_of(1));
        assert_ne!(one, blows_of(2));
        let kills: Vec<&Blow> = one.iter().filter(|blow| blow.how != How::Stall).collect();
        assert_eq!(kills.len(), 1_000);
        for tenth in 0..10 {
            let is_in = |blow: &&&Blow| (blow.at * 10.0) as usize == tenth;
            assert_eq!(kills.iter().filter(is_in).count(), 100, "{tenth}");
        }
        let stalls = one.len() - kills.len();
        assert!((80..180).contains(&stalls), "{stalls}");
    }
}
