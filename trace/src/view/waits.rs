//! Whom a robot waits for.
//!
//! Responsible for: whom its schedule has it wait for, what a waiting robot itself names when it
//! reports failure next (rule 21), and else the first body in the way that it takes later on, as bodies stand and robots' granted ways
//! lie while it waits.
//! Not responsible for: whether it waits (the trace's states say so).
//!
//! A trace names whom a robot waits for only if its task fails of it. Nothing but a body keeps it
//! from a way that it takes as soon as it can, so what is in that way then is the answer; where
//! nothing is, because it took another way in the end or none, there is none. The geometry is the
//! checker's.

#[cfg(test)]
mod tests;

use crate::check::geometry::{Meeting, Solid, Vector};
use crate::record::{Activity, Event, Happening, Motion, SceneRecord, TaskStatus};
use crate::view::story::{RobotDoing, Story, Timeline, entry_at, note};

/// How long an answer holds before it is asked for anew, ns.
const ASK_AGAIN_NS: u64 = 1_000_000_000;
/// Penetration that still counts as touching, m (rule 1).
const CONTACT_M: f64 = 1e-6;

/// What a robot waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Blocker {
    Robot(usize),
    Object(usize),
}

/// Solids of the scene, made once.
struct Room<'a> {
    story: &'a Story,
    robot: Solid,
    objects: Vec<Solid>,
    depth: f64,
}

/// One convex part of a body, and where it is or lies within the body.
type Part<'a> = (&'a Solid, Vector);

/// For each robot whom it waits for, none while it does not wait or nobody is found.
pub(crate) fn waits(story: &Story) -> Vec<Timeline<Option<Blocker>>> {
    let scene = &story.scene;
    let room = Room {
        story,
        robot: Solid::from(&scene.robot.shape),
        objects: scene
            .objects
            .iter()
            .map(|object| Solid::from(&object.shape))
            .collect(),
        depth: depth(scene),
    };
    (0..story.robots.len())
        .map(|id| room.waits_of(id))
        .collect()
}

impl Room<'_> {
    fn waits_of(&self, id: usize) -> Timeline<Option<Blocker>> {
        let doing = &self.story.robots[id].doing;
        let mut waits = Timeline::new();
        for (k, (from_ns, now)) in doing.iter().enumerate() {
            let end_ns = doing.get(k + 1).map_or(self.story.until_ns, |next| next.0);
            if now.activity != Activity::Waiting {
                note(&mut waits, *from_ns, None);
                continue;
            }
            let leg_ns = doing[k..]
                .iter()
                .find(|(_, later)| later.phase != now.phase)
                .map_or(u64::MAX, |later| later.0);
            let mut time_ns = *from_ns;
            while time_ns < end_ns {
                note(&mut waits, time_ns, self.blocker(id, now, time_ns, leg_ns));
                time_ns = time_ns.saturating_add(ASK_AGAIN_NS);
            }
        }
        waits
    }

    /// Whom the robot names when its task fails next, if nothing else becomes of it before.
    fn named(&self, id: usize, time_ns: u64) -> Option<Blocker> {
        let events = &self.story.events;
        let later = events.partition_point(|event| event.time_ns < time_ns);
        let its = |event: &&Event| event.what.names().0 == Some(id);
        match events[later..].iter().find(its)?.what {
            Happening::Failed { blocker, .. } => blocker.map(Blocker::Robot),
            _ => None,
        }
    }

    /// The first body on the way that robot `id` takes between `time_ns` and `leg_ns`.
    fn blocker(&self, id: usize, now: &RobotDoing, time_ns: u64, leg_ns: u64) -> Option<Blocker> {
        if let Some(planned) = now.waits_for {
            return Some(Blocker::Robot(planned.robot));
        }
        if let Some(named) = self.named(id, time_ns) {
            return Some(named);
        }
        let track = &self.story.robots[id].track;
        let begun = track.partition_point(|motion| motion.end_ns <= time_ns);
        let mut way = track[begun..]
            .iter()
            .take_while(|motion| motion.start_ns < leg_ns);
        let own = self.parts(id, now.holding, time_ns);
        let others = self.others(id, now, time_ns);
        way.find_map(|piece| self.first_on(piece, &own, &others))
    }

    /// The first of `others` that a body of these parts meets on a piece of its way.
    fn first_on(
        &self,
        piece: &Motion,
        own: &[Part<'_>],
        others: &[(Blocker, Part<'_>)],
    ) -> Option<Blocker> {
        let (from, to): (Vector, Vector) = (piece.from.into(), piece.to.into());
        let meeting = |(moving, offset): &Part<'_>, (solid, at): Part<'_>| {
            let (a, b) = (from + offset - at, to + offset - at);
            if !near(moving, a, b, solid, self.depth) {
                return None;
            }
            let interval = Meeting::of(moving, solid).nearer_than(self.depth, a, b);
            interval.map(|(start, _)| start)
        };
        others
            .iter()
            .filter_map(|(who, part)| {
                let first = own.iter().filter_map(|own| meeting(own, *part));
                first.min_by(f64::total_cmp).map(|start| (start, *who))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, who)| who)
    }

    /// A robot's parts with their offsets from its centre.
    fn parts(&self, id: usize, holding: Option<usize>, time_ns: u64) -> Vec<Part<'_>> {
        let carried = |object: usize| {
            let robot = Vector::from(self.story.robot_at(id, time_ns));
            let offset = robot - Vector::from(self.story.object_at(object, time_ns));
            let (grasp, _) = self.story.scene.objects[object].nearest_grasp(offset);
            (&self.objects[object], -grasp)
        };
        std::iter::once((&self.robot, Vector::zeros()))
            .chain(holding.map(carried))
            .collect()
    }

    /// Every other body: robots where they stand and at the corners granted to them, objects on
    /// the ground but the robot's own.
    fn others(&self, id: usize, now: &RobotDoing, time_ns: u64) -> Vec<(Blocker, Part<'_>)> {
        let story = self.story;
        let mut others = Vec::new();
        let there = |other: usize| other != id && story.has_robot(other, time_ns);
        for (other, robot) in story.robots.iter().enumerate().filter(|(o, _)| there(*o)) {
            let holding = entry_at(&robot.doing, time_ns).and_then(|doing| doing.holding);
            let at = story.robot_at(other, time_ns);
            let granted = entry_at(&robot.grants, time_ns).map_or(&[][..], Vec::as_slice);
            for place in std::iter::once(&at).chain(granted) {
                for (solid, offset) in self.parts(other, holding, time_ns) {
                    others.push((
                        Blocker::Robot(other),
                        (solid, Vector::from(*place) + offset),
                    ));
                }
            }
        }
        for (object, spec) in story.scene.objects.iter().enumerate() {
            let doing = entry_at(&story.objects[object].doing, time_ns);
            let held = doing.is_some_and(|doing| doing.status == TaskStatus::Held);
            let passable = spec.pass_under && now.holding.is_none();
            if !held && !passable && now.task != Some(object) {
                let at = story.object_at(object, time_ns).into();
                others.push((Blocker::Object(object), (&self.objects[object], at)));
            }
        }
        others
    }
}

/// Bodies nearer than this are in each other's way, m: the clearance, and what counts as touching.
pub(crate) fn depth(scene: &SceneRecord) -> f64 {
    scene.robot.clearance_m - CONTACT_M
}

/// Whether the box around a motion from `a` to `b`, relative to a solid, comes nearer to the box
/// around that than `depth`.
pub(crate) fn near(moving: &Solid, a: Vector, b: Vector, solid: &Solid, depth: f64) -> bool {
    let ((low, high), (there_low, there_high)) = (moving.extent(), solid.extent());
    let apart = (there_low - high - a.sup(&b)).sup(&(low + a.inf(&b) - there_high));
    apart.max() < depth
}
