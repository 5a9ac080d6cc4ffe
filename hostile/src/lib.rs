//! Hostile input: what a broken or hostile process may send or leave behind, and what must come of
//! it: nothing worse than a refusal.
//!
//! Responsible for: one target for each kind of input, which changes good values as a tape of bytes
//! says, has them checked, and drives the machines with what was accepted. The ordinary tests, the
//! loop that counts (`examples/hostile.rs`) and libFuzzer (`fuzz/`) feed them.
//! Not responsible for: where tapes come from.
//!
//! Terms: a *tape* ([`Tape`]) says what to change, so most inputs are good but for a few words, and
//! get past the header. What comes of a tape depends on nothing but it: machines that have a history
//! are made anew for each, and a tape brings them several messages.
#![forbid(unsafe_code)]
#![expect(
    clippy::expect_used,
    reason = "good values that cannot be made are a bug of the tests"
)]

mod bench;
mod recording;
mod saved;
mod scenario;
mod tape;
mod to_robots;
mod to_world;

use bench::Bench;
use scene::Method;
use shm_types::Invalid;
pub use tape::Tape;

/// How far an input got.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Got {
    /// It was refused for what it says of itself: no message of this program, no such file, a
    /// checksum that is wrong.
    Refused,
    /// It was refused for a value further inside.
    Inside,
    /// It was accepted, and used.
    Accepted,
}

impl Got {
    /// How far a message got that was checked.
    const fn of<T>(result: &Result<T, Invalid>) -> Self {
        match result {
            Ok(_) => Self::Accepted,
            Err(Invalid::Foreign) => Self::Refused,
            Err(_) => Self::Inside,
        }
    }
}

/// A kind of input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// The text of a scenario file.
    Scenario,
    /// A trace, to the checker, the viewer and a recorder that goes on with it.
    Trace,
    /// Snapshots, to robots and planner.
    Snapshot,
    /// Commands, to the world.
    Command,
    /// Constraint tables, to the world and robots.
    Table,
    /// Schedules, to the world and robots.
    Schedule,
    /// Requests of control, to the world.
    Control,
    /// The world's saved state, to a world that is started again.
    Journal,
    /// Batches of motion, to the trace's writer.
    Motion,
    /// Robots' questions to the planner, and its answers to robots.
    Question,
    /// The planner's reports, to the world.
    Report,
}

impl Target {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::Scenario,
        Self::Trace,
        Self::Snapshot,
        Self::Command,
        Self::Table,
        Self::Schedule,
        Self::Control,
        Self::Journal,
        Self::Motion,
        Self::Question,
        Self::Report,
    ];
}

/// All targets, with the good values that they need. Nothing in here changes.
pub struct Targets {
    texts: Vec<String>,
    benches: Vec<Bench>,
}

impl Targets {
    /// Small rooms in the middle of runs.
    #[must_use]
    pub fn new() -> Self {
        let options = |seed| scene::GenerateOptions {
            seed,
            objects: 3,
            robots: 2,
            area_m2: 9.0,
            walls: 1,
            ..scene::GenerateOptions::default()
        };
        let rooms: Vec<_> = (0..3)
            .map(|seed| scene::generate(&options(seed)).expect("a room"))
            .collect();
        let mut texts: Vec<String> = rooms.iter().map(|room| room.text.clone()).collect();
        texts.extend(scene::BUILTIN.iter().map(|file| file.text.to_owned()));
        texts.sort_by_key(String::len);
        texts.truncate(8);
        let methods = [Method::Anytime, Method::Restricted, Method::All];
        let benches = rooms.iter().zip(methods).zip([200, 700, 900]);
        Self {
            benches: benches
                .map(|((room, method), ticks)| Bench::new(&room.scene, method, ticks))
                .collect(),
            texts,
        }
    }

    /// Runs `target` on one tape.
    #[must_use]
    pub fn run(&self, target: Target, tape: &[u8]) -> Got {
        let tape = &mut Tape::new(tape);
        if target == Target::Scenario {
            return scenario::read(&self.texts, tape);
        }
        let bench = match target {
            // Only one of the methods has any.
            Target::Schedule => &self.benches[0],
            _ => &self.benches[tape.below(self.benches.len())],
        };
        match target {
            Target::Scenario | Target::Trace => recording::trace(bench, tape),
            Target::Motion => recording::motion(bench, tape),
            Target::Snapshot => to_robots::snapshots(bench, tape),
            Target::Question => to_robots::questions(bench, tape),
            Target::Command => to_world::commands(bench, tape),
            Target::Table => to_world::tables(bench, tape),
            Target::Schedule => to_world::schedules(bench, tape),
            Target::Control => to_world::control(bench, tape),
            Target::Report => to_world::reports(bench, tape),
            Target::Journal => saved::state(bench, tape),
        }
    }
}

impl Default for Targets {
    fn default() -> Self {
        Self::new()
    }
}

/// Brings machines up to four messages, as long as the tape lasts: how far the one got that got least
/// far.
fn each(tape: &mut Tape<'_>, mut bring: impl FnMut(&mut Tape<'_>) -> Got) -> Got {
    let messages = 1 + tape.below(4);
    let mut got = Got::Accepted;
    for _ in 0..messages {
        got = got.min(bring(tape));
        if tape.has_ended() {
            break;
        }
    }
    got
}
