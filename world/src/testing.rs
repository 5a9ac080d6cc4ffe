//! A bench for the world: small scenes from text, driven by hand-written commands.
//!
//! Responsible for: what all tests of this crate share. Not responsible for: any expectation.

use scene::{Method, Scene, Settings, Vec2};
use shm_types::{
    Activity, Checked, Claim, Command, ConstraintTable, ControlKind, ControlRequest, EventKind,
    EventRecord, Failure, FailureCause, Grip, MotionBatch, NONE, ObjectState, PathRequest, Phase,
    PlannerReport, Point, RobotState, RoleKind, Schedule, WorldSnapshot,
};

use crate::{Next, World, WorldInput};

/// Robots 0.5 m square at 0.5 m/s: 5 mm a tick of 10 ms.
pub(crate) const TICK_M: f64 = 0.005;

/// An empty room, 10 m by 6 m, with robots and objects 0.4 m square: `grasp` holds for all
/// objects, `more` is added to the table `[robot]`. Where no object is given there is one out of
/// the way, so that the run is not solved before it begins.
pub(crate) fn room(
    homes: &[[f64; 2]],
    objects: &[[[f64; 2]; 2]],
    grasp: [f64; 2],
    more: &str,
) -> Scene {
    scene::parse(&room_text(homes, objects, grasp, more), "bench.toml").unwrap()
}

/// The scenario file of such a room.
pub(crate) fn room_text(
    homes: &[[f64; 2]],
    objects: &[[[f64; 2]; 2]],
    grasp: [f64; 2],
    more: &str,
) -> String {
    let mut text = format!(
        "name = \"bench\"\n[robot]\nshape = {{ box = [0.5, 0.5] }}\nspeed = 0.5\n{more}\n\
         [object]\nshape = {{ box = [0.4, 0.4] }}\ngrasp = {grasp:?}\n\
         [workspace]\nbounds = [0.0, 0.0, 10.0, 6.0]\n"
    );
    for home in homes {
        text += &format!("[[robots]]\nhome = {home:?}\n");
    }
    let out_of_the_way = [[[0.5, 5.5], [9.5, 5.5]]];
    let objects = if objects.is_empty() {
        &out_of_the_way
    } else {
        objects
    };
    for [start, goal] in objects {
        text += &format!("[[objects]]\nstart = {start:?}\ngoal = {goal:?}\n");
    }
    text
}

/// The default grasp of these objects: the robot below, touching.
pub(crate) const BELOW: [f64; 2] = [0.0, -0.45];

/// A world with everything it is fed.
pub(crate) struct Bench {
    pub(crate) scene: Scene,
    pub(crate) world: World,
    pub(crate) commands: Vec<Command>,
    pub(crate) planner: PlannerReport,
    pub(crate) table: Option<Box<ConstraintTable>>,
    pub(crate) schedule: Option<Box<Schedule>>,
    pub(crate) control: Vec<ControlRequest>,
    /// The version of the scene that the next step brings into force.
    pub(crate) change: Option<Next>,
    pub(crate) batch: Box<MotionBatch>,
    pub(crate) snapshot: Box<WorldSnapshot>,
    /// Robots whose commands are not sent.
    pub(crate) silent: Vec<bool>,
    /// After so many ticks each, the world is put away and another one goes on from its
    /// checkpoint.
    pub(crate) restored_every: Option<u64>,
    settings: Settings,
}

/// The paper's method, all else by default.
pub(crate) fn papers() -> Settings {
    Settings {
        method: Method::GraspingAndRestricted,
        ..Settings::default()
    }
}

impl Bench {
    pub(crate) fn new(scene: Scene) -> Self {
        Self::with(scene, papers())
    }

    pub(crate) fn with(scene: Scene, settings: Settings) -> Self {
        let world = World::new(&scene, settings.clone(), 7);
        let mut snapshot: Box<WorldSnapshot> = shm_types::zeroed();
        world.snapshot_into(&mut snapshot);
        let commands: Vec<Command> = (0..scene.counts().robots).map(command).collect();
        Self {
            silent: vec![false; commands.len()],
            restored_every: None,
            settings,
            scene,
            world,
            commands,
            planner: PlannerReport::default(),
            table: None,
            schedule: None,
            control: Vec::new(),
            change: None,
            batch: shm_types::zeroed(),
            snapshot,
        }
    }

    /// Sends every command anew and lets one tick pass.
    pub(crate) fn step(&mut self) {
        let tick = self.snapshot.header.tick;
        self.planner.tick = tick;
        for (command, silent) in self.commands.iter_mut().zip(&self.silent) {
            if !silent {
                command.sequence += 1;
                command.tick = tick;
                command.valid_until_tick = tick + 10;
            }
        }
        self.step_as_is();
    }

    /// Lets one tick pass with the commands as they are, and finds every invariant kept.
    pub(crate) fn step_as_is(&mut self) {
        self.step_unsound();
        assert_eq!(self.world.violation(), None);
    }

    /// Lets one tick pass with the commands as they are, whatever comes of it.
    pub(crate) fn step_unsound(&mut self) {
        let counts = self.scene.counts();
        let mut commands = [None; 128];
        for (checked, command) in commands.iter_mut().zip(&self.commands) {
            *checked = Some(Checked::new(command, counts).unwrap());
        }
        let table = self.table.as_deref();
        let input = WorldInput {
            commands: &commands[..self.commands.len()],
            planner: Some(Checked::new(&self.planner, counts).unwrap()),
            table: table.map(|table| Checked::new(table, counts).unwrap()),
            schedule: self
                .schedule
                .as_deref()
                .map(|schedule| (schedule.version, Checked::new(schedule, counts).ok())),
            control: &self.control,
            change: self.change.as_ref(),
        };
        self.world.step(&self.scene, input, &mut self.batch);
        self.control.clear();
        if let Some(next) = self.change.take() {
            self.scene = next.scene;
            let added = self.commands.len() as u32..self.scene.counts().robots;
            self.commands.extend(added.map(command));
            self.silent.resize(self.commands.len(), false);
        }
        self.world.snapshot_into(&mut self.snapshot);
        let tick = self.snapshot.header.tick;
        if (self.restored_every).is_some_and(|every| tick.is_multiple_of(every)) {
            let mut bytes = Vec::new();
            self.world.save(&mut bytes);
            let restored = World::restore(&self.scene, self.settings.clone(), &bytes);
            self.world = restored.unwrap();
        }
    }

    pub(crate) fn steps(&mut self, ticks: usize) {
        for _ in 0..ticks {
            self.step();
        }
    }

    pub(crate) fn robot(&self, i: usize) -> &RobotState {
        &self.snapshot.robots[i]
    }

    pub(crate) fn object(&self, i: usize) -> &ObjectState {
        &self.snapshot.objects[i]
    }

    pub(crate) fn at(&self, i: usize) -> [f64; 2] {
        [self.robot(i).position.x, self.robot(i).position.y]
    }

    /// Asks for a path from where robot `i`'s grant ends along `corners`, and to go.
    pub(crate) fn ask(&mut self, i: usize, corners: &[[f64; 2]]) {
        let robot = self.robot(i);
        let start = robot.grant().last().copied().unwrap_or(robot.position);
        let mut path = PathRequest {
            id: self.commands[i].path.id + 1,
            count: corners.len() as u32 + 1,
            ..PathRequest::default()
        };
        path.points[0] = start;
        for (point, corner) in path.points[1..].iter_mut().zip(corners) {
            *point = Point::new(corner[0], corner[1]);
        }
        self.commands[i].path = path;
        self.commands[i].go = 1;
    }

    /// Claims `task` for robot `i`, selected in the epoch it sees.
    pub(crate) fn claim(&mut self, i: usize, task: u32) {
        self.commands[i].claim = Claim {
            task,
            constraints_version: self.snapshot.header.epoch_constraints_version,
            epoch: self.snapshot.header.epoch,
        };
    }

    pub(crate) fn grip(&mut self, i: usize, grip: Grip) {
        self.commands[i].grip = grip.code();
    }

    /// Reports a failure of `task`, answered.
    pub(crate) fn fail(&mut self, i: usize, task: u32, cause: FailureCause, blocker: u32) {
        self.commands[i].failure = Failure {
            id: self.commands[i].failure.id + 1,
            task,
            cause: cause.code(),
            blocker,
            answered: 1,
            reserved: 0,
            epoch: self.snapshot.header.epoch,
        };
    }

    /// Says that robot `i` has looked and found nothing to do.
    pub(crate) fn settle(&mut self, i: usize) {
        self.commands[i].settled_at_change = self.snapshot.header.change;
    }

    pub(crate) fn tell(&mut self, kind: ControlKind, robot: u32, incarnation: u32) {
        self.control.push(ControlRequest {
            id: 1,
            kind: kind.code(),
            role: RoleKind::Robot.code(),
            index: robot,
            incarnation,
            ..ControlRequest::default()
        });
    }

    /// The events of `kind` in the last tick.
    pub(crate) fn events(&self, kind: EventKind) -> Vec<EventRecord> {
        let events = self.batch.events().iter();
        events.filter(|e| e.kind == kind.code()).copied().collect()
    }

    pub(crate) fn header(&self) -> &shm_types::SnapshotHeader {
        &self.snapshot.header
    }

    /// Drives robot `i` along `corners` until it stands at the last; panics if it never does.
    pub(crate) fn drive(&mut self, i: usize, corners: &[[f64; 2]]) {
        self.ask(i, corners);
        let goal = corners[corners.len() - 1];
        for _ in 0..4_000 {
            if self.at(i) == goal {
                return;
            }
            self.step();
        }
        panic!("robot {i} is at {:?}, not at {goal:?}", self.at(i));
    }

    /// Grasps with robot `i`, which stands at its claim's grasp configuration, at once.
    pub(crate) fn grasp(&mut self, i: usize) {
        self.grip(i, Grip::Grasp);
        self.step();
        self.grip(i, Grip::Keep);
        assert_ne!(self.robot(i).holding, NONE, "robot {i} holds nothing");
    }

    /// Puts down what robot `i` holds, at once.
    pub(crate) fn release(&mut self, i: usize) {
        self.grip(i, Grip::Release);
        self.step();
        self.grip(i, Grip::Keep);
        assert_eq!(self.robot(i).holding, NONE, "robot {i} still holds");
    }

    /// Whether any two bodies overlap: every pair, by brute force.
    pub(crate) fn overlapping(&self) -> Option<String> {
        let mut shapes: Vec<(String, &scene::Shape, Vec2)> = Vec::new();
        for i in 0..self.commands.len() {
            let at = scene::vec(self.robot(i).position);
            shapes.push((format!("robot {i}"), &self.scene.robot.shape, at));
        }
        for (o, spec) in self.scene.objects.iter().enumerate() {
            let at = scene::vec(self.object(o).position);
            shapes.push((format!("object {o}"), &spec.shape, at));
        }
        let robots = self.commands.len();
        for (a, (name, shape, at)) in shapes.iter().enumerate() {
            for (b, (other, other_shape, other_at)) in shapes.iter().enumerate().skip(a + 1) {
                let waived = a < robots
                    && b >= robots
                    && (self.scene.lifts_from_below(b - robots)
                        || self.scene.objects[b - robots].pass_under);
                if !waived && scene::overlap(shape, *at, other_shape, *other_at) {
                    return Some(format!("{name} and {other}"));
                }
            }
            for (wall, wall_at) in &self.scene.walls {
                if scene::overlap(shape, *at, wall, *wall_at) {
                    return Some(format!("{name} and a wall"));
                }
            }
        }
        None
    }

    /// Two robots whose bodies along their remaining grants overlap: every pair, by brute force.
    pub(crate) fn overlapping_grants(&self) -> Option<(usize, usize)> {
        let robots = self.commands.len();
        (0..robots)
            .flat_map(|a| (a + 1..robots).map(move |b| (a, b)))
            .find(|&(a, b)| {
                self.pieces(a).iter().any(|p| {
                    self.pieces(b)
                        .iter()
                        .any(|q| scene::swept_regions_overlap(&p.0, p.1, p.2, &q.0, q.1, q.2))
                })
            })
    }

    /// Each part of robot `i`'s body along each piece of its grant.
    fn pieces(&self, i: usize) -> Vec<(scene::Shape, Vec2, Vec2)> {
        let robot = self.robot(i);
        let held = shm_types::index(robot.holding);
        let body = self.scene.body(self.scene.class_holding(held));
        let mut corners = vec![scene::vec(robot.position)];
        corners.extend(robot.grant().iter().copied().map(scene::vec));
        corners.push(corners[corners.len() - 1]);
        let pairs = corners.windows(2);
        pairs
            .flat_map(|pair| {
                body.parts.iter().map(move |part| {
                    let (from, to) = (pair[0] + part.offset, pair[1] + part.offset);
                    (part.bare.clone(), from, to)
                })
            })
            .collect()
    }
}

/// A command that wants nothing.
fn command(robot: u32) -> Command {
    Command {
        robot,
        incarnation: 1,
        phase: Phase::Idle.code(),
        activity: Activity::Idle.code(),
        grip: Grip::Keep.code(),
        claim: Claim::NONE,
        ..Command::default()
    }
}
