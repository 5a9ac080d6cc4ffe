//! The thinking: constraints, priorities, selection, path search.
//!
//! Responsible for: which tasks come before which (`easy`, `hard`), what each is worth
//! (`priority`), who takes which (`selection`), ways through the room (`search`, `field`,
//! `obstacles`), what cannot be solved at all (`certificate`), and the planner service
//! (`service`).
//! Not responsible for: what a robot does about it (crate `robot`), what is allowed to move
//! (crate `world`).
//!
//! Everything that may take long is a resumable computation: `begin` copies its inputs once,
//! `advance` works until it is done or its `Budget` is spent. The outcome and the units are the
//! same whatever the budgets. After construction nothing allocates. `anytime` is an exception to
//! both.
//!
//! Terms: the *initial* place of an object is where it last stood on the ground (rule 9). An
//! *edge* `before → after` keeps `after` from being selected until `before` is completed
//! (rule 13).
#![forbid(unsafe_code)]

mod anytime;
mod assignment;
mod bounds;
mod certificate;
pub mod easy;
mod event;
mod feasibility;
mod field;
mod floods;
mod frontier;
mod hard;
mod joints;
mod kind;
mod legs;
mod lengths;
mod meter;
mod nearby;
pub mod obstacles;
mod pairs;
mod places;
mod priority;
mod proof;
mod repair;
mod rings;
mod rollout;
mod search;
mod selection;
mod service;
mod store;

pub use bounds::{BoundLimits, Bounds, MOST_ROBOTS, MOST_TASKS, Yardstick};
pub use certificate::certificate;
pub use easy::EasyConstraints;
pub use event::{Event, Precedence};
pub use field::DistanceField;
pub use floods::{FloodWork, Floods};
pub use hard::{Found, HardConstraints};
pub use kind::Kind;
pub use legs::{LEG_EXACTNESS, LegSearch, Legs};
pub use obstacles::{Robots, WorldView};
pub use places::Places;
pub use priority::{Priority, PriorityGraph};
pub use proof::Proof;
pub use repair::{MOST_TRIED, Repair};
pub use rings::{event_ring, task_rings};
pub use rollout::{BeginRollout, Rollout, Transfer, UNITS_PER_ROBOT_AND_TICK};
pub use search::PathSearch;
pub use selection::Selection;
pub use service::{Planner, PlannerInput, PlannerOutput};
pub use store::{Constraint, Leg, Placement, Reason, Removal, Store, Ways};
