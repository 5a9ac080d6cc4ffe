//! The tests of geometry and the configuration space allocate nothing once they are set up.
#![expect(
    clippy::unwrap_used,
    reason = "helpers of tests, which fail by panicking"
)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use scene::{
    Flood, Occupancy, ROBOT_ALONE, Scene, Shape, Vec2, joints, overlap, swept_overlap,
    swept_regions_overlap,
};

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

/// Runs `work` and returns how often it allocated.
fn allocations(work: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.get();
    work();
    ALLOCATIONS.get() - before
}

fn shapes() -> [Shape; 3] {
    let corners = [[0.3, 0.0], [-0.1, 0.4], [-0.3, -0.2]].map(|[x, y]| Vec2::new(x, y));
    [
        Shape::rectangle(Vec2::new(0.5, 0.4)).unwrap(),
        Shape::circle(0.3).unwrap(),
        Shape::polygon(&corners).unwrap(),
    ]
}

#[test]
fn the_counter_counts() {
    assert_eq!(allocations(|| drop(std::hint::black_box(vec![1]))), 1);
}

#[test]
fn no_test_of_geometry_allocates() {
    let shapes = shapes();
    let counted = allocations(|| {
        let mut overlaps = 0;
        for i in 0..1_000 {
            let at = Vec2::new(f64::from(i % 40) * 0.02, f64::from(i / 40) * 0.02);
            let to = Vec2::new(0.3, f64::from(i % 7) * 0.1);
            for a in &shapes {
                for b in &shapes {
                    overlaps += u32::from(overlap(a, at, b, Vec2::zeros()));
                    overlaps += u32::from(swept_overlap(a, at, to, b, Vec2::zeros()));
                    let meet = swept_regions_overlap(a, at, to, b, to, -at);
                    overlaps += u32::from(meet);
                }
            }
        }
        assert!((1_000..27_000).contains(&overlaps), "{overlaps}");
    });
    assert_eq!(counted, 0);
}

#[test]
fn a_configuration_space_is_reused_without_allocating() {
    let text = scene::builtin("h1").unwrap().text;
    for text in [
        text.to_owned(),
        text.replace("{ box = [0.5, 0.5] }", "{ circle = 0.25 }"),
    ] {
        let scene: Scene = scene::parse(&text, "h1").unwrap();
        let (mut space, mut flood) = (Occupancy::new(&scene), Flood::new(&scene));
        let shapes = shapes();
        let counted = allocations(|| {
            for class in [ROBOT_ALONE, scene.objects[0].class] {
                space.reset(&scene, class);
                for (i, shape) in shapes.iter().enumerate() {
                    let at = Vec2::new(1.0 + i as f64, 3.0);
                    space.block(&scene, shape, at, true);
                    space.block_swept(&scene, shape, at, at + Vec2::new(0.2, 0.1));
                }
                flood.run(&scene, &space, scene.homes[0]);
                let off_lattice = scene.homes[0] + Vec2::new(0.013, 0.017);
                assert!(joints(&scene, &space, off_lattice).count() > 0);
                assert!(flood.reached_at(&scene, &space, off_lattice));
            }
        });
        assert_eq!(counted, 0);
    }
}
