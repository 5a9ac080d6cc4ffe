//! Wake-ups, for waits that block.
//!
//! Responsible for: a wake-up that is remembered until it is taken, so none is lost between a
//! last look and falling asleep.
//! Not responsible for: whether to sleep at all (`wait`).

use std::time::Duration;

use iceoryx2::port::listener::{Listener as IpcListener, ListenerWaitError};
use iceoryx2::port::notifier::Notifier as IpcNotifier;
use iceoryx2::prelude::ipc;
use iceoryx2::service::port_factory::event::PortFactory;

use crate::ports::{Access, IpcNode, TopicError, failed, service_name};

/// A topic of wake-ups, as the table describes it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wakes {
    pub(crate) name: &'static str,
    pub(crate) listeners: usize,
    pub(crate) notifiers: usize,
    pub(crate) nodes: usize,
}

/// A topic that exists.
pub(crate) struct WakeService {
    topic: &'static str,
    factory: PortFactory<ipc::Service>,
}

/// Sleeps until somebody wakes it.
pub(crate) struct Sleeper {
    topic: &'static str,
    port: IpcListener<ipc::Service>,
}

/// Wakes all sleepers of its topic.
pub(crate) struct Waker {
    topic: &'static str,
    port: IpcNotifier<ipc::Service>,
}

impl Wakes {
    /// Makes or opens the topic.
    ///
    /// # Errors
    /// It exists already, does not exist, or has other limits.
    pub(crate) fn service(
        &self,
        node: &IpcNode,
        access: Access,
    ) -> Result<WakeService, TopicError> {
        let builder = node
            .service_builder(&service_name(self.name)?)
            .event()
            .max_listeners(self.listeners)
            .max_notifiers(self.notifiers)
            .max_nodes(self.nodes);
        let factory = match access {
            Access::Create => builder
                .create()
                .map_err(|e| failed("create", self.name)(&e))?,
            Access::Open => builder.open().map_err(|e| failed("open", self.name)(&e))?,
        };
        Ok(WakeService {
            topic: self.name,
            factory,
        })
    }
}

impl WakeService {
    /// A port that sleeps.
    ///
    /// # Errors
    /// All ports the run allows for exist.
    pub(crate) fn sleeper(&self) -> Result<Sleeper, TopicError> {
        let port = self
            .factory
            .listener_builder()
            .create()
            .map_err(|e| failed("listen to", self.topic)(&e))?;
        Ok(Sleeper {
            topic: self.topic,
            port,
        })
    }

    /// A port that wakes.
    ///
    /// # Errors
    /// All ports the run allows for exist.
    pub(crate) fn waker(&self) -> Result<Waker, TopicError> {
        let port = self
            .factory
            .notifier_builder()
            .create()
            .map_err(|e| failed("notify on", self.topic)(&e))?;
        Ok(Waker {
            topic: self.topic,
            port,
        })
    }
}

impl Sleeper {
    /// Sleeps until woken, or for `at_most`; returns at once if woken since the last time.
    ///
    /// # Errors
    /// The topic is in no state to be waited on. A signal is no error.
    pub(crate) fn sleep(&self, at_most: Duration) -> Result<(), TopicError> {
        match self.port.timed_wait(|_| (), at_most) {
            Ok(_) | Err(ListenerWaitError::InterruptSignal) => Ok(()),
            Err(error) => Err(failed("wait on", self.topic)(&error)),
        }
    }
}

impl Waker {
    /// Wakes whoever sleeps, or will.
    ///
    /// # Errors
    /// The topic is in no state to carry a wake-up.
    pub(crate) fn wake(&self) -> Result<(), TopicError> {
        match self.port.notify() {
            Ok(_) => Ok(()),
            Err(error) => Err(failed("notify on", self.topic)(&error)),
        }
    }
}
