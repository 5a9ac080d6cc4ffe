//! What the supervisor sees of its processes.
//!
//! Responsible for: who is ready, who has been silent since when, the newest state.
//! Not responsible for: what follows from it (`supervisor`).

use std::time::{Duration, Instant};

use shm_types::{
    Checked, Command, ControlReply, ControlRequest, Outcome, PlannerReport, RecorderReport,
    RobotState, SnapshotHeader, TaskStatus, WorldSnapshot,
};

use crate::calls::{Call, Client, OPEN_CALLS};
use crate::domain::RunFile;
use crate::options::{Clock, Role, Wait};
use crate::ports::{Sample, Subscriber, TopicError};
use crate::supervisor::{ASK_AGAIN, Observer};
use crate::topics::HeldTopics;
use crate::wakes::Waker;

/// Signs of life of one participant.
struct Pulse {
    role: Role,
    /// Which process of it is listened to; for the world, the oldest generation that is.
    incarnation: u32,
    /// Whether that one has answered a tick.
    ready: bool,
    /// Something that rises with each answer.
    beat: u64,
    heard: Instant,
}

/// The supervisor's ports.
pub(super) struct Watch {
    run_id: u64,
    snapshots: Subscriber<WorldSnapshot>,
    planner: Subscriber<PlannerReport>,
    recorder: Subscriber<RecorderReport>,
    commands: Subscriber<Command>,
    control: Client<ControlRequest, ControlReply>,
    /// Requests under way, and since when: one that is dropped before it was heard is lost.
    calls: Vec<(Instant, Call<ControlRequest, ControlReply>)>,
    waker: Option<Waker>,
    newest: Option<Sample<WorldSnapshot>>,
    /// When the tick of the newest snapshot was another one last.
    ticked: Instant,
    pulses: Vec<Pulse>,
}

impl Watch {
    pub(super) fn new(topics: &HeldTopics, run: &RunFile) -> Result<Self, TopicError> {
        let blocks = run.options.clock == Clock::Lockstep && run.options.wait == Wait::Block;
        let control = topics.control.client()?;
        // Whatever is asked for is asked again until it is seen to be so.
        control.hurry();
        Ok(Self {
            run_id: run.id_number(),
            snapshots: topics.world.subscriber()?,
            planner: topics.planner.subscriber()?,
            recorder: topics.recorder.subscriber()?,
            commands: topics.command.subscriber()?,
            control,
            calls: Vec::new(),
            waker: blocks.then(|| topics.wake_world.waker()).transpose()?,
            newest: None,
            ticked: Instant::now(),
            pulses: Vec::new(),
        })
    }

    /// Listens to one more participant.
    pub(super) fn add(&mut self, role: Role) {
        self.pulses.push(Pulse {
            role,
            incarnation: 0,
            ready: false,
            beat: 0,
            heard: Instant::now(),
        });
    }

    /// Takes in what has come.
    pub(super) fn look(&mut self) -> Result<(), TopicError> {
        while let Some(snapshot) = self.snapshots.receive()? {
            let header = &snapshot.header;
            let now = (header.generation, header.tick);
            let before = self
                .header()
                .map_or((0, 0), |old| (old.generation, old.tick));
            let is_legal = Checked::new(&*snapshot, snapshot.own_counts()).is_ok();
            if header.run_id != self.run_id || now < before || !is_legal {
                continue;
            }
            if now.1 != before.1 {
                self.ticked = Instant::now();
            }
            self.beat(Role::World, header.generation, header.tick);
            self.newest = Some(snapshot);
        }
        while let Some(report) = self.planner.receive()? {
            self.beat(Role::Planner, report.incarnation, report.tick);
        }
        while let Some(report) = self.recorder.receive()? {
            self.beat(Role::Recorder, report.incarnation, report.next_sequence);
        }
        while let Some(command) = self.commands.receive()? {
            let role = Role::Robot(command.robot);
            self.beat(role, command.incarnation, command.sequence);
        }
        Ok(())
    }

    fn beat(&mut self, role: Role, incarnation: u32, beat: u64) {
        let is_newer = |pulse: &Pulse| match role {
            Role::World => incarnation >= pulse.incarnation,
            _ => incarnation == pulse.incarnation,
        };
        if let Some(pulse) = self.pulses.iter_mut().find(|pulse| pulse.role == role)
            && is_newer(pulse)
            && (!pulse.ready || beat > pulse.beat)
        {
            pulse.ready = true;
            pulse.beat = beat;
            pulse.heard = Instant::now();
        }
    }

    /// From here on listens to another process of `role`, as number `incarnation`.
    pub(super) fn expect(&mut self, role: Role, incarnation: u32) {
        let generation = self.header().map_or(0, |header| header.generation);
        let now = Instant::now();
        for pulse in &mut self.pulses {
            if pulse.role == role {
                *pulse = Pulse {
                    role,
                    incarnation: match role {
                        Role::World => generation.saturating_add(1),
                        _ => incarnation,
                    },
                    ready: false,
                    beat: 0,
                    heard: now,
                };
            }
            // Without the world nobody is heard, nor has anything to say.
            if role == Role::World {
                pulse.heard = now;
            }
        }
    }

    /// Whether the process listened to has answered a tick.
    pub(super) fn is_ready(&self, role: Role) -> bool {
        let mut pulses = self.pulses.iter();
        pulses.any(|pulse| pulse.role == role && pulse.ready)
    }

    /// How long `role` has not been heard.
    pub(super) fn silence(&self, role: Role) -> Duration {
        let pulse = self.pulses.iter().find(|pulse| pulse.role == role);
        pulse.map_or(Duration::ZERO, |pulse| pulse.heard.elapsed())
    }

    /// How long the tick has been the same.
    pub(super) fn standstill(&self) -> Duration {
        self.ticked.elapsed()
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

    /// A robot's newest state.
    pub(super) fn robot(&self, index: u32) -> Option<&RobotState> {
        let newest = self.newest.as_deref()?;
        newest.robots.get(index as usize)
    }

    /// Tasks that are not done.
    pub(super) fn open_tasks(&self) -> Option<usize> {
        let newest = self.newest.as_deref()?;
        let objects = newest.objects.get(..newest.header.object_count as usize)?;
        let is_open = |status: u32| status != TaskStatus::Done.code();
        Some(
            objects
                .iter()
                .filter(|object| is_open(object.status))
                .count(),
        )
    }

    /// Shows the newest state.
    pub(super) fn show(&self, observer: &mut dyn Observer) {
        let newest = self.newest.as_deref();
        if let Some(Ok(snapshot)) = newest.map(|newest| Checked::new(newest, newest.own_counts())) {
            observer.progress(snapshot);
        }
    }

    /// Whether another request can be made without giving up one that may still be heard.
    pub(super) fn may_ask(&mut self) -> bool {
        self.calls.retain(|(since, call)| {
            let is_open = matches!(call.answer(), Ok(None));
            is_open && since.elapsed() < ASK_AGAIN
        });
        self.calls.len() < OPEN_CALLS
    }

    /// Sends a request to the world.
    pub(super) fn ask(&mut self, request: ControlRequest) -> Result<(), TopicError> {
        while self.calls.len() >= OPEN_CALLS {
            self.calls.remove(0);
        }
        let call = self.control.call(request)?;
        self.calls.push((Instant::now(), call));
        if let Some(waker) = &self.waker {
            waker.wake()?;
        }
        Ok(())
    }
}
