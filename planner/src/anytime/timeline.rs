//! Who keeps whom away from where, and when: reservations in space and time.
//!
//! Responsible for: entering what robots and objects occupy, taking a robot's last part back,
//! safe intervals of a lattice point for a class of bodies.
//! Not responsible for: routes (`route`), or who goes where (`plan`).
//!
//! Terms: a *safe interval* of a point is a longest span of time in which a body of the class can
//! be there (Phillips and Likhachev, "SIPP: Safe interval path planning for dynamic environments",
//! ICRA 2011). Its ends belong to it: touching is not overlap, in time neither.

#[cfg(test)]
mod tests;

use crate::anytime::ground::{EVER, Ground, Offset, Time};

/// A robot's number, or that of an object after those of the robots.
pub(crate) type Owner = u32;

/// A span in which somebody keeps a class of bodies away from a lattice point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Busy {
    pub(crate) from: Time,
    pub(crate) to: Time,
    pub(crate) owner: Owner,
    /// Number of the owner's step at whose end the point is free again; of an object, how often it
    /// had been put down.
    pub(crate) step: u32,
}

/// An object at rest, where it was left when it was put down for the time of this number.
pub(crate) type Resting = (Owner, u32);

/// Spans that do not count.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Skip {
    /// Those of the robot itself.
    pub(crate) robot: Owner,
    /// Those of objects that are looked at apart, but only where they are left then.
    pub(crate) resting: [Resting; 2],
    /// Robots below this number that are parked for ever. None, if 0: with it a search tells who
    /// is in the way.
    pub(crate) parked_below: Owner,
}

impl Skip {
    #[inline]
    fn has(self, busy: &Busy) -> bool {
        busy.owner == self.robot
            || self.resting.contains(&(busy.owner, busy.step))
            || busy.to == EVER && busy.owner < self.parked_below
    }
}

/// A safe interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Gap {
    pub(crate) from: Time,
    pub(crate) to: Time,
}

/// Reservations of everybody.
pub(crate) struct Timeline {
    /// By class, then cell, each sorted by `from`.
    lists: Vec<Vec<Busy>>,
    points: usize,
    /// Lists that are not empty.
    touched: Vec<u32>,
    excused: Vec<Excused>,
    /// Where a body that is being entered keeps a class away since when: by class and cell.
    since: Vec<Time>,
}

/// Where an owner keeps a class away from a cell, it does not as long as it stands at `start`.
struct Excused {
    class: usize,
    cell: u32,
    owner: Owner,
    start: u32,
}

/// A body on its way, being entered piece by piece.
pub(crate) struct Walker {
    pub(crate) owner: Owner,
    class: usize,
    cell: u32,
}

impl Timeline {
    pub(crate) fn new(ground: &Ground) -> Self {
        let points = ground.points();
        Self {
            lists: vec![Vec::new(); points * ground.classes],
            points,
            touched: Vec::new(),
            excused: Vec::new(),
            since: vec![EVER; points * ground.classes],
        }
    }

    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        for index in self.touched.drain(..) {
            self.lists[index as usize].clear();
        }
        self.excused.clear();
    }

    /// `owner` does not keep this class away from `cell` as long as it stands at `start`, nor with a
    /// step from there that leads away. To be said before it is entered.
    pub(crate) fn excuse(&mut self, class: usize, cell: u32, owner: Owner, start: u32) {
        self.excused.push(Excused {
            class,
            cell,
            owner,
            start,
        });
    }

    /// What is excused of where a body stands is not entered: it counts from `time` on, and only if
    /// the body still keeps away from there at `next`.
    fn pardon(&mut self, ground: &Ground, walker: &Walker, next: Option<u32>, time: Time) {
        for at in 0..self.excused.len() {
            let excused = &self.excused[at];
            if (excused.owner, excused.start) != (walker.owner, walker.cell) {
                continue;
            }
            let mask = ground.mask(excused.class, walker.class);
            let keeps_away = next.is_some_and(|next| mask.has(ground.offset(excused.cell, next)));
            let index = self.index(excused.class, excused.cell);
            self.since[index] = if keeps_away { time } else { EVER };
        }
    }

    /// Keeps everybody else away from where those below `robots` will be, until they have left:
    /// nobody passes before them.
    pub(crate) fn let_pass(&mut self, robots: Owner) {
        for &index in &self.touched {
            let list = &mut self.lists[index as usize];
            for busy in list.iter_mut().filter(|busy| busy.owner < robots) {
                busy.from = 0;
            }
            list.sort_by_key(|busy| busy.from);
        }
    }

    #[inline]
    fn index(&self, class: usize, cell: u32) -> usize {
        class * self.points + cell as usize
    }

    fn add(&mut self, index: usize, busy: Busy) {
        if busy.from >= busy.to {
            return;
        }
        let list = &mut self.lists[index];
        if list.is_empty() {
            self.touched.push(index as u32);
        }
        let place = list.partition_point(|other| other.from <= busy.from);
        if let Some(before) = place.checked_sub(1).map(|before| &mut list[before])
            && before.owner == busy.owner
            && before.to == busy.from
        {
            before.to = busy.to;
            before.step = busy.step;
            return;
        }
        list.insert(place, busy);
    }

    /// What keeps a class away from a point, sorted by when it begins.
    pub(crate) fn busy(&self, class: usize, cell: u32) -> &[Busy] {
        &self.lists[self.index(class, cell)]
    }

    /// The first safe interval of a point that ends after `time`, or at it if it is not empty.
    #[inline]
    pub(crate) fn gap_after(&self, class: usize, cell: u32, time: Time, skip: Skip) -> Option<Gap> {
        let mut from = 0;
        for busy in &self.lists[self.index(class, cell)] {
            if skip.has(busy) {
                continue;
            }
            if busy.from > from && busy.from >= time {
                return Some(Gap {
                    from,
                    to: busy.from,
                });
            }
            from = from.max(busy.to);
        }
        (from < EVER).then_some(Gap { from, to: EVER })
    }

    /// The safe interval that holds all of a span.
    #[inline]
    pub(crate) fn gap_of(
        &self,
        class: usize,
        cell: u32,
        (from, to): (Time, Time),
        skip: Skip,
    ) -> Option<Gap> {
        let mut gap = self.gap_after(class, cell, from, skip)?;
        while gap.to < to {
            if gap.to > from {
                return None;
            }
            gap = self.gap_after(class, cell, gap.to + 1, skip)?;
        }
        (gap.from <= from).then_some(gap)
    }

    /// Begins to enter a body that is at `cell` from `time` on.
    pub(crate) fn enter(
        &mut self,
        ground: &Ground,
        owner: Owner,
        class: usize,
        cell: u32,
        time: Time,
    ) -> Walker {
        self.begin(ground, class, cell, time);
        Walker { owner, class, cell }
    }

    fn begin(&mut self, ground: &Ground, class: usize, cell: u32, time: Time) {
        let at = ground.xy(cell);
        for kept in 0..ground.classes {
            for &offset in &ground.mask(kept, class).all {
                if let Some(near) = ground.moved(at, offset) {
                    let index = self.index(kept, near);
                    self.since[index] = time;
                }
            }
        }
    }

    /// The body steps on, its step of number `step`.
    pub(crate) fn step(
        &mut self,
        ground: &Ground,
        walker: &mut Walker,
        direction: usize,
        (depart, arrive): (Time, Time),
        step: u32,
    ) {
        let start = ground.xy(walker.cell);
        let next = walker.cell.wrapping_add_signed(ground.offsets[direction]);
        let end = ground.xy(next);
        self.pardon(ground, walker, Some(next), depart);
        for kept in 0..ground.classes {
            let mask = ground.mask(kept, walker.class);
            self.open(ground, kept, end, &mask.entered[direction], depart);
            self.close(
                ground,
                kept,
                start,
                &mask.left[direction],
                walker.owner,
                arrive,
                step,
            );
            for &offset in &mask.swept[direction] {
                if let Some(near) = ground.moved(start, offset) {
                    let busy = Busy {
                        from: depart,
                        to: arrive,
                        owner: walker.owner,
                        step,
                    };
                    self.add(self.index(kept, near), busy);
                }
            }
        }
        walker.cell = next;
    }

    fn open(&mut self, ground: &Ground, kept: usize, at: Offset, offsets: &[Offset], time: Time) {
        for &offset in offsets {
            if let Some(near) = ground.moved(at, offset) {
                let index = self.index(kept, near);
                self.since[index] = time;
            }
        }
    }

    #[expect(clippy::too_many_arguments, reason = "one call, of one step")]
    fn close(
        &mut self,
        ground: &Ground,
        kept: usize,
        at: Offset,
        offsets: &[Offset],
        owner: Owner,
        time: Time,
        step: u32,
    ) {
        for &offset in offsets {
            if let Some(near) = ground.moved(at, offset) {
                let index = self.index(kept, near);
                let from = std::mem::replace(&mut self.since[index], EVER);
                let busy = Busy {
                    from,
                    to: time,
                    owner,
                    step,
                };
                self.add(index, busy);
            }
        }
    }

    /// Ends entering: the body is there until `time`, its steps before `step` made.
    pub(crate) fn leave(&mut self, ground: &Ground, walker: &Walker, time: Time, step: u32) {
        let at = ground.xy(walker.cell);
        self.pardon(ground, walker, None, time);
        for kept in 0..ground.classes {
            let mask = &ground.mask(kept, walker.class).all;
            self.close(ground, kept, at, mask, walker.owner, time, step);
        }
    }

    /// Enters that an object keeps a class away from these cells.
    pub(crate) fn occupy(
        &mut self,
        class: usize,
        cells: &[u32],
        (owner, turn): Resting,
        from: Time,
    ) {
        for &cell in cells {
            let busy = Busy {
                from,
                to: EVER,
                owner,
                step: turn,
            };
            self.add(self.index(class, cell), busy);
        }
    }

    /// Ends at `time` what `owner` occupies for ever at these cells.
    pub(crate) fn vacate(&mut self, class: usize, cells: &[u32], owner: Owner, time: Time) {
        for &cell in cells {
            let index = self.index(class, cell);
            for busy in &mut self.lists[index] {
                if busy.owner == owner && busy.to == EVER {
                    busy.to = time.max(busy.from);
                }
            }
        }
    }

    /// Takes back what `owner` occupies from `time` on, along a walk of these directions.
    pub(crate) fn take_back(
        &mut self,
        ground: &Ground,
        (owner, class): (Owner, usize),
        mut cell: u32,
        directions: impl Iterator<Item = usize>,
        time: Time,
    ) {
        for kept in 0..ground.classes {
            let mask = &ground.mask(kept, class).all;
            self.cut(ground, kept, cell, mask, owner, time);
        }
        for direction in directions {
            let next = cell.wrapping_add_signed(ground.offsets[direction]);
            for kept in 0..ground.classes {
                let mask = ground.mask(kept, class);
                self.cut(ground, kept, next, &mask.entered[direction], owner, time);
                self.cut(ground, kept, cell, &mask.swept[direction], owner, time);
            }
            cell = next;
        }
    }

    fn cut(
        &mut self,
        ground: &Ground,
        kept: usize,
        cell: u32,
        offsets: &[Offset],
        owner: Owner,
        time: Time,
    ) {
        let at = ground.xy(cell);
        for &offset in offsets {
            if let Some(near) = ground.moved(at, offset) {
                let index = self.index(kept, near);
                self.lists[index].retain_mut(|busy| {
                    if busy.owner == owner && busy.to > time {
                        busy.to = time;
                    }
                    busy.from < busy.to
                });
            }
        }
    }
}
