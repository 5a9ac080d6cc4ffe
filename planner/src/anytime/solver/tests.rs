//! What reservations have to be true to.

use super::testing::{cells, planned, solver_of, written};
use super::*;
use crate::anytime::keep::kept;
use crate::anytime::plan::lay::enter;
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
    assert_eq!(solver.ways(), 3 + 1);
    let expanded = solver.router.expanded;
    // Eight steps and two grips at least.
    assert!(expanded >= 10, "{expanded}");
    assert!(solver.units() >= UNITS_PER_INTERVAL * expanded + solver.sequencer.cells);
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
