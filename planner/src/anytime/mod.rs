//! Planning ahead for all robots.
mod ground;
mod order;
mod plan;
mod publish;
mod route;
mod sequence;
mod solver;
mod timeline;
