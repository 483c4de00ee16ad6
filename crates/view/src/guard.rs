//! Which requests reach the bench: those with the token in their path, for this host, and from its own page.
//!
//! A page of another origin knows no token. `Host` is checked because a name of another site may resolve to this machine (DNS rebinding), `Origin` and
//! `Sec-Fetch-Site` because a browser sends them with requests of other pages.

use ring::rand::{SecureRandom, SystemRandom};
use subtle::ConstantTimeEq;

/// Bytes of a token.
const TOKEN_BYTES: usize = 16;

/// The token and the address of a server.
#[derive(Debug, Clone)]
pub(crate) struct PageGuard {
    token: String,
    port: u16,
}

/// Headers of a request, as far as they decide.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Origins<'a> {
    pub(crate) host: Option<&'a str>,
    pub(crate) origin: Option<&'a str>,
    pub(crate) site: Option<&'a str>,
    /// Opens a page in a tab of its own, as a link does.
    pub(crate) navigates: bool,
}

impl PageGuard {
    /// A new token for a server at a port; none where the system has no random numbers.
    pub(crate) fn new(port: u16) -> Option<Self> {
        let mut bytes = [0; TOKEN_BYTES];
        SystemRandom::new().fill(&mut bytes).ok()?;
        let token = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        Some(Self { token, port })
    }

    /// Address of the page.
    pub(crate) fn url(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.port, self.token)
    }

    /// The part of a path behind the token; none where the token is missing or wrong.
    pub(crate) fn place<'p>(&self, path: &'p str) -> Option<&'p str> {
        let (token, place) = path.strip_prefix('/')?.split_once('/')?;
        bool::from(token.as_bytes().ct_eq(self.token.as_bytes())).then_some(place)
    }

    /// Whether the request is for this host and from its own page, or from no page.
    pub(crate) fn admits(&self, from: &Origins<'_>) -> bool {
        let hosts = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", self.port));
        let host = from.host.is_some_and(|host| hosts.iter().any(|own| own == host));
        let own = |origin: &str| origin.strip_prefix("http://").is_some_and(|o| hosts.iter().any(|own| own == o));
        // a link on another page may lead here, but that page reads nothing and shows nothing of it
        let site = from.navigates || from.site.is_none_or(|site| matches!(site, "same-origin" | "none"));
        host && from.origin.is_none_or(own) && site
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Requests of other hosts, origins and sites are refused, and so are other tokens.
    #[test]
    fn only_the_own_page() {
        let guard = PageGuard::new(8080).unwrap();
        let from = |host, origin, site| guard.admits(&Origins { host, origin, site, navigates: false });
        assert!(from(Some("127.0.0.1:8080"), None, None));
        assert!(from(Some("localhost:8080"), Some("http://localhost:8080"), Some("same-origin")));
        assert!(!from(None, None, None));
        assert!(!from(Some("example.org:8080"), None, None));
        assert!(!from(Some("127.0.0.1:8081"), None, None));
        assert!(!from(Some("127.0.0.1:8080"), Some("http://example.org"), None));
        assert!(!from(Some("127.0.0.1:8080"), Some("null"), None));
        assert!(!from(Some("127.0.0.1:8080"), None, Some("cross-site")));
        let link = |host, origin| guard.admits(&Origins { host, origin, site: Some("cross-site"), navigates: true });
        assert!(link(Some("127.0.0.1:8080"), None));
        assert!(!link(Some("example.org:8080"), None) && !link(Some("127.0.0.1:8080"), Some("http://example.org")));
        let path = guard.url().split_once(":8080").unwrap().1.to_owned() + "ask";
        assert_eq!(guard.place(&path), Some("ask"));
        let wrong = format!("/{}/ask", "0".repeat(32));
        assert_eq!(guard.place(&wrong), None);
        assert_eq!(guard.place("/ask"), None);
        assert_ne!(PageGuard::new(1).unwrap().token, PageGuard::new(1).unwrap().token);
    }
}
