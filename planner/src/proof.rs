//! Proofs that a scene has no solution, from all that is known of it.
//!
//! Responsible for: joining what walls and overlaps prove (`certificate`) and what the store's
//! constraints prove: a ring of events (rule 27).
//! Not responsible for: deciding solvability: that there is no proof proves nothing.
//!
//! Why a ring of events is a proof: every constraint of the store is necessary for every plan, and
//! demands its earlier event if the later one takes place. All of a ring's events are those of
//! objects that have to move, or have to be out of the way of such, and none can be the first.

use std::fmt;

use scene::{Infeasible, Scene};
use shm_types::Counters;

use crate::certificate::certificate;
use crate::event::{Event, Precedence};
use crate::rings::event_ring;
use crate::store::Store;

/// Most path searches that are worth making for a proof that nobody asked for.
const MOST_SEARCHES: u64 = 2_000;
/// And most lattice points that these may come to expand.
const MOST_CELLS: u64 = 20_000_000;

/// Why a scene has no solution.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Proof {
    /// What walls alone, or overlaps alone, make impossible.
    Certificate(Infeasible),
    /// Events each of which comes before the next, and the last before the first.
    Ring(Vec<Event>),
}

impl Proof {
    /// A proof, if there is one; `store` is the scene's.
    #[must_use]
    pub fn of(scene: &Scene, store: &Store) -> Option<Self> {
        if let Some(certificate) = certificate(scene) {
            return Some(Self::Certificate(certificate));
        }
        Self::ring(scene, store)
    }

    /// A proof, if one is found with as many path searches as take about a second, and what they
    /// took.
    #[must_use]
    pub fn search(scene: &Scene) -> (Option<Self>, Counters) {
        if let Some(certificate) = certificate(scene) {
            return (Some(Self::Certificate(certificate)), Counters::default());
        }
        let searches = MOST_CELLS / (scene.lattice.len() as u64).max(1);
        let store = Store::of(scene, searches.min(MOST_SEARCHES));
        (Self::ring(scene, &store), store.work())
    }

    fn ring(scene: &Scene, store: &Store) -> Option<Self> {
        let orders: Vec<Precedence> = store.precedences().collect();
        event_ring(scene.objects.len(), &orders).map(Self::Ring)
    }
}

impl fmt::Display for Proof {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Certificate(certificate) => certificate.fmt(f),
            Self::Ring(events) => {
                f.write_str("in a ring, each of these has to come before the next: ")?;
                for event in events {
                    write!(f, "{event} → ")?;
                }
                events.first().map_or(Ok(()), |first| first.fmt(f))
            }
        }
    }
}
