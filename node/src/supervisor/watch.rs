//! What the supervisor sees of its processes.
//!
//! Responsible for: who is ready, who has been silent since when, the newest state.
//! Not responsible for: what follows from it (`supervisor`).

use std::time::{Duration, Instant};

use shm_types::{
    Checked, Command, ControlReply, ControlRequest, Outcome, PlannerReport, RecorderReport,
    SnapshotHeader, WorldSnapshot,
};

use crate::calls::{Call, Client, OPEN_CALLS};
use crate::domain::RunFile;
use crate::options::{Clock, Role, Wait};
use crate::ports::{Sample, Subscriber, TopicError};
use crate::supervisor::Observer;
use crate::topics::HeldTopics;
use crate::wakes::Waker;

/// Signs of life of one participant.
struct Pulse {
    role: Role,
    ready: bool,
    /// Something that rises with each answer.
    beat: u64,
    heard: Instant,
}

/// The supervisor's ports.
pub(super) struct Watch {
    snapshots: Subscriber<WorldSnapshot>,
    planner: Subscriber<PlannerReport>,
    recorder: Subscriber<RecorderReport>,
    /// Only until everybody is ready.
    commands: Option<Subscriber<Command>>,
    control: Client<ControlRequest, ControlReply>,
    /// Requests under way: an answer to one that was dropped would be lost.
    calls: Vec<Call<ControlRequest, ControlReply>>,
    waker: Option<Waker>,
    newest: Option<Sample<WorldSnapshot>>,
    pulses: Vec<Pulse>,
}

impl Watch {
    pub(super) fn new(topics: &HeldTopics, run: &RunFile) -> Result<Self, TopicError> {
        let blocks = run.options.clock == Clock::Lockstep && run.options.wait == Wait::Block;
        let pulses = Role::all(run.robots).map(|role| Pulse {
            role,
            ready: false,
            beat: 0,
            heard: Instant::now(),
        });
        Ok(Self {
            snapshots: topics.world.subscriber()?,
            planner: topics.planner.subscriber()?,
            recorder: topics.recorder.subscriber()?,
            commands: Some(topics.command.subscriber()?),
            control: topics.control.client()?,
            calls: Vec::new(),
            waker: blocks.then(|| topics.wake_world.waker()).transpose()?,
            newest: None,
            pulses: pulses.collect(),
        })
    }

    /// Takes in what has come.
    pub(super) fn look(&mut self) -> Result<(), TopicError> {
        if let Some(snapshot) = self.snapshots.receive()? {
            self.beat(Role::World, snapshot.header.tick);
            self.hear_robots(&snapshot);
            self.newest = Some(snapshot);
        }
        if let Some(report) = self.planner.receive()? {
            self.beat(Role::Planner, report.tick);
        }
        if let Some(report) = self.recorder.receive()? {
            self.beat(Role::Recorder, report.next_sequence);
        }
        while let Some(commands) = &self.commands
            && let Some(command) = commands.receive()?
        {
            self.beat(Role::Robot(command.robot), command.sequence);
        }
        Ok(())
    }

    /// The world acknowledges what robots say.
    fn hear_robots(&mut self, snapshot: &WorldSnapshot) {
        if snapshot.header.tick == 0 {
            return;
        }
        if let Ok(snapshot) = Checked::new(snapshot, snapshot.own_counts()) {
            for (index, robot) in (0..).zip(snapshot.robots()) {
                if robot.live == 1 {
                    self.beat(Role::Robot(index), robot.acknowledged);
                } else {
                    self.excuse(Role::Robot(index));
                }
            }
        }
    }

    /// Who takes part no more is not listened to, and so cannot be heard.
    fn excuse(&mut self, role: Role) {
        if let Some(pulse) = self.pulses.iter_mut().find(|pulse| pulse.role == role) {
            pulse.beat = 0;
            pulse.heard = Instant::now();
        }
    }

    fn beat(&mut self, role: Role, beat: u64) {
        if let Some(pulse) = self.pulses.iter_mut().find(|pulse| pulse.role == role)
            && (!pulse.ready || beat > pulse.beat)
        {
            pulse.ready = true;
            pulse.beat = beat;
            pulse.heard = Instant::now();
        }
    }

    /// Participants that have not answered a first tick.
    pub(super) fn unready(&self) -> Vec<Role> {
        let unready = self.pulses.iter().filter(|pulse| !pulse.ready);
        unready.map(|pulse| pulse.role).collect()
    }

    /// Whether all have.
    pub(super) fn all_are_ready(&self) -> bool {
        self.pulses.iter().all(|pulse| pulse.ready)
    }

    /// From here on the world alone reads commands.
    pub(super) fn set_up_is_over(&mut self) {
        self.commands = None;
        for pulse in &mut self.pulses {
            pulse.heard = Instant::now();
        }
    }

    /// A participant that has been silent for longer than `limit`.
    pub(super) fn silent_for(&self, limit: Duration) -> Option<Role> {
        let silent = |pulse: &&Pulse| pulse.heard.elapsed() > limit;
        // Without the world nobody is heard.
        self.pulses.iter().find(silent).map(|pulse| pulse.role)
    }

    /// `role` does not take part any more.
    pub(super) fn forget(&mut self, role: Role) {
        self.pulses.retain(|pulse| pulse.role != role);
    }

    /// How the run ended, once it has.
    pub(super) fn outcome(&self) -> Option<Outcome> {
        let outcome = Outcome::decode(self.header()?.outcome).ok()?;
        (outcome != Outcome::Running).then_some(outcome)
    }

    /// The newest snapshot's header.
    pub(super) fn header(&self) -> Option<&SnapshotHeader> {
        self.newest.as_ref().map(|snapshot| &snapshot.header)
    }

    /// Shows the newest state.
    pub(super) fn show(&self, observer: &mut dyn Observer) {
        let newest = self.newest.as_deref();
        if let Some(Ok(snapshot)) = newest.map(|newest| Checked::new(newest, newest.own_counts())) {
            observer.progress(snapshot);
        }
    }

    /// Sends a request to the world.
    pub(super) fn ask(&mut self, request: ControlRequest) -> Result<(), TopicError> {
        if self.calls.len() == OPEN_CALLS {
            self.calls.remove(0);
        }
        self.calls.push(self.control.call(request)?);
        if let Some(waker) = &self.waker {
            waker.wake()?;
        }
        Ok(())
    }
}
