//! Who is let in: whoever knows the token, by a name of this machine.

use crate::error::ViewError;

/// Bytes of a token.
const TOKEN_BYTES: usize = 16;

/// Random bytes that stand in the address, in hexadecimal digits.
#[derive(Clone)]
pub(crate) struct Token(String);

impl Token {
    /// 128 random bits from the system.
    pub(crate) fn random() -> Result<Self, ViewError> {
        let mut bytes = [0_u8; TOKEN_BYTES];
        getrandom::fill(&mut bytes)?;
        Ok(Self(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// Its digits.
    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }

    /// Whether a text is the token. The time that this takes says nothing of where they differ.
    pub(crate) fn is(&self, found: &str) -> bool {
        let (token, found) = (self.0.as_bytes(), found.as_bytes());
        // A token's length is no secret.
        token.len() == found.len()
            && std::hint::black_box(token.iter().zip(found).fold(0, |differ, (a, b)| differ | (a ^ b))) == 0
    }
}

/// Whether a request's `Host` names this machine. A page of another site whose name was made to lead here still has its own name there.
/// The port may be another one, which `ssh -L` forwards.
pub(crate) fn names_this_machine(host: Option<&str>) -> bool {
    let Some(host) = host else { return false };
    let (name, port) = host.split_once(':').unwrap_or((host, "80"));
    (name == "127.0.0.1" || name.eq_ignore_ascii_case("localhost")) && port.parse::<u16>().is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_is_itself_alone() {
        let [token, other] = [(); 2].map(|()| Token::random().unwrap());
        assert_eq!(token.as_str().len(), 32);
        assert!(token.is(token.as_str()));
        assert!(!token.is(other.as_str()), "128 random bits twice");
        assert!(
            !token.is("")
                && !token.is(&token.as_str()[1..])
                && !token.is(&token.as_str().to_uppercase()[..31])
        );
    }

    #[test]
    fn only_names_of_this_machine_pass() {
        for host in ["127.0.0.1:8080", "localhost:9000", "LOCALHOST:1", "127.0.0.1"] {
            assert!(names_this_machine(Some(host)), "{host}");
        }
        for host in
            ["evil.example:8080", "127.0.0.1.evil.example", "127.0.0.1:8080:1", "localhost:x", "", "[::1]:80"]
        {
            assert!(!names_this_machine(Some(host)), "{host}");
        }
        assert!(!names_this_machine(None));
    }
}
