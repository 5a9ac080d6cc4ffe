//! What would leave an infeasible scene without a proof against it.
//!
//! Responsible for: a smallest set of objects to take out of the room, and a largest set of
//! objects that can be delivered while the others only stay in the room, as clutter.
//! Not responsible for: whether what is left can be solved; only that nothing here proves the
//! contrary.

use scene::{Draft, Scene};

use crate::proof::Proof;
use crate::store::Store;

/// Most objects of which every set is tried; with more, objects are chosen one by one.
pub const MOST_TRIED: usize = 12;

/// What to do about an infeasible scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Repair {
    /// Objects to take away.
    pub take_away: Vec<usize>,
    /// Objects that can be delivered if none is taken away.
    pub deliver: Vec<usize>,
    /// Whether no smaller and no larger set would do; otherwise only no part of the one, and not
    /// one more in the other.
    pub is_exact: bool,
}

impl Repair {
    /// For an infeasible scene; `searches` is the limit of each store. None if even an empty room
    /// has a proof against it.
    #[must_use]
    pub fn of(scene: &Scene, searches: u64) -> Option<Self> {
        let objects: Vec<_> = (0..scene.objects.len()).collect();
        let has_goal = |object: &usize| scene.objects[*object].goal.is_some();
        let tasks: Vec<_> = objects.iter().copied().filter(has_goal).collect();
        let is_exact = objects.len() <= MOST_TRIED;
        let helps = |change: fn(&Scene, &[usize]) -> Draft| {
            move |chosen: &[usize]| {
                let changed = Scene::new(change(scene, chosen)).ok();
                changed.is_some_and(|room| Proof::of(&room, &Store::of(&room, searches)).is_none())
            }
        };
        let take_away = least(&objects, is_exact, helps(without))?;
        let given_up = least(&tasks, is_exact, helps(without_goals))?;
        Some(Self {
            take_away,
            deliver: tasks
                .into_iter()
                .filter(|task| !given_up.contains(task))
                .collect(),
            is_exact,
        })
    }
}

/// A smallest set of `items` that helps; if not `is_exact`, one of which no part does when left
/// out one by one. Adding to a set that helps does no harm.
fn least(items: &[usize], is_exact: bool, helps: impl Fn(&[usize]) -> bool) -> Option<Vec<usize>> {
    if is_exact {
        let mut sets: Vec<u32> = (0..1_u32 << items.len()).collect();
        sets.sort_by_key(|set| set.count_ones());
        let chosen = |set: u32| {
            let is_in = |i: &usize| set >> i & 1 == 1;
            (0..items.len())
                .filter(is_in)
                .map(|i| items[i])
                .collect::<Vec<_>>()
        };
        return sets.into_iter().map(chosen).find(|chosen| helps(chosen));
    }
    let mut chosen = items.to_vec();
    if !helps(&chosen) {
        return None;
    }
    for item in items {
        let fewer: Vec<_> = chosen
            .iter()
            .copied()
            .filter(|other| other != item)
            .collect();
        if helps(&fewer) {
            chosen = fewer;
        }
    }
    Some(chosen)
}

/// The scenario without these objects; the user's lines about them go with them.
fn without(scene: &Scene, objects: &[usize]) -> Draft {
    let mut draft = without_lines(scene, objects);
    let number = |object: usize| object - objects.iter().filter(|gone| **gone < object).count();
    for order in &mut draft.before {
        order.first.0 = number(order.first.0);
        order.then.0 = number(order.then.0);
    }
    let mut index = 0;
    draft.objects.retain(|_| {
        index += 1;
        !objects.contains(&(index - 1))
    });
    draft
}

/// The scenario in which these objects need not go anywhere.
fn without_goals(scene: &Scene, objects: &[usize]) -> Draft {
    let mut draft = without_lines(scene, objects);
    for &object in objects {
        draft.objects[object].goal = None;
    }
    draft
}

fn without_lines(scene: &Scene, objects: &[usize]) -> Draft {
    let mut draft = scene.draft().clone();
    draft.certificate.clear();
    let is_about = |task: usize| objects.contains(&task);
    draft
        .before
        .retain(|order| !is_about(order.first.0) && !is_about(order.then.0));
    draft
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sets that hit each of these pairs.
    fn hits(chosen: &[usize]) -> bool {
        [[0, 1], [1, 2], [1, 3]]
            .iter()
            .all(|pair| pair.iter().any(|item| chosen.contains(item)))
    }

    #[test]
    fn the_least_set_is_found_and_the_greedy_one_has_no_part_to_spare() {
        assert_eq!(least(&[0, 1, 2, 3], true, hits), Some(vec![1]));
        assert_eq!(least(&[0, 1, 2, 3], false, hits), Some(vec![1]));
        assert_eq!(least(&[1, 0, 2, 3], false, hits), Some(vec![0, 2, 3]));
        assert_eq!(least(&[0, 1], true, |_| false), None);
        assert_eq!(least(&[0, 1], false, |_| false), None);
    }
}
