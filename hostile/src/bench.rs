//! Good values of one method, from the middle of a run, and machines that are there.
//!
//! Responsible for: making the run, keeping one message of each kind from it, handing out machines as
//! new.
//! Not responsible for: what is done to any of it (the targets).

use planner::{Planner, PlannerInput};
use robot::{Robot, RobotInput};
use scene::{Method, Scene, Settings};
use shm_types::{
    Checked, Command, ConstraintTable, HardAnswer, HardRequest, MotionBatch, Outcome,
    PlannerReport, Schedule, Validate, Versioned, WorldSnapshot, zeroed,
};
use sim::Simulation;
use trace::{Ending, SceneRecord, Writer};
use world::World;

use crate::recording;

/// Ticks at the end of the run that its trace has.
const RECORDED: u64 = 40;
/// Virtual time between two states in the trace, ns.
const STATE_EVERY_NS: u64 = 100_000_000;

/// What one run gave. Nothing in here changes.
pub(crate) struct Bench {
    pub(crate) scene: Scene,
    pub(crate) settings: Settings,
    pub(crate) snapshot: Box<WorldSnapshot>,
    pub(crate) commands: Vec<Command>,
    pub(crate) report: PlannerReport,
    pub(crate) table: Box<ConstraintTable>,
    pub(crate) schedule: Box<Schedule>,
    /// The batch that had most in it.
    pub(crate) batch: Box<MotionBatch>,
    /// The world's state.
    pub(crate) saved: Vec<u8>,
    pub(crate) record: SceneRecord,
    pub(crate) trace: Vec<u8>,
    /// The same without checksums.
    pub(crate) open_trace: Vec<u8>,
}

fn settings(method: Method) -> Settings {
    Settings {
        method,
        units_per_second: 500_000,
        ..Settings::default()
    }
}

/// Copies a box whose message is too large for the stack.
pub(crate) fn copy<T: Versioned>(message: &T) -> Box<T> {
    let mut copied: Box<T> = zeroed();
    copied.copy_from(message);
    copied
}

impl Bench {
    /// A run of `scene` up to tick `ticks`.
    pub(crate) fn new(scene: &Scene, method: Method, ticks: u64) -> Self {
        let settings = settings(method);
        let mut run = Simulation::new(scene, &settings, 0);
        let record = SceneRecord::new(scene, &settings, 0);
        let mut writer = Writer::new(Vec::new(), &record, STATE_EVERY_NS).expect("memory");
        let mut batch: Box<MotionBatch> = zeroed();
        while run.outcome() == Outcome::Running && run.snapshot().header.tick < ticks {
            run.tick();
            let made = run.motion();
            if made.motion_count + made.event_count > batch.motion_count + batch.event_count {
                batch.copy_from(made);
            }
            if made.sequence == 0 || made.tick + RECORDED > ticks {
                writer.batch(made).expect("a legal batch");
                let snapshot = Checked::new(run.snapshot(), scene.counts()).expect("legal");
                writer.snapshot(snapshot).expect("memory");
            }
        }
        let trace = writer.finish(Ending {
            outcome: run.outcome().into(),
            reason: None,
            makespan_ns: run.snapshot().header.time_ns,
            options: serde_json::Value::Null,
        });
        let trace = trace.expect("memory");
        let mut saved = Vec::new();
        run.world().save(&mut saved);
        let mut snapshot: Box<WorldSnapshot> = zeroed();
        run.world().snapshot_into(&mut snapshot);
        let (commands, report, table, schedule) = run.messages();
        Self {
            commands: commands.to_vec(),
            report: *report,
            table: table.map_or_else(ConstraintTable::none, copy),
            schedule: schedule.map_or_else(zeroed, copy),
            open_trace: recording::without_checksums(&trace),
            scene: scene.clone(),
            batch,
            settings,
            snapshot,
            saved,
            record,
            trace,
        }
    }

    /// The world where the run was.
    pub(crate) fn world(&self) -> World {
        World::restore(&self.scene, self.settings.clone(), &self.saved).expect("just saved")
    }

    /// Robot `reader`, or past these the planner, as a process that has just been started.
    pub(crate) fn reader(&self, reader: usize) -> Reader {
        let settings = self.settings.clone();
        if reader < self.scene.homes.len() {
            Reader::Robot(Box::new(Robot::new(&self.scene, settings, reader, 1)))
        } else {
            Reader::Planner(Box::new(Planner::new(&self.scene, settings)))
        }
    }
}

/// Somebody who reads snapshots.
pub(crate) enum Reader {
    Robot(Box<Robot>),
    Planner(Box<Planner>),
}

/// What they are brought besides a snapshot.
#[derive(Clone, Copy)]
pub(crate) struct Mail<'a> {
    pub(crate) table: &'a ConstraintTable,
    pub(crate) schedule: Option<&'a Schedule>,
    pub(crate) answer: Option<HardAnswer>,
    pub(crate) requests: &'a [HardRequest],
}

impl Reader {
    /// A step of so many work units.
    pub(crate) fn step(
        &mut self,
        scene: &Scene,
        snapshot: Checked<'_, WorldSnapshot>,
        mail: Mail<'_>,
        units: u64,
    ) {
        let counts = scene.counts();
        match self {
            Self::Robot(robot) => {
                let table = Checked::new(mail.table, counts).expect("it was checked");
                let schedule = mail.schedule.and_then(|s| Checked::new(s, counts).ok());
                let input = RobotInput {
                    snapshot,
                    table,
                    schedule: schedule.filter(|s| s.version > 0),
                    answer: mail.answer,
                };
                let mut command = Command::default();
                robot.step(scene, input, units, &mut command);
                assert_eq!(command.validate(counts), Ok(()), "a robot's command");
            }
            Self::Planner(planner) => {
                let input = PlannerInput {
                    snapshot,
                    requests: mail.requests,
                };
                let output = planner.step(scene, input, units);
                assert_eq!(output.report.validate(counts), Ok(()), "a planner's report");
            }
        }
    }
}
