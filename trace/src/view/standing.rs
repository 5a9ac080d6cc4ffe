//! Why each robot stood still at a time.
//!
//! Responsible for: one cause a robot, in words and for programs.
//! Not responsible for: whom a robot waits for where the trace does not say (`waits`).
//!
//! A trace has states at a set rate: what a robot was at is what the newest state before the time
//! says. Whether it moved is exact.

use serde::Serialize;

use crate::record::{Activity, Happening, Phase, Place};
use crate::view::story::{RobotDoing, Story, entry_at};
use crate::view::waits::{Blocker, waits};

/// How a robot is at a time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Standing {
    /// Which robot.
    pub robot: usize,
    /// Its centre, m.
    pub at: Place,
    /// The object it holds.
    pub holding: Option<usize>,
    /// The task it has claimed.
    pub task: Option<usize>,
    /// What it does, or why it stands.
    #[serde(flatten)]
    pub cause: Cause,
    /// The same in words.
    pub words: String,
}

/// What a robot does, or why it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "cause", rename_all = "snake_case")]
pub enum Cause {
    /// It moves.
    Moves,
    /// Its grip closes or opens.
    Grips,
    /// It computes.
    Computes,
    /// The planner service computes: there is no plan for it yet, or no answer.
    Planner,
    /// Its schedule has this action of another robot come first.
    Order {
        /// Who goes first.
        waits_for: usize,
        /// Number of the action, counted from 1.
        action: u32,
    },
    /// A robot is in its way.
    Robot {
        /// Which.
        waits_for: usize,
    },
    /// An object is in its way.
    Object {
        /// Which.
        waits_for_object: usize,
    },
    /// It waits to be granted a way, and the trace does not tell what is in it.
    Grant,
    /// It has nothing to do.
    NoTask,
    /// All motion was held.
    Held,
    /// Its process did not take part.
    Gone,
}

/// How each robot that is there by then is at a time.
#[must_use]
pub fn standing(story: &Story, time_s: f64) -> Vec<Standing> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "times of a trace are far below 2^53 ns; what is negative is 0"
    )]
    let time_ns = ((time_s * 1e9).round() as u64).min(story.until_ns);
    let waits = waits(story);
    let plans_ahead = story.scene.settings["method"] == "anytime";
    (0..story.robots.len())
        .filter(|&robot| story.has_robot(robot, time_ns))
        .map(|robot| {
            let doing = entry_at(&story.robots[robot].doing, time_ns);
            let blocker = entry_at(&waits[robot], time_ns).copied().flatten();
            let cause = cause(story, robot, doing, blocker, (time_ns, plans_ahead));
            let holding = doing.and_then(|doing| doing.holding);
            let task = doing.and_then(|doing| doing.task);
            Standing {
                robot,
                at: story.robot_at(robot, time_ns),
                holding,
                task,
                cause,
                words: words(robot, holding, task, cause),
            }
        })
        .collect()
}

fn cause(
    story: &Story,
    robot: usize,
    doing: Option<&RobotDoing>,
    blocker: Option<Blocker>,
    (time_ns, plans_ahead): (u64, bool),
) -> Cause {
    let track = &story.robots[robot].track;
    let begun = track.partition_point(|motion| motion.start_ns <= time_ns);
    let is_moving =
        |motion: &crate::record::Motion| time_ns < motion.end_ns && motion.from != motion.to;
    if begun > 0 && is_moving(&track[begun - 1]) {
        return Cause::Moves;
    }
    if is_gone(story, robot, time_ns) {
        return Cause::Gone;
    }
    if is_held(story, time_ns) {
        return Cause::Held;
    }
    let Some(doing) = doing else {
        return Cause::NoTask;
    };
    match doing.activity {
        Activity::Gripping => Cause::Grips,
        Activity::Computing if plans_ahead || doing.phase == Phase::Failing => Cause::Planner,
        Activity::Computing => Cause::Computes,
        Activity::Idle => Cause::NoTask,
        Activity::Waiting | Activity::Moving => match (doing.waits_for, blocker) {
            (Some(planned), _) => Cause::Order {
                waits_for: planned.robot,
                action: planned.action,
            },
            (None, Some(Blocker::Robot(waits_for))) => Cause::Robot { waits_for },
            (None, Some(Blocker::Object(waits_for_object))) => Cause::Object { waits_for_object },
            (None, None) => Cause::Grant,
        },
    }
}

/// Whether a robot took no part: of its ups and downs the last was a down.
fn is_gone(story: &Story, robot: usize, time_ns: u64) -> bool {
    let so_far = story
        .events
        .partition_point(|event| event.time_ns <= time_ns);
    let turns = story.events[..so_far].iter().rev();
    let mut turns = turns.filter_map(|event| match event.what {
        Happening::RobotUp { robot: who, .. } if who == robot => Some(false),
        Happening::RobotDown { robot: who } if who == robot => Some(true),
        _ => None,
    });
    turns.next().unwrap_or(false)
}

fn is_held(story: &Story, time_ns: u64) -> bool {
    let so_far = story
        .events
        .partition_point(|event| event.time_ns <= time_ns);
    let turns = story.events[..so_far].iter().rev();
    let mut turns = turns.filter_map(|event| match event.what {
        Happening::Held => Some(true),
        Happening::Resumed => Some(false),
        _ => None,
    });
    turns.next().unwrap_or(false)
}

fn words(robot: usize, holding: Option<usize>, task: Option<usize>, cause: Cause) -> String {
    let with = match (holding, task) {
        (Some(object), _) => format!(" with object {object}"),
        (None, Some(object)) => format!(", on its way to object {object}"),
        (None, None) => String::new(),
    };
    let why = match cause {
        Cause::Moves => return format!("robot {robot} moves{with}"),
        Cause::Grips => "its grip closes or opens".to_owned(),
        Cause::Computes => "it computes".to_owned(),
        Cause::Planner => "it waits for the planner service".to_owned(),
        Cause::Order { waits_for, action } => {
            format!("it waits for robot {waits_for}, whose action {action} comes first")
        }
        Cause::Robot { waits_for } => format!("robot {waits_for} is in its way"),
        Cause::Object { waits_for_object } => {
            format!("object {waits_for_object} is in its way")
        }
        Cause::Grant => "it waits to be granted a way".to_owned(),
        Cause::NoTask => "it has no task".to_owned(),
        Cause::Held => "all motion is held".to_owned(),
        Cause::Gone => "its process takes no part".to_owned(),
    };
    format!("robot {robot} stands still{with}: {why}")
}
