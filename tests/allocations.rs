//! A step allocates nothing on the heap: from tick 1 to the end of complete runs, robots, world,
//! planner and the driver between them ask the allocator for nothing at all.
//!
//! Tick 0 is left out only because it is where memory set aside by then is first written.
#![expect(clippy::unwrap_used, reason = "a test may fail")]

#[path = "in_process/plans.rs"]
mod plans;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use planner::Planner;
use plans::{CORRIDOR, corridor};
use scene::{HardMode, Method, Scene, Settings, builtin};
use shm_types::{Activity, Outcome};
use sim::Simulation;

/// Counts what a thread asks for while its count is on.
struct Counting;

thread_local! {
    static COUNT: Cell<Option<u64>> = const { Cell::new(None) };
}

fn note() {
    // During the thread's own end there is no count left to add to.
    let _ = COUNT.try_with(|count| count.set(count.get().map(|n| n + 1)));
}

// SAFETY: every call is handed on to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note();
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        note();
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        note();
        // SAFETY: as the caller promises.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        note();
        // SAFETY: as the caller promises.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// What the allocator is asked during `work`.
fn allocations(work: impl FnOnce()) -> u64 {
    COUNT.with(|count| count.set(Some(0)));
    work();
    COUNT.with(|count| count.take()).unwrap()
}

fn scene(name: &str) -> Scene {
    scene::parse(builtin(name).unwrap().text, name).unwrap_or_else(|e| panic!("{e:?}"))
}

/// Runs to the end and checks that nothing was allocated from tick 1 on.
fn run(scene: &Scene, settings: &Settings) -> sim::SimReport {
    run_on(Simulation::new(scene, settings, 1), scene, settings)
}

fn run_on(mut simulation: Simulation<'_>, scene: &Scene, settings: &Settings) -> sim::SimReport {
    simulation.tick();
    let asked = allocations(|| {
        while simulation.outcome() == Outcome::Running {
            simulation.tick();
        }
    });
    let report = simulation.report();
    assert_eq!(
        asked, 0,
        "{} with {}: {:?} after {} ticks",
        scene.name, settings.method, report.outcome, report.ticks
    );
    report
}

#[test]
fn the_count_counts() {
    assert!(allocations(|| drop(std::hint::black_box(Box::new(1)))) == 2);
}

#[test]
fn complete_runs_allocate_nothing() {
    let scene = scene("h1");
    for method in Method::PAPERS {
        let settings = Settings {
            method,
            ..Settings::default()
        };
        let report = run(&scene, &settings);
        assert_eq!(
            report.outcome,
            Outcome::Solved,
            "{method}: {:?}",
            report.reason
        );
        let counters = report.counters();
        assert!(
            counters.selections > 0 && counters.path_plans > 0,
            "{method}"
        );
        assert_eq!(counters.polygon_tests > 0, method.uses_easy(), "{method}");
        assert_eq!(
            report.world.constraints_found > 0,
            method != Method::NoAction,
            "{method}"
        );
        assert_eq!(
            report.world.task_failures > 0,
            method != Method::All,
            "{method}"
        );
    }
}

#[test]
fn following_a_schedule_allocates_nothing() {
    let scene = scene::parse(CORRIDOR, "corridor").unwrap_or_else(|e| panic!("{e:?}"));
    let settings = Settings {
        method: Method::Anytime,
        ..Settings::default()
    };
    let planner = Planner::with_schedule(&scene, settings.clone(), corridor());
    let simulation = Simulation::new(&scene, &settings, 1).with_planner(planner);
    let report = run_on(simulation, &scene, &settings);
    assert_eq!(report.outcome, Outcome::Solved, "{:?}", report.reason);
}

#[test]
fn four_robots_in_each_others_way_allocate_nothing() {
    let scene = scene("paper-17a");
    for method in Method::PAPERS {
        let settings = Settings {
            method,
            ..Settings::default()
        };
        let report = run(&scene, &settings);
        assert_eq!(report.robots.len(), 4);
        let waiting = report
            .robots
            .iter()
            .map(|robot| robot.times.ticks(Activity::Waiting));
        assert!(waiting.sum::<u64>() > 100, "{method}");
    }
}

#[test]
fn computations_over_many_steps_allocate_nothing() {
    let scene = scene("h1");
    for hard in [HardMode::Cached, HardMode::Literal] {
        let settings = Settings {
            hard,
            method: Method::All,
            units_per_second: 50_000,
            ..Settings::default()
        };
        let report = run(&scene, &settings);
        assert_eq!(
            report.outcome,
            Outcome::Solved,
            "{hard}: {:?}",
            report.reason
        );
    }
}
