//! How a plain message becomes one that iceoryx2 carries.
//!
//! Responsible for: the transparent wrapper with the message's type name, and the only unsafe
//! code of messages: a loan of shared memory seen as a message, to be written in place.
//! Not responsible for: what is sent where (`topics`), or whether what arrives makes sense
//! (`shm_types::Checked`).

use std::fmt;
use std::mem::MaybeUninit;

use iceoryx2::prelude::ZeroCopySend;
use shm_types::{
    Command, ConstraintTable, ControlReply, ControlRequest, HardAnswer, HardRequest, MotionBatch,
    PlannerReport, RecorderReport, Schedule, WorldSnapshot,
};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// A message with a name that tells its layout: two programs that mean different layouts never
/// share a topic.
pub(crate) trait Message: FromBytes + IntoBytes + Immutable + KnownLayout + 'static {
    /// Name and version, the same in every program that speaks it.
    const TYPE_NAME: &'static str;
}

macro_rules! messages {
    ($($message:ident),+ $(,)?) => {
        $(impl Message for $message {
            const TYPE_NAME: &'static str = concat!("rearrange/", stringify!($message), "/v3");
        })+
    };
}

messages!(
    WorldSnapshot,
    Command,
    PlannerReport,
    ConstraintTable,
    Schedule,
    HardRequest,
    HardAnswer,
    ControlRequest,
    ControlReply,
    MotionBatch,
    RecorderReport,
);

/// A message as iceoryx2 carries it.
#[repr(transparent)]
pub(crate) struct Wire<T>(pub(crate) T);

// SAFETY: `Message` is kept to types that `zerocopy` has proved to be free of padding and of
// invalid bytes, with a fixed `repr(C)` layout; such a type holds no pointer, reference or handle
// of a process that anybody dereferences: all fields are integers, floats and arrays of them.
unsafe impl<T: Message> ZeroCopySend for Wire<T> {
    unsafe fn type_name() -> &'static str {
        T::TYPE_NAME
    }
}

/// iceoryx2 asks for it; whole messages are too long to print.
impl<T: Message> fmt::Debug for Wire<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(T::TYPE_NAME)
    }
}

/// The message in a loan, holding whatever was written there loans ago: every live field must be
/// written before it is sent.
pub(crate) fn in_place<T: Message>(loan: &mut MaybeUninit<Wire<T>>) -> &mut T {
    // SAFETY: the loan lies in a shared-memory mapping, which the kernel hands out zeroed, so each
    // of its bytes is initialised; `Wire` is transparent; and any bytes make a valid `T`, because
    // it is `FromBytes`.
    unsafe { &mut loan.assume_init_mut().0 }
}
