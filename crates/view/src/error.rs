//! Why a page cannot be served at all.

/// Why a page cannot be served at all. What one request does wrong is answered to it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewError {
    /// The port cannot be listened on.
    #[error(
        "127.0.0.1:{port}: expected a free port, found: {source} (hint: another --port, or none to have a free one chosen)"
    )]
    Port {
        /// The port asked for; 0 for any.
        port: u16,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The system has no random numbers for a token.
    #[error("random numbers for the address: {0}")]
    Random(#[from] getrandom::Error),
    /// There is nothing to show.
    #[error("{title}: expected at least one recording to show, found none")]
    Nothing {
        /// The collection's title.
        title: String,
    },
}
