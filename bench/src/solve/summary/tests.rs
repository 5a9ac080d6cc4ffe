//! Tests of what follows from made-up runs.

use planner::Yardstick;

use super::super::Best;
use super::super::rooms::Room;
use super::super::run::Run;
use super::*;
use crate::paper::run::word;

/// A room with two robots: makespans of the default method and of the best of the four where
/// they solved it, and R.
fn room(set: Set, default_s: Option<f64>, best_s: Option<f64>, r_s: Option<f64>) -> Solved {
    let run = |makespan_s: Option<f64>| Run {
        outcome: makespan_s.map_or("timeout", |_| word(shm_types::Outcome::Solved)),
        reason: None,
        makespan_s: makespan_s.unwrap_or(400.0),
        first_motion_tick: Some(1),
        first_motion_s: Some(0.5),
        computing_after_ticks: 0,
        planning_before_wall_s: 0.0,
        planning_wall_s: 0.0,
        run_wall_s: 0.0,
    };
    let room = Room {
        set,
        name: "made up".into(),
        density: None,
        options: None,
        robots: 2,
    };
    let four = [None, best_s, best_s.map(|best_s| best_s + 9.0), None];
    let best = r_s.map(|r_s| Best {
        bound_s: r_s / 2.0,
        yardstick: Yardstick::Exact {
            makespan_s: r_s,
            routes: Vec::new(),
        },
    });
    Solved {
        room,
        certified: false,
        best,
        runs: Ok([default_s].into_iter().chain(four).map(run).collect()),
    }
}

fn column(table: &Table, name: &str) -> Vec<String> {
    let index = table.position(name).unwrap();
    table
        .rows
        .iter()
        .map(|row| row[index].to_string())
        .collect()
}

fn finding<'a>(findings: &'a [Finding], claim: &str) -> &'a Finding {
    let its = |finding: &&Finding| finding.claim.contains(claim);
    findings.iter().find(its).unwrap()
}

#[test]
fn ratios_are_over_the_rooms_that_are_solved_and_the_others_are_counted() {
    let paper = |default_s, best_s, r_s| room(Set::Paper, default_s, best_s, r_s);
    let rooms = [
        paper(Some(11.0), Some(20.0), Some(10.0)),
        paper(Some(12.0), Some(20.0), Some(10.0)),
        paper(Some(12.0), Some(20.0), None),
        paper(None, Some(20.0), Some(10.0)),
        paper(None, None, None),
        paper(None, None, None),
    ];
    let (tables, findings) = of(&rooms);
    let table = tables.iter().find(|table| table.name == RATIOS).unwrap();
    for (name, number) in [
        ("count", "6"),
        ("missed", "1"),
        ("unknown", "2"),
        ("r_inexact", "1"),
        ("to_r", "1.15"),
        ("reached", "yes"),
    ] {
        assert_eq!(column(table, name), [number], "{name}");
    }
    let found = finding(&findings, "2 robots: mean makespan");
    assert_eq!(found.held, Some(true), "{}", found.evidence);
    let mean = mean_ratio(&rooms, &[Set::Paper], 2).unwrap();
    assert!((mean.value - 1.15).abs() < 1e-12);
    assert!(mean_ratio(&rooms, &[Set::Paper], 3).is_none());
}

#[test]
fn the_figure_of_ratios_names_its_groups_and_the_target() {
    let rooms = [Set::Paper, Set::Generated]
        .map(|set| [11.0, 12.0].map(|default_s| room(set, Some(default_s), None, Some(10.0))));
    let figures = super::super::figures::all(rooms.as_flattened(), &[]).unwrap();
    let legend = figures[0].legend.iter().map(|(_, name)| name.as_str());
    let groups = ["paper and seeded rooms", "generated rooms"];
    assert!(
        legend.eq(groups
            .into_iter()
            .chain(["target in the paper's and seeded rooms"]))
    );
}

#[test]
fn rooms_in_which_another_method_was_faster_are_named_the_worst_first() {
    let rooms = [
        (10.0, 20.0),
        (10.0, 10.0),
        (30.0, 20.0),
        (40.0, 20.0),
        (20.01, 20.0),
    ]
    .map(|(own, best)| room(Set::Generated, Some(own), Some(best), None));
    let (tables, findings) = of(&rooms);
    let table = tables.iter().find(|table| table.name == SLOWER).unwrap();
    let excess = column(table, "excess");
    assert_eq!(
        (&excess[..2], excess.len()),
        (&["2", "1.5"].map(String::from)[..], 3)
    );
    let found = finding(&findings, "none is faster");
    assert_eq!(found.held, Some(false));
    assert!(found.evidence.starts_with("2 of 5"), "{}", found.evidence);
    assert!(found.evidence.contains("1 of them by a single tick"));
    assert_eq!(finding(&findings, "never by more than").held, Some(false));
    assert_eq!(finding(&findings, "are solved").held, Some(true));
}

#[test]
fn a_robot_that_computes_after_the_first_motion_is_found() {
    let held = |ticks| {
        let mut rooms = [(); 2].map(|()| room(Set::Paper, Some(9.0), None, None));
        for run in rooms[1].runs.iter_mut().flatten() {
            run.computing_after_ticks = ticks;
        }
        finding(&of(&rooms).1, "no robot computes").held
    };
    assert_eq!((held(0), held(3)), (Some(true), Some(false)));
}
