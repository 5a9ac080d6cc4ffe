//! One robot's step machine.
