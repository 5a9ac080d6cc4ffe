//! What a trial is cut down to, and what processes started anew make of a run.

use scene::{Draft, Event, ObjectDraft, UserOrder};

use super::*;

/// Three objects beside one another, with the user's lines that each is finished before the next.
fn room() -> Scene {
    let mut draft = Draft::room("room", [0.0, 0.0, 6.0, 4.0]);
    draft.homes = vec![[0.5, 0.5], [5.5, 0.5]];
    draft.objects = [1.0, 3.0, 5.0]
        .map(|x| ObjectDraft::paper([x, 2.0], Some([x, 3.0])))
        .to_vec();
    draft.before = [(0, 1), (1, 2)]
        .map(|(first, then)| UserOrder {
            first: (first, Event::Finish),
            then: (then, Event::Grasp),
        })
        .to_vec();
    Scene::new(draft).unwrap()
}

#[test]
fn what_is_cut_down_keeps_what_is_said_of_the_rest() {
    let scene = room();
    let cut = |robots, objects| cut_down(&scene, Cut { robots, objects }).unwrap();
    let two = cut(None, Some(2));
    assert_eq!((two.homes.len(), two.objects.len()), (2, 2));
    assert_eq!(two.before, scene.before[..1]);
    let one = cut(Some(1), Some(1));
    assert_eq!((one.homes.len(), one.objects.len()), (1, 1));
    assert!(one.before.is_empty());
    assert_eq!(cut(Some(1), None).before, scene.before);
}

#[test]
fn processes_started_anew_solve_what_can_be_solved() {
    let trial = Trial::of(&room(), 0, Cut::default(), Some(Method::Anytime)).unwrap();
    assert_eq!(trial.undisturbed.outcome, Outcome::Solved);
    let mut saved = Saved::default();
    saved.keep(&World::new(&trial.scene, trial.settings.clone(), 0));
    assert!(trial.is_solved_from(&saved));
    // Nobody is there to do it.
    let nothing = Saved::default();
    assert!(!trial.is_solved_from(&nothing));
}
