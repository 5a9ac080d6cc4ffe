//! What events mean, and whether each may happen when it does.
//!
//! Responsible for: claims, grasps, releases, completions, epochs, the user's own order.
//! Not responsible for: where bodies are (`bodies`), what claims and holds permit (`rules`).

use nalgebra::Vector2;

use super::bodies::{Bodies, SAME_PLACE_M};
use super::geometry::Vector;
use super::report::{Findings, Kind, Who};
use super::rules::{Grip, Rules};
use crate::record::{Event, Happening, Instant, Outcome, SceneRecord, TaskInstant};

/// All that an event is held against.
pub(super) struct Context<'a> {
    pub(super) scene: &'a SceneRecord,
    pub(super) bodies: &'a Bodies,
    pub(super) rules: &'a mut Rules,
    pub(super) findings: &'a mut Findings,
    pub(super) time_ns: u64,
}

/// What has happened so far.
#[derive(Default)]
pub(super) struct Events {
    /// Newest epoch; 0 before any was told of.
    pub(super) epoch: u64,
    happened: Vec<TaskInstant>,
    /// When the run ended, and how.
    pub(super) ended: Option<(u64, Outcome)>,
}

impl Events {
    /// Holds an event against the rules and lets it take effect, legal or not: the trace is
    /// followed as it is.
    pub(super) fn apply(&mut self, event: &Event, context: &mut Context<'_>) {
        match event.what {
            Happening::Claimed { robot, task, epoch } => {
                context.claim(robot, task);
                if epoch > self.epoch {
                    context.claim_is_wrong(robot, task, "in an epoch that has not opened yet");
                }
                self.reach(task, Instant::Start, context);
                context.rules.claim(robot, task);
            }
            Happening::Unclaimed { robot, task } => {
                if context.rules.hands[robot].claim != Some(task) {
                    context.find(Kind::Claim, robot, task, |robot, task| {
                        format!("{robot} gives {task} back, which it has not claimed")
                    });
                }
                context.rules.unclaim(robot);
            }
            Happening::GraspStarted { robot, .. } => {
                context.rules.hands[robot].grip = Grip::Closing(event.time_ns);
            }
            Happening::Grasped { robot, task } => {
                context.grasp(robot, task);
                self.reach(task, Instant::Grasp, context);
                let (bodies, time_ns) = (context.bodies, context.time_ns);
                let (grasp, _) = nearest_grasp(context.scene, bodies, robot, task, time_ns);
                context.rules.grasp(robot, task, grasp);
            }
            Happening::ReleaseStarted { robot } => {
                context.rules.hands[robot].grip = Grip::Opening(event.time_ns);
            }
            Happening::Released { robot, task } => {
                context.release(robot, task);
                context.rules.release(robot, task);
            }
            Happening::Completed { task } => {
                context.complete(task);
                self.reach(task, Instant::Finish, context);
            }
            Happening::Epoch { epoch } => {
                if epoch <= self.epoch {
                    let newest = self.epoch;
                    context.findings.add(Kind::Epoch, event.time_ns, &[], || {
                        format!("epoch {epoch} opens after epoch {newest}")
                    });
                }
                self.epoch = epoch;
            }
            // A grip in motion is given up when its robot goes or comes back.
            Happening::RobotUp { robot, .. } | Happening::RobotDown { robot } => {
                context.rules.hands[robot].grip = Grip::Still;
                context.rules.gone[robot] = matches!(event.what, Happening::RobotDown { .. });
            }
            Happening::Ended { outcome } => self.ended = Some((event.time_ns, outcome)),
            Happening::Violated { invariant, .. } => {
                context
                    .findings
                    .add(Kind::Reported, event.time_ns, &[], || {
                        format!("the world itself found its invariant {invariant} broken")
                    });
            }
            Happening::Started
            | Happening::Failed { .. }
            | Happening::Constraint { .. }
            | Happening::Held
            | Happening::Resumed
            | Happening::Changed { .. }
            | Happening::Moved { .. }
            | Happening::ScheduleRefused { .. } => {}
        }
    }

    /// An instant in the life of a task: must others of the user's order have come before it?
    fn reach(&mut self, task: usize, instant: Instant, context: &mut Context<'_>) {
        let present = TaskInstant { task, instant };
        for order in &context.scene.before {
            if order.then == present && !self.happened.contains(&order.first) {
                let who = [Who::Object(order.first.task), Who::Object(task)];
                context.findings.add(Kind::UserOrder, context.time_ns, &who, || {
                    format!(
                        "{instant:?} of {} comes before {:?} of {}, against the scenario's own order",
                        who[1], order.first.instant, who[0]
                    )
                });
            }
        }
        if !self.happened.contains(&present) {
            self.happened.push(present);
        }
    }
}

impl Context<'_> {
    fn find(
        &mut self,
        kind: Kind,
        robot: usize,
        task: usize,
        message: impl FnOnce(Who, Who) -> String,
    ) {
        let who = [Who::Robot(robot), Who::Object(task)];
        self.findings
            .add(kind, self.time_ns, &who, || message(who[0], who[1]));
    }

    fn claim_is_wrong(&mut self, robot: usize, task: usize, why: &str) {
        self.find(Kind::Claim, robot, task, |robot, task| {
            format!("{robot} claims {task} {why}")
        });
    }

    fn claim(&mut self, robot: usize, task: usize) {
        let hand = &self.rules.hands[robot];
        let (claims, holds) = (hand.claim.is_some(), hand.holding.is_some());
        let is_claimed = self.rules.hands.iter().any(|hand| hand.claim == Some(task));
        if self.rules.holders[task].is_some() {
            self.claim_is_wrong(robot, task, "although it is held");
        } else if is_claimed {
            self.claim_is_wrong(robot, task, "although it is claimed already");
        }
        if holds {
            self.claim_is_wrong(robot, task, "while it holds an object");
        } else if claims {
            self.claim_is_wrong(robot, task, "while it claims another");
        }
    }

    fn grasp(&mut self, robot: usize, task: usize) {
        if self.rules.hands[robot].claim != Some(task) {
            self.find(Kind::Grasp, robot, task, |robot, task| {
                format!("{robot} grasps {task} without having claimed it")
            });
        }
        if let Some(holder) = self.rules.holders[task] {
            self.find(Kind::Holding, robot, task, |robot, task| {
                format!("{robot} grasps {task}, which robot {holder} holds")
            });
        }
        if let Some(held) = self.rules.hands[robot].holding.filter(|held| *held != task) {
            self.find(Kind::Holding, robot, task, |robot, task| {
                format!("{robot} grasps {task} while it holds object {held}")
            });
        }
        let (_, off_m) = nearest_grasp(self.scene, self.bodies, robot, task, self.time_ns);
        if off_m > SAME_PLACE_M {
            self.find(Kind::Grasp, robot, task, |robot, task| {
                format!("{robot} grasps {task} from {off_m:.6} m beside where its grasp is")
            });
        }
        let began_ns = match self.rules.hands[robot].grip {
            Grip::Closing(began_ns) => began_ns,
            Grip::Still | Grip::Opening(_) => self.time_ns,
            Grip::Unknown => return,
        };
        self.grip(robot, task, began_ns, self.scene.robot.grasp_ns, "closes");
    }

    fn release(&mut self, robot: usize, task: usize) {
        if self.rules.holders[task] != Some(robot) {
            self.find(Kind::Holding, robot, task, |robot, task| {
                format!("{robot} lets {task} go, which it does not hold")
            });
        }
        if self
            .bodies
            .stands_since(Who::Object(task), self.time_ns)
            .is_none()
        {
            self.find(Kind::MovedAlone, robot, task, |robot, task| {
                format!("{task} moves on after {robot} has let it go")
            });
        }
        let began_ns = match self.rules.hands[robot].grip {
            Grip::Opening(began_ns) => began_ns,
            Grip::Still | Grip::Closing(_) => self.time_ns,
            Grip::Unknown => return,
        };
        self.grip(robot, task, began_ns, self.scene.robot.release_ns, "opens");
    }

    /// A grip takes its time, and its robot stands meanwhile.
    fn grip(
        &mut self,
        robot: usize,
        task: usize,
        began_ns: u64,
        duration_ns: u64,
        does: &'static str,
    ) {
        let took_ns = self.time_ns - began_ns;
        if took_ns < duration_ns {
            self.find(Kind::Grip, robot, task, |robot, task| {
                format!("the grip of {robot} {does} on {task} in {took_ns} ns, but it takes {duration_ns} ns")
            });
        }
        let stands_since = self.bodies.stands_since(Who::Robot(robot), self.time_ns);
        if took_ns > 0 && stands_since.is_none_or(|since_ns| since_ns > began_ns) {
            self.find(Kind::Grip, robot, task, |robot, task| {
                format!("{robot} moves while its grip {does} on {task}")
            });
        }
    }

    fn complete(&mut self, task: usize) {
        let who = Who::Object(task);
        let is_held = self.rules.holders[task].is_some();
        let at = self.bodies.at(who, self.time_ns);
        let alike = (0..self.scene.objects.len()).filter(|&other| self.scene.is_alike(task, other));
        let mut goals = alike
            .filter_map(|other| self.scene.objects[other].goal)
            .peekable();
        let has_goal = goals.peek().is_some();
        let is_there = goals.any(|goal| (at - Vector2::from(goal)).norm() <= SAME_PLACE_M);
        let why = match (is_held, has_goal && !is_there) {
            (true, _) => "is held",
            (false, true) => "is not at its goal",
            (false, false) => return,
        };
        self.findings
            .add(Kind::Completion, self.time_ns, &[who], || {
                format!("{who} counts as brought to its goal, but {why}")
            });
    }
}

/// The grasp by which a robot holds an object, and how far it is from it, m.
pub(super) fn nearest_grasp(
    scene: &SceneRecord,
    bodies: &Bodies,
    robot: usize,
    object: usize,
    time_ns: u64,
) -> (Vector, f64) {
    let (robot, there) = (Who::Robot(robot), Who::Object(object));
    let offset = bodies.at(robot, time_ns) - bodies.at(there, time_ns);
    scene.objects[object].nearest_grasp(offset)
}
