//! Schedules written by hand: what a planner that plans ahead would publish.

use shm_types::{Action, Grip, NONE, Point, RobotSchedule, Schedule, Wait, zeroed};

/// An action of a plan.
pub(crate) struct Step {
    to: [f64; 2],
    grip: Grip,
    object: u32,
    turn: u32,
    after: Vec<Wait>,
}

/// Straight to a place.
pub(crate) fn go(x: f64, y: f64) -> Step {
    Step {
        to: [x, y],
        grip: Grip::Keep,
        object: NONE,
        turn: 0,
        after: Vec::new(),
    }
}

impl Step {
    /// Grasps there what has been put down `turn` times.
    pub(crate) fn grasp(self, object: u32, turn: u32) -> Self {
        Self {
            grip: Grip::Grasp,
            object,
            turn,
            ..self
        }
    }

    /// Puts down there what it holds.
    pub(crate) fn release(self, object: u32) -> Self {
        Self {
            grip: Grip::Release,
            object,
            ..self
        }
    }

    /// Not before `robot` has been granted `actions` of its actions.
    pub(crate) fn after(mut self, robot: u32, actions: u32) -> Self {
        self.after.push(Wait { robot, actions });
        self
    }
}

/// A whole plan: the steps of each robot.
pub(crate) fn schedule(robots: &[Vec<Step>]) -> Box<Schedule> {
    let mut schedule: Box<Schedule> = zeroed();
    schedule.robot_count = robots.len() as u32;
    for (part, steps) in schedule.robots.iter_mut().zip(robots) {
        *part = RobotSchedule {
            first: 0,
            count: steps.len() as u32,
            offset: schedule.action_count,
            complete: 1,
            kept: u32::MAX,
        };
        for step in steps {
            schedule.actions[schedule.action_count as usize] = Action {
                to: Point::new(step.to[0], step.to[1]),
                grip: step.grip.code(),
                object: step.object,
                turn: step.turn,
                first_wait: schedule.wait_count,
                waits: step.after.len() as u32,
                reserved: 0,
            };
            schedule.action_count += 1;
            for wait in &step.after {
                schedule.waits[schedule.wait_count as usize] = *wait;
                schedule.wait_count += 1;
            }
        }
    }
    schedule
}

/// Two rooms and a corridor of 0.6 m between them. Two robots, each of which brings an object
/// into the other's room.
pub(crate) const CORRIDOR: &str = r#"
    name = "corridor"
    [robot]
    shape = { box = [0.5, 0.5] }
    speed = 0.5
    [object]
    shape = { box = [0.4, 0.4] }
    grasp = [0.0, 0.0]
    [workspace]
    bounds = [0.0, 0.0, 8.0, 3.0]
    walls = [{ box = [3.0, 0.0, 5.0, 1.2] }, { box = [3.0, 1.8, 5.0, 3.0] }]
    [[robots]]
    home = [1.0, 1.5]
    [[robots]]
    home = [7.0, 1.5]
    [[objects]]
    start = [2.0, 2.5]
    goal = [6.0, 2.5]
    [[objects]]
    start = [6.0, 0.5]
    goal = [2.0, 0.5]
"#;

/// Robot 0 goes through the corridor first, both ways.
pub(crate) fn corridor() -> Box<Schedule> {
    schedule(&[
        vec![
            go(2.0, 1.5),
            go(2.0, 2.5).grasp(0, 0),
            go(2.0, 1.5),
            go(6.0, 1.5),
            go(6.0, 2.5).release(0),
            go(6.0, 1.5).after(1, 5),
            go(1.0, 1.5),
        ],
        vec![
            go(7.0, 0.5),
            go(6.0, 0.5).grasp(1, 0),
            go(6.0, 1.5).after(0, 5),
            go(2.0, 1.5),
            go(2.0, 0.5).release(1),
            go(2.0, 1.5).after(0, 7),
            go(7.0, 1.5),
        ],
    ])
}
