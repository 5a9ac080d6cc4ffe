//! Every hot piece under criterion: `cargo bench` in `bench/micro`, `cargo bench -- floods` for one.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use micro::{reference, rooms};
use planner::{EasyConstraints, Floods, HardConstraints, PathSearch, Selection};
use scene::{Budget, HardMode, Method, Scene, Settings};
use shm_types::{Checked, ConstraintTable, Counters, WorldSnapshot, zeroed};
use sim::Simulation;
use world::World;

fn finish(mut advance: impl FnMut(&mut Budget, &mut Counters) -> bool) {
    let (mut budget, mut counters) = (Budget::new(u64::MAX), Counters::default());
    while !advance(&mut budget, &mut counters) {}
}

fn crowded() -> Scene {
    rooms::room(100, 68.8, 6, 4)
}

fn path_search(c: &mut Criterion) {
    let scene = crowded();
    let mut search = PathSearch::new(&scene);
    search.occupancy().reset(&scene, scene.objects[0].class);
    let space = search.occupancy().clone();
    let queries = rooms::queries(&scene, 50);
    c.bench_function("path search, 50 queries", |b| {
        b.iter(|| {
            for (from, to) in &queries {
                search.begin(&scene, *from, *to);
                finish(|budget, counters| search.advance(&scene, budget, counters).is_ready());
            }
        });
    });
    c.bench_function("path search, 50 queries, pathfinding crate", |b| {
        b.iter(|| {
            for (from, to) in &queries {
                if let (Some(from), Some(to)) = (scene.lattice.cell(*from), scene.lattice.cell(*to))
                {
                    black_box(reference::cost(&scene, &space, from, to));
                }
            }
        });
    });
}

fn constraints(c: &mut Criterion) {
    let scene = crowded();
    let settings = Settings {
        method: Method::GraspingAndRestricted,
        hard: HardMode::Literal,
        ..Settings::default()
    };
    let mut hard = HardConstraints::new(&scene, &settings);
    c.bench_function("hard constraints on one failure, 100 objects", |b| {
        b.iter(|| {
            hard.update(rooms::places(&scene));
            hard.begin_task(&scene, 7);
            finish(|budget, counters| hard.advance(&scene, budget, counters).is_ready());
        });
    });
    c.bench_function("floods, 100 objects", |b| {
        b.iter(|| black_box(Floods::of(&scene, rooms::places(&scene))));
    });
    let large = rooms::room(1000, 2400.0, 400, 4);
    c.bench_function("easy constraints, 1000 objects", |b| {
        b.iter(|| {
            let mut easy = EasyConstraints::new(&large);
            easy.begin(rooms::places(&large));
            finish(|budget, counters| easy.advance(&large, budget, counters).is_ready());
        });
    });
}

fn selection(c: &mut Criterion) {
    let scene = crowded();
    let settings = Settings {
        method: Method::GraspingAndRestricted,
        ..Settings::default()
    };
    let mut snapshot = zeroed::<WorldSnapshot>();
    World::new(&scene, settings.clone(), 0).snapshot_into(&mut snapshot);
    let table = zeroed::<ConstraintTable>();
    let mut selection = Selection::new(&scene, &settings);
    let world = Checked::new(&*snapshot, scene.counts()).unwrap_or_else(|e| panic!("{e}"));
    c.bench_function("selection, 100 objects, lengths known", |b| {
        b.iter(|| {
            selection.begin(world, &table);
            finish(|budget, counters| selection.advance(&scene, budget, counters).is_ready());
        });
    });
    c.bench_function("snapshot check, 100 objects", |b| {
        b.iter(|| black_box(Checked::new(&*snapshot, scene.counts()).is_ok()));
    });
    let body = scene.body(scene.objects[0].class);
    let (from, to) = (scene.objects[0].start, scene.objects[1].start);
    c.bench_function("swept test", |b| {
        b.iter(|| {
            let shape = &scene.objects[2].shape;
            black_box(body.sweeps(from, black_box(to), true, shape, to, to))
        });
    });
}

/// A tick of everything in process: world, planner, all robots, snapshot, hash.
fn ticks(c: &mut Criterion) {
    for (robots, objects, area_m2, walls) in [(4, 5, 68.8, 3), (100, 100, 1000.0, 60)] {
        let scene = rooms::room(objects, area_m2, walls, robots);
        let settings = Settings {
            method: Method::Restricted,
            ..Settings::default()
        };
        let mut simulation = Simulation::new(&scene, &settings, 0);
        for _ in 0..500 {
            simulation.tick();
        }
        c.bench_function(&format!("tick, {robots} robots, {objects} objects"), |b| {
            b.iter(|| {
                black_box(simulation.tick());
            });
        });
    }
}

criterion_group! {
    name = hot;
    config = Criterion::default().sample_size(20);
    targets = path_search, constraints, selection, ticks
}
criterion_main!(hot);
