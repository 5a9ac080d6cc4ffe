//! Following the schedule of a planner that plans ahead: action after action.
//!
//! Responsible for: which actions to ask the world for, and when; claims and grips on the way.
//! Not responsible for: the schedule (crate `planner`), which version is in force and what is
//! granted (the world).
//!
//! Nearly all follows from the snapshot: how many actions are granted, whether the robot stands,
//! what it holds, how often objects were put down. So a process that is started in the middle
//! goes on where the one before it stopped.
//!
//! Terms: an action's grip is *due* from when the action is granted until the object is held or
//! put down; what comes after it is asked for no earlier than along with the grip.

use scene::{ARRIVAL_M, Settings, vec};
use shm_types::{
    Action, Activity, Grip, PathRequest, Phase, RobotSchedule, Schedule, StateHash, Wait, index,
};

use crate::account::Doing;
use crate::intent::Intent;
use crate::now::Now;
use crate::request::Fate;
use crate::select;

/// Most actions asked for at once, and most corners granted ahead of which more is asked for.
const ACTIONS_AHEAD: usize = 8;

/// What a follower remembers.
pub(crate) struct Follower {
    look_again_ns: u64,
    started: bool,
    /// The last action granted and the last one asked for, and their numbers: a schedule that comes into force
    /// after they were granted may not list them any more.
    last: [Option<(u32, Action)>; 2],
    /// When that was asked for.
    asked_ns: u64,
    /// Version of the scene; in another one what was asked for before is void.
    scene_version: u32,
}

/// A grip that is due.
#[derive(Clone, Copy, Debug)]
struct Due {
    grip: Grip,
    object: usize,
    /// For a grasp: how often the object must have been put down.
    turn: u32,
}

impl Follower {
    /// Nothing asked for yet.
    pub(crate) fn new(settings: &Settings) -> Self {
        Self {
            look_again_ns: settings.look_again_ns,
            started: false,
            last: [None; 2],
            asked_ns: 0,
            scene_version: 0,
        }
    }

    /// What the robot is doing, and what that counts as, in this tick.
    pub(crate) fn act(&mut self, now: &Now<'_>, intent: &mut Intent) -> (Phase, Doing) {
        if !self.started {
            self.started = true;
            intent.take_up(now);
        }
        intent.waits_for = Wait::NONE;
        let version = now.snapshot.header.scene_version;
        if self.scene_version != version {
            (self.scene_version, self.last) = (version, [None; 2]);
        }
        let part = now.schedule.and_then(|schedule| schedule.part(now.id));
        let (Some(schedule), Some(part)) = (now.schedule, part) else {
            intent.claim = select::claim(now, now.holding());
            return (Phase::Selecting, without_schedule(now));
        };
        let due = self.due(now, schedule);
        let next = next_grasp(now, (schedule, part), due);
        intent.claim = select::claim(now, now.holding().or_else(|| may_claim(now, next)));
        match due {
            Some(due) if now.me().grant_count == 0 => {
                let (phase, doing) = grip(now, due);
                if doing.grip != Grip::Keep {
                    self.ask_beyond(now, schedule, intent);
                }
                // What is asked for along with it is driven in the same tick.
                (phase, Doing { go: true, ..doing })
            }
            Some(_) => (under_way(now, next, part), Doing::waiting(u64::MAX)),
            None => {
                intent.waits_for = waits_for(now, schedule);
                let doing = self.go_on(now, (schedule, part), intent);
                (under_way(now, next, part), doing)
            }
        }
    }

    /// The grip that the last granted action ends with, if it is due.
    fn due(&self, now: &Now<'_>, schedule: &Schedule) -> Option<Due> {
        let action = self.action(now, schedule, now.me().actions.checked_sub(1)?)?;
        let due = Due {
            grip: Grip::decode(action.grip).ok()?,
            object: index(action.object)?,
            turn: action.turn,
        };
        let is_due = match due.grip {
            Grip::Keep => false,
            Grip::Grasp => now.holding() != Some(due.object) && put_downs(now, due) <= due.turn,
            Grip::Release => now.holding() == Some(due.object),
        };
        is_due.then_some(due)
    }

    /// An action that is listed, or that it remembers.
    fn action(&self, now: &Now<'_>, schedule: &Schedule, number: u32) -> Option<Action> {
        let mut remembered = self.last.iter().flatten();
        let listed = schedule.action(now.id, number).copied();
        listed.or_else(|| {
            let (_, action) = remembered.find(|(last, _)| *last == number)?;
            Some(*action)
        })
    }

    /// Asks, along with a grip, for what comes after it, so that no tick is lost: the world takes it
    /// up as soon as the grip is made. What goes nowhere is asked for after it.
    fn ask_beyond(&mut self, now: &Now<'_>, schedule: &Schedule, intent: &mut Intent) {
        if intent.asked.fate(now.me()) == Fate::Sent {
            // Another request would take the place of one that may be granted by now.
            return;
        }
        let asked = intent.asked.request();
        let is_new = |request: &PathRequest| {
            let of = |request: &PathRequest| (request.actions, request.schedule_version);
            request.count > 1 && of(request) != of(asked)
        };
        if let Some(request) = batch(now, schedule).filter(is_new) {
            self.ask(now, schedule, intent, request);
        }
    }

    fn ask(
        &mut self,
        now: &Now<'_>,
        schedule: &Schedule,
        intent: &mut Intent,
        request: PathRequest,
    ) {
        let last = [now.me().actions, request.actions].map(|count| {
            let number = count.checked_sub(1)?;
            Some((number, self.action(now, schedule, number)?))
        });
        self.last = last;
        self.asked_ns = now.time_ns();
        intent.asked.ask_for(request, intent.sequence);
    }

    /// Asks for what comes next as soon as it may.
    fn go_on(
        &mut self,
        now: &Now<'_>,
        (schedule, part): (&Schedule, &RobotSchedule),
        intent: &mut Intent,
    ) -> Doing {
        let me = now.me();
        match intent.asked.fate(me) {
            Fate::Sent | Fate::Open => return Doing::waiting(u64::MAX),
            Fate::Granted | Fate::Refused => {}
        }
        if me.actions >= part.first + part.count {
            return at_end(now, (schedule, part));
        }
        let asked = intent.asked.request();
        let is_refused = asked.schedule_version == schedule.version && asked.actions > me.actions;
        if is_refused && now.time_ns() < self.asked_ns + self.look_again_ns {
            return Doing::waiting(now.counted().change);
        }
        if (me.grant_count as usize) < ACTIONS_AHEAD
            && let Some(request) = batch(now, schedule)
        {
            self.ask(now, schedule, intent, request);
        }
        Doing::waiting(u64::MAX)
    }

    /// Adds what it remembers, in a fixed order.
    pub(crate) fn hash_into(&self, hash: &mut StateHash) {
        hash.add(&[u64::from(self.started), self.asked_ns]);
        hash.add(&self.scene_version);
        for last in &self.last {
            hash.add(&u64::from(last.is_some()));
            if let Some((number, action)) = last {
                hash.add(number);
                hash.add(action);
            }
        }
    }
}

/// No schedule is in force, or the one in force has not come yet or does not know this robot yet.
fn without_schedule(now: &Now<'_>) -> Doing {
    waiting_for_planner(match now.snapshot.header.schedule_version {
        0 => now.counted().change,
        _ => u64::MAX,
    })
}

/// All that is listed is granted: it is done, or waits for others to make way, or for the planner
/// to list more.
fn at_end(now: &Now<'_>, (schedule, part): (&Schedule, &RobotSchedule)) -> Doing {
    let change = now.counted().change;
    let is_early = now.snapshot.header.tick < schedule.listed_until_tick;
    match (now.me().grant_count, part.complete) {
        (0, 1) => Doing::idle(change),
        (0, _) if !is_early => waiting_for_planner(change),
        _ => Doing::waiting(u64::MAX),
    }
}

/// Waits for a computation, though not its own. What is granted is driven meanwhile.
fn waiting_for_planner(settled_at_change: u64) -> Doing {
    Doing {
        activity: Activity::Computing,
        ..Doing::waiting(settled_at_change)
    }
}

/// Stands where a grip is due.
fn grip(now: &Now<'_>, due: Due) -> (Phase, Doing) {
    match due.grip {
        Grip::Grasp if put_downs(now, due) < due.turn => {
            (Phase::Grasping, Doing::waiting(u64::MAX))
        }
        Grip::Release => (Phase::Releasing, Doing::gripping(due.grip)),
        Grip::Grasp | Grip::Keep => (Phase::Grasping, Doing::gripping(due.grip)),
    }
}

fn put_downs(now: &Now<'_>, due: Due) -> u32 {
    now.snapshot.objects()[due.object].put_downs
}

/// The object grasped next, and the turn for it: now, or by an action ahead.
fn next_grasp(
    now: &Now<'_>,
    (schedule, part): (&Schedule, &RobotSchedule),
    due: Option<Due>,
) -> Option<(usize, u32)> {
    if let Some(due) = due
        && due.grip == Grip::Grasp
    {
        return Some((due.object, due.turn));
    }
    let granted = now.me().actions.saturating_sub(part.first) as usize;
    let mut ahead = schedule.actions_of(now.id).iter().skip(granted);
    let grasp = ahead.find(|action| action.grip == Grip::Grasp.code())?;
    Some((index(grasp.object)?, grasp.turn))
}

/// The object to claim: the one grasped next, as soon as nobody else has to move it first.
fn may_claim(now: &Now<'_>, next: Option<(usize, u32)>) -> Option<usize> {
    let (object, turn) = next?;
    let state = &now.snapshot.objects()[object];
    let free = index(state.claimed_by).is_none_or(|robot| robot == now.id);
    (state.put_downs == turn && index(state.holder).is_none() && free).then_some(object)
}

/// What it does between grips.
fn under_way(now: &Now<'_>, next: Option<(usize, u32)>, part: &RobotSchedule) -> Phase {
    let me = now.me();
    let at_end = me.grant_count == 0 && me.actions >= part.first + part.count;
    match (now.holding(), next) {
        (Some(_), _) => Phase::Transfer,
        (None, Some(_)) => Phase::Transit,
        (None, None) if at_end => Phase::Idle,
        (None, None) => Phase::GoingHome,
    }
}

/// The next actions to ask for: those whose waits are over, up to the first grip. An action that
/// goes nowhere is asked for by itself.
fn batch(now: &Now<'_>, schedule: &Schedule) -> Option<PathRequest> {
    let me = now.me();
    let start = now.grant_end();
    let mut request = PathRequest {
        actions: me.actions,
        schedule_version: schedule.version,
        count: 1,
        ..PathRequest::default()
    };
    request.points[0] = scene::point(start);
    let mut at = start;
    while request.count as usize <= ACTIONS_AHEAD
        && let Some(action) = schedule.action(now.id, request.actions)
        && waits_are_over(now, schedule, action)
    {
        let to = vec(action.to);
        if (to - at).norm() <= ARRIVAL_M {
            if request.count == 1 {
                request.actions += 1;
            }
            break;
        }
        request.points[request.count as usize] = action.to;
        request.count += 1;
        request.actions += 1;
        at = to;
        if action.grip != Grip::Keep.code() {
            break;
        }
    }
    (request.actions > me.actions).then_some(request)
}

fn waits_are_over(now: &Now<'_>, schedule: &Schedule, action: &Action) -> bool {
    first_wait(now, schedule, action).is_none()
}

/// The first of an action's waits that is not over.
fn first_wait(now: &Now<'_>, schedule: &Schedule, action: &Action) -> Option<Wait> {
    let robots = now.snapshot.robots();
    let is_open = |wait: &Wait| robots[wait.robot as usize].actions < wait.actions;
    let mut waits = schedule.waits_of(action).iter().copied();
    waits.find(is_open)
}

/// What the next action that is not granted waits for.
fn waits_for(now: &Now<'_>, schedule: &Schedule) -> Wait {
    let next = schedule.action(now.id, now.me().actions);
    let wait = next.and_then(|action| first_wait(now, schedule, action));
    wait.unwrap_or(Wait::NONE)
}
