//! Changes of the scene while the run goes on: something was found to be otherwise, or is wanted
//! otherwise.
//!
//! Responsible for: whether a change can be made as bodies stand and move now, and making it, from
//! one tick on. Not responsible for: what a version of a scene is (crate `scene`), who asks for
//! one (crate `node`).
//!
//! A change of walls or of what stands on the ground must be true of a room in which nobody is in
//! anybody's way: it is refused where a body would stand in a wall or in another body, or where a
//! robot has been granted path that would no longer be free. So nothing that is granted is ever
//! taken back by it, but where robots select their tasks: they stop, and select anew.

use std::fmt;

use scene::{Change, ChangeError, ROBOT_ALONE, Scene, Vec2, overlap};
use shm_types::{EventKind, Outcome};

use crate::accounts::ActivityTimes;
use crate::bodies::{Bodies, Sweep, Waiver};
use crate::cleared::Cleared;
use crate::journal::{Event, Journal};
use crate::state::{Object, Robot};
use crate::step::World;

/// What a body or a wall would be in the way of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blocked {
    /// A robot, with what it carries.
    Robot(usize),
    /// Path granted to a robot.
    Grant(usize),
    /// An object on the ground.
    Object(usize),
    /// A wall, or the outside of the room.
    Wall,
}

impl fmt::Display for Blocked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Robot(robot) => write!(f, "robot {robot} stands there"),
            Self::Grant(robot) => write!(f, "robot {robot} is on its way through there"),
            Self::Object(object) => write!(f, "object {object} stands there"),
            Self::Wall => f.write_str("it would stand in a wall"),
        }
    }
}

/// Why a change is not made. Nothing has changed then.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotMade {
    /// The run is over.
    #[error("the run is over")]
    Over,
    /// Another change is about to be made.
    #[error("another change is being made in this very tick; ask again")]
    Busy,
    /// There is no such version of the scene.
    #[error(transparent)]
    Scene(#[from] ChangeError),
    /// An object that a robot holds, or is about to, is moved by nobody else.
    #[error("object {object} is in the grip of a robot")]
    Gripped {
        /// Which.
        object: usize,
    },
    /// An object cannot stand there.
    #[error("object {object} cannot stand there: {by}")]
    Object {
        /// Which.
        object: usize,
        /// What it would be in the way of.
        by: Blocked,
    },
    /// A robot cannot be there.
    #[error("robot {robot} cannot be there: {by}")]
    Robot {
        /// Its number.
        robot: usize,
        /// What it would be in the way of.
        by: Blocked,
    },
    /// A wall cannot stand there.
    #[error("there can be no wall there: {by}")]
    Wall {
        /// What it would be in the way of.
        by: Blocked,
    },
}

/// The next version of the scene, ready to be made.
#[derive(Clone, Debug)]
pub struct Next {
    /// The scene from then on.
    pub scene: Scene,
    /// Objects that were moved by hand, ascending; they are at their starts.
    moved: Vec<usize>,
}

impl World {
    /// The version of `scene`, the one in force, that `changes` lead to, if they can be made in the
    /// next step.
    ///
    /// # Errors
    /// Why they cannot.
    pub fn prepare(&self, scene: &Scene, changes: &[Change]) -> Result<Next, NotMade> {
        if self.outcome != Outcome::Running {
            return Err(NotMade::Over);
        }
        let mut moved: Vec<usize> = changes.iter().filter_map(Change::moved).collect();
        // One that is new is put where these changes say, whether at once or by and by.
        moved.retain(|&object| object < self.objects.len());
        moved.sort_unstable();
        moved.dedup();
        let next = Next {
            scene: scene.changed(changes)?,
            moved,
        };
        for &object in &next.moved {
            if self.bodies.ground.place(object).is_none() {
                return Err(NotMade::Gripped { object });
            }
        }
        let bodies = self.bodies_of(&next);
        let put: Vec<usize> = (next.moved.iter().copied())
            .chain(self.objects.len()..next.scene.objects.len())
            .collect();
        for &object in &put {
            self.find_room(&next.scene, &bodies, object)
                .map_err(|by| NotMade::Object { object, by })?;
        }
        for robot in self.robots.len()..next.scene.homes.len() {
            self.find_room_for_robot(&next.scene, &bodies, robot)
                .map_err(|by| NotMade::Robot { robot, by })?;
        }
        if next.scene.draft().walls != scene.draft().walls {
            self.find_room_for_walls(&next.scene, &bodies)
                .map_err(|by| NotMade::Wall { by })?;
        }
        Ok(next)
    }

    /// Bodies as they stand once `next` is in force.
    fn bodies_of(&self, next: &Next) -> Bodies {
        let place = |object: usize| {
            let is_put = object >= self.objects.len() || next.moved.binary_search(&object).is_ok();
            if is_put {
                Some(next.scene.objects[object].start)
            } else {
                self.bodies.ground.place(object)
            }
        };
        self.bodies.of_version(&next.scene, place)
    }

    /// Whether `object` can stand where `bodies` has it.
    fn find_room(&self, scene: &Scene, bodies: &Bodies, object: usize) -> Result<(), Blocked> {
        let Some(at) = bodies.ground.place(object) else {
            return Ok(());
        };
        let shape = &scene.objects[object].shape;
        if bodies.object_meets_wall(scene, object, at) {
            return Err(Blocked::Wall);
        }
        let region = scene::near::Aabb::of(shape).at(at);
        let met = bodies.ground.find_near(region, |other, there| {
            other != object && overlap(shape, at, &scene.objects[other].shape, there)
        });
        if let Some(other) = met {
            return Err(Blocked::Object(other));
        }
        for (i, robot) in self.robots.iter().enumerate() {
            let passes = robot.hand.object().is_none() && scene.objects[object].pass_under;
            let waiver = |other| {
                if other == object && !passes {
                    Waiver::None
                } else {
                    Waiver::All
                }
            };
            along_grant(scene, i, robot, |sweep| {
                let met = bodies.object_met(scene, sweep, true, waiver);
                met.is_some()
            })?;
        }
        Ok(())
    }

    /// Whether a new robot can be at its home, empty-handed. That no wall and no other home is there
    /// follows from its being a scene.
    fn find_room_for_robot(
        &self,
        scene: &Scene,
        bodies: &Bodies,
        robot: usize,
    ) -> Result<(), Blocked> {
        let standing = Sweep::standing(ROBOT_ALONE, scene.homes[robot]);
        let waiver = |object: usize| {
            if scene.objects[object].pass_under {
                Waiver::All
            } else {
                Waiver::None
            }
        };
        if let Some(object) = bodies.object_met(scene, standing, true, waiver) {
            return Err(Blocked::Object(object));
        }
        for (i, other) in self.robots.iter().enumerate() {
            along_grant(scene, i, other, |sweep| {
                bodies.sweeps_meet(scene, standing, true, sweep)
                    || bodies.sweeps_meet(scene, sweep, true, standing)
            })?;
        }
        Ok(())
    }

    /// Whether the walls of `scene` leave room for what stands on the ground, and for robots where
    /// they are and where they may go.
    fn find_room_for_walls(&self, scene: &Scene, bodies: &Bodies) -> Result<(), Blocked> {
        for object in 0..scene.objects.len() {
            let at = bodies.ground.place(object);
            if at.is_some_and(|at| bodies.object_meets_wall(scene, object, at)) {
                return Err(Blocked::Object(object));
            }
        }
        for (i, robot) in self.robots.iter().enumerate() {
            along_grant(scene, i, robot, |sweep| {
                bodies.meets_wall(scene, sweep, true)
            })?;
        }
        Ok(())
    }

    /// Brings a version of the scene into force.
    pub(crate) fn take_change(&mut self, next: &Next, journal: &mut Journal<'_>) {
        let scene = &next.scene;
        self.scene_version += 1;
        self.wire.header.scenario_hash = scene.hash;
        let event = Event::new(EventKind::Changed).value(scene.hash);
        journal.event(event.other(self.scene_version));
        self.bodies = self.bodies_of(next);
        for &object in &next.moved {
            let place = scene.objects[object].start;
            (self.objects[object].position, self.objects[object].rest) = (place, place);
            journal.event(Event::new(EventKind::Moved).task(object));
        }
        for spec in &scene.objects[self.objects.len()..] {
            self.objects.push(Object::at_start(spec.start, spec.goal));
        }
        for &home in &scene.homes[self.robots.len()..] {
            self.robots.push(Robot {
                times: ActivityTimes::idle_for(self.tick),
                ..Robot::at_home(home)
            });
        }
        // What was clear in one version may not be in another.
        self.cleared = vec![Cleared::nothing(); self.robots.len()];
        self.grants.make_room(self.robots.len());
        self.bars.make_room(self.robots.len(), self.objects.len());
        for (object, spec) in self.objects.iter_mut().zip(&scene.objects) {
            object.goal = spec.goal;
            if object.holder.is_none() && object.claimed_by.is_none() {
                object.status = object.status_on_ground();
            }
        }
        for i in 0..self.robots.len() {
            if self.settings.method.plans_ahead() {
                // What is not granted was asked for when walls were elsewhere.
                self.robots[i].keep_path();
            } else {
                self.park(i, journal);
            }
        }
        self.placed();
        self.epoch.due = true;
    }
}

/// Holds a robot where it stands, then each piece of path granted to it, against something.
fn along_grant(
    scene: &Scene,
    i: usize,
    robot: &Robot,
    mut meets: impl FnMut(Sweep) -> bool,
) -> Result<(), Blocked> {
    let class = robot.class(scene);
    let mut from: Vec2 = robot.position;
    if meets(Sweep::standing(class, from)) {
        return Err(Blocked::Robot(i));
    }
    for &to in robot.grant.points() {
        if meets(Sweep { class, from, to }) {
            return Err(Blocked::Grant(i));
        }
        from = to;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use scene::{Change, Method, Settings};
    use shm_types::{EventKind, Point, TaskStatus};

    use super::*;
    use crate::control::FIRST_INCARNATION;
    use crate::testing::{BELOW, Bench, papers, room};

    /// Object 0 above robot 0, object 1 in a corner; robot 1 at the other end of the room.
    const OBJECTS: [[[f64; 2]; 2]; 2] = [[[1.0, 1.45], [5.0, 5.0]], [[8.0, 3.0], [8.0, 5.0]]];

    fn bench(settings: Settings) -> Bench {
        let homes = [[1.0, 1.0], [8.0, 1.0]];
        Bench::with(room(&homes, &OBJECTS, BELOW, ""), settings)
    }

    fn ahead() -> Settings {
        Settings {
            method: Method::Anytime,
            ..Settings::default()
        }
    }

    fn refusal(bench: &Bench, change: Change) -> NotMade {
        bench.world.prepare(&bench.scene, &[change]).unwrap_err()
    }

    fn make(bench: &mut Bench, changes: &[Change]) {
        bench.change = Some(bench.world.prepare(&bench.scene, changes).unwrap());
        bench.step();
    }

    const FAR: [f64; 2] = [3.0, 3.0];

    fn move_to(object: usize, to: [f64; 2]) -> Change {
        Change::Move { object, to }
    }

    fn add_at(at: [f64; 2]) -> Change {
        Change::AddObject {
            at,
            goal: Some([6.0, 5.0]),
            like: 0,
        }
    }

    fn add_robot(at: [f64; 2]) -> Change {
        Change::AddRobot { at }
    }

    fn close(x0: f64, y0: f64, x1: f64, y1: f64) -> Change {
        Change::Close {
            corners: [x0, y0, x1, y1],
        }
    }

    #[test]
    fn a_change_holds_from_the_next_snapshot_on_and_is_told_once() {
        let mut bench = bench(ahead());
        bench.steps(3);
        let before = *bench.header();
        let goal = Change::Goal {
            object: 1,
            to: Some([8.0, 3.0]),
        };
        make(&mut bench, &[goal, move_to(0, FAR), add_at([5.0, 3.0])]);
        let header = *bench.header();
        assert_eq!((before.scene_version, header.scene_version), (0, 1));
        assert_eq!(header.scenario_hash, bench.scene.hash);
        assert_ne!(header.scenario_hash, before.scenario_hash);
        assert_eq!(header.object_count, 3);
        assert_eq!(bench.object(0).position, Point::new(FAR[0], FAR[1]));
        assert_eq!(
            bench.object(1).status,
            TaskStatus::Done.code(),
            "it is there"
        );
        assert_eq!(bench.object(2).rest, Point::new(5.0, 3.0));
        assert_eq!(bench.object(2).status, TaskStatus::Waiting.code());
        let told = bench.events(EventKind::Changed);
        assert_eq!((told[0].other, told[0].value), (1, header.scenario_hash));
        assert_eq!(
            told[0].time_ns, before.time_ns,
            "from the tick's beginning on"
        );
        assert_eq!(bench.events(EventKind::Moved)[0].task, 0);
        bench.step();
        assert!(bench.events(EventKind::Changed).is_empty());
        assert_eq!(bench.header().scene_version, 1);
    }

    /// Grown by the clearance, the new robot's corner is over the disc that another one carries; the
    /// disc grown likewise would not reach that corner.
    #[test]
    fn a_new_robot_keeps_its_clearance_to_what_others_carry() {
        let homes = [[1.0, 0.8], [8.0, 1.0]];
        let scene = room(&homes, &OBJECTS, BELOW, "clearance = 0.1");
        let mut draft = scene.draft().clone();
        draft.objects[0].shape = scene::ShapeDraft::Circle(0.2);
        let mut bench = Bench::with(Scene::new(draft).unwrap(), papers());
        bench.claim(0, 0);
        bench.drive(0, &[[1.0, 1.0]]);
        bench.grasp(0);
        bench.drive(0, &[[1.0, 0.6], [4.0, 0.6]]);
        let disc = scene::vec(bench.object(0).position);
        let beside = |gap: f64| add_robot((disc + Vec2::repeat(0.25 + gap)).into());
        let by = Blocked::Robot(0);
        assert_eq!(
            refusal(&bench, beside(0.23)),
            NotMade::Robot { robot: 2, by }
        );
        assert!(bench.world.prepare(&bench.scene, &[beside(0.25)]).is_ok());
    }

    #[test]
    fn what_is_new_can_be_put_elsewhere_by_the_same_changes() {
        let mut bench = bench(ahead());
        make(&mut bench, &[add_at([5.0, 3.0]), move_to(2, FAR)]);
        assert_eq!(bench.object(2).position, Point::new(FAR[0], FAR[1]));
        assert!(bench.events(EventKind::Moved).is_empty(), "it is new");
    }

    #[test]
    fn what_stands_where_it_was_put_is_met_there_and_no_longer_where_it_was() {
        let mut bench = bench(ahead());
        make(
            &mut bench,
            &[move_to(0, [1.0, 3.0]), close(3.0, 0.0, 3.2, 3.0)],
        );
        // Where the object stood is free now; in front of it and of the wall the way ends.
        bench.ask(0, &[[1.0, 5.0]]);
        bench.steps(700);
        let [x, y] = bench.at(0);
        assert!(x == 1.0 && (2.5..2.551).contains(&y), "{y}");
        bench.ask(0, &[[1.0, 1.0]]);
        bench.steps(700);
        bench.ask(0, &[[5.0, 1.0]]);
        bench.step();
        assert_eq!(
            bench.world.counters().invalid_requests,
            1,
            "through the wall"
        );
        let corner = Change::Open { at: [3.1, 1.0] };
        make(&mut bench, &[corner]);
        bench.ask(0, &[[5.0, 1.0]]);
        bench.steps(900);
        assert_eq!(bench.at(0), [5.0, 1.0]);
    }

    #[test]
    fn nothing_can_be_where_something_is_or_may_go() {
        let mut bench = bench(ahead());
        bench.ask(1, &[[4.0, 1.0]]);
        bench.step();
        let object = |by| NotMade::Object { object: 0, by };
        let wall = |by| NotMade::Wall { by };
        let cases = [
            (move_to(0, [8.0, 3.3]), object(Blocked::Object(1))),
            (move_to(0, [8.0, 1.3]), object(Blocked::Robot(1))),
            (move_to(0, [5.0, 1.3]), object(Blocked::Grant(1))),
            (move_to(0, [0.1, 3.0]), object(Blocked::Wall)),
            (close(5.0, 0.0, 5.2, 3.0), wall(Blocked::Grant(1))),
            (close(7.9, 2.0, 8.1, 4.0), wall(Blocked::Object(1))),
        ];
        for (change, expected) in cases {
            assert_eq!(refusal(&bench, change), expected, "{change:?}");
        }
        let added = NotMade::Object {
            object: 2,
            by: Blocked::Object(0),
        };
        assert_eq!(refusal(&bench, add_at([1.2, 1.6])), added);
        // Touching is not overlapping.
        for fine in [
            move_to(0, [8.0, 3.4]),
            move_to(0, [5.0, 1.45]),
            close(5.0, 1.25, 5.2, 3.0),
            add_at([1.4, 1.45]),
        ] {
            bench.world.prepare(&bench.scene, &[fine]).unwrap();
        }
        bench.steps(900);
        let where_it_went = close(3.9, 0.5, 4.1, 1.2);
        assert_eq!(refusal(&bench, where_it_went), wall(Blocked::Robot(1)));
        assert_eq!(bench.header().scene_version, 0, "and nothing has changed");
    }

    #[test]
    fn what_a_robot_holds_or_closes_its_grip_on_is_moved_by_nobody_else() {
        let settings = ahead();
        let scene = room(&[[1.0, 1.0], [8.0, 1.0]], &OBJECTS, BELOW, "grasp_s = 0.1");
        let mut bench = Bench::with(scene, settings);
        bench.claim(0, 0);
        bench.step();
        bench.grip(0, shm_types::Grip::Grasp);
        bench.step();
        assert_eq!(
            bench.object(0).status,
            TaskStatus::Claimed.code(),
            "closing"
        );
        let gripped = NotMade::Gripped { object: 0 };
        assert_eq!(refusal(&bench, move_to(0, FAR)), gripped);
        bench.steps(20);
        assert_eq!(bench.robot(0).holding, 0);
        assert_eq!(refusal(&bench, move_to(0, FAR)), gripped);
        // Its goal may change, and a wall counts against what it carries.
        let goal = Change::Goal {
            object: 0,
            to: None,
        };
        make(&mut bench, &[goal]);
        assert_eq!((bench.object(0).has_goal, bench.robot(0).holding), (0, 0));
        let wall = NotMade::Wall {
            by: Blocked::Robot(0),
        };
        assert_eq!(refusal(&bench, close(0.9, 1.6, 1.1, 2.0)), wall);
    }

    #[test]
    fn robots_that_select_stop_and_look_again() {
        let mut bench = bench(papers());
        bench.claim(1, 1);
        bench.ask(1, &[[4.0, 1.0]]);
        bench.step();
        let epoch = bench.header().epoch;
        make(&mut bench, &[move_to(0, FAR)]);
        assert_eq!(bench.events(EventKind::Unclaimed)[0].robot, 1);
        assert_eq!(bench.robot(1).grant_count, 0);
        assert_eq!(bench.header().epoch, epoch + 1);
    }

    #[test]
    fn a_robot_that_is_added_is_at_home_and_takes_part_from_the_next_snapshot_on() {
        let mut bench = bench(ahead());
        bench.steps(3);
        make(&mut bench, &[add_robot([5.0, 1.0])]);
        assert_eq!(bench.header().robot_count, 3);
        let robot = bench.robot(2);
        assert_eq!(robot.position, Point::new(5.0, 1.0));
        assert_eq!((robot.live, robot.incarnation), (1, FIRST_INCARNATION));
        assert_eq!(bench.world.times(2).total(), 4, "before, it was idle");
        bench.ask(2, &[[5.0, 4.0]]);
        bench.steps(900);
        assert_eq!(bench.at(2), [5.0, 4.0]);
        // Others keep off it.
        bench.ask(1, &[[6.5, 1.0], [6.5, 4.0], [1.0, 4.0]]);
        bench.steps(1_400);
        assert!((5.5..5.52).contains(&bench.at(1)[0]), "{:?}", bench.at(1));
    }

    #[test]
    fn no_robot_comes_where_something_is_or_may_go() {
        let mut bench = bench(ahead());
        bench.ask(1, &[[4.0, 1.0]]);
        bench.step();
        let robot = |by| NotMade::Robot { robot: 2, by };
        let cases = [
            ([8.0, 2.6], robot(Blocked::Object(1))),
            ([6.0, 1.4], robot(Blocked::Grant(1))),
        ];
        for (at, expected) in cases {
            assert_eq!(refusal(&bench, add_robot(at)), expected, "{at:?}");
        }
        // Its home is another one's, or it would stand in a wall: there is no such scene.
        for at in [[1.2, 1.0], [0.1, 3.0], [5.0, 5.2]] {
            let refused = refusal(&bench, add_robot(at));
            assert!(matches!(refused, NotMade::Scene(_)), "{refused}");
        }
        // Touching is not overlapping.
        for fine in [[6.0, 1.5], [7.55, 3.0]] {
            bench
                .world
                .prepare(&bench.scene, &[add_robot(fine)])
                .unwrap();
        }
        bench.steps(900);
        let where_it_went = robot(Blocked::Robot(1));
        assert_eq!(refusal(&bench, add_robot([4.4, 1.0])), where_it_went);
        assert_eq!(bench.header().robot_count, 2, "and nothing has changed");
    }

    #[test]
    fn what_a_robot_is_barred_from_does_not_become_another_ones() {
        let mut bench = bench(papers());
        bench.fail(1, 1, shm_types::FailureCause::Robots, 0);
        bench.step();
        let counts = bench.world.bars.counts().to_vec();
        assert_eq!(counts, [0, 0, 0, 1], "by task, then by robot");
        bench.world.bars.make_room(3, 3);
        assert_eq!(bench.world.bars.counts(), [0, 0, 0, 0, 1, 0, 0, 0, 0]);
    }

    #[test]
    fn a_run_that_is_over_does_not_change() {
        let mut bench = bench(ahead());
        bench.tell(shm_types::ControlKind::Stop, 0, 0);
        bench.step();
        assert_eq!(refusal(&bench, move_to(0, FAR)), NotMade::Over);
    }
}
