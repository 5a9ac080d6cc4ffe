//! From a plan to the schedule that robots follow.
//!
//! Responsible for: joining steps into actions, and which action waits for which.
//! Not responsible for: the plan (`plan`), following it (crate `robot`).
//!
//! How: where two robots need the same space, the plan says who is there first. The later one's
//! step waits for the step with which the earlier one leaves (an action dependency graph: Hönig
//! et al., "Persistent and robust execution of MAPF schedules in warehouses", RA-L 2019). Waits are
//! on granted steps: granted space is kept from all others, so the later robot may then follow as
//! closely as the world allows. Every wait is for something planned earlier, so waits form no
//! ring. Steps are joined where nothing is waited for, in either direction.

mod needs;
#[cfg(test)]
mod tests;

use scene::{CONTACT_M, Scene, Vec2, point};
use shm_types::capacity::MAX_ACTIONS;
use shm_types::{Action, Grip, NONE, RobotSchedule, Schedule, Wait};

use crate::anytime::ground::{Ground, Time};
use crate::anytime::plan::Plan;
use crate::anytime::plan::late::LONG_WAIT_S;
use crate::anytime::publish::needs::{Need, add_user_order, needs_of};
use crate::anytime::rounds::patience_s;
use crate::anytime::situation::{RobotAt, Situation};
use crate::anytime::track::{Deed, Track};

/// Most steps in one action.
const MAX_STEPS: u32 = 20;
/// The same of those that robots begin with, while what comes after them can still change.
const FEW_STEPS: u32 = 2;

/// Actions of one robot, and which one each deed is part of.
struct Joined {
    /// How many come before these, which stay as they were.
    kept: u32,
    actions: Vec<Action>,
    /// By deed: how many actions are granted once it is.
    granted: Vec<u32>,
    /// By action: its first deed.
    first: Vec<u32>,
}

/// What one robot will do.
#[derive(Default)]
struct Part {
    /// Number of the first action in `actions`.
    first: u32,
    /// How many there were before anything was planned.
    begun: u32,
    /// How many are as they were in the plan before.
    kept: u32,
    /// Each with what it waits for.
    actions: Vec<(Action, Vec<Wait>)>,
}

/// All that robots will do.
pub(crate) struct Script {
    robots: Vec<Part>,
    /// By robot and deed: how many actions are granted once it is.
    granted: Vec<Vec<u32>>,
    /// By robot, how many of its actions may be listed: those after that can still change.
    limits: Vec<u32>,
    /// The tick by which the next ones are to begin; 0 if there are no limits.
    limited_until_tick: u64,
}

impl Script {
    /// The whole of a plan that robots begin with, or go on with as the situation is.
    pub(crate) fn of(scene: &Scene, ground: &Ground, plan: &Plan, situation: &Situation) -> Self {
        let part = |robot: &RobotAt| Part::standing(robot);
        let before = Self {
            robots: situation.robots.iter().map(part).collect(),
            granted: vec![Vec::new(); situation.robots.len()],
            limits: vec![u32::MAX; situation.robots.len()],
            limited_until_tick: 0,
        };
        Self::joined(scene, ground, plan, &before, |_| 0)
    }

    /// The whole of a plan that keeps a part of this one.
    pub(crate) fn go_on(&self, scene: &Scene, ground: &Ground, plan: &Plan) -> Self {
        Self::joined(scene, ground, plan, self, |robot| plan.tracks()[robot].kept)
    }

    /// A plan's actions after those of `before` with which so many deeds are done.
    fn joined(
        scene: &Scene,
        ground: &Ground,
        plan: &Plan,
        before: &Self,
        kept: impl Fn(usize) -> usize,
    ) -> Self {
        let mut needs: Vec<Vec<Need>> = (plan.tracks().iter().enumerate())
            .map(|(robot, track)| needs_of(ground, plan, robot as u32, track))
            .collect();
        for order in &scene.before {
            add_user_order(plan, *order, &mut needs);
        }
        let mut waited: Vec<Vec<bool>> = (plan.tracks().iter())
            .map(|track| vec![false; track.deeds.len() + 1])
            .collect();
        for need in needs.iter().flatten() {
            waited[need.robot as usize][need.until as usize] = true;
        }
        let joined: Vec<Joined> = (waited.iter().enumerate())
            .map(|(robot, waited)| {
                let granted = &before.granted[robot][..kept(robot)];
                let begun = before.robots[robot].begun;
                let kept = (granted.last().copied().unwrap_or(begun), granted);
                join(scene, ground, plan, robot, &needs[robot], waited, kept)
            })
            .collect();
        let script = |(robot, (part, needs)): (usize, (&Joined, &Vec<Need>))| {
            let mut needs = needs.iter().peekable();
            let actions = part.actions.iter().enumerate().map(|(index, action)| {
                let last = part.first.get(index + 1).copied().unwrap_or(u32::MAX);
                let mut waits = Vec::new();
                while let Some(need) = needs.next_if(|need| need.deed < last) {
                    let granted = &joined[need.robot as usize].granted;
                    waits.push(Wait {
                        robot: need.robot,
                        actions: granted[(need.until as usize).min(granted.len() - 1)],
                    });
                }
                (*action, waits)
            });
            let is_all_kept = plan.tracks()[robot].deeds.len() == kept(robot);
            let known = &before.robots[robot];
            let kept = &known.actions[..(part.kept - known.first) as usize];
            let actions: Vec<_> = kept.iter().cloned().chain(actions).collect();
            // Beside what is kept there may be the last pieces, to where the robot stays.
            let is_same = is_all_kept && is_alike(&actions, &known.actions);
            Part {
                first: known.first,
                begun: known.begun,
                kept: if is_same { u32::MAX } else { part.kept },
                actions,
            }
        };
        Self {
            robots: joined.iter().zip(&needs).enumerate().map(script).collect(),
            limits: vec![u32::MAX; joined.len()],
            limited_until_tick: 0,
            granted: joined.into_iter().map(|part| part.granted).collect(),
        }
    }

    /// By deed of a robot, how many of its actions are granted once it is; at the end, all.
    pub(crate) fn granted(&self, robot: usize) -> &[u32] {
        &self.granted[robot]
    }

    /// How many actions of a robot are granted once its first `deeds` deeds are.
    pub(crate) fn actions_with(&self, robot: usize, deeds: usize) -> usize {
        let last = deeds.checked_sub(1).map(|last| self.granted[robot][last]);
        last.unwrap_or(self.robots[robot].begun) as usize
    }

    /// Lists nothing for now that begins later than `until`, which is this tick. `tracks` are those
    /// it was made of.
    pub(crate) fn limit(&mut self, tracks: &[Track], (until, tick): (Time, u64)) {
        self.limited_until_tick = tick;
        for (robot, track) in tracks.iter().enumerate() {
            let begun = track.deeds.partition_point(|deed| deed.begin() < until);
            self.limits[robot] = if begun < track.deeds.len() {
                self.actions_with(robot, begun) as u32
            } else {
                u32::MAX
            };
        }
    }

    /// Lists everything from now on.
    pub(crate) fn lift_limit(&mut self) {
        self.limits.fill(u32::MAX);
        self.limited_until_tick = 0;
    }

    /// Whether something is not to be listed.
    pub(crate) fn is_limited(&self) -> bool {
        self.limits.iter().any(|&limit| limit != u32::MAX)
    }

    /// How many of a robot's actions may be listed.
    pub(crate) fn listable(&self, robot: usize) -> u32 {
        let part = &self.robots[robot];
        self.limits[robot].min(part.first + part.actions.len() as u32)
    }

    /// What an action waits for.
    pub(crate) fn waits(&self, robot: usize, action: usize) -> &[Wait] {
        let part = &self.robots[robot];
        &part.actions[action - part.first as usize].1
    }

    /// Writes the next actions of each robot, from the last one that is granted to it (so many
    /// are): as many as a message has room for. It is in force already, or nothing that robots
    /// follow has changed.
    pub(crate) fn write(&self, granted: impl Fn(usize) -> u32, out: &mut Schedule) {
        let mut window = MAX_ACTIONS / self.robots.len().max(1);
        while !self.fits(&granted, window, out) {
            window /= 2;
        }
    }

    /// As [`Self::write`], of a script that takes the place of another one.
    pub(crate) fn write_new(&self, granted: impl Fn(usize) -> u32, out: &mut Schedule) {
        self.write(granted, out);
        for (part, listed) in self.robots.iter().zip(&mut out.robots) {
            listed.kept = part.kept;
        }
    }

    fn fits(&self, granted: impl Fn(usize) -> u32, window: usize, out: &mut Schedule) -> bool {
        let (mut actions, mut waits) = (0, 0);
        out.robot_count = self.robots.len() as u32;
        out.listed_until_tick = self.limited_until_tick;
        for (robot, part) in self.robots.iter().enumerate() {
            let first = granted(robot).saturating_sub(1).max(part.first);
            let passed = (first - part.first) as usize;
            let ahead = &part.actions[passed.min(part.actions.len())..];
            let most = self.listable(robot).saturating_sub(first) as usize;
            let listed = &ahead[..ahead.len().min(most).min(window)];
            out.robots[robot] = RobotSchedule {
                first,
                count: listed.len() as u32,
                offset: actions as u32,
                complete: u32::from(listed.len() == ahead.len()),
                kept: u32::MAX,
            };
            for (action, waited) in listed {
                let end = waits + waited.len();
                let Some(room) = out.waits.get_mut(waits..end) else {
                    return false;
                };
                room.copy_from_slice(waited);
                out.actions[actions] = Action {
                    first_wait: waits as u32,
                    waits: waited.len() as u32,
                    ..*action
                };
                (actions, waits) = (actions + 1, end);
            }
        }
        (out.action_count, out.wait_count) = (actions as u32, waits as u32);
        true
    }
}

/// Joins the steps of a robot after those that it keeps: `kept` says how many actions come before,
/// and by deed how many are granted once it is.
fn join(
    scene: &Scene,
    ground: &Ground,
    plan: &Plan,
    robot: usize,
    needs: &[Need],
    waited: &[bool],
    (before, kept): (u32, &[u32]),
) -> Joined {
    let track = &plan.tracks()[robot];
    let mut stops = (track.grips()).map(|grip| ground.stand(grip.object, grip.place));
    let mut joined = Joined {
        kept: before,
        actions: Vec::new(),
        granted: kept.to_vec(),
        first: Vec::new(),
    };
    let mut needs = needs.iter().peekable();
    let mut cell = track.start;
    // Where the robot stands beside the lattice, its next way leads to the lattice first.
    let mut beside = !track.deeds.is_empty() && !is_at(scene, cell, track.from);
    for deed in &track.deeds[..kept.len()] {
        match deed.direction() {
            Some(direction) => {
                cell = cell.wrapping_add_signed(ground.offsets[direction]);
                beside = false;
            }
            None => beside = stops.next().is_some_and(|at| !is_at(scene, cell, at)),
        }
    }
    let can_change = ground.time(patience_s(ground.seconds(plan.makespan())));
    let mut steps = 0;
    let mut heading = None;
    for (deed, done) in track.deeds.iter().enumerate().skip(kept.len()) {
        let mut waits = false;
        while needs.next_if(|need| need.deed as usize == deed).is_some() {
            waits = true;
        }
        match *done {
            Deed::Step(direction, ..) => {
                if std::mem::take(&mut beside) {
                    joined.begin(deed, point(scene.lattice.at(cell)));
                    heading = None;
                }
                cell = cell.wrapping_add_signed(ground.offsets[direction as usize]);
                let to = point(scene.lattice.at(cell));
                let is_early = done.begin() < can_change;
                let most = if is_early { FEW_STEPS } else { MAX_STEPS };
                let goes_on = heading == Some(direction) && !waits && steps < most;
                match joined.actions.last_mut() {
                    Some(action) if goes_on => {
                        action.to = to;
                        steps += 1;
                    }
                    _ => {
                        joined.begin(deed, to);
                        steps = 1;
                    }
                }
                heading = Some(direction);
            }
            Deed::Grasped(object, turn, ..) => {
                let from = stops.next().unwrap_or_else(|| scene.lattice.at(cell));
                beside = joined.stop(deed, scene, cell, from);
                if waits_early(ground, track, deed, can_change) {
                    // The grasp may come to nothing.
                    joined.begin(deed, point(from));
                }
                joined.grip(deed, from, Grip::Grasp, object, turn);
                heading = None;
            }
            Deed::Released(object, _) => {
                let to = stops.next().unwrap_or_else(|| scene.lattice.at(cell));
                beside = joined.stop(deed, scene, cell, to);
                joined.grip(deed, to, Grip::Release, object, 0);
                heading = None;
            }
        }
        if waited[deed] {
            heading = None;
        }
        joined
            .granted
            .push(joined.kept + joined.actions.len() as u32);
    }
    let home = scene.homes[robot];
    let is_still = track.deeds.is_empty();
    let stays = is_still && (track.is_gone || (track.from - home).norm() <= CONTACT_M);
    if !stays && !track.is_cut_off && cell == plan.home(robot) {
        if is_still && !is_at(scene, cell, track.from) {
            joined.begin(0, point(scene.lattice.at(cell)));
        }
        joined.stop(track.deeds.len(), scene, cell, home);
    }
    joined
        .granted
        .push(joined.kept + joined.actions.len() as u32);
    joined
}

/// Whether a robot waits for long from some time before `until` on, before it grasps with this deed.
fn waits_early(ground: &Ground, track: &Track, deed: usize, until: Time) -> bool {
    let arrived = (deed.checked_sub(1)).map_or(0, |last| track.deeds[last].end());
    let begun = track.deeds[deed].end().saturating_sub(ground.grasp);
    arrived < until && begun > arrived + ground.time(LONG_WAIT_S)
}

/// Whether actions lead to the same places after the same waits.
fn is_alike(some: &[(Action, Vec<Wait>)], others: &[(Action, Vec<Wait>)]) -> bool {
    let place = |(action, waits): &(Action, Vec<Wait>)| (action.to, action.grip, waits.clone());
    some.iter().map(place).eq(others.iter().map(place))
}

fn is_at(scene: &Scene, cell: u32, at: Vec2) -> bool {
    (scene.lattice.at(cell) - at).norm() <= CONTACT_M
}

impl Part {
    /// Nothing to do where a robot stands. What was granted to it last is listed as done: no grip
    /// is due any more.
    fn standing(robot: &RobotAt) -> Self {
        let last = robot
            .is_live
            .then(|| robot.actions.checked_sub(1))
            .flatten();
        Self {
            first: last.unwrap_or(robot.actions),
            begun: robot.actions,
            kept: robot.actions,
            actions: (last.iter().map(|_| (moving(point(robot.at)), Vec::new()))).collect(),
        }
    }
}

/// An action that does not grip.
fn moving(to: shm_types::Point) -> Action {
    Action {
        to,
        grip: Grip::Keep.code(),
        object: NONE,
        turn: 0,
        first_wait: 0,
        waits: 0,
        reserved: 0,
    }
}

impl Joined {
    fn begin(&mut self, deed: usize, to: shm_types::Point) {
        self.first.push(deed as u32);
        self.actions.push(moving(to));
    }

    /// The last piece of way to a stop beside the lattice, if it is one.
    fn stop(&mut self, deed: usize, scene: &Scene, cell: u32, at: Vec2) -> bool {
        let beside = !is_at(scene, cell, at);
        if beside {
            self.begin(deed, point(at));
        }
        beside
    }

    /// The grip at the end of the last action, or, if there is none or it grips already, of one
    /// without motion.
    fn grip(&mut self, deed: usize, at: Vec2, grip: Grip, object: u32, turn: u32) {
        let keeps = |action: &&mut Action| action.grip == Grip::Keep.code();
        if self.actions.last_mut().filter(keeps).is_none() {
            self.begin(deed, point(at));
        }
        if let Some(action) = self.actions.last_mut() {
            (action.grip, action.object, action.turn) = (grip.code(), object, turn);
        }
    }
}
