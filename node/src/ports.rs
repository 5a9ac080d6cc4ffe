//! Publish-subscribe ports.
//!
//! Responsible for: making a topic with exactly the limits of the table, sending in place,
//! receiving in place.
//! Not responsible for: which topics there are (`topics`), or when anything is sent (`roles`).
//!
//! Terms: *history* is how many samples a late joiner gets; *buffer* is how many wait for a
//! reader; *borrowed* is how many a reader may hold at once.
//!
//! A full buffer drops its oldest sample, and nobody ever waits for a reader: what must not be
//! lost is repeated until it is acknowledged.

use std::fmt::Debug;
use std::marker::PhantomData;
use std::ops::Deref;
use std::path::Path;

use iceoryx2::node::Node;
use iceoryx2::port::publisher::Publisher as IpcPublisher;
use iceoryx2::port::subscriber::Subscriber as IpcSubscriber;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::{
    BackpressureStrategy, Config, FileName, LogLevel, NodeBuilder, NodeName, SemanticString,
    ServiceName, SignalHandlingMode, ipc, set_log_level_from_env_or,
};
use iceoryx2::sample::Sample as IpcSample;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use crate::wire::{Message, Wire, in_place};

/// Bytes of a segment that are not payload: allocator, headers.
pub(crate) const SEGMENT_OVERHEAD: usize = 64 * 1024;
/// Bytes of each sample that are not payload.
pub(crate) const SAMPLE_OVERHEAD: usize = 128;

/// A run's node: what topics are made with.
pub(crate) type IpcNode = Node<ipc::Service>;

/// A topic or a port on it could not be used.
#[derive(Clone, Debug, thiserror::Error)]
#[error("could not {action} topic {topic}: {reason}")]
pub struct TopicError {
    action: &'static str,
    topic: &'static str,
    reason: String,
}

pub(crate) fn failed(
    action: &'static str,
    topic: &'static str,
) -> impl Fn(&dyn Debug) -> TopicError {
    move |reason| TopicError {
        action,
        topic,
        reason: format!("{reason:?}"),
    }
}

pub(crate) fn service_name(topic: &'static str) -> Result<ServiceName, TopicError> {
    ServiceName::new(&format!("rearrange/{topic}")).map_err(|e| failed("name", topic)(&e))
}

/// Who removes the ports and nodes that dead processes have left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Burial {
    /// Whoever joins.
    OfAll,
    /// Others. What a process has begun to remove that is killed then, nobody removes any more: to
    /// iceoryx2 it is still at it. Its port would be in the way of the next ones for ever, so
    /// whoever may be killed at any time leaves that to the supervisor, with which all would go.
    ByOthers,
}

/// Joins the iceoryx2 domain with this root directory and prefix.
///
/// # Errors
/// The domain cannot be used.
pub(crate) fn join(
    root: &Path,
    prefix: &str,
    name: &str,
    burial: Burial,
) -> Result<IpcNode, TopicError> {
    let error = failed("join the domain of", "all");
    set_log_level_from_env_or(LogLevel::Error);
    NodeBuilder::new()
        .name(&NodeName::new(name).map_err(|e| error(&e))?)
        .config(&config(root, prefix, burial)?)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<ipc::Service>()
        .map_err(|e| error(&e))
}

/// The configuration of the domain is ours alone: iceoryx2's global one would be read from the
/// working directory.
fn config(root: &Path, prefix: &str, burial: Burial) -> Result<Config, TopicError> {
    let error = failed("join the domain of", "all");
    let mut config = Config::default();
    config.global.prefix = FileName::new(prefix.as_bytes()).map_err(|e| error(&e))?;
    let root =
        iceoryx2::prelude::Path::new(root.as_os_str().as_encoded_bytes()).map_err(|e| error(&e))?;
    config.global.set_root_path(&root);
    if burial == Burial::ByOthers {
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        config.global.service.cleanup_dead_nodes_on_open = false;
    }
    Ok(config)
}

/// Who makes a topic and who only uses it: the supervisor makes all before it starts a role.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    /// Make it; it must not exist.
    Create,
    /// Use it; it must exist.
    Open,
}

/// A publish-subscribe topic, as the table describes it.
pub(crate) struct Topic<T> {
    pub(crate) name: &'static str,
    pub(crate) publishers: usize,
    pub(crate) subscribers: usize,
    pub(crate) nodes: usize,
    pub(crate) history: usize,
    pub(crate) buffer: usize,
    pub(crate) borrowed: usize,
    pub(crate) message: PhantomData<T>,
}

/// A topic that exists.
pub(crate) struct Service<T: Message> {
    pub(crate) topic: &'static str,
    pub(crate) history: usize,
    pub(crate) buffer: usize,
    pub(crate) factory: PortFactory<ipc::Service, Wire<T>, ()>,
}

/// Sends messages.
pub(crate) struct Publisher<T: Message> {
    topic: &'static str,
    port: IpcPublisher<ipc::Service, Wire<T>, ()>,
}

/// Receives messages.
pub(crate) struct Subscriber<T: Message> {
    topic: &'static str,
    port: IpcSubscriber<ipc::Service, Wire<T>, ()>,
}

/// A received message, in place. Immutable for as long as it is held.
pub(crate) struct Sample<T: Message>(IpcSample<ipc::Service, Wire<T>, ()>);

impl<T: Message> Topic<T> {
    /// Makes or opens the topic.
    ///
    /// # Errors
    /// It exists already, does not exist, or has other limits or another message.
    pub(crate) fn service(&self, node: &IpcNode, access: Access) -> Result<Service<T>, TopicError> {
        let builder = node
            .service_builder(&service_name(self.name)?)
            .publish_subscribe::<Wire<T>>()
            .max_publishers(self.publishers)
            .max_subscribers(self.subscribers)
            .max_nodes(self.nodes)
            .history_size(self.history)
            .subscriber_max_buffer_size(self.buffer)
            .subscriber_max_borrowed_samples(self.borrowed)
            .enable_safe_overflow(true);
        let factory = match access {
            Access::Create => builder
                .create()
                .map_err(|e| failed("create", self.name)(&e))?,
            Access::Open => builder.open().map_err(|e| failed("open", self.name)(&e))?,
        };
        Ok(Service {
            topic: self.name,
            history: self.history,
            buffer: self.buffer,
            factory,
        })
    }

    /// Bytes of shared memory its publishers' segments can come to hold.
    pub(crate) fn bytes(&self) -> u64 {
        let samples = self.subscribers * (self.buffer + self.borrowed) + self.history + 1;
        let sample = size_of::<T>() + SAMPLE_OVERHEAD;
        (self.publishers * (samples * sample + SEGMENT_OVERHEAD)) as u64
    }
}

impl<T: Message> Service<T> {
    /// A port that sends.
    ///
    /// # Errors
    /// All ports the run allows for exist.
    pub(crate) fn publisher(&self) -> Result<Publisher<T>, TopicError> {
        let port = self
            .factory
            .publisher_builder()
            .max_loaned_samples(1)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|e| failed("publish on", self.topic)(&e))?;
        Ok(Publisher {
            topic: self.topic,
            port,
        })
    }

    /// A port that receives, with the topic's whole buffer.
    ///
    /// # Errors
    /// All ports the run allows for exist.
    pub(crate) fn subscriber(&self) -> Result<Subscriber<T>, TopicError> {
        let port = self
            .factory
            .subscriber_builder()
            .buffer_size(self.buffer)
            .history_request(self.history)
            .create()
            .map_err(|e| failed("subscribe to", self.topic)(&e))?;
        Ok(Subscriber {
            topic: self.topic,
            port,
        })
    }
}

impl<T: Message> Publisher<T> {
    /// Sends what `fill` writes in place. It finds what was written there loans ago and must
    /// write every live field.
    ///
    /// # Errors
    /// Shared memory is in no state to carry a message.
    pub(crate) fn send(&self, fill: impl FnOnce(&mut T)) -> Result<(), TopicError> {
        let mut loan = self
            .port
            .loan_uninit()
            .map_err(|e| failed("write to", self.topic)(&e))?;
        fill(in_place(loan.payload_mut()));
        // SAFETY: `in_place` has just shown that the payload is a valid message.
        let loan = unsafe { loan.assume_init() };
        loan.send().map_err(|e| failed("send on", self.topic)(&e))?;
        Ok(())
    }

    /// Lets readers in that have come since the last message; they get the history now.
    ///
    /// # Errors
    /// A reader's connection could not be made.
    pub(crate) fn connect(&self) -> Result<(), TopicError> {
        self.port
            .update_connections()
            .map_err(|e| failed("connect readers of", self.topic)(&e))
    }
}

impl<T: Message> Subscriber<T> {
    /// The oldest message that waits, if any.
    ///
    /// # Errors
    /// Shared memory is in no state to carry a message, or too many samples are held.
    pub(crate) fn receive(&self) -> Result<Option<Sample<T>>, TopicError> {
        let sample = self
            .port
            .receive()
            .map_err(|e| failed("receive from", self.topic)(&e))?;
        Ok(sample.map(Sample))
    }
}

impl<T: Message> Deref for Sample<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0.payload().0
    }
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use iceoryx2::node::NodeState;
    use iceoryx2::prelude::CallbackProgression;

    use super::*;
    use crate::shared_memory;

    /// What tells this test that it is the process that dies: the root of the domain.
    const ROOT: &str = "REARRANGE_TEST_ROOT";
    const NAME: &str = "ports::tests::whoever_may_be_killed_leaves_the_dead_to_others";

    fn topic() -> Topic<shm_types::Command> {
        Topic {
            name: "test",
            publishers: 1,
            subscribers: 1,
            nodes: 4,
            history: 0,
            buffer: 2,
            borrowed: 2,
            message: PhantomData,
        }
    }

    fn dead(root: &Path, prefix: &str) -> usize {
        let mut dead = 0;
        let config = config(root, prefix, Burial::ByOthers).unwrap();
        IpcNode::list(&config, |state| {
            dead += usize::from(matches!(state, NodeState::Dead(_)));
            CallbackProgression::Continue
        })
        .unwrap();
        dead
    }

    #[test]
    fn whoever_may_be_killed_leaves_the_dead_to_others() {
        if let Some(root) = std::env::var_os(ROOT) {
            let prefix = std::env::var("REARRANGE_TEST_PREFIX").unwrap();
            let node = join(Path::new(&root), &prefix, "dies", Burial::ByOthers).unwrap();
            let service = topic().service(&node, Access::Open).unwrap();
            let _port = service.publisher().unwrap();
            // Nothing is dropped.
            std::process::exit(0);
        }
        let root = tempfile::Builder::new().prefix("rr").tempdir().unwrap();
        let prefix = format!("rrp{}_", std::process::id());
        let supervisor = join(root.path(), &prefix, "supervisor", Burial::OfAll).unwrap();
        let held = topic().service(&supervisor, Access::Create).unwrap();
        let status = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", NAME])
            .env(ROOT, root.path())
            .env("REARRANGE_TEST_PREFIX", &prefix)
            .status();
        assert!(status.unwrap().success());
        assert_eq!(dead(root.path(), &prefix), 1);
        let next = join(root.path(), &prefix, "next", Burial::ByOthers).unwrap();
        let service = topic().service(&next, Access::Open).unwrap();
        let refused = service.publisher().map(|_| ()).unwrap_err().to_string();
        assert!(refused.contains("ExceedsMaxSupported"), "{refused}");
        assert_eq!(dead(root.path(), &prefix), 1, "they are left alone");
        supervisor.try_cleanup_dead_nodes();
        assert_eq!(dead(root.path(), &prefix), 0);
        drop(service.publisher().unwrap());
        drop((service, next));
        drop((held, supervisor));
        shared_memory::remove_all(&prefix).unwrap();
    }
}
