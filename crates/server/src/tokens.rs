//! Authorization by token: the tokens of a file, stored as their SHA-256 and compared in constant time.

use bimorph_wire::credentials::read;
use ring::digest::{SHA256, digest};
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use subtle::{ConditionallySelectable, ConstantTimeEq};
use thiserror::Error;
use tonic::Status;
use tonic::codegen::http::HeaderMap;
use tonic::codegen::http::header::AUTHORIZATION;

/// Fewest characters of a token.
const SHORTEST: usize = 16;
/// Most tokens of a file.
const MAX_TOKENS: usize = 10_000;

/// A token file that cannot be used.
#[derive(Debug, Error)]
#[error("token file {path}{at}: {reason}", path = path.display(), at = line.map(|n| format!(":{n}")).unwrap_or_default())]
pub struct TokenError {
    /// The file.
    pub path: PathBuf,
    /// Its line, from 1; none: the file as a whole.
    pub line: Option<usize>,
    /// The fault and the expected content.
    pub reason: String,
}

/// The tokens of a server.
#[derive(Debug)]
pub(super) struct Tokens {
    known: Vec<(Arc<str>, [u8; 32])>,
}

impl Tokens {
    /// Reads a file: a line for each client, `TOKEN` or `NAME TOKEN`; what begins with `#` is a comment.
    ///
    /// # Errors
    /// [`TokenError`]: nothing is taken of a file with a wrong line.
    pub(super) fn read(path: &Path) -> Result<Self, TokenError> {
        let wrong = |line, reason: String| TokenError { path: path.to_owned(), line, reason };
        let text = read(path).map_err(|error| wrong(None, error.to_string()))?;
        let mut known: Vec<(Arc<str>, [u8; 32])> = Vec::new();
        for (number, line) in text.lines().enumerate().map(|(k, line)| (k + 1, line.trim())) {
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let (name, token) = match *line.split_whitespace().collect::<Vec<_>>() {
                [token] => (format!("line {number}"), token),
                [name, token] => (name.to_owned(), token),
                _ => return Err(wrong(Some(number), "expected TOKEN or NAME TOKEN".to_owned())),
            };
            if token.len() < SHORTEST || !token.bytes().all(|byte| byte.is_ascii_graphic()) {
                let reason = format!(
                    "expected a token of at least {SHORTEST} ASCII characters (`openssl rand -hex 32` makes one)"
                );
                return Err(wrong(Some(number), reason));
            }
            let hash = sha256(token.as_bytes());
            if known.iter().any(|(other, known)| *known == hash || **other == *name) {
                return Err(wrong(
                    Some(number),
                    "expected a name and a token of its own, got one of another line".into(),
                ));
            }
            known.push((name.into(), hash));
            if known.len() > MAX_TOKENS {
                return Err(wrong(Some(number), format!("expected at most {MAX_TOKENS} tokens")));
            }
        }
        if known.is_empty() {
            return Err(wrong(None, "expected at least one token; without one no client can authenticate".to_owned()));
        }
        Ok(Self { known })
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.known.len()
    }

    /// Whose token came with a request.
    pub(super) fn who(&self, headers: &HeaderMap) -> Result<Arc<str>, Status> {
        let Some(value) = headers.get(AUTHORIZATION) else {
            return Err(Status::unauthenticated(
                "this server requires a token: --token-file, or BIMORPH_TOKEN_FILE (metadata: authorization = Bearer TOKEN)",
            ));
        };
        let shown = value.as_bytes();
        let token = shown.split_at_checked(7).filter(|(scheme, _)| scheme.eq_ignore_ascii_case(b"bearer "));
        let Some((_, token)) = token else {
            return Err(Status::unauthenticated("authorization: expected Bearer TOKEN"));
        };
        let found = self.find(token.trim_ascii());
        found.ok_or_else(|| Status::unauthenticated("the token is none of this server's"))
    }

    /// The owner of a token. All are compared, whichever it is.
    fn find(&self, token: &[u8]) -> Option<Arc<str>> {
        let hash = sha256(token);
        let mut found = u64::MAX;
        for (k, (_, known)) in self.known.iter().enumerate() {
            found.conditional_assign(&(k as u64), known.ct_eq(&hash));
        }
        self.known.get(usize::try_from(found).ok()?).map(|(name, _)| Arc::clone(name))
    }
}

/// Whether others than the owner may read a file.
pub(super) fn is_open(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| found.permissions().mode() & 0o007 != 0)
}

/// SHA-256 (FIPS 180-4).
pub(super) fn sha256(bytes: &[u8]) -> [u8; 32] {
    let mut out = [0; 32];
    out.copy_from_slice(digest(&SHA256, bytes).as_ref());
    out
}

#[cfg(test)]
mod tests {
    //! A token is known by its line, and by nothing that is nearly it.
    use super::*;

    fn tokens(text: &str) -> Result<Tokens, TokenError> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("tokens");
        fs::write(&path, text).expect("written");
        Tokens::read(&path)
    }

    #[test]
    fn a_token_names_its_owner() {
        let tokens = tokens("# people\nalice 0123456789abcdef\n\n  fedcba9876543210\n").expect("two tokens");
        let who = |value: &str| {
            let mut headers = HeaderMap::new();
            headers.insert(AUTHORIZATION, value.parse().expect("a header"));
            tokens.who(&headers)
        };
        assert_eq!(tokens.len(), 2);
        assert_eq!(&*who("Bearer 0123456789abcdef").expect("known"), "alice");
        assert_eq!(&*who("bearer  fedcba9876543210 ").expect("known"), "line 4");
        for wrong in
            ["Bearer 0123456789abcde", "Bearer 0123456789abcdeg", "Basic 0123456789abcdef", "Bearer", "Bearer "]
        {
            assert_eq!(who(wrong).expect_err(wrong).code(), tonic::Code::Unauthenticated);
        }
        assert_eq!(tokens.who(&HeaderMap::new()).expect_err("none").code(), tonic::Code::Unauthenticated);
    }

    /// NIST's example of one block: "abc".
    #[test]
    fn hashes_are_sha_256() {
        assert_eq!(sha256(b"abc")[..4], [0xba, 0x78, 0x16, 0xbf]);
    }

    #[test]
    fn files_are_refused_by_line() {
        for (text, place) in [
            ("alice short\n", "tokens:1: "),
            ("# a\n0123456789abcdef\nbob 0123456789abcdef\n", "tokens:3: "),
            ("a b 0123456789abcdef\n", "tokens:1: "),
            ("# nobody\n", "tokens: expected at least one"),
        ] {
            let error = tokens(text).expect_err(text).to_string();
            assert!(error.contains(place), "{error}");
        }
    }
}
