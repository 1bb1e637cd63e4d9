//! Answers: status, headers and bytes. Every one of them forbids to keep it, to guess its type and to be framed.

use serde::Serialize;

use crate::refusal::Refusal;

/// An answer to a request.
pub(crate) struct Reply {
    pub(crate) status: u16,
    pub(crate) headers: Vec<(&'static str, String)>,
    pub(crate) body: Vec<u8>,
}

impl Reply {
    /// An answer of some type.
    pub(crate) fn new(kind: &str, body: Vec<u8>) -> Self {
        let headers = vec![
            ("Content-Type", kind.to_owned()),
            ("Cache-Control", "no-store".to_owned()),
            ("X-Content-Type-Options", "nosniff".to_owned()),
            ("Referrer-Policy", "no-referrer".to_owned()),
            ("Cross-Origin-Resource-Policy", "same-origin".to_owned()),
        ];
        Self { status: 200, headers, body }
    }

    /// A value as JSON.
    pub(crate) fn json(value: &impl Serialize) -> Result<Self, Refusal> {
        let text = serde_json::to_vec(value)
            .map_err(|error| Refusal::new(500, "", "an answer in JSON", error.to_string()))?;
        Ok(Self::new("application/json", text))
    }

    /// What a request that is refused is told.
    pub(crate) fn refused(refusal: &Refusal) -> Self {
        // Four texts have a form in JSON; if not, the status says enough.
        let body = serde_json::to_vec(refusal).unwrap_or_default();
        Self { status: refusal.status, ..Self::new("application/json", body) }
    }

    #[must_use]
    pub(crate) fn with_header(mut self, name: &'static str, value: String) -> Self {
        self.headers.push((name, value));
        self
    }
}
