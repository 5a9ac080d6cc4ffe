//! Safe intervals.

use scene::{ROBOT_ALONE, Settings};

use super::*;
use crate::anytime::solver::testing::cells;

/// Their ends belong to them.
#[test]
fn a_safe_interval_holds_every_span_up_to_its_ends_and_none_beyond() {
    let ground = Ground::new(&cells(&["A.."]), &Settings::default(), Vec::new());
    let mut timeline = Timeline::new(&ground);
    let (class, cell, owner) = (ROBOT_ALONE.0, 1, 5);
    timeline.occupy(class, &[cell], (owner, 0), 100);
    timeline.vacate(class, &[cell], owner, 200);
    let skip = Skip {
        robot: 0,
        resting: [(Owner::MAX, 0); 2],
        parked_below: 0,
    };
    let gap_of = |span| timeline.gap_of(class, cell, span, skip);
    let before = Some(Gap { from: 0, to: 100 });
    let after = Some(Gap {
        from: 200,
        to: EVER,
    });
    for (span, gap) in [
        ((0, 100), before),
        ((40, 60), before),
        ((100, 100), before),
        ((200, 200), after),
        ((200, EVER), after),
        ((0, 101), None),
        ((150, 150), None),
        ((199, 300), None),
    ] {
        assert_eq!(gap_of(span), gap, "{span:?}");
    }
}
