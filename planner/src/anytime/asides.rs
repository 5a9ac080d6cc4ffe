//! Objects set aside though nobody has to: what is in the way of others makes way for them.
//!
//! Responsible for: orders with one intermediate place more, one less, or another one.
//! Not responsible for: whether such an order can be carried out, and how long that takes (`plan`).
//!
//! How: each move's shortest ways among the walls are laid through the objects as they stand when
//! its turn comes. An object that is on one of them is *blamed*. One that is blamed often goes to
//! a place that is a small detour for it and on few of those ways.

use std::rc::Rc;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use scene::{ROBOT_ALONE, Scene};

use crate::anytime::ground::{Field, Ground, Time, duration};
use crate::anytime::order::{Hop, Hops, Item};
use crate::anytime::sequence::Step;
use crate::anytime::track::{Place, Rest, Start};
use crate::frontier::NOWHERE;

/// Lattice points looked at for an intermediate place.
const POINTS_LOOKED_AT: usize = 48;
/// Of these, how many become places that are looked at closely.
const PLACES_LOOKED_AT: usize = 5;
/// Ways to put the new move in an order, of which the shortest is taken.
pub(crate) const ORDERS_LOOKED_AT: usize = 24;

/// A shortest way among the walls, and as which class.
struct Way {
    class: usize,
    cells: Vec<u32>,
}

/// An object is on the way of a move.
struct Blame {
    object: usize,
    /// The move, by its place in the order.
    at: usize,
    /// Whether the object has been moved by then.
    has_moved: bool,
}

/// All that is known of an order's ways.
struct Ways {
    /// By place in the order.
    ways: Vec<[Way; 2]>,
    blames: Vec<Blame>,
}

/// An order like another one but for one intermediate place, and its moves; none if nobody is in
/// anybody's way, or no such place was found.
pub(crate) fn vary(
    scene: &Scene,
    ground: &mut Ground,
    start: &Start,
    homes: &[u32],
    (hops, order): (&Hops, &[Item]),
    random: &mut ChaCha8Rng,
) -> Option<(Hops, Vec<Item>)> {
    let rests = start.rests();
    let ways = ways_of(ground, start, &rests, (hops, order));
    if ways.blames.is_empty() {
        return None;
    }
    let blame = &ways.blames[random.random_range(0..ways.blames.len())];
    let object = blame.object;
    let (first, end) = hops.of[object];
    if first == end && scene.objects[object].goal.is_some() {
        // It is where it should be, and is to stay there.
        return None;
    }
    let of_object = |item: &Item| item.0 == object as u32;
    let mut sequence: Vec<Step> = (hops.list.iter())
        .map(|hop| (hop.object, Rc::clone(&hop.to)))
        .collect();
    if end > first + 1 && random.random_range(0..3) == 0 {
        // One place less.
        let gone = random.random_range(first..end - 1);
        sequence.remove(gone);
        let turn = random.random_range(0..end - first);
        let mut shorter = order.to_vec();
        let item = (0..order.len())
            .filter(|&place| of_object(&order[place]))
            .nth(turn)?;
        shorter.remove(item);
        return Some((Hops::new(scene, ground, start, homes, &sequence)?, shorter));
    }
    let place = place_for(scene, ground, &rests, hops, &ways, blame, random)?;
    if end > first + 1 && random.random_range(0..2) == 0 {
        // Another place.
        sequence[random.random_range(first..end - 1)].1 = place;
        let hops = Hops::new(scene, ground, start, homes, &sequence)?;
        return Some((hops, order.to_vec()));
    }
    let number = if end == first { sequence.len() } else { first };
    sequence.insert(number, (object, place));
    let longer = Hops::new(scene, ground, start, homes, &sequence)?;
    let mut best: Option<(Time, Vec<Item>)> = None;
    for _ in 0..ORDERS_LOOKED_AT {
        let mut tried = order.to_vec();
        let robot = random.random_range(0..homes.len()) as u32;
        // Out of the way before the move that it hinders, or on to its goal after that.
        let at = if blame.has_moved {
            random.random_range(blame.at + 1..=order.len())
        } else {
            random.random_range(0..=blame.at)
        };
        tried.insert(at, (object as u32, robot));
        if let Some(least) = longer.least(&tried)
            && best.as_ref().is_none_or(|(known, _)| least < *known)
        {
            best = Some((least, tried));
        }
    }
    best.map(|(_, order)| (longer, order))
}

/// The shortest ways of all moves of an order, and who is on them.
fn ways_of(
    ground: &mut Ground,
    start: &Start,
    rests: &[Rest],
    (hops, order): (&Hops, &[Item]),
) -> Ways {
    let mut places: Vec<Rc<Place>> = rests.iter().map(|rest| Rc::clone(&rest.place)).collect();
    let mut cells: Vec<u32> = start.robots.iter().map(|track| track.free.0).collect();
    let mut next: Vec<usize> = hops.of.iter().map(|&(first, _)| first).collect();
    let mut found = Ways {
        ways: Vec::new(),
        blames: Vec::new(),
    };
    for (at, &(object, robot)) in order.iter().enumerate() {
        let (object, robot) = (object as usize, robot as usize);
        let Hop { from, to, .. } = &hops.list[next[object]];
        let carrying = ground.carrying(object, to.by);
        let alone = ROBOT_ALONE.0;
        let to_grasp = ground.field(alone, from.grasp);
        let to_goal = ground.field(carrying, to.grasp);
        let ways = [
            trace(ground, alone, &to_grasp, cells[robot]),
            trace(ground, carrying, &to_goal, from.grasp),
        ];
        for (other, place) in places.iter().enumerate() {
            let is_on = |way: &Way| place.closes_any(way.class, &way.cells);
            if other != object && place.is_open() && ways.iter().any(is_on) {
                found.blames.push(Blame {
                    object: other,
                    at,
                    has_moved: next[other] > hops.of[other].0,
                });
            }
        }
        found.ways.push(ways);
        cells[robot] = to.grasp;
        places[object] = Rc::clone(to);
        next[object] += 1;
    }
    found
}

/// A shortest way down a field.
fn trace(ground: &Ground, class: usize, field: &Field, mut cell: u32) -> Way {
    let mut cells = vec![cell];
    while let Some(left) = field.time(cell).filter(|&left| left > 0) {
        let steps = ground.walls(class).steps(cell);
        let next = (0..8)
            .filter(|direction| steps >> direction & 1 == 1)
            .map(|direction| {
                (
                    direction,
                    cell.wrapping_add_signed(ground.offsets[direction]),
                )
            })
            .find(|&(direction, next)| {
                (field.time(next)).is_some_and(|then| then + duration(direction) == left)
            });
        let Some((_, next)) = next else { break };
        cell = next;
        cells.push(cell);
    }
    Way { class, cells }
}

/// A place for an object that is blamed, away from where others start and end.
fn place_for(
    scene: &Scene,
    ground: &mut Ground,
    rests: &[Rest],
    hops: &Hops,
    ways: &Ways,
    blame: &Blame,
    random: &mut ChaCha8Rng,
) -> Option<Rc<Place>> {
    let object = blame.object;
    let (first, end) = hops.of[object];
    let by = match hops.list[first..end].first() {
        Some(hop) => hop.to.by,
        None => rests[object].place.open_by()?,
    };
    let class = ground.carrying(object, by);
    let near = ground.field(class, rests[object].place.held(by).grasp);
    let far = if first < end {
        ground.field(class, hops.list[end - 1].to.grasp)
    } else {
        Field::clone(&near)
    };
    let mut points: Vec<(Time, u32)> = Vec::new();
    for _ in 0..POINTS_LOOKED_AT {
        let cell = random.random_range(0..ground.points()) as u32;
        if let (Some(near), Some(far)) = (near.time(cell), far.time(cell)) {
            points.push((near + far, cell));
        }
    }
    points.sort_unstable();
    let stands = |place: &Place| {
        let clear =
            |other: &Place, class: usize| !other.is_open() || !place.closes(class, other.grasp);
        (0..rests.len())
            .filter(|&other| other != object)
            .all(|other| {
                let moves = &hops.list[hops.of[other].0..hops.of[other].1];
                let ends = moves.first().map(|hop| &hop.from).into_iter();
                let mut ends = ends.chain(moves.last().map(|hop| &hop.to));
                ends.all(|end| clear(end, ground.carrying(other, end.by)))
            })
    };
    // How many of the later ways it would be on, the ways it is to be taken off among them.
    let hinders = |place: &Place| {
        let from = if blame.has_moved { 0 } else { blame.at };
        let until = if blame.has_moved {
            blame.at + 1
        } else {
            ways.ways.len()
        };
        let is_on = |way: &&Way| place.closes_any(way.class, &way.cells);
        ways.ways[from..until]
            .iter()
            .flatten()
            .filter(is_on)
            .count()
    };
    (points.iter())
        .map(|&(_, cell)| {
            let at = scene.lattice.at(cell) - scene.objects[object].grasps[by as usize].offset;
            Place::of(scene, ground, object, at).held(by)
        })
        .filter(|place| place.grasp != NOWHERE && stands(place))
        .take(PLACES_LOOKED_AT)
        .min_by_key(|place| hinders(place))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use scene::GenerateOptions;

    use super::*;
    use crate::anytime::solver::Solver;
    use crate::anytime::solver::testing::{planned, planned_for};

    fn varied(
        scene: &Scene,
        solver: &mut Solver,
        near: (&Hops, &[Item]),
        random: &mut ChaCha8Rng,
    ) -> Option<(Hops, Vec<Item>)> {
        let (ground, start) = (&mut solver.ground, &solver.start);
        vary(scene, ground, start, &solver.homes, near, random)
    }

    #[test]
    fn what_is_varied_still_leads_every_object_from_its_start_to_its_goal() {
        let mut is_longer = false;
        for seed in 0..4 {
            let options = GenerateOptions {
                seed,
                crowding: 0.8,
                ..GenerateOptions::default()
            };
            let (scene, mut solver, _) = planned(&options);
            let (mut hops, mut order) = solver.current.clone().unwrap();
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            for _ in 0..20 {
                let varied = varied(&scene, &mut solver, (&hops, &order), &mut random);
                let Some((found, items)) = varied else {
                    continue;
                };
                for (object, &(first, end)) in found.of.iter().enumerate() {
                    let made = items.iter().filter(|item| item.0 == object as u32).count();
                    assert_eq!(made, end - first, "seed {seed}");
                    let mut at = scene.objects[object].start;
                    for hop in &found.list[first..end] {
                        assert_eq!((hop.object, hop.from.at), (object, at));
                        at = hop.to.at;
                    }
                    let (before, until) = hops.of[object];
                    let last = hops.list[before..until].last();
                    assert!(last.is_none_or(|last| last.to.at == at), "seed {seed}");
                }
                is_longer |= items.len() > order.len();
                (hops, order) = (Rc::new(found), items);
            }
        }
        assert!(is_longer, "something was set aside");
    }

    /// Objects that can be held from below and from above, and stand so near a wall, at their start or
    /// at their goal, that nobody has room on one side.
    const AT_WALLS: &str = r#"
        name = "at-walls"
        [robot]
        shape = { box = [0.5, 0.5] }
        speed = 0.5
        [object]
        shape = { box = [0.4, 0.4] }
        grasps = [[0.0, -0.45], [0.0, 0.45]]
        [workspace]
        bounds = [0.0, 0.0, 5.0, 2.4]
        [[robots]]
        home = [0.5, 1.2]
        [[robots]]
        home = [4.5, 1.2]
        [[objects]]
        start = [1.5, 0.3]
        goal = [3.6, 2.1]
        [[objects]]
        start = [2.5, 0.3]
        [[objects]]
        start = [3.4, 0.4]
        goal = [1.6, 1.4]
    "#;

    #[test]
    fn nothing_is_moved_as_it_cannot_be_held() {
        let scene = scene::parse(AT_WALLS, "at-walls").unwrap();
        let (mut solver, _) = planned_for(&scene);
        let spec = &scene.objects[0];
        let goal = Place::of(&scene, &solver.ground, 0, spec.goal.unwrap());
        // Nobody has room below it where it starts, nor above it where it is to go.
        for by in [0, 1] {
            let sequence = [(0, goal.held(by))];
            let (start, homes) = (&solver.start, &solver.homes);
            let hops = Hops::new(&scene, &mut solver.ground, start, homes, &sequence);
            assert!(hops.is_none(), "by grasp {by}");
        }
    }

    #[test]
    fn an_object_is_set_aside_as_it_can_be_held_and_goes_on_so() {
        let scene = scene::parse(AT_WALLS, "at-walls").unwrap();
        let (mut solver, _) = planned_for(&scene);
        let (mut hops, mut order) = solver.current.clone().unwrap();
        let mut is_clutter_moved = false;
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..200 {
            let varied = varied(&scene, &mut solver, (&hops, &order), &mut random);
            let Some((found, items)) = varied else {
                continue;
            };
            for hop in &found.list {
                assert_ne!(hop.from.grasp, NOWHERE, "object {} there", hop.object);
                assert_ne!(hop.to.grasp, NOWHERE, "object {} then", hop.object);
                assert_eq!(hop.from.by, hop.to.by, "held in one way");
            }
            is_clutter_moved |= found.of[1].0 < found.of[1].1;
            (hops, order) = (Rc::new(found), items);
        }
        assert!(is_clutter_moved);
    }
}
