//! Which faults of a plan are at work, and which have altered something.
//!
//! Responsible for: beginning and end of each fault, counting those that matter. Not responsible
//! for: what they do (`driver.rs`).
//!
//! A fault counts only if it altered something while a task was open.

use super::fault::{Channel, Fault, Kind, Whom};
use super::line::Fate;

/// The faults of a run.
pub(crate) struct Active {
    plan: Vec<Fault>,
    /// Whether each has altered something while a task was open.
    counted: Vec<bool>,
    /// When each that waits for its moment has begun.
    begun: Vec<Option<u64>>,
    /// The first that has not begun.
    next: usize,
    /// Places in the plan of those at work.
    at_work: Vec<usize>,
    /// Whether a task is open.
    pub(crate) is_open: bool,
    /// From this tick on nothing is altered any more.
    until: u64,
}

impl Active {
    pub(crate) fn new(plan: Vec<Fault>, until: u64) -> Self {
        Self {
            counted: vec![false; plan.len()],
            begun: vec![None; plan.len()],
            plan,
            next: 0,
            at_work: Vec::new(),
            is_open: true,
            until,
        }
    }

    /// The next fault that begins by tick `now`; it is at work from then on.
    pub(crate) fn begin(&mut self, now: u64) -> Option<(usize, Fault)> {
        let place = self.next;
        let fault = *self.plan.get(place).filter(|fault| fault.tick <= now)?;
        self.next += 1;
        self.at_work.push(place);
        Some((place, fault))
    }

    /// Lets go of those that are over at tick `now`.
    pub(crate) fn end(&mut self, now: u64) {
        let (plan, begun, until) = (&self.plan, &self.begun, self.until);
        self.at_work.retain(|&place| {
            let fault = &plan[place];
            let begun = match fault.kind {
                Kind::SlowPlanner => begun[place].unwrap_or(now),
                _ => fault.tick,
            };
            now < until && (waits(fault) || now < begun + lasts(fault))
        });
    }

    /// Whether nothing is altered from tick `now` on.
    pub(crate) fn are_over(&self, now: u64) -> bool {
        now >= self.until
    }

    /// The fault at place `place` has altered something.
    pub(crate) fn count(&mut self, place: usize) {
        self.counted[place] |= self.is_open;
    }

    /// As [`Self::count`], of one that waits for its moment: it lasts for its time from now on.
    pub(crate) fn count_from(&mut self, place: usize, now: u64) {
        self.begun[place].get_or_insert(now);
        self.count(place);
    }

    /// What happens to a message sent now.
    pub(crate) fn fate(&mut self, channel: Channel, whom: Whom) -> Option<Fate> {
        let found = self.at_work.iter().position(|&place| {
            let fault = &self.plan[place];
            fault.channel == Some(channel) && fault.whom == whom
        })?;
        let place = self.at_work[found];
        let fault = self.plan[place];
        let fate = match fault.kind {
            Kind::Lost => Fate::Lost,
            Kind::Doubled => Fate::Again(fault.ticks),
            Kind::Reordered => Fate::Swapped,
            _ => Fate::Late(fault.ticks),
        };
        if waits(&fault) {
            self.at_work.swap_remove(found);
        }
        self.count(place);
        Some(fate)
    }

    /// The fault of this kind that is at work on `whom`, if there is one.
    pub(crate) fn at_work(&self, kind: Kind, whom: Whom) -> Option<(usize, Fault)> {
        let mut at_work = self.at_work.iter().map(|&place| (place, self.plan[place]));
        at_work.find(|(_, fault)| fault.kind == kind && fault.whom == whom)
    }

    /// The faults that counted.
    pub(crate) fn counted(&self) -> impl Iterator<Item = &Fault> {
        let pairs = self.plan.iter().zip(&self.counted);
        pairs
            .filter(|(_, counted)| **counted)
            .map(|(fault, _)| fault)
    }
}

/// For how many ticks a fault is at work. A way on which messages are late has to be longer so
/// than by what they are late, or nobody would see old ones.
const fn lasts(fault: &Fault) -> u64 {
    match fault.kind {
        Kind::Stale => 2 * fault.ticks,
        _ => fault.ticks,
    }
}

/// Whether a fault waits for one message and is over then; others last for their time.
fn waits(fault: &Fault) -> bool {
    let is_single = matches!(fault.kind, Kind::Doubled | Kind::Reordered);
    fault
        .channel
        .is_some_and(|channel| is_single || !channel.is_steady())
}
