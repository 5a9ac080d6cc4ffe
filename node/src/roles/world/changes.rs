//! Changes of the scene on their way into the world: those asked for now, and those that the run
//! was given for a stated tick.
//!
//! Responsible for: making the next version of the scene, writing it down for everybody before it
//! is in force, at most one a tick.
//! Not responsible for: what can be changed (crate `world`), who asks (`ears`).

use std::collections::VecDeque;

use scene::Change;
use shm_types::{ControlKind, ControlRequest, RoleKind, SceneChange};
use world::{Next, NotMade, World};

use crate::options::ToldAt;
use crate::roles::Seat;

/// What is to be changed.
pub(super) struct Changes {
    /// By tick, ascending.
    timed: VecDeque<ToldAt>,
    /// What the next step brings into force.
    next: Option<Next>,
}

impl Changes {
    pub(super) fn new(timed: &[ToldAt]) -> Self {
        let mut timed = timed.to_vec();
        timed.sort_by_key(|timed| timed.tick);
        Self {
            timed: timed.into(),
            next: None,
        }
    }

    /// A world that goes on from `tick` has done all that was given for those before.
    pub(super) fn go_on_from(&mut self, tick: u64) {
        self.timed.retain(|timed| timed.tick >= tick);
    }

    /// What the run was given for this tick, one after the other.
    pub(super) fn due(&mut self, tick: u64) -> Option<ToldAt> {
        self.timed.pop_front_if(|timed| timed.tick <= tick)
    }

    /// Makes the next version of the scene: the tick that it holds from, or why there is none.
    pub(super) fn ask(
        &mut self,
        seat: &Seat,
        world: &World,
        tick: u64,
        changes: &[Change],
    ) -> Result<u64, String> {
        if self.next.is_some() {
            return Err(NotMade::Busy.to_string());
        }
        let next = world
            .prepare(&seat.scene, changes)
            .map_err(|reason| reason.to_string())?;
        let most = seat.run.room().robots as usize;
        if next.scene.homes.len() > most {
            return Err(format!(
                "the run has room for {most} robots; start it with more --more-robots"
            ));
        }
        seat.write_version(&next.scene)
            .map_err(|error| error.to_string())?;
        self.next = Some(next);
        Ok(tick + 1)
    }

    /// What the step of this tick brings into force.
    pub(super) fn take(&mut self) -> Option<Next> {
        self.next.take()
    }
}

/// The changes in a request; none if it has one that this version does not know.
pub(super) fn changes_of(asked: &[SceneChange]) -> Option<Vec<Change>> {
    asked.iter().map(Change::from_wire).collect()
}

/// The request that a robot takes part again, or no more.
pub(super) fn take_part(kind: ControlKind, robot: u32) -> ControlRequest {
    ControlRequest {
        kind: kind.code(),
        role: RoleKind::Robot.code(),
        index: robot,
        ..ControlRequest::default()
    }
}
