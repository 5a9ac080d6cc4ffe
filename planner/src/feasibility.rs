//! Whether a task can be done with no other object in the room (rule 10).
//!
//! Responsible for: its three legs among walls: some robot's home to the grasp, the transfer, the
//! goal's grasp to some robot's home; the object itself in the way of the first and the last.
//! Not responsible for: other objects (`hard`).

use std::task::Poll;

use scene::{Budget, Scene, Vec2};
use shm_types::Counters;

use crate::obstacles::{block_for_own, block_for_pair};
use crate::places::Places;
use crate::search::PathSearch;

/// The leg that is being searched; homes are tried one after the other.
#[derive(Clone, Copy, Debug)]
enum Leg {
    Approach { home: usize },
    Transfer,
    Return { home: usize },
}

/// One task's test, in progress.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Feasibility {
    pub(crate) task: usize,
    places: Places,
    leg: Leg,
}

impl Feasibility {
    /// Begins the test of a task whose object is at these places.
    pub(crate) fn begin(
        scene: &Scene,
        search: &mut PathSearch,
        task: usize,
        places: Places,
    ) -> Self {
        let test = Self {
            task,
            places,
            leg: Leg::Approach { home: 0 },
        };
        test.begin_leg(scene, search);
        test
    }

    /// Goes on within `budget`: whether all three legs have a path.
    pub(crate) fn advance(
        &mut self,
        scene: &Scene,
        search: &mut PathSearch,
        budget: &mut Budget,
        counters: &mut Counters,
    ) -> Poll<bool> {
        loop {
            let Poll::Ready(length) = search.advance(scene, budget, counters) else {
                return Poll::Pending;
            };
            let homes = scene.homes.len();
            self.leg = match (self.leg, length) {
                (Leg::Approach { .. }, Some(_)) => Leg::Transfer,
                (Leg::Transfer, Some(_)) => Leg::Return { home: 0 },
                (Leg::Return { .. }, Some(_)) => return Poll::Ready(true),
                (Leg::Approach { home }, None) if home + 1 < homes => {
                    Leg::Approach { home: home + 1 }
                }
                (Leg::Return { home }, None) if home + 1 < homes => Leg::Return { home: home + 1 },
                (_, None) => return Poll::Ready(false),
            };
            self.begin_leg(scene, search);
        }
    }

    fn begin_leg(&self, scene: &Scene, search: &mut PathSearch) {
        let grasp = scene.objects[self.task].grasp;
        let first = self.places.initial + grasp;
        let last = self.places.goal + grasp;
        let own = |search: &mut PathSearch, at: Vec2| {
            let units = block_for_own(search.occupancy(), scene, self.task, at);
            search.charge(units);
        };
        match self.leg {
            Leg::Approach { home } => {
                own(search, self.places.initial);
                search.begin(scene, scene.homes[home], first);
            }
            Leg::Transfer => {
                let units = block_for_pair(search.occupancy(), scene, self.task, None);
                search.charge(units);
                search.begin(scene, first, last);
            }
            Leg::Return { home } => {
                own(search, self.places.goal);
                search.begin(scene, last, scene.homes[home]);
            }
        }
    }
}
