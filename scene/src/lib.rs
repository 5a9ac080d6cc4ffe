//! The domain: geometry, scenario files, configuration space, generators.
