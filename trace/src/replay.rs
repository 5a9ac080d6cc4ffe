//! Where every body is at given times: what a viewer draws.
//!
//! Responsible for: places between records.
//! Not responsible for: whether they are legal (`check`).

use std::collections::VecDeque;
use std::io::Read;

use crate::reader::{Close, ReadError, Reader, Span};
use crate::record::{BodyKind, Happening, Motion, Place, State};

/// Where every body is at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// When, ns of virtual time.
    pub time_ns: u64,
    /// Centres of the robots, m.
    pub robots: Vec<Place>,
    /// Centres of the objects, m.
    pub objects: Vec<Place>,
}

/// One body's way: where it stands or moves now, and what comes next.
struct Way {
    present: Motion,
    ahead: VecDeque<Motion>,
}

impl Way {
    fn standing(body: BodyKind, id: usize, at: Place, since_ns: u64) -> Self {
        Self {
            present: rest(body, id, at, since_ns),
            ahead: VecDeque::new(),
        }
    }

    fn at(&mut self, time_ns: u64) -> Place {
        while let Some(next) = self.ahead.pop_front_if(|next| next.start_ns <= time_ns) {
            self.present = next;
        }
        self.present.at(time_ns).into()
    }
}

/// Standing still, as a motion that goes nowhere.
const fn rest(body: BodyKind, id: usize, at: Place, since_ns: u64) -> Motion {
    Motion {
        body,
        id,
        start_ns: since_ns,
        end_ns: since_ns.saturating_add(1),
        from: at,
        to: at,
    }
}

/// Goes through a trace in equal steps of virtual time, from a given time to the end of what is
/// told. Over a gap, bodies stay where they were last seen.
pub struct Replay<R> {
    reader: Reader<R>,
    robots: Vec<Way>,
    objects: Vec<Way>,
    /// Starts of the objects in the newest version of the scene.
    starts: Vec<Place>,
    time_ns: u64,
    every_ns: u64,
    known_until_ns: u64,
    /// Batches are missing: the first state of this tick or later tells where bodies are.
    lost_until: Option<u64>,
}

impl<R: Read> Replay<R> {
    /// Frames at `from_ns` and then every `every_ns`, which is at least 1.
    #[must_use]
    pub fn new(reader: Reader<R>, from_ns: u64, every_ns: u64) -> Self {
        let scene = reader.scene();
        let way = |body, id, at| Way::standing(body, id, at, 0);
        let robots = scene.homes.iter().enumerate();
        let objects = scene.objects.iter().enumerate();
        Self {
            robots: robots
                .map(|(id, home)| way(BodyKind::Robot, id, *home))
                .collect(),
            objects: objects
                .map(|(id, object)| way(BodyKind::Object, id, object.start))
                .collect(),
            starts: scene.objects.iter().map(|object| object.start).collect(),
            reader,
            time_ns: from_ns,
            every_ns: every_ns.max(1),
            known_until_ns: 0,
            lost_until: None,
        }
    }

    fn take_in(&mut self, span: Span) {
        if let Some(scene) = &span.scene {
            let objects = scene.objects.iter().enumerate();
            for (id, object) in objects.skip(self.objects.len()) {
                let way = Way::standing(BodyKind::Object, id, object.start, 0);
                self.objects.push(way);
            }
            let robots = scene.homes.iter().enumerate();
            for (id, home) in robots.skip(self.robots.len()) {
                let way = Way::standing(BodyKind::Robot, id, *home, 0);
                self.robots.push(way);
            }
            self.starts = scene.objects.iter().map(|object| object.start).collect();
        }
        let mut motions = span.motions;
        motions.extend(span.events.iter().filter_map(|event| match event.what {
            Happening::Moved { task } => {
                let place = self.starts[task];
                Some(rest(BodyKind::Object, task, place, event.time_ns))
            }
            _ => None,
        }));
        if let Some(tick) = self.lost_until
            && let Some(state) = span.states.iter().find(|state| state.tick >= tick)
        {
            self.resume(state);
            motions.retain(|motion| motion.end_ns > state.time_ns);
        }
        motions.sort_by_key(|motion| motion.start_ns);
        for motion in motions {
            let way = match motion.body {
                BodyKind::Robot => &mut self.robots[motion.id],
                BodyKind::Object => &mut self.objects[motion.id],
            };
            way.ahead.push_back(motion);
        }
        match span.close {
            Close::Mark(mark) => self.known_until_ns = mark.time_ns,
            Close::Gap(gap) => self.lost_until = Some(gap.before_tick.saturating_sub(1)),
            Close::End(_) => {}
        }
    }

    fn resume(&mut self, state: &State) {
        self.lost_until = None;
        let robots = self.robots.iter_mut().zip(&state.robots).enumerate();
        for (id, (way, robot)) in robots {
            way.ahead
                .push_back(rest(BodyKind::Robot, id, robot.at, state.time_ns));
        }
        let objects = self.objects.iter_mut().zip(&state.objects).enumerate();
        for (id, (way, object)) in objects {
            way.ahead
                .push_back(rest(BodyKind::Object, id, object.at, state.time_ns));
        }
    }
}

impl<R: Read> Iterator for Replay<R> {
    type Item = Result<Frame, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        while self.known_until_ns < self.time_ns {
            match self.reader.next()? {
                Ok(span) => self.take_in(span),
                Err(error) => return Some(Err(error)),
            }
        }
        let time_ns = self.time_ns;
        self.time_ns = time_ns.saturating_add(self.every_ns);
        Some(Ok(Frame {
            time_ns,
            robots: self.robots.iter_mut().map(|way| way.at(time_ns)).collect(),
            objects: self.objects.iter_mut().map(|way| way.at(time_ns)).collect(),
        }))
    }
}
