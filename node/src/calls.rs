//! Request-response ports.
//!
//! Responsible for: asking, answering, and keeping a question until its answer has come.
//! Not responsible for: asking again (the machines do, and answering twice does no harm).
//!
//! A server that dies looks connected until somebody cleans up, so whoever asks has a deadline of
//! its own.

use std::cell::Cell;
use std::marker::PhantomData;
use std::ops::Deref;
use std::time::Duration;

use iceoryx2::active_request::ActiveRequest;
use iceoryx2::pending_response::PendingResponse;
use iceoryx2::port::client::Client as IpcClient;
use iceoryx2::port::server::Server as IpcServer;
use iceoryx2::prelude::{BackpressureStrategy, ipc};
use iceoryx2::service::port_factory::request_response::PortFactory;

use crate::ports::{Access, IpcNode, SAMPLE_OVERHEAD, SEGMENT_OVERHEAD, TopicError};
use crate::ports::{failed, service_name};
use crate::wire::{Message, Wire};

/// Questions a client may have open at once: one that is being answered while the next is asked.
pub(crate) const OPEN_CALLS: usize = 2;

/// A request-response topic, as the table describes it.
pub(crate) struct Calls<Q, A> {
    pub(crate) name: &'static str,
    pub(crate) clients: usize,
    pub(crate) nodes: usize,
    pub(crate) messages: PhantomData<(Q, A)>,
}

/// A topic that exists.
pub(crate) struct CallService<Q: Message, A: Message> {
    topic: &'static str,
    factory: PortFactory<ipc::Service, Wire<Q>, (), Wire<A>, ()>,
}

/// Asks.
pub(crate) struct Client<Q: Message, A: Message> {
    topic: &'static str,
    port: IpcClient<ipc::Service, Wire<Q>, (), Wire<A>, ()>,
    /// How often the next question is asked again if there is nobody to hear it.
    patience: Cell<u32>,
}

/// How often a client asks its first question again if nobody hears it.
const FIRST_TRIES: u32 = 2_000;
/// How long it waits in between.
const AGAIN: Duration = Duration::from_millis(1);

/// Answers.
pub(crate) struct Server<Q: Message, A: Message> {
    topic: &'static str,
    port: IpcServer<ipc::Service, Wire<Q>, (), Wire<A>, ()>,
}

/// A question on its way.
pub(crate) struct Call<Q: Message, A: Message> {
    topic: &'static str,
    pending: PendingResponse<ipc::Service, Wire<Q>, (), Wire<A>, ()>,
}

/// A question to be answered.
pub(crate) struct Question<Q: Message, A: Message> {
    topic: &'static str,
    request: ActiveRequest<ipc::Service, Wire<Q>, (), Wire<A>, ()>,
}

impl<Q: Message, A: Message> Calls<Q, A> {
    /// Makes or opens the topic.
    ///
    /// # Errors
    /// It exists already, does not exist, or has other limits or other messages.
    pub(crate) fn service(
        &self,
        node: &IpcNode,
        access: Access,
    ) -> Result<CallService<Q, A>, TopicError> {
        let builder = node
            .service_builder(&service_name(self.name)?)
            .request_response::<Wire<Q>, Wire<A>>()
            .max_clients(self.clients)
            .max_servers(1)
            .max_nodes(self.nodes)
            .max_active_requests_per_client(OPEN_CALLS)
            .max_loaned_requests(1)
            .max_response_buffer_size(1)
            .max_borrowed_responses_per_pending_response(1)
            .enable_safe_overflow_for_requests(true)
            .enable_safe_overflow_for_responses(true)
            .enable_fire_and_forget_requests(false);
        let factory = match access {
            Access::Create => builder
                .create()
                .map_err(|e| failed("create", self.name)(&e))?,
            Access::Open => builder.open().map_err(|e| failed("open", self.name)(&e))?,
        };
        Ok(CallService {
            topic: self.name,
            factory,
        })
    }

    /// Bytes of shared memory the segments of clients and server can come to hold.
    pub(crate) fn bytes(&self) -> u64 {
        let questions = 2 * OPEN_CALLS + 1;
        let question = size_of::<Q>() + SAMPLE_OVERHEAD;
        let answers = self.clients * 2 * OPEN_CALLS * 3;
        let answer = size_of::<A>() + SAMPLE_OVERHEAD;
        let asking = self.clients * (questions * question + SEGMENT_OVERHEAD);
        (asking + answers * answer + SEGMENT_OVERHEAD) as u64
    }
}

impl<Q: Message, A: Message> CallService<Q, A> {
    /// A port that asks.
    ///
    /// # Errors
    /// All ports the run allows for exist.
    pub(crate) fn client(&self) -> Result<Client<Q, A>, TopicError> {
        let port = self
            .factory
            .client_builder()
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|e| failed("ask on", self.topic)(&e))?;
        Ok(Client {
            topic: self.topic,
            port,
            patience: Cell::new(FIRST_TRIES),
        })
    }

    /// The port that answers.
    ///
    /// # Errors
    /// Somebody answers already.
    pub(crate) fn server(&self) -> Result<Server<Q, A>, TopicError> {
        let port = self
            .factory
            .server_builder()
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .max_loaned_responses_per_request(1)
            .create()
            .map_err(|e| failed("answer on", self.topic)(&e))?;
        Ok(Server {
            topic: self.topic,
            port,
        })
    }
}

impl<Q: Message + Copy, A: Message> Client<Q, A> {
    /// From the first question on, asks without waiting for somebody to hear it.
    pub(crate) fn hurry(&self) {
        self.patience.set(0);
    }

    /// Asks. At most [`OPEN_CALLS`] calls may be held at once.
    ///
    /// # Errors
    /// Too many calls are held, or shared memory is in no state to carry one.
    pub(crate) fn call(&self, question: Q) -> Result<Call<Q, A>, TopicError> {
        let ask = || {
            self.port
                .send_copy(Wire(question))
                .map_err(|e| failed("ask on", self.topic)(&e))
        };
        let mut pending = ask()?;
        // A question that reaches nobody is lost. At the start of a run whoever answers may still be
        // on its way.
        for _ in 0..self.patience.take() {
            if pending.number_of_server_connections() > 0 {
                break;
            }
            std::thread::sleep(AGAIN);
            pending = ask()?;
        }
        Ok(Call {
            topic: self.topic,
            pending,
        })
    }
}

impl<Q: Message, A: Message> Server<Q, A> {
    /// The oldest question that waits, if any.
    ///
    /// # Errors
    /// Shared memory is in no state to carry one.
    pub(crate) fn receive(&self) -> Result<Option<Question<Q, A>>, TopicError> {
        let request = self
            .port
            .receive()
            .map_err(|e| failed("receive from", self.topic)(&e))?;
        Ok(request.map(|request| Question {
            topic: self.topic,
            request,
        }))
    }
}

impl<Q: Message, A: Message + Copy> Call<Q, A> {
    /// The answer, once it has come.
    ///
    /// # Errors
    /// Shared memory is in no state to carry it.
    pub(crate) fn answer(&self) -> Result<Option<A>, TopicError> {
        let response = self
            .pending
            .receive()
            .map_err(|e| failed("receive from", self.topic)(&e))?;
        Ok(response.map(|response| response.payload().0))
    }
}

impl<Q: Message, A: Message> Question<Q, A> {
    /// Answers. Whether anybody still waits for it does not matter.
    ///
    /// # Errors
    /// Shared memory is in no state to carry it.
    pub(crate) fn answer(&self, answer: A) -> Result<(), TopicError> {
        self.request
            .send_copy(Wire(answer))
            .map_err(|e| failed("answer on", self.topic)(&e))
    }
}

impl<Q: Message, A: Message> Deref for Question<Q, A> {
    type Target = Q;

    fn deref(&self) -> &Q {
        &self.request.payload().0
    }
}
