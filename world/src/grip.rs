//! Grips: closing around an object and opening again, each of which takes its time.
//!
//! Responsible for: when a grip may begin, how long it takes, when it ends. Not responsible for:
//! what its end means to the task (`tasks.rs`).
//!
//! A grip begins only where the robot stands; it gives up what is granted ahead of it. What is asked
//! for in the same command comes after it, and is taken up as soon as the grip is made. From the
//! first moment of closing the object counts as part of the robot, so that nobody is granted path
//! under it. Grips take whole ticks, rounded up; one of no duration takes place at once.

use scene::{ClassId, Scene};
use shm_types::{EventKind, Grip, TaskStatus};

use crate::bodies::Sweep;
use crate::broad::Aabb;
use crate::guards::Guard;
use crate::journal::{Event, Journal};
use crate::state::{Hand, Robot};
use crate::step::World;

impl World {
    /// Begins the grips that are asked for and possible.
    pub(crate) fn begin_grips(&mut self, scene: &Scene, journal: &mut Journal<'_>) {
        for i in 0..self.robots.len() {
            if !self.robots[i].link.is_fresh(self.tick) {
                continue;
            }
            match (self.robots[i].hand, self.robots[i].link.grip) {
                (Hand::Empty, Grip::Grasp) => match self.graspable(scene, i) {
                    Some((object, grasp)) => {
                        self.robots[i].grasp = grasp;
                        self.begin_grasp(scene, i, object, journal);
                    }
                    None => self.counters.grips_refused += 1,
                },
                (Hand::Holding { object }, Grip::Release) => {
                    self.begin_release(scene, i, object, journal);
                }
                _ => {}
            }
        }
    }

    /// The object robot `i` may grasp where it stands, and by which grasp: its claim under the
    /// current epoch, with nobody else in the place of what it will then carry.
    fn graspable(&self, scene: &Scene, i: usize) -> Option<(usize, usize)> {
        let robot = &self.robots[i];
        let is_present = |epoch| self.guards.holds(Guard::Epoch, epoch == self.epoch.number);
        let claim = robot.claim.filter(|c| is_present(c.epoch))?;
        let place = self.bodies.ground.place(claim.task)?;
        let grasp = scene.grasp_by(claim.task, robot.position - place)?;
        let class = scene.objects[claim.task].grasps[grasp].class;
        (self.may_carry(scene, i, claim.task, class)).then_some((claim.task, grasp))
    }

    /// Whether robot `i` with `object` in its grip would stand clear of walls, other objects, and
    /// every other robot's body and granted path. Who passes under an object keeps no clearance
    /// from it, and has to once it is held.
    fn may_carry(&self, scene: &Scene, i: usize, object: usize, class: ClassId) -> bool {
        let robot = &self.robots[i];
        let stand = Sweep::standing(class, robot.position);
        let clearance = scene.objects[object].pass_under;
        let meets_object = |region: Aabb| {
            let met = self.bodies.ground.find_near(region, |other, at| {
                let shape = &scene.objects[other].shape;
                other != object
                    && scene
                        .body(stand.class)
                        .overlaps(stand.from, false, shape, at)
            });
            met.is_some()
        };
        let meets_robot = |j: usize, other: &Robot| {
            j != i && {
                let class = other.class(scene);
                let mut from = other.position;
                let here = Sweep::standing(class, from);
                let mut ahead = other.grant.points().iter();
                self.bodies.sweeps_meet(scene, stand, clearance, here)
                    || ahead.any(|&to| {
                        let piece = Sweep { class, from, to };
                        from = to;
                        self.bodies.sweeps_meet(scene, stand, clearance, piece)
                    })
            }
        };
        !self.bodies.meets_wall(scene, stand, false)
            && !meets_object(self.bodies.region(stand, false))
            && !self
                .robots
                .iter()
                .enumerate()
                .any(|(j, r)| meets_robot(j, r))
    }

    fn begin_grasp(&mut self, scene: &Scene, i: usize, object: usize, journal: &mut Journal<'_>) {
        self.bodies.ground.take(object);
        let ticks = self.ticks_of(scene.robot.grasp_ns);
        self.stand_for_grip(i, Hand::Closing { object, ticks });
        journal.event(Event::new(EventKind::GraspStarted).robot(i).task(object));
        if ticks == 0 {
            self.finish_grip(scene, i, journal);
        }
    }

    fn begin_release(&mut self, scene: &Scene, i: usize, object: usize, journal: &mut Journal<'_>) {
        let ticks = self.ticks_of(scene.robot.release_ns);
        self.stand_for_grip(i, Hand::Opening { object, ticks });
        journal.event(Event::new(EventKind::ReleaseStarted).robot(i).task(object));
        if ticks == 0 {
            self.finish_grip(scene, i, journal);
        }
    }

    fn stand_for_grip(&mut self, i: usize, hand: Hand) {
        let robot = &mut self.robots[i];
        robot.hand = hand;
        robot.gripped = true;
        robot.give_up_path();
    }

    const fn ticks_of(&self, duration_ns: u64) -> u64 {
        duration_ns.div_ceil(self.settings.tick_ns)
    }

    /// Lets a tick pass for every grip that moves, and ends those whose time is up.
    pub(crate) fn advance_grips(&mut self, scene: &Scene, journal: &mut Journal<'_>) {
        for i in 0..self.robots.len() {
            let robot = &mut self.robots[i];
            let (Hand::Closing { ticks, .. } | Hand::Opening { ticks, .. }) = &mut robot.hand
            else {
                continue;
            };
            *ticks = ticks.saturating_sub(1);
            let over = *ticks == 0;
            robot.gripped = true;
            if over {
                self.finish_grip(scene, i, journal);
            }
        }
    }

    fn finish_grip(&mut self, scene: &Scene, i: usize, journal: &mut Journal<'_>) {
        match self.robots[i].hand {
            Hand::Closing { object, .. } => {
                self.robots[i].hand = Hand::Holding { object };
                let grasped = &mut self.objects[object];
                grasped.holder = Some(i);
                grasped.status = TaskStatus::Held;
                grasped.position = self.robots[i].place_of(scene, object);
                journal.event(Event::new(EventKind::Grasped).robot(i).task(object));
                self.placed();
            }
            Hand::Opening { object, .. } => {
                (self.robots[i].hand, self.robots[i].grasp) = (Hand::Empty, 0);
                self.put_down(i, object, journal);
            }
            Hand::Empty | Hand::Holding { .. } => {}
        }
    }

    /// Undoes a grip that robot `i` cannot finish: closing leaves the object on the ground,
    /// opening keeps it held.
    pub(crate) fn abort_grip(&mut self, i: usize) {
        let robot = &mut self.robots[i];
        match robot.hand {
            Hand::Closing { object, .. } => {
                (robot.hand, robot.grasp) = (Hand::Empty, 0);
                self.bodies
                    .ground
                    .put(object, self.objects[object].position);
            }
            Hand::Opening { object, .. } => robot.hand = Hand::Holding { object },
            Hand::Empty | Hand::Holding { .. } => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use scene::Scene;
    use shm_types::{Activity, ControlKind, EventKind, Grip, NONE, Point, TaskStatus};

    use crate::testing::{BELOW, Bench, TICK_M, room};

    const FAR: [[f64; 2]; 2] = [[1.0, 1.45], [5.0, 5.0]];

    /// A robot that stands where it can grasp the object it has claimed.
    fn ready(grasp: [f64; 2], more: &str) -> Bench {
        let home = [FAR[0][0] + grasp[0], FAR[0][1] + grasp[1]];
        let mut bench = Bench::new(room(&[home, [8.0, 1.0]], &[FAR], grasp, more));
        bench.claim(0, 0);
        bench.step();
        bench
    }

    #[test]
    fn a_grip_of_no_duration_takes_place_at_once() {
        let mut bench = ready(BELOW, "");
        bench.grip(0, Grip::Grasp);
        bench.step();
        assert_eq!((bench.robot(0).holding, bench.object(0).holder), (0, 0));
        assert_eq!(bench.object(0).status, TaskStatus::Held.code());
        assert_eq!(bench.robot(0).activity, Activity::Gripping.code());
        let started = bench.events(EventKind::GraspStarted)[0];
        assert_eq!(bench.events(EventKind::Grasped)[0].time_ns, started.time_ns);
        assert_eq!(bench.header().placements, 1);
    }

    #[test]
    fn a_grip_takes_its_duration_rounded_up_to_ticks() {
        let mut bench = ready(BELOW, "grasp_s = 0.025\nrelease_s = 0.01");
        bench.grip(0, Grip::Grasp);
        bench.step();
        let started_ns = bench.events(EventKind::GraspStarted)[0].time_ns;
        for _ in 0..2 {
            assert_eq!(bench.robot(0).holding, NONE);
            assert_eq!(bench.robot(0).activity, Activity::Gripping.code());
            bench.step();
        }
        assert_eq!(bench.robot(0).holding, 0);
        let grasped_ns = bench.events(EventKind::Grasped)[0].time_ns;
        assert_eq!(grasped_ns - started_ns, 30_000_000);
        bench.grip(0, Grip::Keep);
        bench.drive(0, &[[2.0, 1.0]]);
        bench.release(0);
        let ended = bench.events(EventKind::Released)[0].time_ns;
        assert_eq!(
            ended - bench.events(EventKind::ReleaseStarted)[0].time_ns,
            10_000_000
        );
        assert_eq!(bench.robot(0).activity, Activity::Gripping.code());
    }

    #[test]
    fn nothing_is_grasped_from_afar_or_without_a_claim() {
        let mut bench = ready(BELOW, "");
        bench.drive(0, &[[1.0, 0.999]]);
        bench.grip(0, Grip::Grasp);
        bench.step();
        assert_eq!(bench.robot(0).holding, NONE);
        bench.grip(0, Grip::Keep);
        bench.drive(0, &[[1.0, 1.0]]);
        bench.commands[0].claim = shm_types::Claim::NONE;
        bench.grip(0, Grip::Grasp);
        bench.step();
        assert_eq!(bench.robot(0).holding, NONE);
        assert_eq!(bench.world.counters().grips_refused, 2);
    }

    #[test]
    fn a_claim_of_an_older_epoch_grasps_nothing() {
        let mut bench = ready(BELOW, "");
        bench.tell(ControlKind::Down, 1, 1);
        bench.step();
        assert_eq!(bench.header().epoch, 2);
        bench.grip(0, Grip::Grasp);
        bench.step();
        assert_eq!(
            bench.robot(0).holding,
            NONE,
            "others may have selected its task by now"
        );
        bench.claim(0, 0);
        bench.step();
        assert_eq!(bench.robot(0).holding, 0);
    }

    #[test]
    fn a_grip_gives_up_what_is_granted_ahead() {
        let mut bench = ready(BELOW, "grasp_s = 0.02");
        bench.ask(0, &[[1.0, 0.5]]);
        bench.commands[0].go = 0;
        bench.step();
        assert_eq!(bench.robot(0).grant_count, 1);
        bench.commands[0].go = 1;
        bench.grip(0, Grip::Grasp);
        bench.steps(4);
        assert_eq!(bench.robot(0).holding, 0);
        assert_eq!((bench.robot(0).grant_count, bench.at(0)), (0, [1.0, 1.0]));
    }

    #[test]
    fn what_is_asked_for_along_with_a_grip_begins_in_the_tick_in_which_it_is_made() {
        let mut bench = ready(BELOW, "");
        bench.grip(0, Grip::Grasp);
        bench.ask(0, &[[2.0, 1.0]]);
        bench.step();
        assert_eq!(
            (bench.robot(0).holding, bench.at(0)),
            (0, [1.0 + TICK_M, 1.0])
        );
        assert_eq!(bench.robot(0).activity, Activity::Moving.code());
        bench.grip(0, Grip::Keep);
        bench.steps(200);
        bench.grip(0, Grip::Release);
        bench.ask(0, &[[2.0, 0.5]]);
        bench.step();
        assert_eq!(
            (bench.robot(0).holding, bench.at(0)),
            (NONE, [2.0, 1.0 - TICK_M])
        );
        assert_eq!(bench.object(0).position, Point::new(2.0, 1.45));
    }

    #[test]
    fn what_is_asked_for_along_with_a_grip_waits_until_it_is_over() {
        let mut bench = ready(BELOW, "grasp_s = 0.02");
        bench.grip(0, Grip::Grasp);
        bench.ask(0, &[[2.0, 1.0]]);
        for _ in 0..2 {
            bench.step();
            assert_eq!((bench.robot(0).grant_count, bench.at(0)), (0, [1.0, 1.0]));
        }
        assert_eq!(bench.robot(0).holding, 0);
        bench.step();
        assert_eq!(bench.at(0), [1.0 + TICK_M, 1.0]);
    }

    #[test]
    fn without_its_grip_nothing_that_comes_after_it_is_granted() {
        let mut bench = ready(BELOW, "");
        bench.commands[0].claim = shm_types::Claim::NONE;
        bench.grip(0, Grip::Grasp);
        bench.ask(0, &[[2.0, 1.0]]);
        bench.steps(5);
        assert_eq!((bench.robot(0).holding, bench.at(0)), (NONE, [1.0, 1.0]));
        assert_eq!((bench.robot(0).request, bench.robot(0).grant_count), (0, 0));
        bench.claim(0, 0);
        bench.step();
        assert_eq!(
            (bench.robot(0).holding, bench.at(0)),
            (0, [1.0 + TICK_M, 1.0])
        );
    }

    #[test]
    fn what_comes_after_a_grip_is_looked_at_with_what_is_held_then() {
        // The robot alone may go up to the wall; what it carries juts out above it.
        let mut bench = ready(BELOW, "");
        bench.grip(0, Grip::Grasp);
        bench.ask(0, &[[1.0, 5.75]]);
        bench.step();
        assert_eq!(bench.world.counters().invalid_requests, 1);
        assert_eq!((bench.robot(0).holding, bench.at(0)), (0, [1.0, 1.0]));
    }

    /// An object that robots lift from below and may pass under, and two robots.
    fn canopy(clearance: f64) -> Scene {
        let text = "name = \"canopy\"\n[robot]\nshape = { box = [0.5, 0.5] }\nspeed = 0.5\n\
            clearance = CLEARANCE\n[object]\nshape = { box = [0.8, 0.8] }\ngrasp = [0.0, 0.0]\npass_under = true\n\
            [workspace]\nbounds = [0.0, 0.0, 10.0, 6.0]\n\
            [[robots]]\nhome = [1.0, 1.0]\n[[robots]]\nhome = [5.0, 1.0]\n\
            [[objects]]\nstart = [3.0, 1.0]\ngoal = [3.0, 4.0]\n";
        let text = text.replace("CLEARANCE", &clearance.to_string());
        scene::parse(&text, "canopy.toml").unwrap()
    }

    #[test]
    fn nothing_is_lifted_nearer_to_somebody_than_the_clearance() {
        let mut bench = Bench::new(canopy(0.05));
        bench.claim(0, 0);
        bench.drive(0, &[[3.0, 1.0]]);
        // 2 cm beside the object, as who passes under it may be, and 5 cm away.
        for (x, holding) in [(3.67, NONE), (3.7, 0)] {
            bench.grip(0, Grip::Keep);
            bench.drive(1, &[[x, 1.0]]);
            bench.grip(0, Grip::Grasp);
            bench.step();
            assert_eq!(bench.robot(0).holding, holding, "robot 1 at {x}");
        }
    }

    #[test]
    fn nothing_is_lifted_over_somebody_else() {
        let mut bench = Bench::new(canopy(0.0));
        bench.claim(0, 0);
        bench.drive(0, &[[3.0, 1.0]]);
        bench.drive(1, &[[3.5, 1.0]]);
        bench.grip(0, Grip::Grasp);
        bench.step();
        assert_eq!(bench.robot(0).holding, NONE, "robot 1 is under it too");
        bench.grip(0, Grip::Keep);
        bench.drive(1, &[[5.0, 1.0]]);
        bench.grasp(0);
        bench.ask(1, &[[3.5, 1.0]]);
        bench.steps(400);
        assert!(bench.at(1)[0] >= 3.65 - 1e-9, "held, it is in the way");
    }

    #[test]
    fn the_robot_under_what_it_has_put_down_may_leave() {
        for pass_under in [true, false] {
            let mut scene = canopy(0.0);
            scene.objects[0].pass_under = pass_under;
            let mut bench = Bench::new(scene);
            bench.claim(0, 0);
            bench.drive(0, &[[3.0, 1.0]]);
            bench.grasp(0);
            bench.drive(0, &[[3.0, 4.0]]);
            bench.release(0);
            assert_eq!(bench.object(0).status, TaskStatus::Done.code());
            bench.drive(0, &[[1.0, 4.0]]);
            bench.ask(0, &[[3.0, 4.0]]);
            bench.steps(600);
            let under = bench.at(0)[0] > 2.4;
            assert_eq!(under, pass_under, "once it has left it may not come back");
        }
    }

    #[test]
    fn a_touched_target_is_approached_and_left_despite_the_clearance() {
        let objects = [[[3.0, 2.0], [5.0, 4.0]]];
        let mut bench = Bench::new(room(&[[3.0, 1.0]], &objects, BELOW, "clearance = 0.1"));
        bench.ask(0, &[[3.0, 1.55]]);
        bench.steps(200);
        assert!(bench.at(0)[1] < 1.451, "not claimed: clearance is kept");
        bench.claim(0, 0);
        bench.steps(40);
        assert_eq!(bench.at(0), [3.0, 1.55]);
        bench.grasp(0);
        bench.drive(0, &[[5.0, 3.55]]);
        bench.release(0);
        assert_eq!(bench.object(0).status, TaskStatus::Done.code());
        bench.drive(0, &[[5.0, 1.0]]);
        bench.ask(0, &[[5.0, 3.55]]);
        bench.steps(600);
        assert!(bench.at(0)[1] < 3.451, "left, it is like any other");
    }

    #[test]
    fn putting_down_at_the_goal_puts_it_exactly_there() {
        let mut bench = ready([0.1, -0.45], "");
        bench.grasp(0);
        // The sum is not exact in floating point.
        bench.drive(0, &[[5.0 + 0.1, 5.0 - 0.45]]);
        bench.release(0);
        let object = bench.object(0);
        assert_eq!((object.position, object.rest), (object.goal, object.goal));
        assert_eq!(object.status, TaskStatus::Done.code());
    }
}
