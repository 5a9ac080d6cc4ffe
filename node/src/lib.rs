//! The process shell: iceoryx2, clocks, cores.
