//! Workloads, histograms, reports.
