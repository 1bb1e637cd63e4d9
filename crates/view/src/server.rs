//! The server: 127.0.0.1 alone, a token in the address, a bounded number of connections.

use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use crate::access::{Token, names_this_machine};
use crate::asked::Asked;
use crate::collection::Collection;
use crate::error::ViewError;
use crate::http::{Connection, RequestHead};
use crate::refusal::Refusal;
use crate::replies::Reply;
use crate::site::{Site, Verb};

/// Connections at a time, each with a thread: a browser opens six.
const MOST_CONNECTIONS: usize = 64;
/// Pause after a connection that the system could not give, such as for want of descriptors.
const RETRY_PAUSE: Duration = Duration::from_millis(50);

/// A page of recordings, served on this machine.
///
/// ```no_run
/// use chainwave_view::{Collection, Server, ShownRecording};
///
/// let recordings = vec![ShownRecording::new("shots/view1_trial1.cine")];
/// let collection = Collection { title: "shots".into(), recordings, ..Collection::default() };
/// let server = Server::bind(collection, None)?;
/// println!("{}", server.address());
/// server.serve();
/// # Ok::<(), chainwave_view::ViewError>(())
/// ```
pub struct Server {
    listener: TcpListener,
    port: u16,
    token: Token,
    site: Site,
    n_connections: AtomicUsize,
}

impl Server {
    /// Listens on 127.0.0.1, at a port that is given or else chosen by the system. Nothing is answered before [`Server::serve`].
    ///
    /// # Errors
    /// [`ViewError`] when there is nothing to show, the port is taken, or the system has no random numbers.
    pub fn bind(collection: Collection, port: Option<u16>) -> Result<Self, ViewError> {
        if collection.recordings.is_empty() {
            return Err(ViewError::Nothing { title: collection.title });
        }
        let asked = port.unwrap_or(0);
        let taken = |source| ViewError::Port { port: asked, source };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, asked)).map_err(taken)?;
        let port = listener.local_addr().map_err(taken)?.port();
        let (token, site) = (Token::random()?, Site::new(collection));
        Ok(Self { listener, port, token, site, n_connections: AtomicUsize::new(0) })
    }

    /// The address to open in a browser, with its token.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/?token={}", self.port, self.token.as_str())
    }

    /// The port that is listened on.
    pub fn port(&self) -> u16 {
        self.port
    }

    /// Answers requests until the process ends.
    pub fn serve(&self) -> ! {
        thread::scope(|scope| {
            loop {
                let Ok((stream, _)) = self.listener.accept() else {
                    thread::sleep(RETRY_PAUSE);
                    continue;
                };
                if self.n_connections.fetch_add(1, Ordering::Relaxed) < MOST_CONNECTIONS {
                    let spawned = thread::Builder::new().spawn_scoped(scope, || {
                        self.serve_one(stream);
                        self.n_connections.fetch_sub(1, Ordering::Relaxed);
                    });
                    if spawned.is_ok() {
                        continue;
                    }
                }
                // The connection closes without an answer.
                self.n_connections.fetch_sub(1, Ordering::Relaxed);
            }
        })
    }

    fn serve_one(&self, stream: TcpStream) {
        let Ok(connection) = Connection::new(stream) else { return };
        connection.serve(|head, read_body| {
            // A decoder of foreign files that panics after all costs one answer.
            let reply = catch_unwind(AssertUnwindSafe(|| self.reply(head, read_body)));
            let failed =
                || Refusal::new(500, "", "an answer", "a fault of the program (standard error has more)");
            reply.unwrap_or_else(|_| Err(failed())).unwrap_or_else(|refusal| Reply::refused(&refusal))
        });
    }

    fn reply(
        &self,
        head: &RequestHead,
        read_body: &mut dyn FnMut() -> Result<Vec<u8>, Refusal>,
    ) -> Result<Reply, Refusal> {
        if !names_this_machine(head.header("Host")) {
            let expected = format!("the host 127.0.0.1:{} or localhost", self.port);
            return Err(Refusal::new(403, "", expected, "another host, or none"));
        }
        let asked = Asked::parse(&head.url);
        let in_address = asked.as_ref().ok().and_then(|asked| asked.text("token"));
        if !in_address.or(head.header("X-Token")).is_some_and(|found| self.token.is(found)) {
            let refusal = Refusal::new(403, "", "the token of this server", "another one, or none");
            return Err(
                refusal.with_hint("open the whole address that chainwave view printed, with its token")
            );
        }
        let asked = asked?;
        let (verb, body) = match head.method.as_str() {
            "GET" | "HEAD" => (Verb::Get, Vec::new()),
            "PUT" => (Verb::Put, read_body()?),
            other => return Err(Refusal::new(405, asked.path, "GET or PUT", other)),
        };
        self.site.reply(verb, &asked, &body)
    }
}
