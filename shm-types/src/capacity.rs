//! Every capacity of a message, in one place. A scenario that exceeds one is refused when it is
//! read; a message that claims more is refused when it is checked.

/// Most objects (and so tasks) in a scenario.
pub const MAX_OBJECTS: usize = 1024;
/// Most robots in a run.
pub const MAX_ROBOTS: usize = 128;
/// Most corner points in a path request or a grant.
pub const MAX_PATH_POINTS: usize = 32;
/// Most hard constraints in force at once.
pub const MAX_CONSTRAINTS: usize = 16_384;
/// Most actions in a schedule, of all robots. Longer plans are listed piece by piece: what is listed
/// at once is held in shared memory for every reader.
pub const MAX_ACTIONS: usize = 4_096;
/// Most waits in a schedule, of all actions.
pub const MAX_WAITS: usize = 16_384;
/// Most pieces of motion in one tick: each robot and what it carries, across three corners.
pub const MAX_MOTIONS: usize = MAX_ROBOTS * 2 * 4;
/// Most events in one tick.
pub const MAX_EVENTS: usize = 2_048;
/// Most changes of the scene that one request makes together.
pub const MAX_CHANGES: usize = 16;
/// Longest answer in words to a request of control, bytes.
pub const MAX_ANSWER_BYTES: usize = 488;
/// Words of a bit set over robots.
pub const ROBOT_WORDS: usize = MAX_ROBOTS / 64;

/// First word of every snapshot: "rearrang" in ASCII, little endian.
pub const MAGIC: u64 = u64::from_le_bytes(*b"rearrang");
/// Layout of the messages. Raised whenever one changes.
pub const LAYOUT_VERSION: u32 = 5;

const _: () = assert!(MAX_ROBOTS.is_multiple_of(64));
