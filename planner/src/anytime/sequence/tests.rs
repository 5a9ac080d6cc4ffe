//! What sequences have to be: legal, and found where there is one.

use scene::{
    Draft, GenerateOptions, Move, ObjectDraft, Settings, WallDraft, check_certificate, generate,
};

use super::*;
use crate::anytime::situation::Situation;
use crate::anytime::track::Start;

/// Floods that are certainly enough to lead four objects.
const MANY: u64 = 1_000;

struct Room {
    scene: Scene,
    ground: Ground,
    sequencer: Sequencer,
    start: Vec<Rc<Place>>,
}

fn room(scene: Scene) -> Room {
    let situation = Situation::at_start(&scene);
    let ground = Ground::new(&scene, &Settings::default(), Vec::new());
    let start = Start::new(&scene, &ground, &situation).unwrap();
    let homes: Vec<u32> = start.robots.iter().map(|track| track.free.0).collect();
    let goals: Vec<Option<Rc<Place>>> = (scene.objects.iter().enumerate())
        .map(|(object, spec)| Some(Place::of(&scene, &ground, object, spec.goal?)))
        .collect();
    let sequencer = Sequencer::new(&scene, &ground, &homes, &goals);
    let start = start.objects.into_iter().map(|(place, _)| place).collect();
    Room {
        scene,
        ground,
        sequencer,
        start,
    }
}

/// Rooms with one robot that were scrambled by legal moves, some objects more than once.
fn generated(
    seeds: std::ops::Range<u64>,
    objects: usize,
    area_m2: f64,
) -> impl Iterator<Item = (u64, Room)> {
    let options = move |seed| GenerateOptions {
        seed,
        objects,
        robots: 1,
        area_m2,
        walls: objects / 2,
        crowding: 0.6,
        extra_moves: 4,
    };
    // Some seeds make no room.
    seeds.filter_map(move |seed| Some((seed, room(generate(&options(seed)).ok()?.scene))))
}

impl Room {
    /// What an attempt finds.
    fn find(&mut self, attempt: u64) -> Option<Vec<Step>> {
        let (scene, ground) = (&self.scene, &self.ground);
        self.sequencer.find(scene, ground, &self.start, attempt)
    }

    /// Holds steps against somebody else's idea of what is legal.
    fn assert_solved_by(&self, steps: &[Step]) {
        let mut at: Vec<scene::Vec2> = self.start.iter().map(|place| place.at).collect();
        let moves: Vec<Move> = (steps.iter())
            .map(|(object, to)| {
                let from = std::mem::replace(&mut at[*object], to.at);
                Move {
                    object: *object,
                    from: [from.x, from.y],
                    to: [to.at.x, to.at.y],
                }
            })
            .collect();
        check_certificate(&self.scene, &moves).unwrap();
    }
}

fn is_set_aside(steps: &[Step]) -> bool {
    let mut moved: Vec<usize> = steps.iter().map(|step| step.0).collect();
    moved.sort_unstable();
    moved.windows(2).any(|pair| pair[0] == pair[1])
}

#[test]
fn by_perturbing_a_legal_sequence_is_found_for_every_room_that_was_scrambled_by_legal_moves() {
    let mut set_aside = 0;
    let small = generated(50_000..50_010, 4, 20.0);
    for (seed, mut room) in small.chain(generated(50_010..50_020, 7, 35.0)) {
        let steps = (1..40).find_map(|attempt| room.find(attempt));
        let steps = steps.unwrap_or_else(|| panic!("seed {seed} is not solved"));
        room.assert_solved_by(&steps);
        set_aside += usize::from(is_set_aside(&steps));
    }
    assert!(set_aside > 2, "only {set_aside} need that");
}

/// One room, divided by a wall with a doorway. An object stands in it, where it is to stay, and
/// leaves a robot just enough room to pass without the other object.
fn doorway() -> Room {
    let mut draft = Draft::room("doorway", [0.0, 0.0, 6.0, 3.0]);
    draft.walls = vec![
        WallDraft::Box([3.0, 0.0, 3.2, 1.0]),
        WallDraft::Box([3.0, 2.0, 3.2, 3.0]),
    ];
    draft.homes = vec![[0.5, 0.5]];
    draft.objects = vec![
        ObjectDraft::paper([1.0, 1.5], Some([5.0, 1.5])),
        ObjectDraft::paper([3.1, 1.8], Some([3.1, 1.8])),
    ];
    room(Scene::new(draft).unwrap())
}

#[test]
fn what_stands_at_its_goal_is_set_aside_and_brought_back() {
    for attempt in [0, 1] {
        let mut room = doorway();
        let steps = room.find(attempt).unwrap();
        room.assert_solved_by(&steps);
        let moved: Vec<usize> = steps.iter().map(|step| step.0).collect();
        assert_eq!(moved, [1, 0, 1]);
    }
}

/// Whether some order of single moves leads there, tried one after the other.
fn leads(room: &mut Room, places: &mut Vec<Rc<Place>>, to: &[Rc<Place>]) -> bool {
    let left: Vec<usize> = (0..to.len())
        .filter(|&object| !is_same(&places[object], &to[object]))
        .collect();
    left.is_empty()
        || left.into_iter().any(|object| {
            let Room {
                sequencer, ground, ..
            } = room;
            if !sequencer.can_move(ground, places, object, &to[object]) {
                return false;
            }
            let from = std::mem::replace(&mut places[object], Rc::clone(&to[object]));
            let leads = leads(room, places, to);
            places[object] = from;
            leads
        })
}

#[test]
fn one_move_each_is_found_enough_exactly_where_some_order_of_them_is() {
    let mut found = [0, 0];
    for (seed, mut room) in generated(51_000..51_060, 4, 14.0) {
        let goals: Vec<Rc<Place>> = room.sequencer.goals.iter().flatten().cloned().collect();
        let mut start = room.start.clone();
        let expected = leads(&mut room, &mut start, &goals);
        let before = room.sequencer.floods;
        let (steps, is_there) = room.sequencer.lead(&room.ground, &start, &goals);
        let took = room.sequencer.floods - before;
        assert!(took < MANY);
        assert_eq!(is_there, expected, "seed {seed}, {took} floods");
        if is_there {
            room.assert_solved_by(&steps);
        }
        found[usize::from(is_there)] += 1;
    }
    assert!(found.iter().all(|&count| count > 5), "{found:?}");
}

#[test]
fn attempts_end_and_are_charged_where_nothing_can_be_grasped() {
    let mut room = doorway();
    let goals = room.sequencer.goals.iter_mut().flatten();
    for place in room.start.iter_mut().chain(goals) {
        *place = Place::out_of_reach(&room.ground, place.at);
    }
    for attempt in 1..20 {
        let before = room.sequencer.cells;
        assert!(room.find(attempt).is_none());
        assert!(room.sequencer.cells > before);
    }
}

#[test]
fn every_flood_is_counted() {
    let mut room = doorway();
    let (from, to) = (room.start[0].grasp, room.start[1].grasp);
    let Room {
        ground,
        sequencer,
        start,
        ..
    } = &mut room;
    sequencer.finds(ground, 0, from, to);
    assert_eq!(sequencer.floods, 1);
    sequencer.reaches(ground, 0, &[from], &[to]);
    assert_eq!(sequencer.floods, 2);
    sequencer.cheapest(ground, start, 0, 0, &[from], to, &mut Vec::new());
    assert_eq!(sequencer.floods, 3);
}
