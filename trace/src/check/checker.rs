//! The order of things: motion and events of a trace, one after the other, each held against what
//! was so far.
//!
//! Responsible for: order of time, continuity, speed, rigidity, states.
//! Not responsible for: what an event means (`events`), collisions (`bodies`), gaps (`gap`), how
//! the run ends (`ending`).

use nalgebra::Vector2;

use super::bodies::{Bodies, SAME_PLACE_M, body_of};
use super::events::{Context, Events, off_grasp_m};
use super::report::{Findings, Kind, Who};
use super::rules::Rules;
use crate::reader::{Close, Span};
use crate::record::{End, Event, Happening, Mark, Motion, SceneRecord, State};

/// What may be added to the way a body can go in a piece of motion, m: what rounding the ends of
/// a piece to a nanosecond and joining pieces may add.
const WAY_SLACK_M: f64 = 1e-8;

/// One thing that happens, in the order in which things at one instant happen: motion ends, then
/// events, then states that show them, then motion begins.
#[derive(Clone, Copy)]
enum Entry<'a> {
    Arrive(&'a Motion),
    Event(&'a Event),
    State(&'a State),
    SetOut(&'a Motion),
}

impl Entry<'_> {
    fn key(&self) -> (u64, u8, u64, u8) {
        match self {
            Self::Arrive(motion) => (motion.end_ns, 0, 0, 0),
            Self::Event(event) => (event.time_ns, 1, event.tick, 0),
            Self::State(state) => (state.time_ns, 1, state.tick, 1),
            Self::SetOut(motion) => (motion.start_ns, 2, 0, 0),
        }
    }
}

/// Replays a trace.
pub(super) struct Checker {
    pub(super) scene: SceneRecord,
    pub(super) bodies: Bodies,
    pub(super) rules: Rules,
    pub(super) events: Events,
    pub(super) findings: Findings,
    pub(super) last: Mark,
    /// Time and tick of the newest event, in the order of the file.
    pub(super) last_event: (u64, u64),
    /// Versions of the newest state: tick, epoch, constraints.
    pub(super) last_state: (u64, u64, u32),
    /// Batches are missing: nothing is known until a state of this tick or later.
    pub(super) lost_until: Option<u64>,
    pub(super) missing_batches: u64,
    pub(super) last_motion: Option<(u64, Who)>,
    pub(super) end: Option<End>,
}

impl Checker {
    pub(super) fn new(scene: SceneRecord) -> Self {
        Self {
            bodies: Bodies::new(&scene),
            rules: Rules::new(&scene),
            events: Events::default(),
            findings: Findings::default(),
            last: Mark {
                tick: 0,
                time_ns: 0,
            },
            last_event: (0, 0),
            last_state: (0, 0, 0),
            lost_until: None,
            missing_batches: 0,
            last_motion: None,
            end: None,
            scene,
        }
    }

    /// Replays what lies between two marks.
    pub(super) fn span(&mut self, mut span: Span) {
        if let Some(scene) = span.scene.take() {
            self.change(scene);
        }
        let until = match &span.close {
            Close::Mark(mark) => *mark,
            Close::Gap(_) | Close::End(_) => self.last,
        };
        self.put_in_order(&mut span, until);
        if self
            .lost_until
            .is_none_or(|tick| self.resume(&mut span, tick))
        {
            self.replay(&span);
        }
        self.last.tick = until.tick.max(self.last.tick);
        self.last.time_ns = until.time_ns.max(self.last.time_ns);
        match span.close {
            Close::Mark(_) => {}
            Close::Gap(gap) => self.lose(gap),
            Close::End(end) => self.end = Some(end),
        }
    }

    /// Another version of the scene holds from the last mark on: all up to it is held to the one
    /// before.
    fn change(&mut self, scene: SceneRecord) {
        self.settle_all();
        self.bodies = self.bodies.changed(&scene, self.last.time_ns);
        self.rules.change(&scene);
        self.scene = scene;
    }

    /// Somebody moves an object by hand. Nobody may hold it meanwhile.
    fn move_by_hand(&mut self, object: usize, time_ns: u64) {
        let who = Who::Object(object);
        if let Some(robot) = self.rules.holders[object] {
            let holder = Who::Robot(robot);
            self.findings
                .add(Kind::Holding, time_ns, &[who, holder], || {
                    format!("{who} is moved by hand while {holder} holds it")
                });
        }
        let start = self.scene.objects[object].start;
        self.bodies.put_down(who, start.into(), time_ns);
    }

    /// Reports and drops what does not belong between the last mark and `until`.
    fn put_in_order(&mut self, span: &mut Span, until: Mark) {
        let from_ns = self.last.time_ns;
        let findings = &mut self.findings;
        if until.time_ns < from_ns || until.tick < self.last.tick {
            findings.add(Kind::Order, until.time_ns, &[], || {
                "a mark goes back in time".to_owned()
            });
        }
        let is_inside = |time_ns: u64| (from_ns..=until.time_ns).contains(&time_ns);
        span.motions.retain(|motion| {
            let fits = is_inside(motion.start_ns) && is_inside(motion.end_ns);
            if !fits {
                let who = body_of(motion);
                findings.add(Kind::Order, motion.start_ns, &[who], || {
                    format!("a motion of {who} is not told between the marks of its time")
                });
            }
            fits
        });
        let last = &mut self.last_event;
        span.events.retain(|event| {
            let fits = is_inside(event.time_ns) && (event.time_ns, event.tick) >= *last;
            if fits {
                *last = (event.time_ns, event.tick);
            } else {
                findings.add(Kind::Order, event.time_ns, &[], || {
                    "an event is told after later ones, or not between the marks of its time"
                        .to_owned()
                });
            }
            fits
        });
        span.states.retain(|state| {
            let fits = is_inside(state.time_ns);
            if !fits {
                findings.add(Kind::Order, state.time_ns, &[], || {
                    "a state is not told between the marks of its time".to_owned()
                });
            }
            fits
        });
    }

    fn replay(&mut self, span: &Span) {
        let mut entries = Vec::new();
        for motion in &span.motions {
            entries.push(Entry::Arrive(motion));
            entries.push(Entry::SetOut(motion));
        }
        entries.extend(span.events.iter().map(Entry::Event));
        entries.extend(span.states.iter().map(Entry::State));
        // Stable: what happens at one instant keeps the order of the file.
        entries.sort_by_key(Entry::key);
        for entry in entries {
            match entry {
                Entry::Arrive(motion) => self.arrive(motion),
                Entry::Event(event) => self.event(event),
                Entry::State(state) => self.state(state),
                Entry::SetOut(motion) => self.set_out(motion),
            }
        }
    }

    /// Tests a body up to now, and forgets which objects it has left by now.
    fn settle(&mut self, who: Who, time_ns: u64) {
        let mut leaving = Vec::new();
        if let Who::Robot(robot) = who {
            leaving = self.rules.hands[robot].leaving.clone();
            leaving.retain_mut(|leaving| {
                let object = leaving.object;
                let (was, is) = self.bodies.nearness(robot, object, time_ns, &self.rules);
                leaving.was_near |= was;
                is || !leaving.was_near
            });
        }
        self.bodies
            .settle(who, time_ns, &self.rules, &mut self.findings);
        self.test_rigidity(who, time_ns);
        if let Who::Robot(robot) = who {
            self.rules.hands[robot].leaving = leaving;
        }
    }

    /// Tests everything up to the last mark, unless where things are is unknown.
    pub(super) fn settle_all(&mut self) {
        if self.lost_until.is_some() {
            return;
        }
        let time_ns = self.last.time_ns;
        self.bodies
            .settle_all(time_ns, &self.rules, &mut self.findings);
        for robot in 0..self.rules.hands.len() {
            self.test_rigidity(Who::Robot(robot), time_ns);
        }
    }

    fn arrive(&mut self, motion: &Motion) {
        if self.bodies.is_on(motion) {
            self.settle(body_of(motion), motion.end_ns);
            self.bodies.arrive(motion);
        }
    }

    fn set_out(&mut self, motion: &Motion) {
        let who = body_of(motion);
        let time_ns = motion.start_ns;
        let (from, to): (Vector2<f64>, Vector2<f64>) = (motion.from.into(), motion.to.into());
        let findings = &mut self.findings;
        if self.bodies.stands_since(who, time_ns).is_none() {
            findings.add(Kind::Continuity, time_ns, &[who], || {
                format!("{who} sets out while it is still on its way elsewhere")
            });
        }
        let jump_m = (from - self.bodies.at(who, time_ns)).norm();
        if jump_m > SAME_PLACE_M {
            findings.add(Kind::Continuity, time_ns, &[who], || {
                format!("{who} sets out {jump_m:.6} m away from where it was")
            });
        }
        let duration_s = ((motion.end_ns - time_ns) as f64 + 1.0) / 1e9;
        let limit = self.scene.robot.speed_m_per_s;
        let way_m = (to - from).norm();
        if way_m > limit * duration_s + WAY_SLACK_M {
            findings.add(Kind::Speed, time_ns, &[who], || {
                format!(
                    "{who} moves at {:.6} m/s, but {limit} m/s is the limit",
                    way_m / duration_s
                )
            });
        }
        if self.rules.robot_of(who).is_none() {
            findings.add(Kind::MovedAlone, time_ns, &[who], || {
                format!("{who} moves, but no robot holds it")
            });
        }
        if self
            .last_motion
            .is_none_or(|(end_ns, _)| end_ns < motion.end_ns)
        {
            self.last_motion = Some((motion.end_ns, who));
        }
        self.settle(who, time_ns);
        self.bodies.set_out(motion);
    }

    /// A robot and what it holds are one: whenever either is settled, they are where the grasp says.
    fn test_rigidity(&mut self, who: Who, time_ns: u64) {
        let Some(robot) = self.rules.robot_of(who) else {
            return;
        };
        let Some(object) = self.rules.hands[robot].holding else {
            return;
        };
        let off_m = off_grasp_m(&self.scene, &self.bodies, robot, object, time_ns);
        if off_m > SAME_PLACE_M {
            let (robot, object) = (Who::Robot(robot), Who::Object(object));
            self.findings
                .lasting(Kind::Rigidity, (time_ns, time_ns), (robot, object), || {
                    format!("{robot} holds {object}, but they are {off_m:.6} m off their grasp")
                });
        }
    }

    fn event(&mut self, event: &Event) {
        let (robot, task) = event.what.names();
        let held = robot.and_then(|robot| self.rules.hands[robot].holding);
        let objects = task.into_iter().chain(held).map(Who::Object);
        // Rules are about to change for these: all up to now is held to the old ones.
        for who in robot.map(Who::Robot).into_iter().chain(objects) {
            self.settle(who, event.time_ns);
        }
        if let Happening::Moved { task } = event.what {
            self.move_by_hand(task, event.time_ns);
        }
        let mut context = Context {
            scene: &self.scene,
            bodies: &self.bodies,
            rules: &mut self.rules,
            findings: &mut self.findings,
            time_ns: event.time_ns,
        };
        self.events.apply(event, &mut context);
    }

    /// A state record shows what motion and events have led to, and versions never go back.
    fn state(&mut self, state: &State) {
        let versions = (state.tick, state.epoch, state.constraints_version);
        let (tick, epoch, constraints) = std::mem::replace(&mut self.last_state, versions);
        let findings = &mut self.findings;
        if versions.0 < tick || versions.1 < epoch || versions.2 < constraints {
            findings.add(Kind::Epoch, state.time_ns, &[], || {
                format!(
                    "tick {}, epoch {} and constraints {} follow on tick {tick}, epoch {epoch} and \
                     constraints {constraints}",
                    versions.0, versions.1, versions.2
                )
            });
        }
        let robots = state.robots.iter().enumerate().map(|(id, robot)| {
            let hand = &self.rules.hands[id];
            let same = robot.holding == hand.holding && robot.task == hand.claim;
            (Who::Robot(id), robot.at, same)
        });
        let objects = state.objects.iter().enumerate().map(|(id, object)| {
            (
                Who::Object(id),
                object.at,
                object.holder == self.rules.holders[id],
            )
        });
        for (who, at, same) in robots.chain(objects) {
            let off_m = (Vector2::from(at) - self.bodies.at(who, state.time_ns)).norm();
            if off_m > SAME_PLACE_M {
                findings.add(Kind::State, state.time_ns, &[who], || {
                    format!("a state shows {who} {off_m:.6} m away from where its motion has led")
                });
            }
            if !same {
                findings.add(Kind::State, state.time_ns, &[who], || {
                    format!("a state shows other claims or holds of {who} than its events")
                });
            }
        }
    }
}
