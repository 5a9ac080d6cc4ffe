//! Which step of a plan waits for which.
//!
//! Responsible for: who is first where two robots need the same space, and in the user's own order.
//! Not responsible for: actions (the parent module).

use scene::{Event, UserOrder};

use crate::anytime::ground::Ground;
use crate::anytime::plan::Plan;
use crate::anytime::route::sides;
use crate::anytime::track::{Deed, Track};

/// What one step waits for.
pub(super) struct Need {
    /// The robot's deed that waits.
    pub(super) deed: u32,
    /// Whom it waits for, and that one's deed.
    pub(super) robot: u32,
    pub(super) until: u32,
}

/// Whom each step of a robot waits for: only what the steps before have not waited for already.
pub(super) fn needs_of(ground: &Ground, plan: &Plan, robot: u32, track: &Track) -> Vec<Need> {
    let robots = plan.tracks().len();
    let mut waited_for = vec![None; robots];
    let mut needs = Vec::new();
    let mut class = 0;
    let mut cell = track.start;
    for (deed, done) in track.deeds.iter().enumerate() {
        let (direction, depart) = match *done {
            Deed::Step(direction, depart, _) => (direction as usize, depart),
            Deed::Grasped(object, .., by) => {
                class = ground.carrying(object as usize, by);
                continue;
            }
            Deed::Released(..) => {
                class = 0;
                continue;
            }
        };
        let next = cell.wrapping_add_signed(ground.offsets[direction]);
        if deed < track.kept {
            cell = next;
            continue;
        }
        let mut look = |class: usize, at: u32| {
            for busy in plan.timeline().busy(class, at) {
                let other = busy.owner as usize;
                // Who is there before leaves it in time, or at the same time and the same way.
                if busy.owner != robot && other < robots && busy.from <= depart {
                    let before: &mut Option<u32> = &mut waited_for[other];
                    if before.is_none_or(|before| before < busy.step) {
                        *before = Some(busy.step);
                        needs.push(Need {
                            deed: deed as u32,
                            robot: busy.owner,
                            until: busy.step,
                        });
                    }
                }
            }
        };
        look(class, next);
        for side in sides(ground, cell, direction).into_iter().flatten() {
            look(class, side);
        }
        if let Some(Deed::Grasped(object, .., by)) = track.deeds.get(deed + 1) {
            look(ground.carrying(*object as usize, *by), next);
        }
        cell = next;
    }
    needs
}

/// What comes second in the user's order waits for what its robot does after what comes first.
pub(super) fn add_user_order(plan: &Plan, order: UserOrder, needs: &mut [Vec<Need>]) {
    let (Some(first), Some(then)) = (find(plan, order.first), find(plan, order.then)) else {
        return;
    };
    if first.0 == then.0 || then.1 < plan.tracks()[then.0].kept {
        return;
    }
    let need = Need {
        // The step that leads there.
        deed: then.1.saturating_sub(1) as u32,
        robot: first.0 as u32,
        until: first.1 as u32 + 1,
    };
    let list = &mut needs[then.0];
    let place = list.partition_point(|other| other.deed <= need.deed);
    list.insert(place, need);
}

/// The robot and the deed that are an event of an object: its first grasp, its last release.
fn find(plan: &Plan, (object, event): (usize, Event)) -> Option<(usize, usize)> {
    let deeds = (plan.tracks().iter().enumerate()).flat_map(|(robot, track)| {
        let deeds = track.deeds.iter().enumerate();
        deeds.map(move |(number, deed)| (robot, number, *deed))
    });
    let found = deeds.filter_map(|(robot, number, deed)| match deed {
        Deed::Grasped(of, _, time, _) if event != Event::Finish && of as usize == object => {
            Some((time, robot, number))
        }
        Deed::Released(of, time) if event == Event::Finish && of as usize == object => {
            Some((time, robot, number))
        }
        _ => None,
    });
    let found = match event {
        Event::Start | Event::Grasp => found.min(),
        Event::Finish => found.max(),
    };
    found.map(|(_, robot, number)| (robot, number))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anytime::ground::Time;
    use crate::anytime::solver::testing::planned;

    /// Where a robot is after a deed: its cell and class, from when to when, and the deed with
    /// which it leaves.
    struct Stay {
        cell: u32,
        class: usize,
        from: Time,
        until: Time,
        leaves: usize,
    }

    fn stays(ground: &Ground, track: &Track) -> Vec<Stay> {
        let (mut cell, mut class, mut from) = (track.start, 0, 0);
        let mut stays = Vec::new();
        for (number, deed) in track.deeds.iter().enumerate() {
            let until = deed.end();
            stays.push(Stay {
                cell,
                class,
                from,
                until,
                leaves: number,
            });
            match *deed {
                Deed::Step(direction, depart, _) => {
                    cell = cell.wrapping_add_signed(ground.offsets[direction as usize]);
                    from = depart;
                }
                Deed::Grasped(object, _, _, by) => {
                    class = ground.carrying(object as usize, by);
                    from = until - ground.grasp;
                }
                Deed::Released(..) => {
                    class = 0;
                    from = until;
                }
            }
        }
        stays
    }

    #[test]
    fn whoever_comes_second_waits_until_the_first_has_left() {
        let mut waited = 0;
        for seed in 0..6 {
            let options = scene::GenerateOptions {
                seed,
                crowding: 0.8,
                ..scene::GenerateOptions::default()
            };
            let (scene, mut solver, _) = planned(&options);
            for _ in 0..5 {
                solver.improve(&scene);
                solver.restore().unwrap();
                waited += assert_in_turn(&solver.ground, &solver.plan);
            }
        }
        assert!(waited > 0, "they never meet");
    }

    /// Robots meet nobody, and whoever comes second waits for the first; how often.
    fn assert_in_turn(ground: &Ground, plan: &Plan) -> usize {
        let mut waited = 0;
        let tracks = plan.tracks();
        let all: Vec<Vec<Stay>> = tracks.iter().map(|track| stays(ground, track)).collect();
        for (robot, track) in tracks.iter().enumerate() {
            let needs = needs_of(ground, plan, robot as u32, track);
            for (other, mine, theirs) in pairs(&all, robot) {
                let meet = ground.meet(mine.class, mine.cell, theirs.class, theirs.cell);
                if !meet || mine.until <= theirs.from {
                    continue;
                }
                assert!(theirs.until <= mine.from, "{robot} meets {other}");
                let waits = |need: &Need| {
                    need.robot as usize == other
                        && (need.deed as usize) < mine.leaves
                        && need.until as usize >= theirs.leaves
                };
                assert!(needs.iter().any(waits), "{robot} passes before {other}");
                waited += 1;
            }
        }
        waited
    }

    /// Each stay of a robot with each of any other one, and that one's number.
    fn pairs(all: &[Vec<Stay>], robot: usize) -> impl Iterator<Item = (usize, &Stay, &Stay)> {
        let others = all
            .iter()
            .enumerate()
            .filter(move |(other, _)| *other != robot);
        others.flat_map(move |(other, theirs)| {
            let mine = all[robot].iter();
            mine.flat_map(move |mine| theirs.iter().map(move |theirs| (other, mine, theirs)))
        })
    }
}
