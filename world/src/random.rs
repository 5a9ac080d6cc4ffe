//! Whatever is commanded, sense or nonsense: no overlap, nothing lost or doubled, no motion off
//! grants, grants disjoint, every tick accounted for.

use proptest::prelude::*;
use scene::{Scene, Vec2};
use shm_types::{
    Activity, BodyKind, Checked, Claim, ControlKind, Failure, FailureCause, Grip, NONE, Outcome,
    Point, index,
};

use crate::cleared::Cleared;
use crate::path::Path;
use crate::state::Hand;
use crate::testing::{Bench, TICK_M};
use crate::track::Track;

/// One thing that changes between two ticks.
#[derive(Clone, Debug)]
enum Act {
    /// Robot claims a task, selected so many epochs ago.
    Claim(usize, u32, u64),
    GiveBack(usize),
    /// Robot claims a task and asks for a path to where it can grasp its object, sideways first
    /// or upwards first, and for the grasp.
    AskToGrasp(usize, usize, bool),
    /// Robot asks for a path to where it can release an object at its goal.
    AskToRelease(usize, usize, bool),
    /// Robot carries an object to its goal from now on, as far as blind paths of one corner lead.
    Trip(usize, usize, bool),
    AskFor(usize, Vec<[f64; 2]>),
    Garbage(usize, [f64; 2], u32),
    Go(usize, bool),
    Grip(usize, Grip),
    Fail(usize, u32, FailureCause, u32, bool),
    Silent(usize, bool),
    Control(ControlKind, usize),
    /// So many ticks pass with everything as it is.
    Wait(usize),
}

const ROBOTS: usize = 4;
const OBJECTS: usize = 5;

fn scene(clearance: bool, slow_grip: bool) -> Scene {
    let clearance = if clearance { 0.025 } else { 0.0 };
    let grip = if slow_grip { 0.035 } else { 0.0 };
    let text = format!(
        "name = \"random\"\n[robot]\nshape = {{ box = [0.5, 0.5] }}\nspeed = 0.5\n\
         clearance = {clearance}\ngrasp_s = {grip}\nrelease_s = {grip}\n\
         [object]\nshape = {{ box = [0.4, 0.4] }}\ngrasp = [0.0, -0.45]\n\
         [workspace]\nbounds = [0.0, 0.0, 5.5, 4.5]\n\
         walls = [{{ box = [1.8, 0.0, 2.0, 0.4] }}]\n\
         [[robots]]\nhome = [0.5, 0.5]\n[[robots]]\nhome = [1.25, 0.5]\n\
         [[robots]]\nhome = [2.5, 0.5]\n[[robots]]\nhome = [3.5, 0.5]\n\
         [[objects]]\nstart = [1.0, 1.75]\ngoal = [1.75, 4.0]\n\
         [[objects]]\nstart = [2.25, 2.0]\ngoal = [5.0, 3.5]\n\
         [[objects]]\nstart = [3.75, 1.75]\ngoal = [0.5, 4.0]\n\
         shape = {{ box = [0.7, 0.7] }}\ngrasp = [0.0, 0.0]\npass_under = true\n\
         [[objects]]\nstart = [2.75, 3.25]\ngoal = [3.5, 3.75]\ngrasp = [0.0, 0.0]\n\
         [[objects]]\nstart = [0.75, 3.0]\ngoal = [5.0, 2.0]\nshape = {{ circle = 0.2 }}\n"
    );
    scene::parse(&text, "random.toml").unwrap()
}

fn act() -> impl Strategy<Value = Act> {
    let robot = 0..ROBOTS;
    let task = 0..OBJECTS as u32;
    let place =
        (0_u32..=22, 0_u32..=18).prop_map(|(x, y)| [f64::from(x) * 0.25, f64::from(y) * 0.25]);
    let anywhere = (-0.5..6.0, -0.5..5.0).prop_map(|(x, y)| [x, y]);
    let number = prop_oneof![
        Just(1e12),
        Just(-1e12),
        Just(1e-300),
        Just(0.0),
        Just(-0.0),
        -1e9..1e9,
        0.0..4.0
    ];
    let grip = prop_oneof![Just(Grip::Keep), Just(Grip::Grasp), Just(Grip::Release)];
    let cause = prop_oneof![
        Just(FailureCause::None),
        Just(FailureCause::Objects),
        Just(FailureCause::Robots)
    ];
    let kind = prop_oneof![
        Just(ControlKind::Up),
        Just(ControlKind::Down),
        Just(ControlKind::Hold),
        Just(ControlKind::Resume),
        Just(ControlKind::Resume)
    ];
    prop_oneof![
        4 => (robot.clone(), task.clone(), prop_oneof![4 => Just(0_u64), 1 => 1..3_u64])
            .prop_map(|(r, t, late)| Act::Claim(r, t, late)),
        1 => robot.clone().prop_map(Act::GiveBack),
        6 => (robot.clone(), 0..OBJECTS, any::<bool>())
            .prop_map(|(r, o, first)| Act::AskToGrasp(r, o, first)),
        4 => (robot.clone(), 0..OBJECTS, any::<bool>())
            .prop_map(|(r, o, first)| Act::AskToRelease(r, o, first)),
        10 => (robot.clone(), 0..OBJECTS, any::<bool>())
            .prop_map(|(r, o, first)| Act::Trip(r, o, first)),
        6 => (robot.clone(), proptest::collection::vec(place, 1..6))
            .prop_map(|(r, path)| Act::AskFor(r, path)),
        3 => (robot.clone(), proptest::collection::vec(anywhere, 1..31))
            .prop_map(|(r, path)| Act::AskFor(r, path)),
        2 => (robot.clone(), [number.clone(), number], 0_u32..=32)
            .prop_map(|(r, point, count)| Act::Garbage(r, point, count)),
        2 => (robot.clone(), prop_oneof![3 => Just(true), 1 => Just(false)])
            .prop_map(|(r, go)| Act::Go(r, go)),
        6 => (robot.clone(), grip).prop_map(|(r, grip)| Act::Grip(r, grip)),
        1 => (robot.clone(), task, cause, prop_oneof![Just(NONE), 0..ROBOTS as u32], any::<bool>())
            .prop_map(|(r, t, cause, by, answered)| Act::Fail(r, t, cause, by, answered)),
        1 => (robot.clone(), any::<bool>()).prop_map(|(r, silent)| Act::Silent(r, silent)),
        1 => (kind, robot).prop_map(|(kind, r)| Act::Control(kind, r)),
        25 => (1_usize..200).prop_map(Act::Wait),
    ]
}

/// A path with one corner from where the robot's grant ends.
fn ask_to(bench: &mut Bench, i: usize, to: Vec2, sideways_first: bool) {
    let robot = bench.robot(i);
    let from = robot.grant().last().copied().unwrap_or(robot.position);
    let corner = if sideways_first {
        [to.x, from.y]
    } else {
        [from.x, to.y]
    };
    bench.ask(i, &[corner, [to.x, to.y]]);
}

fn perform(bench: &mut Bench, act: &Act) {
    match act {
        Act::Claim(i, task, late) => {
            bench.claim(*i, *task);
            let epoch = &mut bench.commands[*i].claim.epoch;
            *epoch = epoch.saturating_sub(*late);
        }
        Act::GiveBack(i) => bench.commands[*i].claim = Claim::NONE,
        Act::AskToGrasp(i, object, first) => {
            let at = scene::vec(bench.object(*object).position);
            let to = bench.scene.grasp_at(*object, at);
            bench.claim(*i, *object as u32);
            bench.grip(*i, Grip::Grasp);
            ask_to(bench, *i, to, *first);
        }
        Act::AskToRelease(i, object, first) => {
            let object = index(bench.robot(*i).holding).unwrap_or(*object);
            let goal = bench.scene.objects[object].goal.unwrap();
            let to = bench.scene.grasp_at(object, goal);
            ask_to(bench, *i, to, *first);
        }
        Act::AskFor(i, corners) => bench.ask(*i, corners),
        Act::Garbage(i, point, count) => {
            let path = &mut bench.commands[*i].path;
            path.id = path.id.wrapping_add(1);
            path.count = *count;
            path.points[1..].fill(Point::new(point[0], point[1]));
        }
        Act::Go(i, go) => bench.commands[*i].go = u32::from(*go),
        Act::Grip(i, grip) => bench.grip(*i, *grip),
        Act::Fail(i, task, cause, blocker, answered) => {
            let id = bench.commands[*i].failure.id + 1;
            bench.commands[*i].failure = Failure {
                id,
                task: *task,
                cause: cause.code(),
                blocker: *blocker,
                answered: u32::from(*answered),
                reserved: 0,
                epoch: bench.header().epoch,
            };
        }
        Act::Silent(i, silent) => bench.silent[*i] = *silent,
        Act::Control(kind, i) => {
            let incarnation = bench.robot(*i).incarnation + u32::from(*kind == ControlKind::Up);
            if *kind == ControlKind::Up {
                bench.commands[*i].incarnation = incarnation;
            }
            bench.tell(*kind, *i as u32, incarnation);
        }
        Act::Trip(..) | Act::Wait(_) => {}
    }
}

/// What a robot on a trip wants next.
fn travel(bench: &mut Bench, i: usize, object: usize, sideways_first: bool) {
    let robot = bench.robot(i);
    let holds = robot.holding == object as u32;
    let free = robot.request_open == 0 && robot.grant_count == 0;
    let place = scene::vec(robot.position);
    let goal = bench.scene.objects[object].goal.unwrap();
    let at = if holds {
        goal
    } else {
        scene::vec(bench.object(object).position)
    };
    let to = bench.scene.grasp_at(object, at);
    let there = (to - place).norm() < 1e-9;
    let grip = match (there, holds) {
        (false, _) => Grip::Keep,
        (true, true) => Grip::Release,
        (true, false) => Grip::Grasp,
    };
    bench.grip(i, grip);
    if robot_may_claim(bench, i, object) {
        bench.claim(i, object as u32);
    }
    // Blocked, it tries the other way round, and a way through anywhere.
    let tick = bench.header().tick as usize + 7 * i;
    if (free || tick.is_multiple_of(40)) && !there {
        match tick / 40 % 4 {
            3 => {
                let (x, y) = (tick * 31 % 23, tick * 17 % 19);
                bench.ask(i, &[[x as f64 * 0.25, y as f64 * 0.25]]);
            }
            turn => ask_to(bench, i, to, sideways_first ^ (turn == 1)),
        }
    }
}

fn robot_may_claim(bench: &Bench, i: usize, object: usize) -> bool {
    let claim = bench.commands[i].claim;
    bench.robot(i).holding == NONE
        && (claim.task != object as u32 || claim.epoch != bench.header().epoch)
}

/// Where everything is, robots first.
fn places(bench: &Bench) -> Vec<Point> {
    let robots = (0..ROBOTS).map(|i| bench.robot(i).position);
    robots
        .chain((0..OBJECTS).map(|o| bench.object(o).position))
        .collect()
}

fn check(bench: &Bench, before: &[Point]) -> Result<(), TestCaseError> {
    let counts = bench.scene.counts();
    Checked::new(&*bench.snapshot, counts).unwrap();
    Checked::new(&*bench.batch, counts).unwrap();
    prop_assert_eq!(bench.overlapping(), None);
    prop_assert_eq!(bench.overlapping_grants(), None);
    let mut expected = before.to_vec();
    for piece in bench.batch.motions() {
        let robot = piece.body == BodyKind::Robot.code();
        let body = piece.id as usize + if robot { 0 } else { ROBOTS };
        prop_assert_eq!(piece.from, expected[body], "motion starts where it ended");
        expected[body] = piece.to;
    }
    let now = places(bench);
    for (body, (place, told)) in now.iter().zip(&expected).enumerate() {
        let gap_m = (place.x - told.x).hypot(place.y - told.y);
        let moved_m = (place.x - before[body].x).hypot(place.y - before[body].y);
        prop_assert!(gap_m <= 1e-6, "untold motion of {body}");
        prop_assert!(moved_m <= TICK_M + 1e-6, "{body} moved {moved_m}");
    }
    for i in 0..ROBOTS {
        let robot = bench.robot(i);
        prop_assert_eq!(bench.world.times(i).total(), bench.header().tick);
        let moved = now[i] != before[i];
        let moving = robot.activity == Activity::Moving.code();
        prop_assert_eq!(moved, moving);
        if let Some(object) = index(robot.holding) {
            prop_assert_eq!(bench.object(object).holder, i as u32);
            let at = bench
                .scene
                .grasp_at(object, scene::vec(bench.object(object).position));
            prop_assert!((at - scene::vec(robot.position)).norm() < 1e-12);
        }
    }
    for o in 0..OBJECTS {
        let holders = (0..ROBOTS).filter(|i| bench.robot(*i).holding == o as u32);
        let object = bench.object(o);
        prop_assert_eq!(holders.count(), usize::from(object.holder != NONE));
        if object.holder == NONE {
            prop_assert_eq!(object.position, object.rest);
        }
    }
    Ok(())
}

fn run(clearance: bool, slow_grip: bool, acts: &[Act]) -> Result<(Bench, usize), TestCaseError> {
    run_restored(clearance, slow_grip, acts, None)
}

fn run_restored(
    clearance: bool,
    slow_grip: bool,
    acts: &[Act],
    restored_every: Option<u64>,
) -> Result<(Bench, usize), TestCaseError> {
    let mut bench = Bench::new(scene(clearance, slow_grip));
    bench.restored_every = restored_every;
    let mut grasps = 0;
    let mut trips = [None; ROBOTS];
    for act in acts {
        perform(&mut bench, act);
        if let Act::Trip(i, object, first) = act {
            trips[*i] = Some((*object, *first));
        } else if let Act::AskFor(i, _) = act {
            trips[*i] = None;
        }
        let ticks = if let Act::Wait(ticks) = act {
            *ticks
        } else {
            1
        };
        for _ in 0..ticks {
            let before = places(&bench);
            let (epoch, tick) = (bench.header().epoch, bench.header().tick);
            for (i, trip) in trips.iter().enumerate() {
                if let Some((object, first)) = *trip {
                    travel(&mut bench, i, object, first);
                }
            }
            bench.step();
            if bench.world.outcome() != Outcome::Running {
                return Ok((bench, grasps));
            }
            prop_assert_eq!(bench.header().tick, tick + 1);
            prop_assert!(bench.header().epoch - epoch <= 1);
            check(&bench, &before)?;
            grasps += bench.events(shm_types::EventKind::Grasped).len();
        }
    }
    Ok((bench, grasps))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn whatever_is_commanded_the_invariants_hold(
        clearance in any::<bool>(),
        slow_grip in any::<bool>(),
        acts in proptest::collection::vec(act(), 1..80),
    ) {
        let (bench, _) = run(clearance, slow_grip, &acts)?;
        prop_assert_eq!(bench.world.counters().violations, 0);
    }

    #[test]
    fn the_same_commands_give_the_same_hash(
        acts in proptest::collection::vec(act(), 1..40),
    ) {
        let (one, _) = run(false, true, &acts)?;
        let (other, _) = run(false, true, &acts)?;
        prop_assert_eq!(one.header().state_hash, other.header().state_hash);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn a_world_goes_on_from_its_checkpoint_as_if_nothing_had_been(
        clearance in any::<bool>(),
        slow_grip in any::<bool>(),
        every in 1_u64..60,
        acts in proptest::collection::vec(act(), 1..60),
    ) {
        let (one, _) = run(clearance, slow_grip, &acts)?;
        let (other, _) = run_restored(clearance, slow_grip, &acts, Some(every))?;
        prop_assert_eq!(one.header().tick, other.header().tick);
        prop_assert_eq!(one.header().state_hash, other.header().state_hash);
        let (mut one, mut other) = (*one.world.counters(), *other.world.counters());
        (one.swept_tests, other.swept_tests) = (0, 0);
        for checks in [&mut one.checks, &mut other.checks] {
            // A world that was restored has looked at nothing yet.
            (checks.anew, checks.swept_tests) = (Default::default(), 0);
        }
        prop_assert_eq!(one, other);
    }
}

/// The strategy is worth something only if things do get moved by it.
#[test]
fn random_commands_grasp_and_move_objects() {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;

    let mut runner = TestRunner::deterministic();
    let mut grasped = 0;
    for _ in 0..30 {
        let acts = proptest::collection::vec(act(), 60..80)
            .new_tree(&mut runner)
            .unwrap();
        grasped += run(false, false, &acts.current()).unwrap().1;
    }
    assert!(grasped >= 10, "only {grasped} grasps in 30 runs");
}

/// Something that goes wrong between two looks, or not.
#[derive(Clone, Debug)]
enum Harm {
    /// A robot is elsewhere.
    Jump(usize, [f64; 2]),
    /// It goes on along its grant.
    Walk(usize, f64),
    /// It is granted a straight piece more.
    Grant(usize, [f64; 2]),
    /// Its grant is taken back, and given to it again.
    TakeBack(usize),
    GiveAgain(usize),
    /// It forgets its task.
    Forget(usize),
    /// An object comes to lie elsewhere.
    PutDown(usize, [f64; 2]),
    /// It is said to be elsewhere.
    Misplace(usize, [f64; 2]),
    /// It is no longer on the ground.
    Lift(usize),
    /// A robot no longer has what it holds.
    LetGo(usize),
    /// It goes on closing its grip.
    GripAgain(usize),
}

fn harm() -> impl Strategy<Value = Harm> {
    let robot = 0..ROBOTS;
    let little = || [-0.1..0.1, -0.1..0.1];
    prop_oneof![
        2 => (robot.clone(), little()).prop_map(|(i, by)| Harm::Jump(i, by)),
        6 => (robot.clone(), 0.0..0.3).prop_map(|(i, by)| Harm::Walk(i, by)),
        6 => (robot.clone(), [-0.6..0.6, -0.6..0.6]).prop_map(|(i, by)| Harm::Grant(i, by)),
        2 => robot.clone().prop_map(Harm::TakeBack),
        2 => robot.clone().prop_map(Harm::GiveAgain),
        1 => robot.clone().prop_map(Harm::Forget),
        1 => (0..OBJECTS, little()).prop_map(|(o, by)| Harm::PutDown(o, by)),
        1 => (0..OBJECTS, little()).prop_map(|(o, by)| Harm::Misplace(o, by)),
        1 => (0..OBJECTS).prop_map(Harm::Lift),
        1 => robot.clone().prop_map(Harm::LetGo),
        1 => robot.prop_map(Harm::GripAgain),
    ]
}

fn inflict(bench: &mut Bench, harm: &Harm, taken: &mut [Path; ROBOTS]) {
    let world = &mut bench.world;
    let by = |[x, y]: &[f64; 2]| Vec2::new(*x, *y);
    for robot in &mut world.robots {
        robot.track = Track::still(robot.position);
        (robot.moved, robot.granted_m) = (false, 0.0);
    }
    match harm {
        Harm::Jump(i, step) => {
            let robot = &mut world.robots[*i];
            robot.position += by(step);
            robot.track = Track::still(robot.position);
        }
        Harm::Walk(i, length_m) => {
            let robot = &mut world.robots[*i];
            world.tick_m = 1.0;
            robot.granted_m = robot.grant.length_from(robot.position);
            robot.track = Track::walk(robot.position, &robot.grant, *length_m);
            robot.moved = robot.track.corners().len() > 1;
            robot.grant.drop_front(robot.track.used());
            robot.position = robot.track.end();
        }
        Harm::Grant(i, step) => {
            let robot = &mut world.robots[*i];
            let end = robot.grant_end() + by(step);
            robot.grant.push(end);
        }
        Harm::TakeBack(i) => {
            taken[*i] = world.robots[*i].grant;
            world.robots[*i].grant.clear();
        }
        Harm::GiveAgain(i) => world.robots[*i].grant = taken[*i],
        Harm::Forget(i) => world.robots[*i].claim = None,
        Harm::PutDown(object, step) => {
            let ground = &mut world.bodies.ground;
            if let Some(at) = ground.place(*object) {
                ground.take(*object);
                ground.put(*object, at + by(step));
                world.objects[*object].position = at + by(step);
                world.objects[*object].rest = at + by(step);
            }
        }
        Harm::Misplace(object, step) => world.objects[*object].position += by(step),
        Harm::Lift(object) => world.bodies.ground.take(*object),
        Harm::LetGo(i) => world.robots[*i].hand = Hand::Empty,
        Harm::GripAgain(i) => {
            let hand = &mut world.robots[*i].hand;
            if let Hand::Holding { object } = *hand {
                *hand = Hand::Closing { object, ticks: 1 };
            }
        }
    }
    for i in 0..ROBOTS {
        if let Some(object) = world.robots[i].hand.object() {
            let at = world.robots[i].place_of(&bench.scene, object);
            world.objects[object].position = at;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// Looking only at what has changed finds as much as looking at everything.
    #[test]
    fn what_was_looked_at_before_hides_nothing(
        acts in proptest::collection::vec(act(), 1..30),
        harms in proptest::collection::vec(harm(), 1..60),
    ) {
        let (mut bench, _) = run(false, false, &acts)?;
        let mut taken = [Path::EMPTY; ROBOTS];
        for harm in harms {
            inflict(&mut bench, &harm, &mut taken);
            let found = bench.world.find_violation(&bench.scene);
            let kept = bench.world.cleared.clone();
            bench.world.cleared.fill(Cleared::nothing());
            let anew = bench.world.find_violation(&bench.scene);
            bench.world.cleared = kept;
            prop_assert_eq!(found.is_some(), anew.is_some(), "{:?}: {:?}, {:?}", harm, found, anew);
            if found.is_some() {
                break;
            }
        }
    }
}
