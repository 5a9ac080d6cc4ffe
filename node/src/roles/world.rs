//! The loop around the world: it makes the ticks.
//!
//! Responsible for: publishing each snapshot, in lockstep waiting for every live participant's
//! answer to it, in real time keeping the world's own deadlines, and staying until everybody has
//! seen the end.
//! Not responsible for: anything the world decides (crate `world`).
//!
//! Snapshots are written in place. Each tick is in the journal before anything of it is sent, so a
//! world process that is started again goes on from where the one before it stopped: it sends the
//! newest snapshot once more, as another *generation*, and everybody answers it as before.

mod changes;
mod ears;
mod hashes;
mod outbox;

use std::path::Path;
use std::time::Duration;

use shm_types::capacity::MAX_ROBOTS;
use shm_types::{Activity, ControlRequest, MotionBatch, Outcome, SnapshotHeader, WorldSnapshot};
use world::{CheckpointError, World, WorldInput};

use crate::clock;
use crate::histograms::Timed;
use crate::journal::{Found, Journal};
use crate::options::Role;
use crate::ports::{Access, Publisher};
use crate::report::{ActivityReport, InvariantsReport, WorldReport};
use crate::roles::{RoleError, Seat, Telling};
use crate::ticker::{Due, Ticker};
use crate::wait::Waiter;
use crate::wakes::Waker;
use changes::Changes;
use ears::Ears;
use hashes::HashFile;
use outbox::Outbox;

/// Identity of the run, as the machine knows it: none, so that its state is the same in every run
/// of a scenario, whatever drives it. The snapshot's own is stamped on it with the time.
const NO_RUN: u64 = 0;
/// How long the world sleeps between two looks once the run is over.
const LINGER: Duration = Duration::from_millis(1);

/// Takes part in the run in `run_dir`, as process `incarnation` of the world, until it ends and the
/// supervisor lets go.
///
/// # Errors
/// Set-up failed, or the run broke off.
pub fn main(run_dir: &Path, incarnation: u32) -> Result<(), RoleError> {
    let mut seat = Seat::take(run_dir, Role::World, incarnation)?;
    let mut shell = Shell::new(&mut seat)?;
    seat.settle();
    shell.publish(&mut seat)?;
    if shell.world.outcome() == Outcome::Running && shell.wait_for_all(&seat)? {
        shell.start_ticker(&seat);
        shell.run(&mut seat)?;
    }
    shell.linger(&seat)?;
    let telling = Telling {
        deadline_misses: shell.ticker.map_or(0, |ticker| ticker.misses()),
        lost: shell.ears.lost_commands(),
        world: Some(shell.report(&seat)),
        ..Telling::default()
    };
    seat.leave(telling)
}

/// Opens the journal; the states that a world process before this one has left, newest first.
fn open_journal(seat: &Seat) -> Result<(Journal, Vec<Found>), RoleError> {
    let path = seat.journal_path();
    let rooms = outbox::rooms_for(seat.run.room(), &seat.options().settings);
    Journal::open(&path, seat.run.id_number(), &rooms).map_err(|error| RoleError::File {
        path,
        reason: error.to_string(),
    })
}

/// The world as it was in the newest state that is whole.
fn restore(seat: &mut Seat, found: &[Found]) -> Result<Option<World>, RoleError> {
    let settings = seat.options().settings.clone();
    let mut why = None;
    for (_, bytes) in found {
        let Some(scenario_hash) = World::scene_of(bytes) else {
            why = Some(CheckpointError::Damaged);
            continue;
        };
        if scenario_hash != seat.scene.hash {
            // Some version after the first; which one is known once the state is read.
            seat.follow(&SnapshotHeader {
                scene_version: u32::MAX,
                scenario_hash,
                ..SnapshotHeader::default()
            })?;
        }
        match World::restore(&seat.scene, settings.clone(), bytes) {
            Ok(world) => {
                seat.follow(&SnapshotHeader {
                    scene_version: world.scene_version(),
                    scenario_hash,
                    ..SnapshotHeader::default()
                })?;
                return Ok(Some(world));
            }
            Err(error) => why = Some(error),
        }
    }
    match why {
        None => Ok(None),
        // Beginning anew would undo what everybody has seen.
        Some(error) => Err(RoleError::File {
            path: seat.journal_path(),
            reason: format!("no state in it is whole: {error}"),
        }),
    }
}

/// The world and its ports.
struct Shell {
    world: World,
    run_id: u64,
    tick: u64,
    ears: Ears,
    changes: Changes,
    snapshots: Publisher<WorldSnapshot>,
    /// What the step makes.
    batch: Box<MotionBatch>,
    outbox: Outbox,
    waiter: Waiter,
    waker: Option<Waker>,
    /// The own deadlines, in real time.
    ticker: Option<Ticker>,
    /// When each tick is due, in real time.
    due: Option<Due>,
    hashes: Option<HashFile>,
    /// What the step of this tick is told.
    control: Vec<ControlRequest>,
    published_ns: u64,
}

impl Shell {
    fn new(seat: &mut Seat) -> Result<Self, RoleError> {
        let (journal, found) = open_journal(seat)?;
        let restored = restore(seat, &found)?;
        let is_kept = restored.is_some();
        let mut world = match restored {
            Some(world) => world,
            None => World::new(&seat.scene, seat.options().settings.clone(), NO_RUN),
        };
        let (topics, node) = (&seat.topics, &seat.node);
        let options = seat.options();
        let tick = world.tick();
        let mut changes = Changes::new(&options.changes);
        changes.go_on_from(tick);
        let motion = topics.motion.service(node, Access::Open)?.publisher()?;
        let sleeper = || topics.wake_world.service(node, Access::Open)?.sleeper();
        let waker = || {
            let wakes = &topics.wake_participants;
            wakes.service(node, Access::Open)?.waker()
        };
        Ok(Self {
            run_id: seat.run.id_number(),
            tick,
            ears: Ears::new(seat, &world)?,
            outbox: Outbox::new(journal, motion, &mut world, is_kept)?,
            batch: shm_types::zeroed(),
            world,
            changes,
            snapshots: topics.world.service(node, Access::Open)?.publisher()?,
            waiter: seat.waiter(sleeper)?,
            waker: seat.waker(waker)?,
            ticker: None,
            due: None,
            hashes: options
                .hashes
                .as_deref()
                .map(|path| HashFile::create(path, tick))
                .transpose()?,
            control: Vec::with_capacity(ears::MOST_REQUESTS),
            published_ns: 0,
        })
    }

    /// Ticks until the run is over or this process is to end.
    fn run(&mut self, seat: &mut Seat) -> Result<(), RoleError> {
        loop {
            self.step(seat)?;
            seat.answering();
            self.publish(seat)?;
            if self.world.outcome() != Outcome::Running {
                return Ok(());
            }
            let go_on = match &mut self.ticker {
                Some(ticker) => {
                    if !seat.is_warm() {
                        ticker.forget_misses();
                    }
                    ticker.wait();
                    self.listen(seat)?;
                    !seat.is_stopped()
                }
                None => self.wait_for_all(seat)?,
            };
            if !go_on {
                return Ok(());
            }
        }
    }

    /// In real time, too, everybody must have answered the first snapshot; then time starts.
    fn start_ticker(&mut self, seat: &Seat) {
        if let Some(period_ns) = seat.options().clock.period_ns() {
            let mut ticker = Ticker::aligned(clock::now_ns(), period_ns, 0);
            ticker.wait();
            self.ticker = Some(ticker);
            self.due = Some(Due::new(period_ns, 0));
        }
    }

    /// Waits until every live participant has answered the present tick, or somebody has asked
    /// for the end. Lets late joiners in meanwhile. `false` if this process is to end.
    fn wait_for_all(&mut self, seat: &Seat) -> Result<bool, RoleError> {
        loop {
            self.listen(seat)?;
            if self.is_answered() || self.ears.stop_is_asked() {
                self.waiter.arrived();
                return Ok(true);
            }
            if seat.is_stopped() {
                return Ok(false);
            }
            self.connect()?;
            self.waiter.pause()?;
        }
    }

    /// Whether everybody has answered the present tick, and what it leads to can be kept.
    fn is_answered(&self) -> bool {
        self.ears.have_answered(self.tick) && self.outbox.has_room()
    }

    fn listen(&mut self, seat: &Seat) -> Result<(), RoleError> {
        self.ears.listen(seat, &self.world, &mut self.changes)?;
        self.outbox.send(self.tick, self.ears.recorded())
    }

    /// Does what the run was given for the present tick.
    fn do_timed(&mut self, seat: &mut Seat) {
        while let Some(timed) = self.changes.due(self.tick) {
            let (world, changes) = (&self.world, &mut self.changes);
            let done = self.ears.obey_timed(seat, &timed.what, world, changes);
            if let Err(why) = done {
                seat.note(timed.not_made(&why));
            }
        }
    }

    fn connect(&self) -> Result<(), RoleError> {
        self.snapshots.connect()?;
        self.outbox.connect()
    }

    /// One tick of the machine; it is safe, and its motion on its way, when this returns.
    fn step(&mut self, seat: &mut Seat) -> Result<(), RoleError> {
        let started_ns = clock::now_ns();
        self.ears.take_control(&mut self.control);
        let change = self.changes.take();
        let mut commands = [None; MAX_ROBOTS];
        self.ears.commands(&mut commands)?;
        let input = WorldInput {
            commands: &commands[..self.world.robots()],
            planner: self.ears.report()?,
            table: self.ears.table(),
            schedule: self.ears.schedule(),
            control: &self.control,
            change: change.as_ref(),
        };
        self.world.step(&seat.scene, input, &mut self.batch);
        self.tick += 1;
        if let Some(next) = change {
            seat.scene = next.scene;
            self.ears.recount(seat.counts(), &self.world);
        }
        seat.record_since(Timed::WorldStep, started_ns);
        if let Some(hashes) = &mut self.hashes {
            hashes.add(self.world.state_hash())?;
        }
        let kept_ns = clock::now_ns();
        self.outbox.keep(&self.batch, &mut self.world)?;
        seat.record_since(Timed::Journal, kept_ns);
        self.ears.reply()?;
        self.outbox.send(self.tick, self.ears.recorded())
    }

    fn publish(&mut self, seat: &mut Seat) -> Result<(), RoleError> {
        let (world, run_id) = (&self.world, self.run_id);
        let generation = self.outbox.generation();
        let started_ns = clock::now_ns();
        let mut stamp_ns = started_ns;
        self.snapshots.send(|snapshot| {
            world.snapshot_into(snapshot);
            snapshot.header.run_id = run_id;
            snapshot.header.generation = generation;
            stamp_ns = clock::now_ns();
            snapshot.header.publish_stamp_ns = stamp_ns;
        })?;
        let sent_ns = clock::now_ns();
        let before_ns = std::mem::replace(&mut self.published_ns, sent_ns);
        if self.tick > 1 && before_ns > 0 {
            let latencies = &mut seat.latencies;
            latencies.record(Timed::SnapshotWrite, stamp_ns - started_ns);
            latencies.record(Timed::SnapshotSend, sent_ns - stamp_ns);
            latencies.record(Timed::Tick, sent_ns - before_ns);
        }
        if let Some(due) = &mut self.due {
            for late_ns in due.came(stamp_ns, stamp_ns) {
                seat.latencies.record(Timed::TickLateness, late_ns);
            }
        }
        if let Some(waker) = &self.waker {
            waker.wake()?;
        }
        self.do_timed(seat);
        Ok(())
    }

    /// Stays, so that everybody can see the end, until the supervisor lets go.
    fn linger(&mut self, seat: &Seat) -> Result<(), RoleError> {
        while !seat.is_stopped() {
            self.listen(seat)?;
            self.connect()?;
            std::thread::sleep(LINGER);
        }
        Ok(())
    }

    fn report(&self, seat: &Seat) -> WorldReport {
        let world = &self.world;
        let counters = world.counters();
        let activities = (0..world.robots()).map(|robot| {
            let mut report = ActivityReport::default();
            for activity in Activity::ALL {
                *report.of_mut(*activity) = world.times(robot).ticks(*activity);
            }
            report
        });
        WorldReport {
            outcome: world.outcome().code(),
            verdict: world.verdict().code(),
            reason: world.reason(&seat.scene),
            ticks: self.tick,
            time_ns: self.tick * seat.options().settings.tick_ns,
            state_hash: world.state_hash(),
            hard_constraints: counters.constraints_found,
            task_failures: counters.task_failures,
            grants_refused: counters.grants_refused,
            invalid_requests: counters.invalid_requests,
            schedules_refused: counters.schedules_refused,
            refused_schedule: world.refused_schedule().map(|refused| refused.to_string()),
            scene_changes: u64::from(world.scene_version()),
            selection_conflicts: counters.selection_conflicts,
            invariants: InvariantsReport::new(&counters.checks, world.violation()),
            activities: activities.collect(),
        }
    }
}
