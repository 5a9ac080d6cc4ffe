//! What reservations have to be true to.

use std::collections::BTreeSet;
use std::collections::HashSet;

use scene::Vec2;

use super::testing::{cells, planned, solver_of, written};
use super::*;
use crate::anytime::ground::duration;
use crate::anytime::keep::kept;
use crate::anytime::plan::lay::enter;
use crate::anytime::publish::Script;
use crate::anytime::route::sides;
use crate::anytime::timeline::Timeline;
use crate::anytime::track::{Deed, grips_in_turn};

/// When robots keep others away from where: class, cell, robot, from, to.
type Span = (usize, u32, u32, Time, Time);

fn reserved(solver: &Solver) -> Vec<Span> {
    let robots = solver.plan.tracks().len();
    let mut spans: Vec<Span> = Vec::new();
    for class in 0..solver.ground.classes {
        for cell in 0..solver.ground.points() as u32 {
            let busy = solver.plan.timeline().busy(class, cell).iter();
            let robots = busy.filter(|busy| (busy.owner as usize) < robots);
            spans.extend(robots.map(|busy| (class, cell, busy.owner, busy.from, busy.to)));
        }
    }
    spans.sort_unstable();
    // One after the other is one.
    spans.dedup_by(|next, span| {
        let goes_on = (next.0, next.1, next.2) == (span.0, span.1, span.2) && next.3 <= span.4;
        span.4 = if goes_on { span.4.max(next.4) } else { span.4 };
        goes_on
    });
    spans
}

#[test]
fn what_is_reserved_after_many_changes_is_what_robots_do_in_the_end() {
    for seed in 0..6 {
        let options = scene::GenerateOptions {
            seed,
            crowding: 0.8,
            ..scene::GenerateOptions::default()
        };
        let (scene, mut solver, _) = planned(&options);
        for _ in 0..10 {
            solver.improve(&scene);
            let found = reserved(&solver);
            let tracks = solver.plan.tracks().to_vec();
            solver.plan.take_over(&solver.ground, &solver.start, tracks);
            assert!(found == reserved(&solver), "seed {seed}");
        }
    }
}

#[test]
fn an_object_keeps_others_away_from_when_its_grip_begins_to_open() {
    let (_, mut solver, _) = planned(&scene::GenerateOptions::default());
    solver.restore().unwrap();
    let (ground, tracks) = (&solver.ground, solver.plan.tracks());
    let mut releases = 0;
    for grip in grips_in_turn(tracks).iter().filter(|grip| grip.is_release) {
        let owner = (tracks.len() + grip.object) as u32;
        for (class, cells) in grip.place.cells.iter().enumerate() {
            for &cell in cells {
                let busy = solver.plan.timeline().busy(class, cell).iter();
                let mut own = busy.filter(|busy| busy.owner == owner);
                let opens = grip.time - ground.release;
                assert!(own.any(|busy| busy.from == opens));
            }
        }
        releases += 1;
    }
    assert!(releases > 0);
}

/// What is kept waits for nothing that is planned later: so it has to come first. And nothing is
/// planned for a time that will be over.
#[test]
fn what_is_planned_under_way_comes_after_what_is_kept() {
    let mut shared = 0;
    for seed in 0..8 {
        let options = scene::GenerateOptions {
            seed,
            objects: 8,
            area_m2: 30.0,
            ..scene::GenerateOptions::default()
        };
        let (scene, mut solver, makespan) = planned(&options);
        let script = written(&scene, &mut solver);
        let until = makespan / 3;
        let goes_on = solver.go_on(&scene, until, |tracks| kept(&script, tracks, until));
        // Where all moves have begun by then, nothing is left.
        for _ in 0..if goes_on { 20 } else { 0 } {
            solver.improve(&scene);
            shared += assert_kept_first(&solver, seed);
            assert_not_before(&solver, until);
        }
    }
    assert!(shared > 0, "they never meet");
}

fn assert_not_before(solver: &Solver, until: Time) {
    for track in solver.plan.tracks() {
        let planned = &track.deeds[track.kept..];
        assert!(planned.iter().all(|deed| deed.begin() >= until));
    }
}

/// How often what is planned leads to where somebody else has been before with what is kept.
fn assert_kept_first(solver: &Solver, seed: u64) -> usize {
    let (ground, tracks) = (&solver.ground, solver.plan.tracks());
    let mut entered = Timeline::new(ground);
    for (robot, track) in tracks.iter().enumerate() {
        enter(&mut entered, ground, robot as u32, track);
    }
    let mut shared = 0;
    for (robot, track) in tracks.iter().enumerate() {
        let (mut cell, mut class) = (track.start, ROBOT_ALONE.0);
        for (number, deed) in track.deeds.iter().enumerate() {
            match *deed {
                Deed::Grasped(object, ..) => class = ground.carrying(object as usize, 0),
                Deed::Released(..) => class = ROBOT_ALONE.0,
                Deed::Step(direction, depart, _) => {
                    cell = cell.wrapping_add_signed(ground.offsets[direction as usize]);
                    for busy in entered.busy(class, cell) {
                        let owner = busy.owner as usize;
                        let is_kept = (busy.step as usize) < tracks[owner].kept;
                        if number >= track.kept && owner != robot && is_kept {
                            shared += 1;
                            let to = busy.to;
                            assert!(to <= depart, "{seed}: {robot} at {depart}, {busy:?}");
                        }
                    }
                }
            }
        }
    }
    shared
}

/// Where an object rests, from when to when.
type Rested = (Rc<Place>, Time, Time);

#[test]
fn nobody_passes_through_an_object_at_rest() {
    let mut moved_again = 0;
    let crowded = (40..43).map(|seed| scene::GenerateOptions {
        seed,
        objects: 6,
        robots: 4,
        area_m2: 40.0,
        walls: 5,
        ..scene::GenerateOptions::default()
    });
    let loose = (1019..1020).map(|seed| scene::GenerateOptions {
        seed,
        objects: 8,
        area_m2: 64.0,
        walls: 8,
        crowding: 0.2,
        ..scene::GenerateOptions::default()
    });
    for options in crowded.chain(loose) {
        let seed = options.seed;
        let (scene, mut solver, _) = planned(&options);
        for _ in 0..100 {
            solver.improve(&scene);
            let (ground, tracks) = (&solver.ground, solver.plan.tracks());
            let rested = rested(&solver);
            moved_again += usize::from(rested.len() > 2 * scene.objects.len());
            for (robot, track) in tracks.iter().enumerate() {
                let (mut cell, mut class) = (track.start, ROBOT_ALONE.0);
                for deed in &track.deeds {
                    match *deed {
                        Deed::Step(direction, depart, arrive) => {
                            let beside = sides(ground, cell, direction as usize);
                            cell = cell.wrapping_add_signed(ground.offsets[direction as usize]);
                            let swept = beside.into_iter().flatten().chain([cell]);
                            let is_there = |(place, since, until): &&Rested| {
                                let cells = &place.cells[class];
                                *since < arrive
                                    && depart < *until
                                    && swept.clone().any(|at| cells.binary_search(&at).is_ok())
                            };
                            let through = rested.iter().find(is_there);
                            assert!(through.is_none(), "{seed}: robot {robot} at {depart}");
                        }
                        Deed::Grasped(object, .., by) => {
                            class = ground.carrying(object as usize, by);
                        }
                        Deed::Released(..) => class = ROBOT_ALONE.0,
                    }
                }
            }
        }
    }
    assert!(moved_again > 0, "something is set aside");
}

/// Where objects rest in the plan.
fn rested(solver: &Solver) -> Vec<Rested> {
    let mut at: Vec<(Rc<Place>, Time)> = (solver.start.objects.iter())
        .map(|(place, _)| (Rc::clone(place), 0))
        .collect();
    let mut rested = Vec::new();
    for grip in grips_in_turn(solver.plan.tracks()) {
        let (place, since) = &mut at[grip.object];
        if grip.is_release {
            (*place, *since) = (Rc::clone(grip.place), grip.time);
        } else {
            rested.push((Rc::clone(place), *since, grip.time - solver.ground.grasp));
        }
    }
    rested.extend(at.into_iter().map(|(place, since)| (place, since, EVER)));
    rested
}

#[test]
fn who_is_parked_in_the_way_makes_room_and_goes_home_after_that() {
    let scene = cells(&["1.A.B.a", "##.####"]);
    let mut solver = solver_of(&scene);
    assert!(solver.first(&scene, 0).is_some());
    let carries = |track: &Track| track.grips().count() == 2;
    let tracks = solver.plan.tracks();
    // The object comes from B's side, and A, in its dead end, goes aside.
    assert_eq!([carries(&tracks[0]), carries(&tracks[1])], [false, true]);
    assert!(!tracks[0].deeds.is_empty());
    assert!((0..2).all(|robot| solver.plan.ends_at_home(robot)));
}

/// A first plan for a room in which robots stand elsewhere than at home, in these columns and rows
/// from below, if that is said; with or without margins.
fn planned_from(rows: &[&'static str], at: &[[u8; 2]], needs_margins: bool) -> (Scene, Solver) {
    let scene = cells(rows);
    let mut situation = Situation {
        needs_margins,
        ..Situation::at_start(&scene)
    };
    for (robot, at) in situation.robots.iter_mut().zip(at) {
        robot.at = Vec2::from(at.map(|cell| f64::from(cell) + 0.5));
    }
    let mut solver = Solver::new(&scene, &Settings::default(), &situation).unwrap();
    solver.first(&scene, 0).unwrap();
    (scene, solver)
}

#[test]
fn who_stands_too_close_to_another_at_first_can_still_move() {
    let rows = ["aA....Bb", "........", "1......2"];
    let (_, solver) = planned_from(&rows, &[[3, 2], [4, 2]], true);
    let carries = |track: &Track| track.grips().count() == 2;
    assert!(solver.plan.tracks().iter().all(carries));
    assert!((0..2).all(|robot| solver.plan.ends_at_home(robot)));
}

/// Also where robots stand too close to each other at first.
#[test]
fn no_plan_has_robots_wait_for_one_another_in_a_ring() {
    let rows = ["a.A...B.b", ".........", "d...C...c", "3.4...1.2"];
    let together = [[3, 2], [4, 2], [4, 1]];
    let mut improved = 0;
    for turn in 0..3 {
        let mut at = together;
        at.rotate_left(turn);
        let (scene, mut solver) = planned_from(&rows, &at, true);
        for _ in 0..100 {
            improved += u32::from(solver.improve(&scene));
            let tracks = solver.plan.tracks().to_vec();
            let (ground, start) = (&solver.ground, &solver.start);
            solver.plan.take_over(ground, start, tracks);
            let situation = Situation::at_start(&scene);
            let script = Script::of(&scene, ground, &solver.plan, &situation);
            assert!(comes_to_its_end(&script, scene.homes.len()), "{at:?}");
        }
    }
    assert!(improved > 0);
}

/// Whether robots get through all of it, each action as soon as what it waits for is granted.
fn comes_to_its_end(script: &Script, robots: usize) -> bool {
    let mut granted = vec![0; robots];
    let mut progress = true;
    while progress {
        progress = false;
        for robot in 0..robots {
            let is_free = |action: u32| {
                let mut waits = script.waits(robot, action as usize).iter();
                waits.all(|wait| granted[wait.robot as usize] >= wait.actions)
            };
            if granted[robot] < script.listable(robot) && is_free(granted[robot]) {
                granted[robot] += 1;
                progress = true;
            }
        }
    }
    (0..robots).all(|robot| granted[robot] == script.listable(robot))
}

#[test]
fn robots_that_need_margins_stay_a_step_further_apart() {
    let crossing = ["A......B", "a......b", "2......1"];
    let (_, plain) = planned_from(&crossing, &[], false);
    assert_eq!(least_distance(&plain), 1, "they pass each other closely");
    let (_, wide) = planned_from(&crossing, &[], true);
    assert!(least_distance(&wide) >= 2);
}

/// How many columns or rows two robots are apart at the least, at any time.
fn least_distance(solver: &Solver) -> i32 {
    let [one, other] = [0, 1].map(|robot| visits(solver, robot));
    let pairs = one
        .iter()
        .flat_map(|mine| other.iter().map(move |theirs| (mine, theirs)));
    let meeting = pairs.filter(|(mine, theirs)| mine.1 < theirs.2 && theirs.1 < mine.2);
    let far = meeting.map(|(mine, theirs)| {
        let (dx, dy) = solver.ground.offset(mine.0, theirs.0);
        dx.abs().max(dy.abs())
    });
    far.min().unwrap()
}

/// Which points a robot is at, or on its way from or to, from when to when.
fn visits(solver: &Solver, robot: usize) -> Vec<(u32, Time, Time)> {
    let track = &solver.plan.tracks()[robot];
    let mut visits = vec![(track.start, 0, EVER)];
    for deed in &track.deeds {
        if let Deed::Step(direction, depart, arrive) = *deed {
            let (cell, _, until) = visits.last_mut().unwrap();
            *until = arrive;
            let next = cell.wrapping_add_signed(solver.ground.offsets[direction as usize]);
            visits.push((next, depart, EVER));
        }
    }
    visits
}

/// What the other one puts down would leave it no way.
#[test]
fn a_robot_that_is_away_from_home_goes_home_in_time() {
    let mut draft = cells(&["..1....B", "####.a.A"]).draft().clone();
    draft.objects[0].pass_under = false;
    let scene = Scene::new(draft).unwrap();
    let mut situation = Situation::at_start(&scene);
    situation.robots[1].at = Vec2::new(0.5, 1.5);
    let mut solver = Solver::new(&scene, &Settings::default(), &situation).unwrap();
    assert!(solver.first(&scene, 0).is_some());
    assert!((0..2).all(|robot| solver.plan.ends_at_home(robot)));
}

/// The first can go home only after the second has.
#[test]
fn who_has_no_way_home_yet_is_sent_after_the_others() {
    let scene = cells(&["A....a1", "#B#####"]);
    let mut situation = Situation::at_start(&scene);
    situation.robots[0].at = Vec2::new(2.5, 1.5);
    situation.robots[1].at = Vec2::new(1.5, 1.5);
    let mut solver = Solver::new(&scene, &Settings::default(), &situation).unwrap();
    solver.begin();
    assert!(solver.send_all_home().is_some());
    assert!((0..2).all(|robot| solver.plan.ends_at_home(robot)));
}

/// What lies about is first in the list of objects, and in the way.
#[test]
fn what_has_no_goal_may_be_set_aside_too() {
    let mut draft = cells(&["A.ba.2", ".####.", ".####.", ".####.", ".....1"])
        .draft()
        .clone();
    draft.objects[0].goal = None;
    let scene = Scene::new(draft).unwrap();
    let mut solver = solver_of(&scene);
    solver.first(&scene, 0).unwrap();
    let mut aside = 0;
    for _ in 0..200 {
        solver.improve(&scene);
        let moves = solver.plan.tracks().iter().flat_map(Track::grips);
        aside += moves.filter(|grip| grip.object == 0).count();
    }
    assert!(aside > 0, "it is never tried");
}

#[test]
fn a_robot_that_puts_something_down_from_below_gets_out_from_under_it() {
    let mut draft = cells(&["A...", ".a.1", "...."]).draft().clone();
    draft.objects[0].pass_under = false;
    // Steps are smaller than bodies, which so overlap while the robot comes out.
    draft.objects[0].start[0] += 0.25;
    let scene = Scene::new(draft).unwrap();
    assert!(scene.lattice.pitch_m < 1.0 && scene.lifts_from_below(0));
    assert!(solver_of(&scene).first(&scene, 0).is_some());
}

/// One transfer, two ways between it and home, and one search for the way as a whole.
#[test]
fn what_is_looked_for_is_counted_and_charged() {
    let scene = cells(&["A.a.1"]);
    let mut solver = solver_of(&scene);
    solver.first(&scene, 0).unwrap();
    assert_eq!(solver.work().path_plans, 3 + 1);
    let expanded = solver.router.expanded;
    // Eight steps and two grips at least.
    assert!(expanded >= 10, "{expanded}");
    assert!(solver.units() >= UNITS_PER_INTERVAL * expanded + solver.sequencer.cells);
    // A cell takes a unit at least.
    assert!((expanded..=solver.units()).contains(&solver.work().cells_expanded));
}

#[test]
fn what_a_search_for_a_shortest_plan_looks_at_is_charged() {
    let scene = cells(&["A.a1.", "....."]);
    let mut solver = solver_of(&scene);
    solver.first(&scene, 0).unwrap();
    let before = solver.units();
    while solver.shorten(&scene) {}
    // Each of five steps from either end at least.
    assert!(solver.small_configurations >= 10);
    let least = solver.small_configurations * UNITS_PER_SMALL_CONFIGURATION;
    assert!(solver.units() - before >= least);
}

/// How long a robot takes from one point to another among what is closed to it, if it can.
fn quickest(
    ground: &Ground,
    class: usize,
    (from, to): (u32, u32),
    closed: &HashSet<u32>,
) -> Option<Time> {
    let mut open = BTreeSet::from([(0, from)]);
    let mut done = HashSet::new();
    while let Some((time, cell)) = open.pop_first() {
        if cell == to {
            return Some(time);
        }
        if !done.insert(cell) {
            continue;
        }
        let steps = ground.walls(class).steps(cell);
        for direction in (0..8).filter(|direction| steps >> direction & 1 == 1) {
            let next = cell.wrapping_add_signed(ground.offsets[direction]);
            let mut passed = sides(ground, cell, direction).into_iter().flatten();
            if !closed.contains(&next) && passed.all(|side| !closed.contains(&side)) {
                open.insert((time + duration(direction), next));
            }
        }
    }
    None
}

/// How long a single robot takes to move one object and to go home, while all others stand, if it
/// can.
fn quickest_alone(solver: &Solver, object: usize) -> Option<Time> {
    let (hops, _) = solver.current.as_ref()?;
    let hop = &hops.list[hops.of[object].0];
    let (ground, home) = (&solver.ground, solver.homes[0]);
    let leg = |class: usize, from: u32, to: u32, own: &[u32]| {
        let rests = solver.start.rests();
        let others = (0..rests.len()).filter(|&other| other != object);
        let closed = others.flat_map(|other| rests[other].place.cells[class].clone());
        quickest(
            ground,
            class,
            (from, to),
            &closed.chain(own.to_vec()).collect(),
        )
    };
    let alone = ROBOT_ALONE.0;
    let approach = leg(alone, home, hop.from.grasp, &hop.from.bare)?;
    let transfer = leg(hop.class, hop.from.grasp, hop.to.grasp, &[])?;
    let back = leg(alone, hop.to.grasp, home, &hop.to.bare)?;
    Some(approach + ground.grasp + transfer + ground.release + back)
}

/// A crowded room with a single robot.
fn planned_for_one(seed: u64) -> (Scene, Solver, Time) {
    planned(&scene::GenerateOptions {
        seed,
        robots: 1,
        objects: 8,
        area_m2: 30.0,
        ..scene::GenerateOptions::default()
    })
}

#[test]
fn ways_are_the_quickest_unless_in_haste() {
    let (mut moved, mut longer) = (0, 0);
    for seed in 0..12 {
        let (scene, mut solver, _) = planned_for_one(seed);
        let (hops, _) = solver.current.clone().unwrap();
        for object in 0..scene.objects.len() {
            if hops.of[object].0 == hops.of[object].1 {
                continue;
            }
            let least = quickest_alone(&solver, object);
            let order = [(object as u32, 0)];
            let found = [false, true].map(|is_hasty| {
                solver.router.is_hasty = is_hasty;
                solver.known.clear();
                solver.decode(&scene, &hops, &order, EVER)
            });
            assert_eq!(found[0], least, "seed {seed}: {object}");
            let Some(least) = least else { continue };
            assert!(
                found[1].unwrap() <= least + least / 4,
                "seed {seed}: {object}"
            );
            moved += 1;
            longer += usize::from(found[1].unwrap() > least);
        }
    }
    assert!(moved > 12 && longer > 0, "{longer} of {moved} were longer");
}

#[test]
fn improving_begins_with_the_first_order_by_the_quickest_ways() {
    let mut is_better = false;
    for seed in 0..12 {
        let (scene, mut solver, first) = planned_for_one(seed);
        let (hops, order) = solver.current.clone().unwrap();
        solver.improve(&scene);
        let better = solver.best.as_ref().unwrap().makespan;
        solver.known.clear();
        let again = solver.decode(&scene, &hops, &order, EVER).unwrap();
        assert_eq!(better, again.min(first), "seed {seed}");
        is_better |= better < first;
    }
    assert!(is_better, "haste never made anything longer");
}

/// Nobody gets past anybody in a corridor. Whichever goals are given first, one way round is left.
#[test]
fn where_interchangeable_objects_cannot_get_to_the_goals_given_first_they_get_others() {
    let mut draft = cells(&["Aab..12"]).draft().clone();
    for object in &mut draft.objects {
        object.kind = Some("crate".to_owned());
    }
    let scene = Scene::new(draft).unwrap();
    let mut in_turn = 0;
    for swapped in [false, true] {
        let mut solver = solver_of(&scene);
        if swapped {
            solver.goals.swap(0, 1);
        }
        let attempt = (0..8).find(|attempt| solver.first(&scene, *attempt).is_some());
        in_turn += u32::from(attempt.unwrap() == 0);
        let ends = grips_in_turn(solver.plan.tracks()).into_iter();
        let ends: BTreeSet<_> = ends
            .filter(|grip| grip.is_release)
            .map(|grip| (grip.place.at.x * 2.0) as u32)
            .collect();
        assert!(ends.is_superset(&BTreeSet::from([11, 13])), "{ends:?}");
    }
    assert_eq!(in_turn, 1);
}

#[test]
fn what_was_tried_is_known_after_robots_have_begun_some_of_it() {
    let mut begun = 0;
    for seed in 0..6 {
        let (scene, mut solver, _) = planned(&scene::GenerateOptions {
            seed,
            ..scene::GenerateOptions::default()
        });
        for _ in 0..10 {
            solver.improve(&scene);
        }
        let script = written(&scene, &mut solver);
        let (_, before) = solver.best.clone().unwrap().source.unwrap();
        solver.current = solver.best.clone().unwrap().source;
        let until = solver.plan.makespan() / 3;
        if solver.go_on(&scene, until, |tracks| kept(&script, tracks, until)) {
            let (hops, order) = solver.current.clone().unwrap();
            begun += before.len() - order.len();
            assert!(solver.tried.has(&hops, &order, EVER), "{seed}: {order:?}");
        }
    }
    assert!(begun > 0);
}
