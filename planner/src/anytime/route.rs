//! A quick way of one robot through what others have reserved: safe-interval path planning over the
//! legs of a task.
//!
//! Responsible for: one search over several legs, grips between them included.
//! Not responsible for: reserving what was found (`plan`).
//!
//! Terms: a *leg* is the way to one place as one class of bodies. At its end the grip closes or
//! opens, and the next leg goes on as another class. The last leg ends where the robot may stay for
//! ever.
//! Source: Phillips and Likhachev, "SIPP", ICRA 2011; the legs are layers of one search, so that a
//! grasp is never made at a time from which there is no way on. In haste what is ahead counts a
//! quarter more than it takes at least (weighted A*, Pohl 1970): a way takes at most a quarter more
//! than the quickest, and mostly no more, but whoever has to wait or go round does not look at all
//! that is as quick so far.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::rc::Rc;

use crate::anytime::ground::{EVER, Field, Ground, Time, duration};
use crate::anytime::timeline::{Gap, Owner, Resting, Skip, Timeline};
use crate::search::DIRECTIONS;

/// What the grip does at the end of a leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Then {
    /// It grasps, no earlier than this: the next leg is the transfer.
    Grasp(Time),
    /// It releases, no earlier than this: the next leg is without the object.
    Release(Time),
    /// Nothing: the robot stays.
    Stay,
}

/// Where a leg leads.
#[derive(Clone)]
pub(crate) enum Target {
    /// To a place, with the distances to it.
    Place(u32, Field),
    /// To wherever the robot may stay for ever, but for the cells with a mark.
    Anywhere(Option<Rc<[u32]>>),
}

/// A leg.
#[derive(Clone)]
pub(crate) struct Leg {
    pub(crate) class: usize,
    pub(crate) target: Target,
    pub(crate) then: Then,
    /// Cells closed to this leg beside what is reserved: its own objects on the ground.
    pub(crate) closed: Vec<u32>,
    /// Whose reservations do not count: the object that is moved, where it is taken from, and one
    /// that was just put down.
    pub(crate) own: [Resting; 2],
}

/// A way that was asked for.
pub(crate) struct Quest<'a> {
    pub(crate) robot: Owner,
    pub(crate) from: u32,
    pub(crate) time: Time,
    pub(crate) legs: &'a [Leg],
    /// Ways that end at this time or later are not looked for.
    pub(crate) limit: Time,
    /// Robots below this number do not count while they are parked for ever.
    pub(crate) ignoring_parked: Owner,
}

/// One piece of a way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Piece {
    /// A step in a direction, from when to when.
    Step(u8, Time, Time),
    /// The grip at the end of a leg is done at this time.
    Grip(Time),
}

#[derive(Clone, Copy, Debug)]
struct Node {
    cell: u32,
    leg: u32,
    gap: Gap,
    time: Time,
    parent: u32,
    piece: Piece,
    /// Next node at the same place of the same leg.
    next: u32,
    closed: bool,
}

const NO_NODE: u32 = u32::MAX;

/// The search and its memory.
pub(crate) struct Router {
    nodes: Vec<Node>,
    /// First node by leg and cell, of this round.
    heads: Vec<(u32, u32)>,
    /// By leg and cell, the last round in which the leg was not to go there.
    closed: Vec<u32>,
    round: u32,
    points: usize,
    /// Whether ways need not be the quickest.
    pub(crate) is_hasty: bool,
    /// Nodes to expand, the one that promises most first, then the latest.
    open: BinaryHeap<Reverse<(u64, u32)>>,
    /// Lower bound of what follows each leg.
    rest: Vec<Time>,
    /// Nodes expanded so far.
    pub(crate) expanded: u64,
    /// Searches made so far.
    pub(crate) searches: u64,
}

impl Router {
    pub(crate) fn new(ground: &Ground) -> Self {
        Self {
            nodes: Vec::new(),
            heads: Vec::new(),
            closed: Vec::new(),
            round: 0,
            points: ground.points(),
            is_hasty: false,
            open: BinaryHeap::new(),
            rest: Vec::new(),
            expanded: 0,
            searches: 0,
        }
    }

    /// When the robot is there the way that was found, or none if there is no way. Its pieces are
    /// written to `way`.
    pub(crate) fn find(
        &mut self,
        ground: &Ground,
        timeline: &Timeline,
        quest: &Quest<'_>,
        way: &mut Vec<Piece>,
    ) -> Option<Time> {
        self.searches += 1;
        self.begin(ground, quest)?;
        let class = quest.legs[0].class;
        let start = (quest.time, quest.time);
        let gap = timeline.gap_of(class, quest.from, start, quest.skip(0))?;
        self.offer(
            quest,
            Node {
                cell: quest.from,
                leg: 0,
                gap,
                time: quest.time,
                parent: NO_NODE,
                piece: Piece::Grip(quest.time),
                next: NO_NODE,
                closed: false,
            },
        );
        while let Some(Reverse((_, index))) = self.open.pop() {
            let node = self.nodes[index as usize];
            if node.closed {
                continue;
            }
            self.nodes[index as usize].closed = true;
            self.expanded += 1;
            let leg = &quest.legs[node.leg as usize];
            if leg.is_end(node.cell, node.gap) {
                match leg.then {
                    Then::Stay => {
                        if node.gap.to == EVER {
                            self.trace(index, way);
                            return Some(node.time);
                        }
                    }
                    _ => self.grip(ground, timeline, quest, index),
                }
            }
            self.expand(ground, timeline, quest, index);
        }
        None
    }

    fn begin(&mut self, ground: &Ground, quest: &Quest<'_>) -> Option<()> {
        self.nodes.clear();
        self.open.clear();
        let needed = self.points * quest.legs.len();
        if self.heads.len() < needed {
            self.heads.resize(needed, (0, NO_NODE));
            self.closed.resize(needed, 0);
        }
        self.round += 1;
        for (marks, leg) in self.closed.chunks_mut(self.points).zip(quest.legs) {
            for &cell in &leg.closed {
                marks[cell as usize] = self.round;
            }
        }
        self.rest.clear();
        self.rest.resize(quest.legs.len(), 0);
        for index in (1..quest.legs.len()).rev() {
            let Target::Place(from, _) = quest.legs[index - 1].target else {
                return None;
            };
            let grip = match quest.legs[index - 1].then {
                Then::Grasp(_) => ground.grasp,
                Then::Release(_) => ground.release,
                Then::Stay => 0,
            };
            let way = match &quest.legs[index].target {
                Target::Place(_, field) => field.time(from)?,
                Target::Anywhere(_) => 0,
            };
            self.rest[index - 1] = self.rest[index] + way + grip;
        }
        Some(())
    }

    /// The first node at a place of a leg, if there is one.
    #[inline]
    fn first(&self, slot: usize) -> u32 {
        let (round, first) = self.heads[slot];
        if round == self.round { first } else { NO_NODE }
    }

    /// The nodes at a place of a leg.
    #[inline]
    fn known(&self, slot: usize) -> impl Iterator<Item = (u32, &Node)> {
        let node = |at: u32| self.nodes.get(at as usize).map(|node| (at, node));
        std::iter::successors(node(self.first(slot)), move |(_, known)| node(known.next))
    }

    fn offer(&mut self, quest: &Quest<'_>, node: Node) {
        let leg = &quest.legs[node.leg as usize];
        let Some(ahead) = leg.ahead(node.cell) else {
            return;
        };
        let ahead = ahead + self.rest[node.leg as usize];
        if node.time + ahead >= quest.limit {
            return;
        }
        let slot = node.leg as usize * self.points + node.cell as usize;
        let same = (self.known(slot))
            .find(|(_, known)| known.gap.from == node.gap.from)
            .map(|(at, known)| (at, known.time, known.next));
        let index = match same {
            Some((_, time, _)) if time <= node.time => return,
            Some((at, _, next)) => {
                self.nodes[at as usize] = Node { next, ..node };
                at
            }
            None => {
                let next = self.first(slot);
                let index = self.nodes.len() as u32;
                self.heads[slot] = (self.round, index);
                self.nodes.push(Node { next, ..node });
                index
            }
        };
        let more = if self.is_hasty { ahead / 4 } else { 0 };
        let key = node.time.saturating_add(ahead + more);
        let key = u64::from(key) << 32 | u64::from(!node.time);
        self.open.push(Reverse((key, index)));
    }

    fn expand(&mut self, ground: &Ground, timeline: &Timeline, quest: &Quest<'_>, index: u32) {
        let node = self.nodes[index as usize];
        let leg = &quest.legs[node.leg as usize];
        let skip = quest.skip(node.leg as usize);
        let rest = self.rest[node.leg as usize];
        let marks = node.leg as usize * self.points;
        let mut steps = ground.walls(leg.class).steps(node.cell);
        while steps != 0 {
            let direction = steps.trailing_zeros() as usize;
            steps &= steps - 1;
            let next = node.cell.wrapping_add_signed(ground.offsets[direction]);
            let takes = duration(direction);
            let least = node.time + takes;
            let in_time = |ahead: Time| least + ahead + rest < quest.limit;
            if !leg.ahead(next).is_some_and(in_time) {
                continue;
            }
            // Whatever interval is reached from here may have been reached no later before.
            let is_late = |known: &Node| known.time <= least && known.gap.to >= node.gap.to;
            if (self.known(marks + next as usize)).any(|(_, known)| is_late(known)) {
                continue;
            }
            let is_closed = |cell: u32| self.closed[marks + cell as usize] == self.round;
            let sides = sides(ground, node.cell, direction);
            if is_closed(next) || sides.is_some_and(|sides| sides.into_iter().any(is_closed)) {
                continue;
            }
            let mut after = node.time;
            while let Some(gap) = timeline.gap_after(leg.class, next, after, skip) {
                let earliest = node.time.max(gap.from);
                if earliest.saturating_add(takes) > node.gap.to {
                    break;
                }
                let depart = match sides {
                    None => Some(earliest),
                    Some(sides) => clear_of(timeline, leg.class, sides, earliest, takes, skip),
                };
                if let Some(depart) = depart {
                    let arrive = depart.saturating_add(takes);
                    if arrive <= gap.to && arrive <= node.gap.to && arrive < EVER {
                        self.offer(
                            quest,
                            Node {
                                cell: next,
                                leg: node.leg,
                                gap,
                                time: arrive,
                                parent: index,
                                piece: Piece::Step(direction as u8, depart, arrive),
                                next: NO_NODE,
                                closed: false,
                            },
                        );
                    }
                }
                if gap.to == EVER {
                    break;
                }
                after = gap.to + 1;
            }
        }
    }

    /// The end of a leg: the grip, and then the next leg.
    fn grip(&mut self, ground: &Ground, timeline: &Timeline, quest: &Quest<'_>, index: u32) {
        let node = self.nodes[index as usize];
        let leg = &quest.legs[node.leg as usize];
        let skip = quest.skip(node.leg as usize + 1);
        let next_class = quest.legs[node.leg as usize + 1].class;
        let mut after = node.time;
        while let Some(gap) = timeline.gap_after(next_class, node.cell, after, skip) {
            let (begin, end) = match leg.then {
                Then::Release(earliest) => {
                    let begin = node.time.max(earliest);
                    let end = begin.saturating_add(ground.release).max(gap.from);
                    // While the grip opens, and until the room for what follows is there, the
                    // robot counts as carrying.
                    if end > node.gap.to {
                        return;
                    }
                    (begin, end)
                }
                Then::Grasp(earliest) => {
                    let begin = node.time.max(earliest).max(gap.from);
                    if begin > node.gap.to {
                        return;
                    }
                    (begin, begin.saturating_add(ground.grasp))
                }
                Then::Stay => return,
            };
            if begin <= end && end <= gap.to && end < EVER {
                self.offer(
                    quest,
                    Node {
                        cell: node.cell,
                        leg: node.leg + 1,
                        gap,
                        time: end,
                        parent: index,
                        piece: Piece::Grip(end),
                        next: NO_NODE,
                        closed: false,
                    },
                );
            }
            if gap.to == EVER {
                return;
            }
            after = gap.to + 1;
        }
    }

    fn trace(&self, mut index: u32, way: &mut Vec<Piece>) {
        way.clear();
        loop {
            let node = &self.nodes[index as usize];
            if node.parent == NO_NODE {
                break;
            }
            way.push(node.piece);
            index = node.parent;
        }
        way.reverse();
    }
}

impl Quest<'_> {
    fn skip(&self, leg: usize) -> Skip {
        Skip {
            robot: self.robot,
            resting: self.legs[leg].own,
            parked_below: self.ignoring_parked,
        }
    }
}

impl Piece {
    /// When it is done.
    pub(crate) const fn end(self) -> Time {
        match self {
            Self::Step(_, _, end) | Self::Grip(end) => end,
        }
    }
}

impl Leg {
    /// The least time from a cell to the end of the leg; none if there is no way.
    #[inline]
    pub(crate) fn ahead(&self, cell: u32) -> Option<Time> {
        match &self.target {
            Target::Place(_, field) => field.time(cell),
            Target::Anywhere(_) => Some(0),
        }
    }

    #[inline]
    fn is_end(&self, cell: u32, gap: Gap) -> bool {
        match &self.target {
            Target::Place(place, _) => *place == cell,
            Target::Anywhere(but) => {
                gap.to == EVER && but.as_ref().is_none_or(|marks| marks[cell as usize] == 0)
            }
        }
    }
}

/// The two cells beside a diagonal step.
#[inline]
pub(crate) fn sides(ground: &Ground, cell: u32, direction: usize) -> Option<[u32; 2]> {
    if direction < 4 {
        return None;
    }
    let (dx, dy) = DIRECTIONS[direction];
    let up = cell.wrapping_add_signed(dy * ground.width);
    Some([cell.wrapping_add_signed(dx), up])
}

/// The earliest time from `earliest` on at which both cells are free for a while; none if that
/// takes more than a few tries.
fn clear_of(
    timeline: &Timeline,
    class: usize,
    sides: [u32; 2],
    earliest: Time,
    takes: Time,
    skip: Skip,
) -> Option<Time> {
    let mut time = earliest;
    for _ in 0..4 {
        let before = time;
        for side in sides {
            let mut after = time;
            loop {
                let gap = timeline.gap_after(class, side, after, skip)?;
                let from = time.max(gap.from);
                if from.saturating_add(takes) <= gap.to {
                    time = from;
                    break;
                }
                if gap.to == EVER {
                    return None;
                }
                after = gap.to + 1;
            }
        }
        if time == before {
            return Some(time);
        }
    }
    None
}
