//! The trap in iceoryx2 that the janitor is there for, against a bare domain: a connection file of no
//! length makes everybody who opens it wait without end, until it is gone.

use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Duration;

use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::{Config, FileName, NodeBuilder, SemanticString, ServiceName};
use iceoryx2::prelude::{SignalHandlingMode, ipc};

use super::janitor::Janitor;
use crate::shared_memory;

/// How long something that waits without end is watched. If it had gone on, that would be told.
const WATCHED: Duration = Duration::from_millis(400);
/// How long a cure may take, whatever the machine does.
const PATIENCE: Duration = Duration::from_secs(30);

fn node(root: &Path, prefix: &str) -> iceoryx2::node::Node<ipc::Service> {
    let mut config = Config::default();
    config.global.prefix = FileName::new(prefix.as_bytes()).unwrap();
    let root = iceoryx2::prelude::Path::new(root.as_os_str().as_encoded_bytes()).unwrap();
    config.global.set_root_path(&root);
    NodeBuilder::new()
        .config(&config)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<ipc::Service>()
        .unwrap()
}

fn service(
    node: &iceoryx2::node::Node<ipc::Service>,
) -> iceoryx2::service::port_factory::publish_subscribe::PortFactory<ipc::Service, u64, ()> {
    let name = ServiceName::new("trap").unwrap();
    node.service_builder(&name)
        .publish_subscribe::<u64>()
        .open_or_create()
        .unwrap()
}

fn connections(prefix: &str) -> Vec<PathBuf> {
    let files = std::fs::read_dir(shared_memory::SHARED_MEMORY)
        .unwrap()
        .flatten();
    let paths = files.map(|file| file.path());
    let name = |path: &PathBuf| path.file_name().unwrap().to_string_lossy().into_owned();
    paths
        .filter(|path| name(path).starts_with(prefix) && name(path).ends_with(".connection"))
        .collect()
}

/// A publisher that finds a half-made connection to its reader: whether it got stuck, and whether
/// it went on after `cure`.
fn stuck_and_cured(name: &str, cure: impl FnOnce(&str, &[PathBuf])) -> (bool, bool) {
    let root = tempfile::Builder::new().prefix("rr").tempdir().unwrap();
    let prefix = format!("rrw{}{name}_", std::process::id());
    let (ready, is_ready) = mpsc::channel();
    let (go, goes) = mpsc::channel::<()>();
    let (done, is_done) = mpsc::channel();
    let (path, theirs) = (root.path().to_owned(), prefix.clone());
    let thread = std::thread::spawn(move || {
        let node = node(&path, &theirs);
        let service = service(&node);
        let publisher = service.publisher_builder().create().unwrap();
        ready.send(()).unwrap();
        goes.recv().unwrap();
        let _ = publisher.update_connections();
        done.send(()).unwrap();
    });
    is_ready.recv_timeout(PATIENCE).unwrap();
    let own = node(root.path(), &prefix);
    let reader = service(&own).subscriber_builder().create().unwrap();
    // As a process leaves it that is killed between making the file and giving it its length. The
    // reader keeps the one it has mapped.
    let files = connections(&prefix);
    for file in &files {
        std::fs::remove_file(file).unwrap();
        std::fs::write(file, b"").unwrap();
    }
    go.send(()).unwrap();
    let stuck = is_done.recv_timeout(WATCHED).is_err();
    cure(&prefix, &files);
    let cured = is_done.recv_timeout(PATIENCE).is_ok();
    if cured {
        thread.join().unwrap();
    }
    std::mem::forget(reader);
    drop(own);
    shared_memory::remove_all(&prefix).unwrap();
    assert!(!files.is_empty(), "there was a connection to be made");
    (stuck, cured)
}

#[test]
fn a_half_made_connection_stops_a_bare_domain_until_it_is_removed_by_hand() {
    let by_hand = |_: &str, files: &[PathBuf]| {
        for file in files {
            std::fs::remove_file(file).unwrap();
        }
    };
    assert_eq!(stuck_and_cured("bare", by_hand), (true, true));
}

#[test]
fn the_janitor_gets_a_domain_going_again() {
    let mut janitor = None;
    let hire = |prefix: &str, _: &[PathBuf]| {
        janitor = Some(Janitor::start(prefix.to_owned()).unwrap());
    };
    assert_eq!(stuck_and_cured("ours", hire), (true, true));
    assert!(janitor.unwrap().take_removed() > 0);
}
