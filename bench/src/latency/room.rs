//! The rooms that latencies are measured in.
//!
//! Responsible for: rooms of any number of robots and objects in which every robot is busy for as
//! long as is measured.
//! Not responsible for: rooms that are hard to solve (crate `scene` has those).

use scene::{Draft, ObjectDraft, Problems, Scene, ShapeDraft, WallDraft};

/// Objects in each dead end.
pub(super) const ROW: usize = 6;
/// Height of a lane, m.
const LANE_M: f64 = 2.0;
/// From a robot's home to its object, m.
const TRANSIT_M: f64 = 2.5;
/// From one piece of clutter to the next, m.
const CLUTTER_M: f64 = 1.0;
/// Places lie this far from a multiple of half a metre, so that bodies touch at multiples.
const QUARTER_M: f64 = 0.25;

/// Room for `robots` lanes, in each of which a robot carries an object to the far end, for at
/// least `seconds` of world time; the other objects stand aside and have no goal. All lengths are
/// multiples of half a metre, so that the lattice is coarse and the work of planning small.
///
/// # Errors
/// There are fewer objects than robots, or more than a room may have.
pub(super) fn lanes(robots: usize, objects: usize, seconds: f64) -> Result<Scene, Problems> {
    let speed = scene::RobotDraft::paper().speed_m_per_s;
    let width = (seconds * speed).ceil() + TRANSIT_M + 3.5;
    let columns = ((width - 1.0) / CLUTTER_M).floor().max(1.0) as usize;
    let clutter = objects.saturating_sub(robots);
    let floor = robots as f64 * LANE_M;
    let height = floor + clutter.div_ceil(columns) as f64 * CLUTTER_M + 1.0;
    let mut draft = Draft::room("latency", [0.0, 0.0, width, height]);
    for lane in 0..robots {
        let y = lane as f64 * LANE_M + QUARTER_M;
        draft.homes.push([0.5 + QUARTER_M, y]);
        draft.objects.push(object(
            [0.5 + QUARTER_M + TRANSIT_M, y + 0.5],
            Some([width - 1.0 - QUARTER_M, y + 0.5]),
        ));
    }
    for i in 0..clutter {
        let at = |step: usize| step as f64 * CLUTTER_M + QUARTER_M;
        let place = [0.5 + at(i % columns), floor + 0.5 + at(i / columns)];
        draft.objects.push(object(place, None));
    }
    Scene::new(draft)
}

/// Room for `robots` corridors of [`ROW`] objects each, in which every object but the last is in
/// need of the place of the next: its robot tries, fails, and asks for hard constraints.
///
/// # Errors
/// More objects than a room may have.
pub(super) fn dead_ends(robots: usize) -> Result<Scene, Problems> {
    let step = 2.0;
    let shift = step * ROW as f64;
    let width = 2.0 * shift + 6.0;
    let height = robots as f64 * (LANE_M - 0.5);
    let mut draft = Draft::room("latency-hard", [0.0, 0.0, width, height]);
    for lane in 0..robots {
        let floor = lane as f64 * (LANE_M - 0.5);
        if lane > 0 {
            let wall = [0.0, floor - 0.5, width, floor];
            draft.walls.push(WallDraft::Box(wall));
        }
        let y = floor + QUARTER_M;
        draft.homes.push([0.5 + QUARTER_M, y]);
        for place in 0..ROW {
            let x = 2.5 + QUARTER_M + step * place as f64;
            draft
                .objects
                .push(object([x, y + 0.5], Some([x + shift, y + 0.5])));
        }
    }
    Scene::new(draft)
}

fn object(start: [f64; 2], goal: Option<[f64; 2]>) -> ObjectDraft {
    ObjectDraft {
        shape: ShapeDraft::Box([0.5, 0.5]),
        grasp: [0.0, -0.5],
        ..ObjectDraft::paper(start, goal)
    }
}

#[cfg(test)]
mod tests {
    use scene::{Method, Settings};
    use shm_types::{Activity, Outcome};
    use sim::Simulation;

    use super::*;

    #[test]
    fn every_robot_is_busy_for_as_long_as_is_measured() {
        for (robots, objects) in [(1, 10), (5, 30)] {
            let scene = lanes(robots, objects, 20.0).unwrap();
            assert_eq!((scene.homes.len(), scene.objects.len()), (robots, objects));
            assert!(scene.lattice.exact && scene.lattice.pitch_m > 0.2);
            let settings = Settings {
                method: Method::NoAction,
                time_limit_ns: 20_000_000_000,
                ..Settings::default()
            };
            let mut simulation = Simulation::new(&scene, &settings, 0);
            while simulation.outcome() == Outcome::Running {
                simulation.tick();
            }
            let report = simulation.report();
            assert_eq!(report.outcome, Outcome::Timeout);
            for robot in &report.robots {
                assert!(robot.times.ticks(Activity::Moving) * 10 > report.ticks * 9);
            }
        }
    }

    #[test]
    fn dead_ends_need_hard_constraints() {
        let scene = dead_ends(2).unwrap();
        let settings = Settings {
            method: Method::Restricted,
            ..Settings::default()
        };
        let mut simulation = Simulation::new(&scene, &settings, 0);
        while simulation.outcome() == Outcome::Running {
            simulation.tick();
        }
        let report = simulation.report();
        assert_eq!(report.outcome, Outcome::Solved);
        assert_eq!(report.world.task_failures, 2 * (ROW as u64 - 1));
    }
}
