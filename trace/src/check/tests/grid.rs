//! The grid against a look at every region.

use proptest::prelude::*;

use crate::check::geometry::Vector;
use crate::check::grid::{Grid, Region};

fn region() -> impl Strategy<Value = Region> {
    // Beyond the bounds too.
    (-2.0..12.0f64, -2.0..8.0f64, 0.0..3.0f64, 0.0..3.0f64).prop_map(|(x, y, width, height)| {
        Region {
            low: Vector::new(x, y),
            high: Vector::new(x + width, y + height),
        }
    })
}

fn meet(a: &Region, b: &Region) -> bool {
    let along = |a: (f64, f64), b: (f64, f64)| a.0.max(b.0) <= a.1.min(b.1);
    along((a.low.x, a.high.x), (b.low.x, b.high.x))
        && along((a.low.y, a.high.y), (b.low.y, b.high.y))
}

proptest! {
    #[test]
    fn whatever_is_near_is_found_once_and_nothing_else(
        size in (0.1..10.0f64, 0.1..6.0f64),
        size_m in 0.05..12.0f64,
        regions in prop::collection::vec(region(), 1..10),
        moved in prop::collection::vec((any::<prop::sample::Index>(), region()), 0..5),
        asked in region(),
    ) {
        let mut regions = regions;
        let bounds = Region { low: Vector::new(0.0, 0.0), high: Vector::new(size.0, size.1) };
        let mut grid = Grid::new(bounds, regions.len(), size_m);
        for (id, region) in regions.iter().enumerate() {
            grid.put(id, *region);
        }
        for (which, region) in moved {
            let id = which.index(regions.len());
            regions[id] = region;
            grid.put(id, region);
        }
        let mut found = Vec::new();
        grid.near(asked, &mut found);
        let near: Vec<usize> = (0..regions.len()).filter(|id| meet(&regions[*id], &asked)).collect();
        prop_assert_eq!(found, near);
    }
}
