//! What can go wrong in a simulated run: kinds of faults, and plans of them drawn from a seed.
//!
//! Responsible for: the words for faults, how often each kind is drawn, how long each lasts.
//! Not responsible for: letting them happen (`driver.rs`).

use std::fmt;
use std::str::FromStr;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Messages never arrive.
    Lost,
    /// A message arrives once more, later.
    Doubled,
    /// A message arrives behind the next one.
    Reordered,
    /// Messages arrive late, so that their reader acts on old ones.
    Stale,
    /// A robot's process dies and is started again.
    RobotCrash,
    /// The planner's process dies and is started again.
    PlannerCrash,
    /// The world's process dies between two ticks, or while it writes its journal, and goes on
    /// from that.
    WorldCrash,
    /// A process stands still, and goes on with the newest there is.
    Stall,
    /// The planner, or a robot that plans for itself, computes slowly, from when it next computes.
    SlowPlanner,
    /// A process's clock jumps: it acts again and again at once, or not for a while.
    ClockJump,
    /// A robot moves less than it should.
    Slip,
    /// A robot does not move.
    Stop,
    /// A robot's process sends legal rubbish, then dies and is started again.
    Babble,
}

impl Kind {
    /// Every kind.
    pub const ALL: [Self; 13] = [
        Self::Lost,
        Self::Doubled,
        Self::Reordered,
        Self::Stale,
        Self::RobotCrash,
        Self::PlannerCrash,
        Self::WorldCrash,
        Self::Stall,
        Self::SlowPlanner,
        Self::ClockJump,
        Self::Slip,
        Self::Stop,
        Self::Babble,
    ];

    /// The word for it.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Lost => "lost",
            Self::Doubled => "doubled",
            Self::Reordered => "reordered",
            Self::Stale => "stale",
            Self::RobotCrash => "robot-crash",
            Self::PlannerCrash => "planner-crash",
            Self::WorldCrash => "world-crash",
            Self::Stall => "stall",
            Self::SlowPlanner => "slow-planner",
            Self::ClockJump => "clock-jump",
            Self::Slip => "slip",
            Self::Stop => "stop",
            Self::Babble => "babble",
        }
    }

    /// How often it is drawn, in relation to the others. What comes to nothing more often, a
    /// slip of a robot that stands for instance, is drawn more often.
    const fn weight(self) -> u32 {
        match self {
            Self::Lost | Self::Doubled | Self::Reordered | Self::Stale => 14,
            Self::RobotCrash => 5,
            Self::PlannerCrash | Self::WorldCrash | Self::Babble => 4,
            Self::Stall => 8,
            Self::SlowPlanner => 12,
            Self::ClockJump => 8,
            Self::Slip | Self::Stop => 10,
        }
    }

    /// Whether it befalls messages.
    #[must_use]
    pub const fn befalls_messages(self) -> bool {
        matches!(
            self,
            Self::Lost | Self::Doubled | Self::Reordered | Self::Stale
        )
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.word())
    }
}

/// Whom a fault befalls. For messages it is their reader, or, of those the world reads, the
/// robot that sent them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Whom {
    /// The robot of this index.
    Robot(usize),
    /// The planner service.
    Planner,
    /// The world.
    World,
}

impl fmt::Display for Whom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Robot(id) => write!(f, "robot {id}"),
            Self::Planner => f.write_str("the planner"),
            Self::World => f.write_str("the world"),
        }
    }
}

/// Which messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Snapshots to a robot or to the planner.
    Snapshot,
    /// A robot's commands to the world.
    Command,
    /// A robot's questions to the planner.
    Request,
    /// The planner's answers to a robot.
    Answer,
    /// The planner's reports to the world.
    Report,
    /// Constraint tables to a robot or to the world.
    Table,
    /// Schedules to a robot or to the world.
    Schedule,
    /// What the supervisor tells the world of a robot.
    Control,
}

impl Channel {
    const fn word(self) -> &'static str {
        match self {
            Self::Snapshot => "snapshots",
            Self::Command => "commands",
            Self::Request => "questions",
            Self::Answer => "answers",
            Self::Report => "reports",
            Self::Table => "constraint tables",
            Self::Schedule => "schedules",
            Self::Control => "control",
        }
    }

    /// Whether there is a message in every tick.
    pub(crate) const fn is_steady(self) -> bool {
        matches!(self, Self::Snapshot | Self::Command | Self::Report)
    }
}

/// One fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Number in the plan it was drawn in.
    pub number: usize,
    /// Tick at which it begins, or from which on it waits for a message.
    pub tick: u64,
    /// What happens.
    pub kind: Kind,
    /// To which messages, for kinds that befall some.
    pub channel: Option<Channel>,
    /// To whom.
    pub whom: Whom,
    /// For how many ticks, or how many ticks later.
    pub ticks: u64,
    /// What else there is to say of it, from 0 to 99: a share in percent, a direction.
    pub share: u32,
}

/// What becomes of the schedule that a planner's process has written down for the next one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Damage {
    /// So much of it is left.
    CutOff { percent: usize },
    /// A byte is another one.
    Altered { at: usize },
}

impl Fault {
    /// What it damages beside a planner's process: nothing in three of four cases.
    pub(crate) const fn damage(&self) -> Option<Damage> {
        let share = self.share as usize;
        match (self.kind, share % 8) {
            (Kind::PlannerCrash, 0) => Some(Damage::CutOff { percent: share }),
            (Kind::PlannerCrash, 4) => Some(Damage::Altered { at: share }),
            _ => None,
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            number,
            tick,
            kind,
            whom,
            ticks,
            share,
            ..
        } = self;
        write!(f, "#{number} tick {tick}: {kind}")?;
        match (kind, self.channel) {
            (_, Some(channel)) => {
                write!(f, ", {} of {whom}, {ticks} ticks", channel.word())
            }
            (Kind::SlowPlanner | Kind::Slip, None) => {
                write!(f, ", {whom}, to {share} %, {ticks} ticks")
            }
            (Kind::ClockJump, None) if share % 2 == 0 => {
                write!(f, ", {whom}, {ticks} ticks ahead")
            }
            (Kind::WorldCrash, None) if share % 2 == 0 => {
                write!(f, ", {whom}, in the middle of its journal")
            }
            (Kind::WorldCrash, None) => write!(f, ", {whom}"),
            (Kind::ClockJump, None) => write!(f, ", {whom}, {ticks} ticks back"),
            (Kind::PlannerCrash, None) if self.damage().is_some() => {
                write!(f, ", {whom}, {ticks} ticks, what it left is damaged")
            }
            (_, None) => write!(f, ", {whom}, {ticks} ticks"),
        }
    }
}

/// What a plan of faults is drawn for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terms {
    /// Same seed, same plan.
    pub seed: u64,
    /// Robots of the run.
    pub robots: usize,
    /// Whether the method plans ahead: there are schedules then, else questions and tables.
    pub plans_ahead: bool,
    /// Ticks within which faults begin.
    pub ticks: u64,
    /// How many.
    pub count: usize,
}

/// Draws a plan of faults, in the order of their ticks.
#[must_use]
pub fn draw(terms: &Terms) -> Vec<Fault> {
    let mut rng = ChaCha8Rng::seed_from_u64(terms.seed);
    let mut plan: Vec<Fault> = (0..terms.count)
        .map(|_| {
            let kind = kind(&mut rng);
            let channel = kind
                .befalls_messages()
                .then(|| channel(&mut rng, terms.plans_ahead));
            Fault {
                number: 0,
                tick: rng.random_range(0..terms.ticks.max(1)),
                kind,
                channel,
                whom: whom(&mut rng, kind, channel, terms),
                ticks: duration(&mut rng, kind, channel),
                share: rng.random_range(0..100),
            }
        })
        .collect();
    plan.sort_by_key(|fault| fault.tick);
    for (number, fault) in plan.iter_mut().enumerate() {
        fault.number = number;
    }
    plan
}

fn kind(rng: &mut ChaCha8Rng) -> Kind {
    let total: u32 = Kind::ALL.iter().map(|kind| kind.weight()).sum();
    let mut pick = rng.random_range(0..total);
    for kind in Kind::ALL {
        match pick.checked_sub(kind.weight()) {
            Some(left) => pick = left,
            None => return kind,
        }
    }
    Kind::Lost
}

fn channel(rng: &mut ChaCha8Rng, plans_ahead: bool) -> Channel {
    let rare: &[Channel] = if plans_ahead {
        &[Channel::Schedule, Channel::Control]
    } else {
        &[
            Channel::Request,
            Channel::Answer,
            Channel::Table,
            Channel::Control,
        ]
    };
    match rng.random_range(0..10) {
        0..3 => Channel::Snapshot,
        3..6 => Channel::Command,
        6..7 => Channel::Report,
        _ => rare[rng.random_range(0..rare.len())],
    }
}

fn whom(rng: &mut ChaCha8Rng, kind: Kind, channel: Option<Channel>, terms: &Terms) -> Whom {
    let robot = Whom::Robot(rng.random_range(0..terms.robots));
    let is_other = rng.random_bool(0.3);
    match (kind, channel) {
        (Kind::PlannerCrash, _) => Whom::Planner,
        (Kind::SlowPlanner, _) if is_other || terms.plans_ahead => Whom::Planner,
        (Kind::WorldCrash, _) => Whom::World,
        (Kind::Stall | Kind::ClockJump, _) | (_, Some(Channel::Snapshot)) if is_other => {
            Whom::Planner
        }
        (_, Some(Channel::Table | Channel::Schedule)) if is_other => Whom::World,
        (_, Some(Channel::Report)) => Whom::World,
        _ => robot,
    }
}

/// Mostly short; now and then long enough for commands to grow stale.
fn duration(rng: &mut ChaCha8Rng, kind: Kind, channel: Option<Channel>) -> u64 {
    let is_long = rng.random_bool(0.1);
    let most = match (kind, channel) {
        (Kind::ClockJump, _) => 8,
        (_, Some(Channel::Table | Channel::Schedule)) => 60,
        (Kind::SlowPlanner | Kind::Stop | Kind::Slip, _) => 80,
        _ if is_long => 90,
        _ => 15,
    };
    rng.random_range(1..=most)
}

/// Numbers of faults, as the command line gives them: `3,17,20-24`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Numbers(pub Vec<usize>);

impl FromStr for Numbers {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| {
            text.parse::<usize>()
                .ok()
                .filter(|&number| number < MOST_FAULTS)
                .ok_or_else(|| format!("{text:?} is no number of a fault"))
        };
        let mut numbers = Vec::new();
        for part in text.split(',').filter(|part| !part.is_empty()) {
            match part.split_once('-') {
                Some((first, last)) => numbers.extend(number(first)?..=number(last)?),
                None => numbers.push(number(part)?),
            }
        }
        Ok(Self(numbers))
    }
}

/// No plan has more faults.
pub const MOST_FAULTS: usize = 100_000;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plans_are_drawn_alike_from_one_seed_and_hold_every_kind() {
        let terms = Terms {
            seed: 3,
            robots: 3,
            plans_ahead: false,
            ticks: 1_000,
            count: 2_000,
        };
        let plan = draw(&terms);
        assert_eq!(plan, draw(&terms));
        assert!(plan.is_sorted_by_key(|fault| fault.tick));
        for kind in Kind::ALL {
            let count = plan.iter().filter(|fault| fault.kind == kind).count();
            assert!(count * 50 > plan.len(), "{kind}: {count}");
        }
    }

    #[test]
    fn messages_are_befallen_at_their_reader_or_at_the_robot_that_the_world_hears() {
        for plans_ahead in [false, true] {
            let plan = draw(&Terms {
                seed: 4,
                robots: 3,
                plans_ahead,
                ticks: 1_000,
                count: 2_000,
            });
            let mut reports = 0;
            for fault in plan {
                let is_robot = matches!(fault.whom, Whom::Robot(_));
                let is_right = match fault.channel {
                    Some(Channel::Report) => fault.whom == Whom::World,
                    Some(Channel::Snapshot) => fault.whom != Whom::World,
                    Some(Channel::Table | Channel::Schedule) => fault.whom != Whom::Planner,
                    Some(_) => is_robot,
                    None => true,
                };
                assert!(is_right, "{fault}");
                reports += u32::from(fault.channel == Some(Channel::Report));
            }
            assert!(reports > 10, "{reports}");
        }
    }

    #[test]
    fn a_fault_says_which_way_it_goes() {
        let told = |kind, share| {
            let fault = Fault {
                number: 3,
                tick: 40,
                kind,
                channel: None,
                whom: Whom::World,
                ticks: 5,
                share,
            };
            fault.to_string()
        };
        let ahead = "#3 tick 40: clock-jump, the world, 5 ticks ahead";
        let back = "#3 tick 40: clock-jump, the world, 5 ticks back";
        assert_eq!(
            [0, 1].map(|share| told(Kind::ClockJump, share)),
            [ahead, back]
        );
        let damaged = "#3 tick 40: planner-crash, the world, 5 ticks, what it left is damaged";
        let whole = "#3 tick 40: planner-crash, the world, 5 ticks";
        assert_eq!(
            [0, 4, 6].map(|share| told(Kind::PlannerCrash, share)),
            [damaged, damaged, whole]
        );
        let torn = "#3 tick 40: world-crash, the world, in the middle of its journal";
        let whole = "#3 tick 40: world-crash, the world";
        assert_eq!(
            [2, 3].map(|share| told(Kind::WorldCrash, share)),
            [torn, whole]
        );
    }

    #[test]
    fn numbers_read_as_lists_and_ranges() {
        assert_eq!("3,17,20-22".parse(), Ok(Numbers(vec![3, 17, 20, 21, 22])));
        assert_eq!("".parse(), Ok(Numbers(vec![])));
        assert!("x".parse::<Numbers>().is_err());
        assert!("1-99999999999".parse::<Numbers>().is_err());
    }
}
