//! The thinking: constraints, priorities, selection, path search.
