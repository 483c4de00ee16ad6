//! Jobs in pages. A token is the position of the last job of its page among all jobs ever submitted. It stays valid
//! when jobs come and go, and a forged token shows only jobs that its client may list anyway.

use bimorph_wire::convert::Violation;

/// Default size of a page.
const PAGE: usize = 100;
/// Most jobs of a page.
const LARGEST: usize = 1000;

/// A requested page.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Page {
    /// Most jobs on it.
    pub(super) size: usize,
    /// It has jobs before this one alone.
    pub(super) before: u64,
}

impl Page {
    /// The request, checked.
    ///
    /// # Errors
    /// A negative size, or a token that no answer had.
    pub(super) fn of(size: i32, token: &str) -> Result<Self, Violation> {
        let size = usize::try_from(size)
            .map_err(|_| Violation::new("page_size", format!("expected a number from 0, got {size}")))?;
        let size = if size == 0 { PAGE } else { size.min(LARGEST) };
        let is_token = token.len() == 16 && token.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b));
        let before = match token {
            "" => Some(u64::MAX),
            token if is_token => u64::from_str_radix(token, 16).ok(),
            _ => None,
        };
        let expected = || Violation::new("page_token", "expected the next_page_token of an answer, or nothing");
        Ok(Self { size, before: before.ok_or_else(expected)? })
    }
}

/// The token of what follows a job.
pub(super) fn token(sequence: u64) -> String {
    format!("{sequence:016x}")
}

#[cfg(test)]
mod tests {
    //! Tokens of pages are valid, and all other texts are rejected.
    use super::*;

    #[test]
    fn tokens_are_those_of_answers() {
        assert_eq!(Page::of(0, ""), Ok(Page { size: PAGE, before: u64::MAX }));
        assert_eq!(Page::of(i32::MAX, &token(77)), Ok(Page { size: LARGEST, before: 77 }));
        assert!(Page::of(-1, "").is_err_and(|violation| violation.field == "page_size"));
        let long = "0".repeat(1 << 20);
        for bad in
            ["0", "+00000000000004d", "00000000000004D0", " 00000000000004d", "zzzzzzzzzzzzzzzz", "ééééé ", &long]
        {
            assert!(Page::of(1, bad).is_err_and(|violation| violation.field == "page_token"), "{}", bad.len());
        }
    }
}
