//! The domain: geometry, scenario files, configuration space, generators.
//!
//! Responsible for: what a scene is, whether a scenario file describes one, where in it a body
//! fits, and what computing costs.
//! Not responsible for: what anybody decides (crate `planner`) or does (crates `robot`, `world`).
//!
//! Terms: a *draft* is a scenario as stated, unchecked; a *scene* is one that was checked, with
//! all that follows from it. All lengths are metres of the world frame unless a name says
//! otherwise.
#![forbid(unsafe_code)]

pub mod body;
mod build;
pub mod builtin;
pub mod canonical;
mod change;
pub mod cspace;
pub mod draft;
mod file;
mod furnish;
pub mod generate;
pub mod geometry;
pub mod lattice;
pub mod moves;
pub mod near;
mod orders;
mod overlaps;
mod pieces;
mod polygon;
pub mod problem;
mod raster;
pub mod reach;
mod rooms;
pub mod scenario;
mod scene;
pub mod schema;
pub mod settings;
pub mod shape;
pub mod validate;
mod warehouse;
pub mod work;

pub use body::{Body, ClassId, Part, ROBOT_ALONE};
pub use builtin::{BUILTIN, Builtin, builtin, warehouses};
pub use canonical::to_canonical_toml;
pub use change::{Change, ChangeError};
pub use cspace::Occupancy;
pub use draft::{Draft, Event, Move, ObjectDraft, RobotDraft, ShapeDraft, UserOrder, WallDraft};
pub use generate::{GenerateError, GenerateOptions, Generated, generate, scatter};
pub use geometry::{
    ARRIVAL_M, CONTACT_M, Vec2, overlap, point, swept_overlap, swept_regions_overlap, vec,
};
pub use lattice::{Connectivity, Lattice};
pub use moves::{CertificateError, MovePart, check_certificate};
pub use pieces::{PieceWork, Pieces};
pub use problem::{Key, Problem, Problems};
pub use reach::{CycleKind, Flood, Infeasible, certificate, joints};
pub use scenario::{Located, ScenarioError, parse, parse_version};
pub use scene::{ObjectSpec, RobotSpec, Scene};
pub use schema::json_schema;
pub use settings::{Compute, HardMode, Method, Performance, Settings};
pub use shape::{Shape, ShapeError, ShapeOutline};
pub use warehouse::warehouse;
pub use work::{Budget, UNITS_PER_OBSTACLE, UNITS_PER_POLYGON_TEST, UNITS_PER_RESET};
