//! A run as a viewer needs it: everything a trace tells, by body and by time.
//!
//! Responsible for: reading a trace whole; where each body is at any time; what robots and tasks
//! do from when on.
//! Not responsible for: how it looks (`page`, `still`), whether it was legal (`check`).
//!
//! Terms: a *track* is a body's motion as straight pieces, exact as the trace has them. A
//! *timeline* holds a value from the time it was first so until the next entry.

use std::io::Read;

use crate::reader::{Close, ReadError, Reader};
use crate::record::{
    Activity, BodyKind, End, Event, Gap, Happening, Motion, Object, Phase, Place, RobotNow,
    SceneRecord, State, TaskStatus, WaitsFor,
};

/// What a robot is at, from a time on.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RobotDoing {
    pub(crate) phase: Phase,
    pub(crate) activity: Activity,
    pub(crate) task: Option<usize>,
    pub(crate) holding: Option<usize>,
    /// Whose action has to come before its next one, as its schedule says.
    pub(crate) waits_for: Option<WaitsFor>,
}

/// How a task stands, from a time on, and the robot that has claimed it or holds its object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TaskDoing {
    pub(crate) status: TaskStatus,
    pub(crate) robot: Option<usize>,
}

/// Values, each from its time (ns) until the next.
pub(crate) type Timeline<T> = Vec<(u64, T)>;

/// A robot over the whole run.
#[derive(Clone, Debug, Default)]
pub(crate) struct RobotStory {
    /// When it came, ns.
    pub(crate) since_ns: u64,
    pub(crate) track: Vec<Motion>,
    pub(crate) doing: Timeline<RobotDoing>,
    /// Corners of the granted path ahead.
    pub(crate) grants: Timeline<Vec<Place>>,
}

/// An object and its task over the whole run.
#[derive(Clone, Debug)]
pub(crate) struct ObjectStory {
    /// When it came, ns, and where.
    pub(crate) since_ns: u64,
    pub(crate) start: Place,
    pub(crate) track: Vec<Motion>,
    pub(crate) doing: Timeline<TaskDoing>,
}

/// Everything a trace tells.
#[derive(Clone, Debug)]
pub struct Story {
    /// The scene at the end.
    pub(crate) scene: SceneRecord,
    /// Its versions, each from its time (ns) until the next.
    pub(crate) versions: Timeline<SceneRecord>,
    pub(crate) robots: Vec<RobotStory>,
    pub(crate) objects: Vec<ObjectStory>,
    pub(crate) events: Vec<Event>,
    /// Times (ns) between which batches of motion are missing.
    pub(crate) gaps: Vec<(u64, u64)>,
    /// How the run ended; none if the trace was cut short.
    pub(crate) end: Option<End>,
    pub(crate) until_ns: u64,
}

impl Story {
    /// Reads a trace to its end, or to where it was cut.
    ///
    /// # Errors
    /// It is damaged, or not what a trace is.
    pub fn read(mut reader: Reader<impl Read>) -> Result<Self, ReadError> {
        let scene = reader.scene().clone();
        let mut story = Self {
            robots: scene.homes.iter().map(|_| RobotStory::default()).collect(),
            objects: scene
                .objects
                .iter()
                .map(|object| ObjectStory::of(object, 0))
                .collect(),
            versions: vec![(0, scene.clone())],
            scene,
            events: Vec::new(),
            gaps: Vec::new(),
            end: None,
            until_ns: 0,
        };
        let mut lost: Option<Gap> = None;
        for span in reader.by_ref() {
            let span = span?;
            if let Some(scene) = span.scene {
                story.change(scene);
            }
            if let Some(gap) = lost
                && let Some(state) = span
                    .states
                    .iter()
                    .find(|state| state.tick + 1 >= gap.before_tick)
            {
                story.resume(state);
                lost = None;
            }
            for motion in &span.motions {
                story.motion(motion);
            }
            // A state shows all events up to its time.
            let mut states = span.states.iter().peekable();
            for event in span.events {
                while let Some(state) = states.next_if(|state| state.time_ns < event.time_ns) {
                    story.state(state);
                }
                story.event(event);
            }
            states.for_each(|state| story.state(state));
            match span.close {
                Close::Mark(mark) => story.until_ns = story.until_ns.max(mark.time_ns),
                Close::Gap(gap) => lost = Some(gap),
                Close::End(end) => {
                    story.until_ns = story.until_ns.max(end.makespan_ns);
                    story.end = Some(end);
                }
            }
        }
        if lost.is_some() {
            story.gaps.push((reader.read_until_ns(), story.until_ns));
        }
        story.sort();
        Ok(story)
    }

    /// Time up to which the trace tells of the run, s.
    #[must_use]
    pub fn until_s(&self) -> f64 {
        self.until_ns as f64 / 1e9
    }

    /// Whether the trace was cut short: it has no end.
    #[must_use]
    pub const fn is_cut_short(&self) -> bool {
        self.end.is_none()
    }

    /// The scene at the end.
    #[must_use]
    pub const fn scene(&self) -> &SceneRecord {
        &self.scene
    }

    /// Where a robot is, m.
    pub(crate) fn robot_at(&self, robot: usize, time_ns: u64) -> Place {
        place_at(&self.robots[robot].track, self.scene.homes[robot], time_ns)
    }

    /// Whether a robot is there yet.
    pub(crate) fn has_robot(&self, robot: usize, time_ns: u64) -> bool {
        self.robots[robot].since_ns <= time_ns
    }

    /// Where an object is, m.
    pub(crate) fn object_at(&self, object: usize, time_ns: u64) -> Place {
        let object = &self.objects[object];
        place_at(&object.track, object.start, time_ns)
    }

    /// Another version of the scene holds from now on.
    fn change(&mut self, scene: SceneRecord) {
        let now_ns = self.until_ns;
        let since_now = || RobotStory {
            since_ns: now_ns,
            ..RobotStory::default()
        };
        self.robots.resize_with(scene.homes.len(), since_now);
        for object in &scene.objects[self.objects.len()..] {
            self.objects.push(ObjectStory::of(object, now_ns));
        }
        for (id, object) in scene.objects.iter().enumerate() {
            let had_goal = self.scene.objects.get(id).and_then(|before| before.goal);
            if object.goal != had_goal && self.objects[id].since_ns < now_ns {
                note(&mut self.objects[id].doing, now_ns, waiting(object.goal));
            }
        }
        self.versions.push((now_ns, scene.clone()));
        self.scene = scene;
    }

    fn motion(&mut self, motion: &Motion) {
        self.until_ns = self.until_ns.max(motion.end_ns);
        let track = match motion.body {
            BodyKind::Robot => &mut self.robots[motion.id].track,
            BodyKind::Object => &mut self.objects[motion.id].track,
        };
        track.push(*motion);
    }

    fn sort(&mut self) {
        for robot in &mut self.robots {
            robot.track.sort_by_key(|motion| motion.start_ns);
        }
        for object in &mut self.objects {
            object.track.sort_by_key(|motion| motion.start_ns);
        }
    }

    /// Behind a gap everything is where the first state says, whatever moved meanwhile.
    fn resume(&mut self, state: &State) {
        self.gaps.push((self.until_ns, state.time_ns));
        let seen = |body, id, at| Motion {
            body,
            id,
            start_ns: state.time_ns.saturating_sub(1),
            end_ns: state.time_ns.max(1),
            from: at,
            to: at,
        };
        for (id, robot) in state.robots.iter().enumerate() {
            self.motion(&seen(BodyKind::Robot, id, robot.at));
        }
        for (id, object) in state.objects.iter().enumerate() {
            self.motion(&seen(BodyKind::Object, id, object.at));
        }
    }

    fn state(&mut self, state: &State) {
        for (story, now) in self.robots.iter_mut().zip(&state.robots) {
            note(&mut story.doing, state.time_ns, doing(now));
            note(&mut story.grants, state.time_ns, now.grant.clone());
        }
        for (id, now) in state.objects.iter().enumerate() {
            let claimant = || state.robots.iter().position(|robot| robot.task == Some(id));
            let robot = match now.status {
                TaskStatus::Claimed => claimant(),
                TaskStatus::Held => now.holder,
                TaskStatus::Waiting | TaskStatus::Done => None,
            };
            let status = now.status;
            note(
                &mut self.objects[id].doing,
                state.time_ns,
                TaskDoing { status, robot },
            );
        }
    }

    /// How a task stood before it was claimed: one that is done may be claimed, to be moved for
    /// others' sake.
    fn status_before(&self, task: usize) -> TaskStatus {
        let before = self.objects[task].doing.iter().rev();
        let unclaimed = before.map(|(_, doing)| doing.status);
        let mut unclaimed = unclaimed.filter(|status| *status != TaskStatus::Claimed);
        unclaimed.next().unwrap_or(TaskStatus::Waiting)
    }

    /// What is known the instant it happens, before the next state shows it.
    fn event(&mut self, event: Event) {
        if let Happening::Moved { task } = event.what {
            let place = self.scene.objects[task].start;
            self.objects[task].track.push(Motion {
                body: BodyKind::Object,
                id: task,
                start_ns: event.time_ns,
                end_ns: event.time_ns + 1,
                from: place,
                to: place,
            });
        }
        let task = match event.what {
            Happening::Claimed { robot, task, .. } => {
                Some((task, TaskStatus::Claimed, Some(robot)))
            }
            Happening::Grasped { robot, task } => Some((task, TaskStatus::Held, Some(robot))),
            Happening::Unclaimed { task, .. } => Some((task, self.status_before(task), None)),
            Happening::Completed { task } => Some((task, TaskStatus::Done, None)),
            _ => None,
        };
        if let Some((task, status, robot)) = task {
            let doing = &mut self.objects[task].doing;
            note(doing, event.time_ns, TaskDoing { status, robot });
        }
        self.events.push(event);
    }
}

impl ObjectStory {
    fn of(object: &Object, since_ns: u64) -> Self {
        Self {
            since_ns,
            start: object.start,
            track: Vec::new(),
            doing: vec![(since_ns, waiting(object.goal))],
        }
    }
}

/// How a task stands that nobody has begun.
fn waiting(goal: Option<Place>) -> TaskDoing {
    TaskDoing {
        status: goal.map_or(TaskStatus::Done, |_| TaskStatus::Waiting),
        robot: None,
    }
}

/// What is so at a time; none before the first entry.
pub(crate) fn entry_at<T>(timeline: &Timeline<T>, time_ns: u64) -> Option<&T> {
    let begun = timeline.partition_point(|(from_ns, _)| *from_ns <= time_ns);
    begun.checked_sub(1).map(|last| &timeline[last].1)
}

/// Adds a value if it is another one than before; of several at one time the last counts.
pub(crate) fn note<T: PartialEq>(timeline: &mut Timeline<T>, time_ns: u64, value: T) {
    if timeline.last().is_some_and(|(_, last)| *last == value) {
        return;
    }
    timeline.pop_if(|(time, _)| *time == time_ns);
    timeline.push((time_ns, value));
}

fn doing(now: &RobotNow) -> RobotDoing {
    RobotDoing {
        phase: now.phase,
        activity: now.activity,
        task: now.task,
        holding: now.holding,
        waits_for: now.waits_for,
    }
}

fn place_at(track: &[Motion], start: Place, time_ns: u64) -> Place {
    let begun = track.partition_point(|motion| motion.start_ns <= time_ns);
    begun
        .checked_sub(1)
        .map_or(start, |last| track[last].at(time_ns).into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_timeline_tells_changes_and_of_several_at_one_time_the_last() {
        let mut timeline = Timeline::default();
        for (time_ns, value) in [(1, 'a'), (2, 'a'), (3, 'b'), (3, 'c'), (5, 'd')] {
            note(&mut timeline, time_ns, value);
        }
        assert_eq!(timeline, [(1, 'a'), (3, 'c'), (5, 'd')]);
        let at = |time_ns| entry_at(&timeline, time_ns).copied();
        let all = [None, Some('a'), Some('a'), Some('c'), Some('c'), Some('d')];
        assert_eq!([0, 1, 2, 3, 4, 5].map(at), all);
    }
}
