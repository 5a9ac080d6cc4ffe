//! What robots keep of a plan that is made anew while they follow it.
//!
//! Responsible for: how much each robot keeps, so that it can be carried out to its end whatever
//! comes after.
//! Not responsible for: planning what comes after (`solver`), publishing it (`publish`).
//!
//! How: each robot keeps what it will have got to by the time the new plan is out, which is all that
//! was listed for it, up to the end of an action, and up to the release if it holds something
//! then. Whatever that waits for is kept as well. So what is kept waits for nothing else, and
//! leaves robots parked where nothing kept needs to pass: it is a plan of its own.

use shm_types::Wait;

use crate::anytime::ground::Time;
use crate::anytime::publish::Script;
use crate::anytime::track::{Deed, Track};

/// By robot, how many deeds it keeps if everything that begins before `until` is to stay as it is.
pub(crate) fn kept(script: &Script, tracks: &[Track], until: Time) -> Vec<usize> {
    let mut kept = vec![0; tracks.len()];
    let begun = |track: &Track| track.deeds.partition_point(|deed| deed.begin() < until);
    let mut open: Vec<(usize, usize)> = tracks.iter().map(begun).enumerate().collect();
    while let Some((robot, least)) = open.pop() {
        let track = &tracks[robot];
        let granted = script.granted(robot);
        let end = end_of_action(track, granted, least);
        let before = kept[robot];
        if before >= end {
            continue;
        }
        kept[robot] = end;
        let actions = script.actions_with(robot, before)..granted[end - 1] as usize;
        for wait in actions.flat_map(|action| script.waits(robot, action)) {
            open.push((wait.robot as usize, deeds_for(script, *wait)));
        }
        // An object that others have moved before must have been put down.
        for deed in &track.deeds[before..end] {
            if let Deed::Grasped(object, turn, ..) = *deed {
                open.extend(put_down(tracks, object, turn));
            }
        }
    }
    kept
}

/// How many deeds of a robot are kept if at least `least` are: to the end of an action in which it
/// holds nothing.
fn end_of_action(track: &Track, granted: &[u32], least: usize) -> usize {
    let mut holds = false;
    for (deed, done) in track.deeds.iter().enumerate() {
        let ends_before = deed == 0 || granted[deed] > granted[deed - 1];
        if deed >= least && !holds && ends_before {
            return deed;
        }
        match done {
            Deed::Step(..) => {}
            Deed::Grasped(..) => holds = true,
            Deed::Released(..) => holds = false,
        }
    }
    track.deeds.len()
}

/// How many deeds a robot has to keep for what waits for it.
fn deeds_for(script: &Script, wait: Wait) -> usize {
    let granted = script.granted(wait.robot as usize);
    let deeds = &granted[..granted.len() - 1];
    deeds
        .partition_point(|&count| count < wait.actions)
        .saturating_add(1)
        .min(deeds.len())
}

/// Whoever moves an object just before its move of this turn, and how many deeds that takes; none
/// if nobody does in this plan.
fn put_down(tracks: &[Track], object: u32, turn: u32) -> Option<(usize, usize)> {
    let before = turn.checked_sub(1)?;
    tracks.iter().enumerate().find_map(|(robot, track)| {
        let is_it =
            |deed: &Deed| matches!(*deed, Deed::Grasped(o, t, ..) if (o, t) == (object, before));
        let grasped = track.deeds.iter().position(is_it)?;
        let carried = track.deeds[grasped..].iter();
        let released = carried.take_while(|deed| !matches!(deed, Deed::Released(..)));
        Some((robot, grasped + released.count() + 1))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anytime::solver::testing::{planned, written};

    #[test]
    fn what_is_kept_is_all_that_is_listed_waits_for_nothing_else_and_ends_with_free_hands() {
        let (mut waited, mut moved_again) = (0, 0);
        for seed in 0..6 {
            let options = scene::GenerateOptions {
                seed,
                crowding: 0.8,
                extra_moves: 2,
                ..scene::GenerateOptions::default()
            };
            let (scene, mut solver, makespan) = planned(&options);
            let mut script = written(&scene, &mut solver);
            let tracks = solver.plan.tracks();
            for share in 0..10 {
                let until = makespan / 10 * share;
                script.limit(tracks, (until, 0));
                let kept = kept(&script, tracks, until);
                let actions = |robot: usize| script.actions_with(robot, kept[robot]);
                for (robot, track) in tracks.iter().enumerate() {
                    let grips = track.deeds[..kept[robot]]
                        .iter()
                        .filter(|deed| deed.direction().is_none());
                    assert_eq!(grips.count() % 2, 0, "{seed}: {robot} holds something");
                    let is_all = kept[robot] == track.deeds.len();
                    assert!(is_all || script.listable(robot) as usize <= actions(robot));
                    for deed in &track.deeds[..kept[robot]] {
                        moved_again += assert_put_down(tracks, &kept, *deed);
                    }
                    for action in 0..actions(robot) {
                        for wait in script.waits(robot, action) {
                            waited += 1;
                            let other = wait.robot as usize;
                            let (actions, kept) = (actions(other), kept[other]);
                            assert!(
                                wait.actions as usize <= actions
                                    || kept == tracks[other].deeds.len(),
                                "{seed}: {robot} waits for {wait:?}, {actions} are kept"
                            );
                        }
                    }
                }
            }
        }
        assert!(waited > 0 && moved_again > 0);
    }

    /// An object that is grasped again has been put down by what is kept; whether it is one.
    fn assert_put_down(tracks: &[Track], kept: &[usize], deed: Deed) -> usize {
        let Deed::Grasped(object, turn, ..) = deed else {
            return 0;
        };
        let Some((robot, deeds)) = put_down(tracks, object, turn) else {
            assert_eq!(turn, 0);
            return 0;
        };
        let before = &tracks[robot].deeds[..deeds];
        let grasped = |deed: &&Deed| matches!(**deed, Deed::Grasped(of, ..) if of == object);
        let last = before.iter().rev().find(grasped);
        assert!(matches!(last, Some(Deed::Grasped(_, past, ..)) if past + 1 == turn));
        assert!(matches!(before.last(), Some(Deed::Released(of, _)) if *of == object));
        assert!(kept[robot] >= deeds);
        1
    }
}
