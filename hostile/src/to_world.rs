//! What the world reads: commands, tables, schedules, requests of control, reports.
//!
//! Responsible for: the targets that begin with the world in the middle of the run, taking each message
//! in as the world's shell does (crate `node`).
//! Not responsible for: the world's own saved state (`saved`).

use scene::{Change, Scene};
use shm_types::{
    Checked, Command, ConstraintTable, ControlKind, ControlRequest, Invalid, MotionBatch,
    PlannerReport, SceneChange, Schedule, Validate, WorldSnapshot, zeroed,
};
use world::{Next, World, WorldInput};
use zerocopy::IntoBytes;

use crate::bench::{Bench, Mail, copy};
use crate::{Got, Tape, each};

/// Ticks a command is good for.
const VALID_TICKS: u64 = 20;
/// Bytes of a schedule before its robots, of each robot, of a table before its constraints, of each of
/// these, of a request before its changes, of each of these.
const SCHEDULE_HEAD: usize = 24;
const SCHEDULED_ROBOT: usize = 20;
const TABLE_HEAD: usize = 24;
const CONSTRAINT: usize = 12;
const CONTROL_HEAD: usize = 40;
/// Work units of a step of those who see what the world makes of it.
const UNITS: u64 = 500;

/// The world, and the scene that is in force in it.
struct Stage<'a> {
    bench: &'a Bench,
    scene: Scene,
    world: World,
    motion: Box<MotionBatch>,
    /// Messages before this one.
    before: u32,
}

/// What is new in a tick.
#[derive(Clone, Copy, Default)]
struct News<'a> {
    command: Option<(usize, &'a Command)>,
    table: Option<&'a ConstraintTable>,
    schedule: Option<&'a Schedule>,
    report: Option<&'a PlannerReport>,
    control: &'a [ControlRequest],
    change: Option<&'a Next>,
}

impl<'a> Stage<'a> {
    fn new(bench: &'a Bench) -> Self {
        Self {
            bench,
            scene: bench.scene.clone(),
            world: bench.world(),
            motion: zeroed(),
            before: 0,
        }
    }

    /// A tick with what is new, and otherwise the messages that there were.
    fn step(&mut self, news: News<'_>) {
        let counts = self.scene.counts();
        let mut commands = [None; 8];
        for (slot, command) in commands.iter_mut().zip(&self.bench.commands) {
            *slot = Checked::new(command, counts).ok();
        }
        if let Some((id, command)) = news.command {
            commands[id] = Checked::new(command, counts).ok();
        }
        let report = news.report.unwrap_or(&self.bench.report);
        let schedule = news.schedule;
        let input = WorldInput {
            commands: &commands[..self.world.robots()],
            planner: Checked::new(report, counts).ok(),
            table: news
                .table
                .and_then(|table| Checked::new(table, counts).ok()),
            schedule: schedule.map(|s| (s.version, Checked::new(s, counts).ok())),
            control: news.control,
            change: news.change,
        };
        self.world.step(&self.scene, input, &mut self.motion);
        assert_eq!(self.world.violation(), None, "the world is safe");
        self.before += 1;
    }

    /// Lets robot `reader`, or past these the planner, see what the world has come to.
    fn show(&self, reader: usize, mail: Mail<'_>) {
        let mut snapshot: Box<WorldSnapshot> = zeroed();
        self.world.snapshot_into(&mut snapshot);
        let snapshot = Checked::new(&*snapshot, self.scene.counts());
        let snapshot = snapshot.expect("the world's snapshots are legal");
        let mut reader = self.bench.reader(reader);
        reader.step(&self.scene, snapshot, mail, UNITS);
    }
}

/// Commands of robots, one a tick.
pub(crate) fn commands(bench: &Bench, tape: &mut Tape<'_>) -> Got {
    let mut stage = Stage::new(bench);
    let mut last = bench.commands.clone();
    each(tape, |tape| {
        let id = tape.below(last.len());
        let mut command = last[id];
        let tick = stage.world.tick();
        (command.robot, command.incarnation) = (id as u32, 1);
        command.sequence += 1;
        (command.tick, command.valid_until_tick) = (tick, tick + VALID_TICKS);
        command.claim.epoch = command.claim.epoch.max(bench.snapshot.header.epoch);
        command.path.id += 1;
        let good = command;
        tape.change_message(&mut command, size_of::<Command>());
        let result = command.validate(bench.scene.counts());
        if result.is_ok() {
            stage.step(News {
                command: Some((id, &command)),
                ..News::default()
            });
        }
        // The next goes on from a good one: what is far off would shut its sender's door for good.
        last[id] = good;
        Got::of(&result)
    })
}

/// Constraint tables, each of a newer version.
pub(crate) fn tables(bench: &Bench, tape: &mut Tape<'_>) -> Got {
    let mut stage = Stage::new(bench);
    each(tape, |tape| {
        let mut table = copy(&*bench.table);
        table.version += stage.before + 1;
        let live = TABLE_HEAD + CONSTRAINT * (table.count as usize + 4);
        tape.change_message(&mut *table, live);
        let result = table.validate(bench.scene.counts());
        if result.is_ok() {
            stage.step(News {
                table: Some(&table),
                ..News::default()
            });
            if tape.once_in(16) {
                stage.show(
                    tape.below(bench.scene.homes.len() + 1),
                    Mail {
                        table: &table,
                        schedule: None,
                        answer: None,
                        requests: &[],
                    },
                );
            }
        }
        Got::of(&result)
    })
}

/// Schedules, each of a newer version.
pub(crate) fn schedules(bench: &Bench, tape: &mut Tape<'_>) -> Got {
    let mut stage = Stage::new(bench);
    let counts = bench.scene.counts();
    each(tape, |tape| {
        let mut schedule = copy(&*bench.schedule);
        schedule.version += stage.before + 1;
        schedule.robot_count = schedule.robot_count.max(counts.robots);
        match tape.below(4) {
            0 => {
                let live = SCHEDULE_HEAD + SCHEDULED_ROBOT * bench.scene.homes.len();
                tape.change_message(&mut *schedule, live);
            }
            1 | 2 => {
                let count = (schedule.action_count as usize).max(1);
                tape.change(schedule.actions[..count].as_mut_bytes());
            }
            _ => {
                let count = (schedule.wait_count as usize).max(1);
                tape.change(schedule.waits[..count].as_mut_bytes());
            }
        }
        let result = schedule.validate(counts);
        if result.is_ok() {
            stage.step(News {
                schedule: Some(&schedule),
                ..News::default()
            });
            if tape.once_in(16) {
                stage.show(
                    tape.below(bench.scene.homes.len() + 1),
                    Mail {
                        table: &bench.table,
                        schedule: Some(&schedule),
                        answer: None,
                        requests: &[],
                    },
                );
            }
        }
        Got::of(&result)
    })
}

/// Reports of the planner.
pub(crate) fn reports(bench: &Bench, tape: &mut Tape<'_>) -> Got {
    let mut stage = Stage::new(bench);
    each(tape, |tape| {
        let mut report = bench.report;
        report.tick = stage.world.tick();
        tape.change_message(&mut report, size_of::<PlannerReport>());
        let result = report.validate(bench.scene.counts());
        if result.is_ok() {
            stage.step(News {
                report: Some(&report),
                ..News::default()
            });
        }
        Got::of(&result)
    })
}

/// A good request, and changes that may be.
fn request(scene: &Scene, tape: &mut Tape<'_>) -> ControlRequest {
    let mut request = ControlRequest {
        id: 1,
        role: 2,
        kind: tape.below(ControlKind::ALL.len()) as u32,
        index: tape.below(scene.homes.len()) as u32,
        incarnation: tape.below(3) as u32,
        ..ControlRequest::default()
    };
    let is_change = request.kind == ControlKind::Change.code();
    request.change_count = u32::from(is_change) * (tape.below(3) as u32 + 1);
    let (low, high) = scene.bounds;
    for change in &mut request.changes[..request.change_count as usize] {
        (change.kind, change.object) = (tape.below(6) as u32, tape.below(8) as u32);
        change.has_goal = tape.below(2) as u32;
        let mut at = |low: f64, high: f64| low + (high - low) * tape.below(128) as f64 / 127.0;
        (change.at.x, change.at.y) = (at(low.x, high.x), at(low.y, high.y));
        (change.to.x, change.to.y) = (change.at.x + 0.3, change.at.y + 0.2);
        if change.kind < 3 {
            (change.to.x, change.to.y) = (at(low.x, high.x), at(low.y, high.y));
        }
    }
    request
}

/// Requests of control, one a tick, changes of the scene among them.
pub(crate) fn control(bench: &Bench, tape: &mut Tape<'_>) -> Got {
    let mut stage = Stage::new(bench);
    each(tape, |tape| {
        let mut request = request(&stage.scene, tape);
        let live = CONTROL_HEAD + size_of::<SceneChange>() * request.change_count as usize;
        tape.change_message(&mut request, live);
        let reply = stage.world.reply_to(&request);
        assert!(reply.accepted <= 1, "a reply");
        if reply.result().is_err() {
            return Got::Inside;
        }
        if request.kind == ControlKind::Change.code() {
            return change(&mut stage, &request);
        }
        let result: Result<(), Invalid> = request.validate(stage.scene.counts());
        if result.is_ok() {
            stage.step(News {
                control: &[request],
                ..News::default()
            });
        }
        Got::of(&result)
    })
}

/// Makes a version of the scene as the world's shell does, which leaves it to the scene to judge, and
/// brings it into force.
fn change(stage: &mut Stage<'_>, request: &ControlRequest) -> Got {
    let asked: Option<Vec<Change>> = request.changes().iter().map(Change::from_wire).collect();
    let made = asked.and_then(|asked| stage.world.prepare(&stage.scene, &asked).ok());
    // A shell has room for some robots only.
    let Some(next) = made.filter(|next| next.scene.homes.len() <= 8) else {
        return Got::Inside;
    };
    stage.step(News {
        change: Some(&next),
        ..News::default()
    });
    stage.scene = next.scene;
    stage.step(News::default());
    Got::Accepted
}
