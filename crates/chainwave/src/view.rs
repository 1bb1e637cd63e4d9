//! `chainwave view`: a page of recordings in a browser on this machine.

mod browser;
mod collect;

use crate::cli;
use crate::error::Error;
use crate::outcome::Outcome;

/// Serves the page until the process ends, and says where.
#[expect(clippy::print_stdout, reason = "the address is the command's result")]
pub(crate) fn view(arguments: &cli::View) -> Result<Outcome, Error> {
    let server = chainwave_view::Server::bind(collect::collection(arguments)?, arguments.port)?;
    let address = server.address();
    println!(
        "{address}\n(Ctrl-C ends it; from another machine: ssh -L {0}:127.0.0.1:{0} HOST, then the same address)",
        server.port()
    );
    if !arguments.no_browser {
        browser::open(&address);
    }
    server.serve()
}
