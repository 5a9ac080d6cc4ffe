//! The in-process driver.
