//! MCAP traces and the independent checker.
