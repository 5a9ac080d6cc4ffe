//! After construction a step of the world allocates nothing, whatever happens in it.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use shm_types::{ConstraintKind, ControlKind, FailureCause, NONE, Outcome};
use world::{Next, World, WorldInput};

#[cfg(test)]
#[path = "../src/testing.rs"]
#[allow(dead_code, reason = "the unit tests use the rest of it")]
mod testing;

use testing::{BELOW, Bench, room};

thread_local! {
    /// Of this thread: the harness's own threads are not of interest.
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller keeps the contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Steps until robot `i` stands at `goal`, which it is on its way to.
fn until_at(bench: &mut Bench, i: usize, goal: [f64; 2]) {
    for _ in 0..4_000 {
        if bench.at(i) == goal {
            return;
        }
        bench.step();
    }
    panic!("robot {i} is at {:?}, not at {goal:?}", bench.at(i));
}

fn allocated() -> u64 {
    ALLOCATIONS.get()
}

/// Claims, failures, bars, constraints, followers, grips, deaths, holds: to the end of the run.
#[test]
fn no_step_of_a_whole_run_allocates() {
    let objects = [[[1.0, 3.45], [1.0, 5.0]], [[5.0, 3.0], [5.0, 3.0]]];
    let homes = [[1.0, 1.0], [4.0, 1.0], [4.5, 1.0], [5.0, 1.0]];
    let more = "grasp_s = 0.05\nrelease_s = 0.05\nclearance = 0.0";
    let mut bench = Bench::new(room(&homes, &objects, BELOW, more));
    let mut table: Box<shm_types::ConstraintTable> = shm_types::zeroed();
    (table.version, table.count) = (1, 1);
    table.constraints[0] = shm_types::Constraint {
        before: 0,
        after: 1,
        kind: ConstraintKind::H1.code(),
    };
    bench.control.reserve(4);
    let probe = allocated();
    drop(std::hint::black_box(Box::new(1)));
    assert_eq!(allocated(), probe + 1, "the counter counts");

    let before = allocated();
    bench.claim(0, 0);
    bench.step();
    for _ in 0..4 {
        bench.fail(1, 0, FailureCause::Robots, 0);
        bench.step();
    }
    bench.fail(2, 0, FailureCause::Objects, NONE);
    bench.step();
    bench.table = Some(table);
    bench.step();
    for (i, home) in homes.iter().enumerate().skip(1) {
        bench.ask(i, &[[home[0] + 3.0, 1.0], [home[0] + 3.0, 1.5]]);
    }
    bench.ask(0, &[[1.0, 3.0]]);
    until_at(&mut bench, 0, [1.0, 3.0]);
    bench.claim(0, 0);
    bench.grip(0, shm_types::Grip::Grasp);
    bench.steps(8);
    assert_eq!(bench.robot(0).holding, 0);
    bench.ask(0, &[[1.0, 4.55]]);
    until_at(&mut bench, 0, [1.0, 4.55]);
    bench.grip(0, shm_types::Grip::Release);
    bench.steps(8);
    assert_eq!(bench.robot(0).holding, NONE);
    bench.tell(ControlKind::Down, 1, 1);
    bench.tell(ControlKind::Hold, 0, 0);
    bench.step();
    bench.tell(ControlKind::Up, 1, 2);
    bench.tell(ControlKind::Resume, 0, 0);
    bench.step();
    bench.commands[1].incarnation = 2;
    bench.commands[1].path.id = 0;
    bench.steps(5);
    for i in [1, 2, 3, 0] {
        let at = bench.at(i);
        let goal = homes[i];
        bench.ask(i, &[[at[0], 2.0], [goal[0], 2.0], goal]);
    }
    for _ in 0..4_000 {
        bench.step();
    }
    assert_eq!(allocated() - before, 0);
    assert_eq!(bench.world.outcome(), Outcome::Solved);
    assert_eq!(bench.world.counters().task_failures, 5);
}
