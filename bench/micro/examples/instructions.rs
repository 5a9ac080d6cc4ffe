//! One hot piece, again and again, to be counted by callgrind: `bench/micro/instructions`.

use std::hint::black_box;
use std::task::Poll;

use micro::{reference, rooms};
use planner::{EasyConstraints, Floods, PathSearch};
use scene::{Budget, Occupancy, Scene};
use shm_types::Counters;

const QUERIES: usize = 100;

fn main() {
    let piece = std::env::args().nth(1).unwrap_or_default();
    let scene = rooms::room(100, 68.8, 6, 4);
    match piece.as_str() {
        "path-search" => path_search(&scene),
        "path-search-reference" => path_search_reference(&scene),
        "floods" => floods(&scene),
        "easy" => easy(&scene),
        other => panic!("no piece {other:?}: path-search, path-search-reference, floods, easy"),
    }
}

#[inline(never)]
fn path_search(scene: &Scene) {
    let mut search = PathSearch::new(scene);
    search.occupancy().reset(scene, scene.objects[0].class);
    let mut counters = Counters::default();
    for (from, to) in rooms::queries(scene, QUERIES) {
        search.begin(scene, from, to);
        let mut budget = Budget::new(u64::MAX);
        while search.advance(scene, &mut budget, &mut counters) == Poll::Pending {}
    }
    println!("{} cells", counters.cells_expanded);
}

#[inline(never)]
fn path_search_reference(scene: &Scene) {
    let mut space = Occupancy::new(scene);
    space.reset(scene, scene.objects[0].class);
    for (from, to) in rooms::queries(scene, QUERIES) {
        if let (Some(from), Some(to)) = (scene.lattice.cell(from), scene.lattice.cell(to)) {
            black_box(reference::cost(scene, &space, from, to));
        }
    }
}

#[inline(never)]
fn floods(scene: &Scene) {
    black_box(Floods::of(scene, rooms::places(scene)));
}

#[inline(never)]
fn easy(scene: &Scene) {
    let mut easy = EasyConstraints::new(scene);
    easy.begin(rooms::places(scene));
    let mut counters = Counters::default();
    while easy
        .advance(scene, &mut Budget::new(u64::MAX), &mut counters)
        .is_pending()
    {}
    println!("{} tests", easy.tested());
}
