//! What a hostile or broken process may send, and what must come of it: nothing worse than a
//! refusal.
//!
//! Responsible for: one target for each kind of input, which changes a good value as a tape of
//! bytes says, has it checked, and drives the machines with what was accepted. The ordinary tests
//! (`sim/tests/hostile.rs`) and the loop that counts (`sim/examples/hostile.rs`) feed these.
//! Not responsible for: where tapes come from.
//!
//! A tape is read four bytes at a time: how many changes, then for each a place and what to put
//! there. So most inputs are good but for a few words, and get past the header.

use planner::{Planner, PlannerInput};
use robot::{Robot, RobotInput};
use scene::{Change, Method, Scene, Settings};
use shm_types::{
    Checked, Command, ConstraintTable, ControlRequest, Invalid, MotionBatch, Outcome,
    PlannerReport, Schedule, Validate, Versioned, WorldSnapshot, zeroed,
};
use sim::Simulation;
use trace::{Ending, SceneRecord, Writer};
use world::{CheckpointError, World, WorldInput};
use zerocopy::{FromBytes, Immutable, IntoBytes};

/// How far an input got.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Got {
    /// It was refused for what it says of itself: no message of this program, no such file.
    Refused,
    /// It was refused for a value further inside.
    Inside,
    /// It was accepted, and used.
    Accepted,
}

/// A kind of input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    Scenario,
    Trace,
    Snapshot,
    Command,
    Table,
    Schedule,
    Control,
    Journal,
}

impl Target {
    pub(crate) const ALL: [Self; 8] = [
        Self::Scenario,
        Self::Trace,
        Self::Snapshot,
        Self::Command,
        Self::Table,
        Self::Schedule,
        Self::Control,
        Self::Journal,
    ];
}

/// Words that break things.
const WORDS: [u32; 12] = [
    0,
    1,
    2,
    3,
    31,
    32,
    33,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_fffe,
    0xffff_ffff,
    0x7ff8_0000,
];
/// After so many inputs the machines are new ones.
const FRESH: u32 = 512;
/// Work units a machine may spend on one input.
const UNITS: u64 = 2_000;

/// What to do to a good value.
struct Tape<'a>(&'a [u8]);

impl Tape<'_> {
    fn word(&mut self) -> u32 {
        let (word, rest) = self.0.split_at(self.0.len().min(4));
        self.0 = rest;
        let mut bytes = [0; 4];
        bytes[..word.len()].copy_from_slice(word);
        u32::from_le_bytes(bytes)
    }

    fn below(&mut self, end: usize) -> usize {
        self.word() as usize % end.max(1)
    }

    /// Changes a few words of `bytes`.
    fn change(&mut self, bytes: &mut [u8]) {
        for _ in 0..self.below(4) {
            let at = self.below(bytes.len() / 4) * 4;
            let Some(place) = bytes.get_mut(at..at + 4) else {
                return;
            };
            let old = u32::from_le_bytes([place[0], place[1], place[2], place[3]]);
            let new = match self.below(4) {
                0 => WORDS[self.below(WORDS.len())],
                1 => old ^ 1 << self.below(32),
                2 => old.wrapping_add(self.below(5) as u32).wrapping_sub(2),
                _ => self.word(),
            };
            place.copy_from_slice(&new.to_le_bytes());
        }
    }

    /// Changes a few words of a message's first `live` bytes.
    fn change_message<T: IntoBytes + FromBytes + Immutable>(
        &mut self,
        message: &mut T,
        live: usize,
    ) {
        let bytes = message.as_mut_bytes();
        let live = live.min(bytes.len());
        self.change(&mut bytes[..live]);
    }
}

/// How far a message got that was refused or not.
fn got(result: Result<(), Invalid>) -> Got {
    match result {
        Ok(()) => Got::Accepted,
        Err(Invalid::Foreign) => Got::Refused,
        Err(_) => Got::Inside,
    }
}

/// Good values of one method, and machines in the middle of a run.
struct Bench {
    scene: Scene,
    settings: Settings,
    snapshot: Box<WorldSnapshot>,
    commands: Vec<Command>,
    report: PlannerReport,
    table: Box<ConstraintTable>,
    schedule: Box<Schedule>,
    journal: Vec<u8>,
    trace: Vec<u8>,
    world: World,
    robots: Vec<Robot>,
    planner: Planner,
    motion: Box<MotionBatch>,
    used: u32,
}

fn settings(method: Method) -> Settings {
    Settings {
        method,
        units_per_second: 500_000,
        ..Settings::default()
    }
}

/// Copies a box whose message is too large for the stack.
fn copy<T: Versioned>(message: &T) -> Box<T> {
    let mut copied: Box<T> = zeroed();
    copied.copy_from(message);
    copied
}

impl Bench {
    /// A run of `scene` at tick `ticks`.
    fn new(scene: &Scene, method: Method, ticks: u64) -> Self {
        let settings = settings(method);
        let mut run = Simulation::new(scene, &settings, 0);
        let record = SceneRecord::new(scene, &settings, 0);
        let mut writer = Writer::new(Vec::new(), &record, 100_000_000).expect("memory");
        while run.outcome() == Outcome::Running && run.snapshot().header.tick < ticks {
            run.tick();
            writer.batch(run.motion()).expect("a legal batch");
            let snapshot = Checked::new(run.snapshot(), scene.counts()).expect("legal");
            writer.snapshot(snapshot).expect("memory");
        }
        let trace = writer.finish(Ending {
            outcome: run.outcome().into(),
            reason: None,
            makespan_ns: run.snapshot().header.time_ns,
            options: serde_json::Value::Null,
        });
        let mut journal = Vec::new();
        run.world().save(&mut journal);
        let mut snapshot: Box<WorldSnapshot> = zeroed();
        run.world().snapshot_into(&mut snapshot);
        let (commands, report, table, schedule) = run.messages();
        let mut bench = Self {
            world: World::restore(scene, settings.clone(), &journal).expect("just saved"),
            robots: Vec::new(),
            planner: Planner::new(scene, settings.clone()),
            commands: commands.to_vec(),
            report: *report,
            table: table.map_or_else(zeroed, copy),
            schedule: schedule.map_or_else(zeroed, copy),
            motion: zeroed(),
            trace: trace.expect("memory"),
            scene: scene.clone(),
            settings,
            snapshot,
            journal,
            used: 0,
        };
        bench.renew();
        bench
    }

    fn renew(&mut self) {
        let (scene, settings) = (&self.scene, &self.settings);
        self.used = 0;
        self.planner = Planner::new(scene, settings.clone());
        self.robots = (0..scene.homes.len())
            .map(|id| Robot::new(scene, settings.clone(), id, 1))
            .collect();
        self.world = World::restore(scene, settings.clone(), &self.journal).expect("just saved");
    }

    fn use_up(&mut self) {
        self.used += 1;
        if self.used >= FRESH || self.world.outcome() != Outcome::Running {
            self.renew();
        }
    }

    /// Bytes of a snapshot that are live: the header, and some robots and objects. Of the rest the
    /// last is too far off to be hit.
    fn snapshot(&mut self, tape: &mut Tape<'_>) -> Got {
        let mut snapshot: Box<WorldSnapshot> = zeroed();
        self.world.snapshot_into(&mut snapshot);
        let header = size_of_val(&snapshot.header);
        let robots = size_of_val(&snapshot.robots[0]) * self.scene.homes.len();
        let objects = self.scene.objects.len();
        match tape.below(3) {
            0 => tape.change(&mut snapshot.as_mut_bytes()[16..header]),
            1 => tape.change(&mut snapshot.as_mut_bytes()[header..header + robots]),
            _ => tape.change(snapshot.objects[..objects].as_mut_bytes()),
        }
        if tape.below(16) == 0 {
            tape.change_message(&mut *snapshot, 16);
        }
        let counts = self.scene.counts();
        let checked = match Checked::new(&*snapshot, counts) {
            Ok(checked) => checked,
            Err(invalid) => return got(Err(invalid)),
        };
        self.act_on(checked);
        Got::Accepted
    }

    /// Lets robots and planner act on a snapshot.
    fn act_on(&mut self, snapshot: Checked<'_, WorldSnapshot>) {
        let counts = self.scene.counts();
        let table = Checked::new(&*self.table, counts).ok();
        let schedule = Checked::new(&*self.schedule, counts).ok();
        let mut command = Command::default();
        for robot in &mut self.robots {
            let Some(table) = table else { return };
            let input = RobotInput {
                snapshot,
                table,
                schedule: schedule.filter(|s| s.version > 0),
                answer: None,
            };
            robot.step(&self.scene, input, UNITS, &mut command);
            assert_eq!(command.validate(counts), Ok(()), "a robot's command");
        }
        let input = PlannerInput {
            snapshot,
            requests: &[],
        };
        let output = self.planner.step(&self.scene, input, UNITS);
        assert_eq!(output.report.validate(counts), Ok(()), "a planner's report");
    }

    fn command(&mut self, tape: &mut Tape<'_>) -> Got {
        let id = tape.below(self.commands.len());
        let mut command = self.commands[id];
        let header = &self.snapshot.header;
        let tick = self.world.tick();
        (command.robot, command.incarnation) = (id as u32, 1);
        command.sequence += u64::from(self.used) + 1;
        (command.tick, command.valid_until_tick) = (tick, tick + 20);
        command.claim.epoch = command.claim.epoch.max(header.epoch);
        command.path.id += self.used + 1;
        tape.change_message(&mut command, size_of::<Command>());
        match command.validate(self.scene.counts()) {
            Ok(()) => {
                self.step_world(Some((id, &command)), None, None, &[]);
                Got::Accepted
            }
            Err(invalid) => got(Err(invalid)),
        }
    }

    fn table(&mut self, tape: &mut Tape<'_>) -> Got {
        let mut table = copy(&*self.table);
        table.version += self.used + 1;
        let live = 24 + 12 * (table.count as usize + 4);
        tape.change_message(&mut *table, live);
        match table.validate(self.scene.counts()) {
            Ok(()) => {
                self.step_world(None, Some(&table), None, &[]);
                Got::Accepted
            }
            Err(invalid) => got(Err(invalid)),
        }
    }

    fn schedule(&mut self, tape: &mut Tape<'_>) -> Got {
        let mut schedule = copy(&*self.schedule);
        schedule.version += self.used + 1;
        schedule.robot_count = schedule.robot_count.max(self.scene.counts().robots);
        match tape.below(4) {
            0 => tape.change_message(&mut *schedule, 24 + 20 * self.scene.homes.len()),
            1 | 2 => {
                let count = (schedule.action_count as usize).max(1);
                tape.change(schedule.actions[..count].as_mut_bytes());
            }
            _ => {
                let count = (schedule.wait_count as usize).max(1);
                tape.change(schedule.waits[..count].as_mut_bytes());
            }
        }
        let counts = self.scene.counts();
        if let Err(invalid) = schedule.validate(counts) {
            return got(Err(invalid));
        }
        self.step_world(None, None, Some(&schedule), &[]);
        let mut snapshot: Box<WorldSnapshot> = zeroed();
        self.world.snapshot_into(&mut snapshot);
        let before = std::mem::replace(&mut self.schedule, schedule);
        if let Ok(snapshot) = Checked::new(&*snapshot, counts) {
            self.act_on(snapshot);
        }
        self.schedule = before;
        Got::Accepted
    }

    fn control(&mut self, tape: &mut Tape<'_>) -> Got {
        let mut request = ControlRequest {
            id: 1,
            role: 2,
            kind: tape.below(6) as u32,
            index: tape.below(self.scene.homes.len()) as u32,
            incarnation: tape.below(3) as u32,
            ..ControlRequest::default()
        };
        request.change_count = u32::from(request.kind == 5) * (tape.below(3) as u32 + 1);
        for change in &mut request.changes[..request.change_count as usize] {
            (change.kind, change.object) = (tape.below(6) as u32, tape.below(8) as u32);
            change.at.x = tape.below(500) as f64 * 0.01;
            change.at.y = tape.below(500) as f64 * 0.01;
            (change.to.x, change.to.y) = (change.at.x + 0.3, change.at.y + 0.2);
        }
        let live = 40 + 48 * request.change_count as usize;
        tape.change_message(&mut request, live);
        let reply = self.world.reply_to(&request);
        assert!(reply.accepted <= 1, "a reply");
        match request.validate(self.scene.counts()) {
            Ok(()) => {
                let changes = changes(&request);
                let _ = self.world.prepare(&self.scene, &changes);
                self.step_world(None, None, None, &[request]);
                Got::Accepted
            }
            Err(invalid) => got(Err(invalid)),
        }
    }

    /// A tick of the world with one message that is not as the others.
    fn step_world(
        &mut self,
        command: Option<(usize, &Command)>,
        table: Option<&ConstraintTable>,
        schedule: Option<&Schedule>,
        control: &[ControlRequest],
    ) {
        let counts = self.scene.counts();
        let mut commands = [None; shm_types::capacity::MAX_ROBOTS];
        for (place, command) in commands.iter_mut().zip(&self.commands) {
            *place = Checked::new(command, counts).ok();
        }
        if let Some((id, command)) = command {
            commands[id] = Checked::new(command, counts).ok();
        }
        let input = WorldInput {
            commands: &commands[..self.commands.len()],
            planner: Checked::new(&self.report, counts).ok(),
            table: table.and_then(|table| Checked::new(table, counts).ok()),
            schedule: schedule.map(|s| (s.version, Checked::new(s, counts).ok())),
            control,
            change: None,
        };
        self.world.step(&self.scene, input, &mut self.motion);
        assert_eq!(self.world.violation(), None, "the world is safe");
    }

    fn journal(&mut self, tape: &mut Tape<'_>) -> Got {
        let mut journal = self.journal.clone();
        if tape.below(8) == 0 {
            journal.truncate(tape.below(journal.len()));
        }
        // Past the first length, and what it says of itself.
        let from = journal.len().min(32);
        tape.change(&mut journal[from..]);
        // Most are given a checksum that is right: the values are to be judged.
        let restored = if tape.below(8) == 0 {
            World::restore(&self.scene, self.settings.clone(), &journal)
        } else {
            let guard = world::Guard::Checksum;
            World::restore_without(&self.scene, self.settings.clone(), &journal, guard)
        };
        match restored {
            Ok(world) => {
                // Nobody says that such a state is a safe one: only that to go on from it is.
                let before = std::mem::replace(&mut self.world, world);
                let input = WorldInput {
                    commands: &[],
                    planner: None,
                    table: None,
                    schedule: None,
                    control: &[],
                    change: None,
                };
                for _ in 0..3 {
                    self.world.step(&self.scene, input, &mut self.motion);
                }
                self.world = before;
                Got::Accepted
            }
            Err(CheckpointError::Damaged | CheckpointError::Foreign(_)) => Got::Refused,
            Err(_) => Got::Inside,
        }
    }

    fn trace(&mut self, tape: &mut Tape<'_>) -> Got {
        let mut trace = self.trace.clone();
        if tape.below(4) == 0 {
            trace.truncate(tape.below(trace.len()));
        }
        if tape.below(2) == 0 {
            // Digits and letters inside records: the file is whole, what it says is not.
            for _ in 0..=tape.below(3) {
                let at = tape.below(trace.len());
                if let Some(byte) = trace
                    .get_mut(at)
                    .filter(|byte| byte.is_ascii_alphanumeric())
                {
                    *byte = b"0123456789-eE.nN"[tape.below(16)];
                }
            }
        } else {
            tape.change(&mut trace);
        }
        match trace::check(&trace[..]) {
            Ok(_) => Got::Accepted,
            Err(
                trace::ReadError::Foreign
                | trace::ReadError::OtherProgram
                | trace::ReadError::TooShort,
            ) => Got::Refused,
            Err(_) => Got::Inside,
        }
    }
}

/// The changes of the scene that a request asks for.
fn changes(request: &ControlRequest) -> Vec<Change> {
    let place = |p: shm_types::Point| [p.x, p.y];
    let changes = request.changes().iter().map(|change| {
        let (object, goal) = (change.object as usize, change.has_goal == 1);
        match change.kind {
            0 => Change::Goal {
                object,
                to: goal.then(|| place(change.to)),
            },
            1 => Change::Move {
                object,
                to: place(change.at),
            },
            2 => Change::AddObject {
                at: place(change.at),
                goal: goal.then(|| place(change.to)),
                like: object,
            },
            3 => Change::Close {
                corners: [change.at.x, change.at.y, change.to.x, change.to.y],
            },
            4 => Change::Open {
                at: place(change.at),
            },
            _ => Change::AddRobot {
                at: place(change.at),
            },
        }
    });
    changes.collect()
}

/// Pieces of scenario files, good and bad.
const PIECES: [&str; 16] = [
    "[[robots]]\nhome = [0.5, 0.5]\n",
    "[[objects]]\nstart = [1.0, 1.0]\n",
    "speed = -1.0\n",
    "nan",
    "inf",
    "-0.0",
    "1e308",
    "1e-300",
    "clearance = 0.1\n",
    "pass_under = true\n",
    "[]",
    "{ circle = 0.2 }",
    "{ polygon = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]] }",
    "0.05",
    "4",
    "\"",
];

fn scenario(texts: &[String], tape: &mut Tape<'_>) -> Got {
    let mut text = texts[tape.below(texts.len())].clone().into_bytes();
    for _ in 0..tape.below(4) {
        let at = tape.below(text.len());
        let is_end = |byte: &u8| *byte == b'\n';
        let line = text[..at].iter().rposition(is_end).map_or(0, |end| end + 1);
        match tape.below(16) {
            // A digit for a digit: what is said is said well.
            0..=7 => {
                if let Some(digit) = text[line..].iter().position(u8::is_ascii_digit) {
                    text[line + digit] = b'0' + tape.below(10) as u8;
                }
            }
            8..=10 => {
                let piece = PIECES[tape.below(PIECES.len())].bytes();
                text.splice(line..line, piece);
            }
            11..=13 => {
                let end = text[line..].iter().position(is_end);
                text.drain(line..end.map_or(text.len(), |end| line + end + 1));
            }
            14 => text[at] = b"0123456789.-"[tape.below(12)],
            _ => text[at] = tape.word() as u8,
        }
        if text.is_empty() {
            break;
        }
    }
    let Ok(text) = String::from_utf8(text) else {
        return Got::Refused;
    };
    match scene::parse(&text, "hostile.toml") {
        Ok(scene) => {
            let canonical = scene::to_canonical_toml(&scene);
            assert!(scene::parse(&canonical, "canonical.toml").is_ok(), "{text}");
            Got::Accepted
        }
        Err(problems) if text.parse::<toml::Table>().is_err() => {
            assert!(!problems.to_string().is_empty());
            Got::Refused
        }
        Err(_) => Got::Inside,
    }
}

/// All targets, with what they need.
pub(crate) struct Targets {
    texts: Vec<String>,
    benches: Vec<Bench>,
}

impl Targets {
    /// Small rooms in the middle of runs.
    pub(crate) fn new() -> Self {
        let options = |seed| scene::GenerateOptions {
            seed,
            objects: 3,
            robots: 2,
            area_m2: 9.0,
            walls: 1,
            ..scene::GenerateOptions::default()
        };
        let rooms: Vec<_> = (0..3)
            .filter_map(|seed| scene::generate(&options(seed)).ok())
            .collect();
        let mut texts: Vec<String> = rooms.iter().map(|room| room.text.clone()).collect();
        texts.extend(scene::BUILTIN.iter().map(|file| file.text.to_owned()));
        texts.sort_by_key(String::len);
        texts.truncate(8);
        let methods = [Method::Anytime, Method::Restricted, Method::All];
        let benches = rooms.iter().zip(methods).zip([200, 700, 900]);
        Self {
            benches: benches
                .map(|((room, method), ticks)| Bench::new(&room.scene, method, ticks))
                .collect(),
            texts,
        }
    }

    /// Runs `target` on one tape.
    pub(crate) fn run(&mut self, target: Target, tape: &[u8]) -> Got {
        let mut tape = Tape(tape);
        if target == Target::Scenario {
            return scenario(&self.texts, &mut tape);
        }
        let count = self.benches.len();
        let bench = match target {
            Target::Schedule => &mut self.benches[0],
            _ => &mut self.benches[tape.below(count)],
        };
        bench.use_up();
        match target {
            Target::Scenario | Target::Trace => bench.trace(&mut tape),
            Target::Snapshot => bench.snapshot(&mut tape),
            Target::Command => bench.command(&mut tape),
            Target::Table => bench.table(&mut tape),
            Target::Schedule => bench.schedule(&mut tape),
            Target::Control => bench.control(&mut tape),
            Target::Journal => bench.journal(&mut tape),
        }
    }
}
