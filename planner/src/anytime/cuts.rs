//! What is learned from moves that could not be made: cuts (rule 35).
//!
//! Responsible for: why a move had no way, as a smallest set of bodies that close it; which orders
//! come to the same again.
//! Not responsible for: what one object closes where it starts or ends (`order`), time (`plan`).
//!
//! How: a move that finds no way in space and time is looked at without time, among bodies as they
//! stand after all moves before it in the order. If there is no way either, bodies are left out one
//! by one as long as there is none. What remains is the cut. Only failures are looked at, so no
//! order pays for what it does not need.
//!
//! A cut is a hypothesis: a robot might pass before a body comes to where it stands then. An order
//! in which that robot's move comes first says so better.

use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;

use scene::{ROBOT_ALONE, Vec2};

use crate::anytime::ground::Ground;
use crate::anytime::order::{Hops, Item, Progress};
use crate::anytime::sequence::Sequencer;

/// A way that a move needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Leg {
    class: usize,
    from: u32,
    to: u32,
    /// The object that is moved, and the one in whose room the way begins: they close nothing but
    /// what is said apart.
    own: [Option<usize>; 2],
}

/// Somebody who stays where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Body {
    /// An object, by where its centre is, m.
    Object(usize, Vec2),
    /// A robot that has made no move, by its lattice point.
    Robot(usize, u32),
}

/// A body, and the lattice points that it closes to a leg.
type Closing<'a> = (Body, Cow<'a, [u32]>);

/// What the objects that are said apart close to a leg.
type Own<'a> = [&'a [u32]; 2];

/// What was learned.
#[derive(Default)]
pub(crate) struct Cuts {
    /// By leg: bodies that close it together, none of which can be left out.
    by_leg: HashMap<Leg, Vec<Vec<Body>>>,
}

impl Cuts {
    /// Whether an order comes to a move that is known to have no way.
    pub(crate) fn forbid(&self, hops: &Hops, order: &[Item]) -> bool {
        if self.by_leg.is_empty() {
            return false;
        }
        let mut progress = Progress::new(hops);
        order.iter().enumerate().any(|(place, &item)| {
            // Whoever has no way home may have one later.
            let needed = if place + 1 == order.len() { 0..3 } else { 0..2 };
            let is_cut = self.cut(hops, &progress, item, needed);
            progress.make(item);
            is_cut
        })
    }

    /// Whether the robot that makes the move that comes after an order is known to have no way home
    /// then, but a way to make it.
    pub(crate) fn shut_in(&self, hops: &Hops, order: &[Item], item: Item) -> bool {
        if self.by_leg.is_empty() {
            return false;
        }
        let mut progress = Progress::new(hops);
        for &made in order {
            progress.make(made);
        }
        self.cut(hops, &progress, item, 2..3) && !self.cut(hops, &progress, item, 0..2)
    }

    /// Whether one of these legs of a move is known to be closed.
    fn cut(&self, hops: &Hops, progress: &Progress, item: Item, needed: Range<usize>) -> bool {
        let stands = |body: &Body| match *body {
            Body::Object(object, at) => progress.place(hops, object).at == at,
            Body::Robot(robot, cell) => {
                robot != item.1 as usize && progress.unmoved(hops, robot) == Some(cell)
            }
        };
        legs(hops, progress, item).is_some_and(|legs| {
            legs[needed].iter().any(|leg| {
                let cuts = self.by_leg.get(&leg.0);
                cuts.is_some_and(|cuts| cuts.iter().any(|cut| cut.iter().all(stands)))
            })
        })
    }

    /// Learns why the move that comes after an order has no way, if bodies as they stand then say
    /// so.
    pub(crate) fn learn(
        &mut self,
        ground: &Ground,
        sequencer: &mut Sequencer,
        hops: &Hops,
        order: &[Item],
        item: Item,
    ) {
        let mut progress = Progress::new(hops);
        for &made in order {
            progress.make(made);
        }
        for (leg, own) in legs(hops, &progress, item).into_iter().flatten() {
            let mut bodies = standing(ground, hops, &progress, leg, item.1 as usize);
            if leg.is_open(ground, sequencer, own, &bodies) {
                continue;
            }
            // Whoever is not beside what was reached from the end that is shut in is not needed.
            bodies.retain(|(_, cells)| sequencer.has_met(ground, cells));
            let mut needed = 0;
            while needed < bodies.len() {
                let body = bodies.remove(needed);
                if leg.is_open(ground, sequencer, own, &bodies) {
                    bodies.insert(needed, body);
                    needed += 1;
                }
            }
            let cut = bodies.into_iter().map(|(body, _)| body).collect();
            let known: &mut Vec<Vec<Body>> = self.by_leg.entry(leg).or_default();
            if !known.contains(&cut) {
                known.push(cut);
            }
        }
    }
}

impl Leg {
    /// Whether there is a way among bodies, and what its own object closes.
    fn is_open(
        self,
        ground: &Ground,
        sequencer: &mut Sequencer,
        own: Own<'_>,
        bodies: &[Closing<'_>],
    ) -> bool {
        let closed = bodies.iter().map(|(_, cells)| &**cells).chain(own);
        sequencer.finds_among(ground, self.class, (self.from, self.to), closed)
    }
}

/// Who stands still while a robot is on its way.
fn standing<'a>(
    ground: &Ground,
    hops: &'a Hops,
    progress: &Progress,
    leg: Leg,
    mover: usize,
) -> Vec<Closing<'a>> {
    let objects = (0..hops.of.len())
        .filter(|&object| !leg.own.contains(&Some(object)))
        .map(|object| {
            let place = progress.place(hops, object);
            let cells = Cow::from(&place.cells[leg.class]);
            (Body::Object(object, place.at), cells)
        });
    let robots = (0..hops.robots())
        .filter(|&robot| robot != mover)
        .filter_map(|robot| {
            let cell = progress.unmoved(hops, robot)?;
            let cells = ground.kept_away(leg.class, ROBOT_ALONE.0, cell);
            Some((Body::Robot(robot, cell), cells.into()))
        });
    objects.chain(robots).collect()
}

/// Approach, transfer and way home of a move, and what its own object and the one that its robot
/// comes from close to each; none if the robot is gone.
fn legs<'a>(
    hops: &'a Hops,
    progress: &Progress,
    (object, robot): Item,
) -> Option<[(Leg, Own<'a>); 3]> {
    let (object, robot) = (object as usize, robot as usize);
    let hop = &hops.list[progress.next(object)];
    let (begin, left) = progress.begins(hops, robot)?;
    let leg = |class, from, to, left| Leg {
        class,
        from,
        to,
        own: [Some(object), left],
    };
    let (alone, home) = (ROBOT_ALONE.0, hops.home_of(robot));
    let approach = leg(alone, begin, hop.from.grasp, left);
    let transfer = leg(hop.class, hop.from.grasp, hop.to.grasp, None);
    let back = leg(alone, hop.to.grasp, home, None);
    let behind = left.filter(|_| progress.unmoved(hops, robot).is_none());
    let behind = behind.map_or(&[][..], |object| &progress.place(hops, object).bare);
    Some([
        (approach, [&hop.from.bare, behind]),
        (transfer, [&[]; 2]),
        (back, [&hop.to.bare, &[]]),
    ])
}

#[cfg(test)]
mod tests {
    use std::rc::Rc;

    use rand::RngExt;
    use rand::seq::SliceRandom;
    use scene::GenerateOptions;

    use super::*;
    use crate::anytime::ground::EVER;
    use crate::anytime::solver::Solver;
    use crate::anytime::solver::testing::{cells, planned, planned_for, solver_of};
    use crate::anytime::track::Place;

    /// Carries an order out; whether it can be, and whether that was foreseen.
    fn tried(scene: &scene::Scene, solver: &mut Solver, order: &[Item]) -> (bool, bool) {
        let (hops, _) = solver.current.clone().unwrap();
        let is_foreseen = solver.cuts.forbid(&hops, order);
        (
            solver.decode(scene, &hops, order, EVER).is_some(),
            is_foreseen,
        )
    }

    #[test]
    fn objects_that_close_both_ways_together_are_learned_and_it_is_enough_that_one_of_them_goes() {
        let scene = cells(&[
            "##2#####", //
            "#.b...##", //
            "#a###1##", //
            "#A.c..d4", //
            "###3####",
        ]);
        let (mut solver, _) = planned_for(&scene);
        let all = [(0, 0), (1, 0), (2, 0), (3, 0)];
        assert_eq!(tried(&scene, &mut solver, &all), (false, false));
        assert_eq!(tried(&scene, &mut solver, &all), (false, true));
        let cuts: Vec<_> = solver.cuts.by_leg.values().flatten().collect();
        let objects = scene.objects.iter().map(|object| object.start);
        let at: Vec<Vec2> = objects.collect();
        let both = vec![Body::Object(1, at[1]), Body::Object(2, at[2])];
        assert_eq!(cuts, [&both], "the object that hinders nobody is left out");
        // It is the same later, whoever has moved that has nothing to do with it.
        assert_eq!(tried(&scene, &mut solver, &[(3, 0), (0, 0)]), (false, true));
        for first in [1, 2] {
            assert_eq!(
                tried(&scene, &mut solver, &[(first, 0), (0, 0)]),
                (true, false)
            );
        }
    }

    #[test]
    fn a_robot_that_has_not_moved_closes_the_way_of_others_but_not_its_own() {
        let scene = cells(&["AaB1"]);
        let (mut solver, _) = planned_for(&scene);
        assert_eq!(tried(&scene, &mut solver, &[(0, 0)]), (false, false));
        assert_eq!(tried(&scene, &mut solver, &[(0, 0)]), (false, true));
        assert_eq!(tried(&scene, &mut solver, &[(0, 1)]), (true, false));
    }

    /// An object in a corridor that leads down into a room, and is grasped from below: one robot in
    /// the room, one at the upper end of the corridor.
    const CORRIDOR: &str = r#"
        name = "corridor"
        [robot]
        shape = { box = [0.5, 0.5] }
        speed = 0.5
        [object]
        shape = { box = [0.4, 0.4] }
        [workspace]
        bounds = [0.0, 0.0, 3.0, 4.0]
        walls = [{ box = [0.6, 1.2, 3.0, 4.0] }]
        [[robots]]
        home = [2.6, 0.5]
        [[robots]]
        home = [0.3, 3.7]
        [[objects]]
        start = [0.3, 2.0]
        goal = [2.0, 0.9]
    "#;

    #[test]
    fn nobody_gets_to_an_object_through_itself() {
        let scene = scene::parse(CORRIDOR, "corridor").unwrap();
        let (mut solver, _) = planned_for(&scene);
        let from_above = [(0, 1)];
        assert_eq!(tried(&scene, &mut solver, &from_above), (false, false));
        assert_eq!(tried(&scene, &mut solver, &from_above), (false, true));
        assert_eq!(tried(&scene, &mut solver, &[(0, 0)]), (true, false));
    }

    /// A corridor, up which the robot brings one object; that and the other one then leave it no way
    /// home.
    const SHUT_IN: &str = r#"
        name = "shut-in"
        [robot]
        shape = { box = [0.5, 0.5] }
        speed = 0.5
        [object]
        shape = { box = [0.4, 0.4] }
        pass_under = false
        [workspace]
        bounds = [0.0, 0.0, 1.2, 4.0]
        [[robots]]
        home = [0.6, 3.5]
        [[objects]]
        start = [0.3, 1.1]
        goal = [0.3, 2.0]
        [[objects]]
        start = [0.9, 2.0]
        goal = [0.9, 0.8]
    "#;

    #[test]
    fn whoever_is_shut_in_stays_away_if_a_later_move_lets_it_home() {
        let scene = scene::parse(SHUT_IN, "shut-in").unwrap();
        let mut solver = solver_of(&scene);
        let goal = |object: usize| {
            let at = scene.objects[object].goal.unwrap();
            (object, Place::of(&scene, &solver.ground, object, at))
        };
        let each_once = [goal(0), goal(1)];
        let (ground, start, homes) = (&mut solver.ground, &solver.start, &solver.homes);
        let hops = Hops::new(&scene, ground, start, homes, &each_once).unwrap();
        solver.current = Some((Rc::new(hops), Vec::new()));
        assert_eq!(tried(&scene, &mut solver, &[(0, 0), (1, 0)]), (true, false));
        assert_eq!(tried(&scene, &mut solver, &[(0, 0), (1, 0)]), (true, false));
        assert_eq!(tried(&scene, &mut solver, &[(0, 0)]), (false, true));
        assert_eq!(tried(&scene, &mut solver, &[(1, 0), (0, 0)]), (true, false));
    }

    #[test]
    fn of_a_single_robot_every_failure_is_explained_and_what_is_foreseen_comes_true() {
        let (mut foreseen, mut failed) = (0, 0);
        for seed in 0..12 {
            let options = GenerateOptions {
                seed,
                robots: 1,
                objects: 8,
                area_m2: 30.0,
                ..GenerateOptions::default()
            };
            let (scene, mut solver, _) = planned(&options);
            let (_, mut order) = solver.current.clone().unwrap();
            for _ in 0..100 {
                order.shuffle(&mut solver.random);
                let items = solver.random.random_range(1..=order.len());
                let (is_possible, is_foreseen) = tried(&scene, &mut solver, &order[..items]);
                assert!(!(is_possible && is_foreseen), "seed {seed}: {order:?}");
                let (hops, _) = solver.current.clone().unwrap();
                let is_known = solver.cuts.forbid(&hops, &order[..items]);
                assert_ne!(is_known, is_possible, "seed {seed}: {order:?}");
                foreseen += usize::from(is_foreseen);
                failed += usize::from(!is_possible);
            }
        }
        assert!(
            2 * foreseen > failed,
            "{foreseen} of {failed} were foreseen"
        );
    }
}
