//! Path search against the `pathfinding` crate's A*: the same queries on the same maps, the same
//! lengths, medians. `cargo run --release --example path_search`.

use std::hint::black_box;
use std::time::Instant;

use micro::{reference, rooms};
use planner::PathSearch;
use scene::{Budget, Scene};
use shm_types::Counters;

const QUERIES: usize = 400;

fn main() {
    let maps = [
        ("paper-68a", rooms::builtin("paper-68a")),
        ("paper-17b", rooms::builtin("paper-17b")),
        ("100 objects, 68.8 m²", rooms::room(100, 68.8, 6, 4)),
        ("100 objects, 240 m²", rooms::room(100, 240.0, 40, 4)),
        ("300 objects, 720 m²", rooms::room(300, 720.0, 120, 4)),
    ];
    for (name, scene) in &maps {
        for blocked in [false, true] {
            compare(name, scene, blocked);
        }
    }
}

fn compare(name: &str, scene: &Scene, blocked: bool) {
    let mut search = PathSearch::new(scene);
    let (mut ours, mut theirs, mut counters) = (Vec::new(), Vec::new(), Counters::default());
    let mut paths = 0;
    for (index, (from, to)) in rooms::queries(scene, QUERIES).into_iter().enumerate() {
        let class = scene.objects[0].class;
        search.occupancy().reset(scene, class);
        if blocked {
            let other = &scene.objects[(index * 3 + 1) % scene.objects.len()];
            search
                .occupancy()
                .block(scene, &other.shape, other.start, true);
        }
        let (Some(start), Some(end)) = (scene.lattice.cell(from), scene.lattice.cell(to)) else {
            panic!("{name}: a place off the lattice");
        };
        let begun = Instant::now();
        search.begin(scene, from, to);
        let mut budget = Budget::new(u64::MAX);
        let length = loop {
            if let std::task::Poll::Ready(length) =
                search.advance(scene, &mut budget, &mut counters)
            {
                break length;
            }
        };
        ours.push(begun.elapsed().as_secs_f64());
        let space = search.occupancy().clone();
        let free = space.is_free(start) && space.is_free(end);
        let begun = Instant::now();
        let cost = free
            .then(|| reference::cost(scene, &space, start, end))
            .flatten();
        theirs.push(black_box(begun.elapsed().as_secs_f64()));
        let expected = cost.map(|cost| f64::from(cost) / 408.0 * scene.lattice.pitch_m);
        match (length, expected) {
            (None, None) => {}
            (Some(length), Some(expected)) => {
                paths += 1;
                let apart = (length - expected).abs();
                assert!(
                    apart <= 4e-6 * expected.max(1.0),
                    "{name}: {length} and {expected} m"
                );
            }
            other => panic!("{name}: {other:?}"),
        }
    }
    let ns_per_cell = ours.iter().sum::<f64>() * 1e9 / counters.cells_expanded as f64;
    let ratios: Vec<f64> = ours.iter().zip(&theirs).map(|(a, b)| b / a).collect();
    let totals = theirs.iter().sum::<f64>() / ours.iter().sum::<f64>();
    let (ours, theirs) = (median(ours), median(theirs));
    println!(
        "{name}{}: {} points, {QUERIES} queries ({paths} paths): ours {:.1} µs, reference {:.1} µs, \
         medians; {:.1} times as fast, per query {:.1}, in total {totals:.1}; {ns_per_cell:.1} ns a cell",
        if blocked {
            ", an object in the way"
        } else {
            ""
        },
        scene.lattice.len(),
        ours * 1e6,
        theirs * 1e6,
        theirs / ours,
        median(ratios),
    );
}

fn median(mut sample: Vec<f64>) -> f64 {
    sample.sort_by(f64::total_cmp);
    sample[sample.len() / 2]
}
