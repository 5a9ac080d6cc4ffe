//! A controller of one's own: the machines stepped by hand, without processes, shared memory or
//! the drivers of this project.
//!
//! Responsible for: showing the least that a loop has to do. Two robots carry one object each
//! with the method that needs no planner.
//! Not responsible for: being a driver; crate `sim` is a complete one in two hundred lines.
//!
//! Run it with `cargo run --release --example own_loop`.
#![expect(clippy::print_stdout, reason = "an example talks to its reader")]

use robot::{Robot, RobotInput};
use scene::{Method, Settings};
use shm_types::{Checked, Command, ConstraintTable, MotionBatch, Outcome, WorldSnapshot, zeroed};
use world::{FIRST_INCARNATION, World, WorldInput};

const ROOM: &str = r#"
name = "own-loop"
[robot]
shape = { box = [0.5, 0.5] }
speed = 0.5
[object]
shape = { box = [0.4, 0.4] }
[workspace]
bounds = [0.0, 0.0, 5.0, 3.0]
[[robots]]
home = [0.5, 0.5]
[[robots]]
home = [1.5, 0.5]
[[objects]]
start = [1.0, 2.0]
goal = [4.0, 2.0]
[[objects]]
start = [2.0, 2.0]
goal = [3.2, 2.0]
"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = scene::parse(ROOM, "own-loop")?;
    let settings = Settings {
        method: Method::NoAction,
        ..Settings::default()
    };
    let counts = scene.counts();
    let units = settings.units_per_tick(0);

    let mut world = World::new(&scene, settings.clone(), 1);
    let mut robots: Vec<Robot> = (0..scene.homes.len())
        .map(|id| Robot::new(&scene, settings.clone(), id, FIRST_INCARNATION))
        .collect();
    let mut commands = vec![Command::default(); robots.len()];
    let table: Box<ConstraintTable> = zeroed(); // no planner, no hard constraints
    let mut snapshot: Box<WorldSnapshot> = zeroed();
    let mut motion: Box<MotionBatch> = zeroed();

    while world.outcome() == Outcome::Running {
        world.snapshot_into(&mut snapshot);
        let seen = Checked::new(&*snapshot, counts)?;
        for (robot, command) in robots.iter_mut().zip(&mut commands) {
            let input = RobotInput {
                snapshot: seen,
                table: Checked::new(&*table, counts)?,
                schedule: None,
                answer: None,
            };
            let _asked = robot.step(&scene, input, units, command);
            // Here a loop of your own may send `command` anywhere, or put another in its place.
        }
        let commands = commands
            .iter()
            .map(|command| Checked::new(command, counts).map(Some))
            .collect::<Result<Vec<_>, _>>()?;
        let input = WorldInput {
            commands: &commands,
            planner: None,
            table: None,
            schedule: None,
            control: &[],
            change: None,
        };
        world.step(&scene, input, &mut motion);
        // `motion` holds what moved in this tick, exactly, and what happened.
    }
    world.snapshot_into(&mut snapshot);
    println!(
        "{:?} after {} s of world time",
        world.outcome(),
        snapshot.header.time_ns as f64 / 1e9
    );
    Ok(())
}
