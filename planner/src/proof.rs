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

use crate::certificate::certificate;
use crate::event::{Event, Precedence};
use crate::rings::event_ring;
use crate::store::Store;

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
