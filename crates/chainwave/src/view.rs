//! `chainwave view`: a page of recordings in a browser on this machine.

mod browser;
mod collect;
mod corrections;
mod results;
mod set_up;

use std::io::Write;

use crate::cli;
use crate::error::Error;
use crate::outcome::Outcome;

/// Serves the page until the process ends, and says where.
pub(crate) fn view(arguments: &cli::View) -> Result<Outcome, Error> {
    let server = chainwave_view::Server::bind(collect::collection(arguments)?, arguments.port)?;
    let (address, port) = (server.address(), server.port());
    let forwarded = format!("ssh -L {port}:127.0.0.1:{port} HOST, then the same address");
    let said = format!("{address}\n(Ctrl-C ends it; from another machine: {forwarded})\n");
    // Whoever reads the address alone may have closed the pipe behind it.
    let _ = std::io::stdout().write_all(said.as_bytes());
    if !arguments.no_browser {
        browser::open(&address);
    }
    server.serve()
}
