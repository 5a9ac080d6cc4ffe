//! Small runs written by hand, for tests: one clean run, to be spoilt in one way each.

use nalgebra::Vector2;

use crate::check::checker::Checker;
use crate::check::report::{CheckReport, Kind, Violation};
use crate::reader::{Close, Span};
use crate::record::{
    Activity, BodyKind, End, Event, FORMAT, Happening, Mark, Motion, Object, ObjectNow, Outcome,
    Outline, Phase, Place, RobotKind, RobotNow, SceneRecord, State, TaskStatus, Wall,
};

/// Time of one tick, ns.
pub(super) const TICK_NS: u64 = 10_000_000;

/// A square of this half width.
pub(super) fn square(half: f64) -> Outline {
    Outline::Box {
        half: Place::new(half, half),
    }
}

/// A room of 10 m by 10 m with a wall in its upper part, two robots of 0.5 m at 0.5 m/s and
/// three objects of 0.4 m.
pub(super) fn scene() -> SceneRecord {
    let object = |x, y, goal: Option<(f64, f64)>| Object {
        shape: square(0.2),
        grasp: Place::new(0.0, -0.45),
        pass_under: false,
        start: Place::new(x, y),
        goal: goal.map(|(x, y)| Place::new(x, y)),
    };
    SceneRecord {
        format: FORMAT,
        program_version: "0".to_owned(),
        name: "by hand".to_owned(),
        scenario_hash: "0".to_owned(),
        run_id: "0".to_owned(),
        low: Place::new(0.0, 0.0),
        high: Place::new(10.0, 10.0),
        walls: vec![Wall {
            shape: square(1.0),
            at: Place::new(5.0, 8.0),
        }],
        robot: RobotKind {
            shape: square(0.25),
            speed_m_per_s: 0.5,
            clearance_m: 0.0,
            grasp_ns: 0,
            release_ns: 0,
        },
        homes: vec![Place::new(1.0, 1.0), Place::new(3.0, 1.0)],
        objects: vec![
            object(2.0, 2.0, Some((6.0, 2.0))),
            object(8.0, 8.0, Some((8.0, 8.0))),
            object(9.0, 5.0, None),
        ],
        before: Vec::new(),
        settings: serde_json::Value::Null,
    }
}

/// A run in the making.
pub(super) struct Story {
    pub(super) scene: SceneRecord,
    pub(super) now_ns: u64,
    pub(super) robots: Vec<Vector2<f64>>,
    pub(super) objects: Vec<Vector2<f64>>,
    pub(super) motions: Vec<Motion>,
    pub(super) events: Vec<Event>,
    pub(super) states: Vec<State>,
    pub(super) outcome: Outcome,
}

impl Story {
    pub(super) fn new(scene: SceneRecord) -> Self {
        Self {
            now_ns: 0,
            robots: scene.homes.iter().map(|home| (*home).into()).collect(),
            objects: scene
                .objects
                .iter()
                .map(|object| object.start.into())
                .collect(),
            motions: Vec::new(),
            events: Vec::new(),
            states: Vec::new(),
            outcome: Outcome::Stuck,
            scene,
        }
        .event(Happening::Started)
        .event(Happening::Epoch { epoch: 1 })
    }

    pub(super) fn event(mut self, what: Happening) -> Self {
        let tick = self.now_ns / TICK_NS + 1;
        self.events.push(Event {
            tick,
            time_ns: self.now_ns,
            what,
        });
        self
    }

    pub(super) fn claim(self, robot: usize, task: usize) -> Self {
        self.event(Happening::Claimed {
            robot,
            task,
            epoch: 1,
        })
    }

    pub(super) fn grasp(self, robot: usize, task: usize) -> Self {
        self.event(Happening::GraspStarted { robot, task })
            .event(Happening::Grasped { robot, task })
    }

    pub(super) fn release(self, robot: usize, task: usize) -> Self {
        self.event(Happening::ReleaseStarted { robot })
            .event(Happening::Released { robot, task })
    }

    pub(super) fn wait_s(mut self, duration_s: f64) -> Self {
        self.now_ns += (duration_s * 1e9).round() as u64;
        self
    }

    /// A robot moves in a straight line at full speed, with what it holds, if anything.
    pub(super) fn go(self, robot: usize, with: Option<usize>, x: f64, y: f64) -> Self {
        let way = Vector2::new(x, y) - self.robots[robot];
        let duration_s = way.norm() / self.scene.robot.speed_m_per_s;
        let story = self.moves(BodyKind::Robot, robot, way, duration_s);
        let story = match with {
            Some(object) => story.moves(BodyKind::Object, object, way, duration_s),
            None => story,
        };
        story.wait_s(duration_s)
    }

    /// A body moves from where it is, starting now; time stands still.
    pub(super) fn moves(
        mut self,
        body: BodyKind,
        id: usize,
        way: Vector2<f64>,
        duration_s: f64,
    ) -> Self {
        let at = match body {
            BodyKind::Robot => &mut self.robots[id],
            BodyKind::Object => &mut self.objects[id],
        };
        self.motions.push(Motion {
            body,
            id,
            start_ns: self.now_ns,
            end_ns: self.now_ns + (duration_s * 1e9).round() as u64,
            from: (*at).into(),
            to: (*at + way).into(),
        });
        *at += way;
        self
    }

    /// A state of now that shows what the story says, for a world in which `claim` and `hold` are
    /// robot 0's.
    pub(super) fn show(mut self, claim: Option<usize>, hold: Option<usize>) -> Self {
        let robot = |(id, at): (usize, &Vector2<f64>)| RobotNow {
            at: (*at).into(),
            task: claim.filter(|_| id == 0),
            holding: hold.filter(|_| id == 0),
            phase: Phase::Idle,
            activity: Activity::Idle,
            grant: Vec::new(),
        };
        let object = |(id, at): (usize, &Vector2<f64>)| ObjectNow {
            at: (*at).into(),
            holder: hold.filter(|held| *held == id).map(|_| 0),
            status: TaskStatus::Waiting,
        };
        self.states.push(State {
            tick: self.now_ns / TICK_NS,
            time_ns: self.now_ns,
            epoch: 1,
            constraints_version: 0,
            robots: self.robots.iter().enumerate().map(robot).collect(),
            objects: self.objects.iter().enumerate().map(object).collect(),
        });
        self
    }

    /// Robot 0 fetches object 0 and stands there holding it, at (2, 1.55).
    pub(super) fn fetched(scene: SceneRecord) -> Self {
        Self::new(scene)
            .claim(0, 0)
            .go(0, None, 2.0, 1.0)
            .go(0, None, 2.0, 1.55)
            .grasp(0, 0)
    }

    /// Robot 0 brings object 0 to its goal and stands there, at (6, 1.55).
    pub(super) fn brought(scene: SceneRecord) -> Self {
        Self::fetched(scene)
            .go(0, Some(0), 6.0, 1.55)
            .show(Some(0), Some(0))
            .release(0, 0)
            .event(Happening::Completed { task: 0 })
            .event(Happening::Epoch { epoch: 2 })
    }

    /// The whole clean run, up to but without its last event.
    pub(super) fn clean(scene: SceneRecord) -> Self {
        let mut story = Self::brought(scene)
            .go(0, None, 6.0, 0.4)
            .go(0, None, 1.0, 0.4)
            .go(0, None, 1.0, 1.0);
        story.outcome = Outcome::Solved;
        story
    }

    pub(super) fn end(&self) -> End {
        End {
            outcome: self.outcome,
            reason: None,
            makespan_ns: self.now_ns,
            complete: true,
            options: serde_json::Value::Null,
        }
    }

    /// The one span of the story.
    pub(super) fn span(self) -> Span {
        let mark = Mark {
            tick: self.now_ns / TICK_NS,
            time_ns: self.now_ns,
        };
        Span {
            scene: None,
            motions: self.motions,
            events: self.events,
            states: self.states,
            close: Close::Mark(mark),
        }
    }

    pub(super) fn check(self) -> CheckReport {
        let outcome = self.outcome;
        self.event(Happening::Ended { outcome })
            .check_without_ended()
    }

    pub(super) fn check_without_ended(self) -> CheckReport {
        let mut checker = Checker::new(self.scene.clone());
        let end = self.end();
        checker.span(self.span());
        checker.span(empty(Close::End(end)));
        checker.finish(true)
    }

    /// The one violation there must be.
    pub(super) fn violation(self) -> Violation {
        let report = self.check();
        assert_eq!(report.violations.len(), 1, "{:#?}", report.violations);
        report.violations[0].clone()
    }

    /// All kinds found, in order of time.
    pub(super) fn kinds(self) -> Vec<Kind> {
        self.check()
            .violations
            .iter()
            .map(|violation| violation.kind)
            .collect()
    }
}

/// A span with nothing in it.
pub(super) const fn empty(close: Close) -> Span {
    Span {
        scene: None,
        motions: Vec::new(),
        events: Vec::new(),
        states: Vec::new(),
        close,
    }
}
