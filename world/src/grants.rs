//! Grants: space is given to one robot before it moves, so that no two ever collide, whatever is
//! late, stale or dead.
//!
//! Responsible for: the queue of open requests, oldest first and then by id; what each is granted
//! in this tick. Not responsible for: whether a request is sound (`requests.rs`), what is in the
//! way of one (`extension.rs`), moving along what is granted (`motion.rs`).
//!
//! Terms: the *region* of a robot is what its body covers from where it stands along all that is
//! granted to it. Two passes a tick:
//!
//! - *In space*: a grant grows as far as the sweep of the body meets no grounded object and no
//!   other robot's region. Regions stay disjoint, so wherever a robot stops on its own grant it
//!   blocks granted path of nobody (no hold-and-wait).
//! - *In time*: what is not granted in space grows by at most what the tick's motion uses up at
//!   once, if the body meets no other body at any instant of the tick, nor what stays granted
//!   to others after it. Robots are asked again whenever the one that blocked them goes further:
//!   a fixed point that works from front to back, whatever the ids, so that robots follow one
//!   another nose to tail and lose no time. After the tick the regions are disjoint again.

use scene::{Scene, Vec2};

use crate::bodies::{Bodies, Sweep};
use crate::broad::Aabb;
use crate::extension::{Field, Refusal, farthest};
use crate::guards::Guards;
use crate::path::ARRIVAL_M;
use crate::state::Robot;
use crate::track::Track;

/// Into how many equal steps the motion of one tick is cut where it cannot be granted whole: a
/// robot stops at most this share of it short of what is in its way.
const STEPS_PER_TICK: f64 = 64.0;

/// The passes' working memory, kept over ticks.
#[derive(Clone, Debug)]
pub(crate) struct Grants {
    queue: Vec<usize>,
    /// Box of each robot's region.
    regions: Vec<Aabb>,
    /// Who is to be asked again.
    again: Vec<bool>,
    blocked_by: Vec<Option<usize>>,
    /// Arc length of one tick at full speed, m.
    tick_m: f64,
}

/// What the passes look at besides the robots.
#[derive(Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) bodies: &'a Bodies,
    pub(crate) guards: Guards,
}

impl Grants {
    /// For `robots` robots that move `tick_m` in a tick.
    pub(crate) fn new(robots: usize, tick_m: f64) -> Self {
        let nowhere = Aabb::around(Vec2::zeros(), Vec2::zeros());
        Self {
            queue: Vec::with_capacity(robots),
            regions: vec![nowhere; robots],
            again: vec![false; robots],
            blocked_by: vec![None; robots],
            tick_m,
        }
    }

    /// Makes room for more robots.
    pub(crate) fn make_room(&mut self, robots: usize) {
        *self = Self::new(robots, self.tick_m);
    }

    /// Grants what can be granted at `tick`, and sets every robot's track for its motion.
    /// Returns how many requests were refused for the first time.
    pub(crate) fn extend(
        &mut self,
        around: Surroundings<'_>,
        robots: &mut [Robot],
        tick: u64,
    ) -> u64 {
        self.queue.clear();
        for (i, robot) in robots.iter().enumerate() {
            let open = !robot.rest.is_empty() && !robot.hand.is_moving();
            if open && robot.link.is_fresh(tick) {
                self.queue.push(i);
            }
            self.regions[i] = region_of(around, robot);
        }
        self.queue
            .sort_unstable_by_key(|&i| (robots[i].request_tick, i));
        for q in 0..self.queue.len() {
            self.extend_in_space(around, robots, self.queue[q]);
        }
        for robot in robots.iter_mut() {
            robot.track = set_out(robot, tick, self.tick_m);
        }
        let mut refused = 0;
        for &i in &self.queue {
            if !robots[i].rest.is_empty() && !robots[i].refused {
                robots[i].refused = true;
                refused += 1;
            }
        }
        self.extend_all_in_time(around, robots, tick);
        refused
    }

    fn extend_in_space(&mut self, around: Surroundings<'_>, robots: &mut [Robot], i: usize) {
        while let Some(to) = robots[i].rest.first()
            && has_room(&robots[i])
        {
            let from = robots[i].grant_end();
            let field = self.field(around, robots);
            let farthest = farthest(from, to, f64::INFINITY, self.tick_m, |end| {
                field.check_in_space(i, from, end)
            });
            let Some((end, whole)) = farthest.end else {
                break;
            };
            self.grant(around, &mut robots[i], i, end, whole);
            if !whole {
                break;
            }
        }
    }

    /// Asks everyone once, and again whenever who blocked it has gone further.
    fn extend_all_in_time(&mut self, around: Surroundings<'_>, robots: &mut [Robot], tick: u64) {
        for &i in &self.queue {
            self.again[i] = moves(&robots[i], tick);
            self.blocked_by[i] = None;
        }
        let mut progress = true;
        while progress {
            progress = false;
            for q in 0..self.queue.len() {
                let i = self.queue[q];
                if !std::mem::take(&mut self.again[i]) {
                    continue;
                }
                if self.extend_in_time(around, robots, i) {
                    for &behind in &self.queue {
                        if self.blocked_by[behind] == Some(i) {
                            self.again[behind] = true;
                            self.blocked_by[behind] = None;
                            progress = true;
                        }
                    }
                }
            }
        }
    }

    /// Extends one robot's grant by what it can use up within this tick; whether it got any.
    fn extend_in_time(&mut self, around: Surroundings<'_>, robots: &mut [Robot], i: usize) -> bool {
        let mut extended = false;
        while let Some(to) = robots[i].rest.first()
            && has_room(&robots[i])
        {
            let track = robots[i].track;
            let tick_m = self.tick_m * robots[i].drive;
            let left_m = tick_m - track.moved_m();
            let at_grant_end = track.used() == robots[i].grant.points().len();
            if !at_grant_end || track.is_full() || left_m <= ARRIVAL_M {
                break;
            }
            let from = track.end();
            let step_m = self.tick_m / STEPS_PER_TICK;
            let field = self.field(around, robots);
            let farthest = farthest(from, to, left_m, step_m, |end| {
                field.check_in_time(i, end, self.tick_m)
            });
            if let Some(Refusal::Robot(other)) = farthest.refusal {
                self.blocked_by[i] = Some(other);
            }
            let Some((end, whole)) = farthest.end else {
                break;
            };
            self.grant(around, &mut robots[i], i, end, whole);
            let robot = &mut robots[i];
            robot.track = Track::walk(robot.position, &robot.grant, tick_m);
            extended = true;
            if !whole {
                break;
            }
        }
        extended
    }

    fn grant(
        &mut self,
        around: Surroundings<'_>,
        robot: &mut Robot,
        i: usize,
        end: Vec2,
        whole: bool,
    ) {
        let sweep = Sweep {
            class: robot.class(around.scene),
            from: robot.grant_end(),
            to: end,
        };
        self.regions[i] = self.regions[i].joined(around.bodies.region(sweep, false));
        if robot.cut && !robot.grant.is_empty() {
            robot.grant.replace_last(end);
        } else {
            robot.grant.push(end);
        }
        robot.cut = !whole;
        if whole {
            robot.rest.drop_front(1);
            robot.action_end = Some(end);
        }
    }

    fn field<'a>(&'a self, around: Surroundings<'a>, robots: &'a [Robot]) -> Field<'a> {
        Field {
            scene: around.scene,
            bodies: around.bodies,
            guards: around.guards,
            robots,
            regions: &self.regions,
        }
    }
}

/// Whether one more point can be granted: a cut point is moved, any other added.
fn has_room(robot: &Robot) -> bool {
    !robot.grant.is_full() || robot.cut
}

/// Whether a robot moves in this tick, if it has where to go.
fn moves(robot: &Robot, tick: u64) -> bool {
    robot.link.is_fresh(tick) && robot.link.go && !robot.hand.is_moving()
}

fn set_out(robot: &Robot, tick: u64, tick_m: f64) -> Track {
    if moves(robot, tick) {
        Track::walk(robot.position, &robot.grant, tick_m * robot.drive)
    } else {
        Track::still(robot.position)
    }
}

/// Box of what a robot covers from where it stands along its whole grant.
fn region_of(around: Surroundings<'_>, robot: &Robot) -> Aabb {
    let (class, points) = (robot.class(around.scene), robot.grant.points());
    let bodies = around.bodies;
    bodies.region_along(class, robot.position, points.iter().copied())
}

#[cfg(test)]
mod tests {
    use crate::testing::{BELOW, Bench, TICK_M, room};

    /// Ticks a way takes at full speed.
    fn ticks(length_m: f64) -> usize {
        (length_m / TICK_M - 1e-6).ceil() as usize
    }

    #[test]
    fn robots_nose_to_tail_lose_no_time_whatever_their_ids() {
        // Touching, and the leader has the highest id, so that it comes last in the queue.
        let homes = [[1.0, 1.0], [1.5, 1.0], [2.0, 1.0], [2.5, 1.0]];
        let mut bench = Bench::new(room(&homes, &[], BELOW, ""));
        for (i, home) in homes.iter().enumerate() {
            bench.ask(i, &[[home[0] + 5.0, home[1]]]);
        }
        bench.steps(ticks(5.0));
        for (i, home) in homes.iter().enumerate() {
            assert_eq!(bench.at(i), [home[0] + 5.0, home[1]]);
        }
        assert_eq!(bench.overlapping(), None);
    }

    #[test]
    fn a_follower_stops_when_its_leader_does() {
        let homes = [[1.0, 1.0], [1.5, 1.0]];
        let mut bench = Bench::new(room(&homes, &[], BELOW, ""));
        bench.ask(0, &[[6.0, 1.0]]);
        bench.ask(1, &[[3.0, 1.0]]);
        bench.steps(ticks(1.5) + 20);
        assert_eq!(bench.at(1), [3.0, 1.0]);
        let gap_m = bench.at(1)[0] - bench.at(0)[0] - 0.5;
        assert!(gap_m.abs() < 1e-9, "gap {gap_m}");
        assert_eq!(bench.robot(0).request_open, 1);
    }

    #[test]
    fn a_follower_waits_while_its_leader_computes() {
        let homes = [[1.0, 1.0], [1.5, 1.0]];
        let mut bench = Bench::new(room(&homes, &[], BELOW, ""));
        bench.ask(0, &[[6.0, 1.0]]);
        bench.ask(1, &[[9.0, 1.0]]);
        bench.commands[1].go = 0;
        bench.steps(10);
        assert_eq!(bench.at(0), [1.0, 1.0]);
        bench.commands[1].go = 1;
        bench.steps(10);
        let gap_m = bench.at(1)[0] - bench.at(0)[0] - 0.5;
        assert!(bench.at(0)[0] > 1.04 && gap_m.abs() < 1e-9, "gap {gap_m}");
    }

    #[test]
    fn robots_head_on_stop_before_they_overlap() {
        let mut bench = Bench::new(room(&[[1.0, 1.0], [4.0, 1.0]], &[], BELOW, ""));
        bench.ask(0, &[[8.0, 1.0]]);
        bench.ask(1, &[[1.0, 1.0]]);
        bench.steps(800);
        let gap_m = bench.at(1)[0] - bench.at(0)[0] - 0.5;
        assert!((0.0..TICK_M).contains(&gap_m), "gap {gap_m}");
        assert!(bench.robot(0).request_open == 1 && bench.robot(1).request_open == 1);
    }

    #[test]
    fn turning_into_a_place_waits_until_its_body_has_left() {
        // Robot 1 leaves upwards from the place that robot 0 enters from the left.
        let mut bench = Bench::new(room(&[[1.0, 1.0], [1.5, 1.0]], &[], BELOW, ""));
        bench.ask(0, &[[1.5, 1.0]]);
        bench.ask(1, &[[1.5, 2.0]]);
        for tick in 1..=ticks(0.5) {
            bench.step();
            assert_eq!(bench.at(0), [1.0, 1.0], "tick {tick}");
            assert_eq!(bench.overlapping(), None);
        }
        bench.steps(ticks(0.5));
        assert_eq!(bench.at(0), [1.5, 1.0], "gone after as many ticks again");
    }

    #[test]
    fn the_oldest_request_comes_first_then_the_lowest_id() {
        let homes = [[1.0, 1.0], [3.0, 1.0], [2.0, 3.0]];
        let mut bench = Bench::new(room(&homes, &[], BELOW, ""));
        // Robot 2 stands still of its own will, but has asked first.
        bench.ask(2, &[[2.0, 1.0]]);
        bench.commands[2].go = 0;
        bench.step();
        bench.ask(0, &[[2.0, 1.0]]);
        bench.ask(1, &[[2.0, 1.0]]);
        bench.steps(300);
        assert_eq!(bench.robot(2).request_open, 0);
        assert!(bench.at(0)[0] <= 1.5 && bench.at(1)[0] >= 2.5);
        bench.commands[2].go = 1;
        bench.steps(ticks(2.0));
        assert_eq!(bench.at(2), [2.0, 1.0]);

        let mut bench = Bench::new(room(&homes[..2], &[], BELOW, ""));
        bench.ask(1, &[[2.0, 1.0]]);
        bench.ask(0, &[[2.0, 1.0]]);
        bench.step();
        assert_eq!(
            (bench.robot(0).request_open, bench.robot(1).request_open),
            (0, 1)
        );
        assert_eq!(bench.world.counters().grants_refused, 1);
        bench.steps(20);
        assert_eq!(bench.world.counters().grants_refused, 1, "counted once");
    }

    #[test]
    fn a_grant_stops_short_of_an_object() {
        let mut bench = Bench::new(room(&[[1.0, 1.0]], &[[[3.0, 1.0], [5.0, 5.0]]], BELOW, ""));
        bench.ask(0, &[[8.0, 1.0]]);
        bench.steps(600);
        let gap_m = 3.0 - 0.2 - 0.25 - bench.at(0)[0];
        assert!((-1e-12..1e-4).contains(&gap_m), "gap {gap_m}");
        assert_eq!(bench.robot(0).request_open, 1);
    }

    #[test]
    fn clearance_is_kept_from_robots_and_objects() {
        let objects = [[[3.0, 1.0], [5.0, 5.0]]];
        let homes = [[1.0, 1.0], [5.0, 3.0], [7.0, 3.0]];
        let mut bench = Bench::new(room(&homes, &objects, [0.0, -0.5], "clearance = 0.05"));
        bench.ask(0, &[[8.0, 1.0]]);
        bench.ask(1, &[[7.0, 3.0]]);
        bench.steps(600);
        let gap_m = 3.0 - 0.2 - 0.25 - bench.at(0)[0];
        assert!((0.05 - 1e-12..0.05 + 1e-4).contains(&gap_m), "gap {gap_m}");
        let gap_m = bench.at(2)[0] - bench.at(1)[0] - 0.5;
        assert!((0.05 - 1e-12..0.05 + 1e-4).contains(&gap_m), "gap {gap_m}");
    }

    #[test]
    fn a_long_path_with_many_corners_is_used_by_arc_length() {
        let mut bench = Bench::new(room(&[[1.0, 1.0]], &[], BELOW, ""));
        let corners: Vec<[f64; 2]> = (1..=30)
            .map(|k| {
                [
                    1.0 + 0.05 * f64::from((k + 1) / 2),
                    1.0 + 0.05 * f64::from(k / 2),
                ]
            })
            .collect();
        bench.ask(0, &corners);
        bench.steps(ticks(30.0 * 0.05));
        assert_eq!(bench.at(0), corners[29]);
        assert_eq!(bench.robot(0).grant_count, 0);
    }
}
