//! Places in the text of a bundle.

/// A stretch of text in one file of a bundle: byte offsets, end exclusive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct TextSpan {
    /// Index of the file in reading order; 0 is the root. [`TextSpan::NOWHERE`] has none.
    pub(crate) file: u16,
    /// First byte.
    pub(crate) start: u32,
    /// One past the last byte.
    pub(crate) end: u32,
}

impl TextSpan {
    /// The place of a message that is about no text at all (a setting from outside).
    pub(crate) const NOWHERE: Self = Self { file: u16::MAX, start: 0, end: 0 };

    /// From the start of `self` to the end of `last`, in the file of `self`.
    pub(crate) fn to(self, last: Self) -> Self {
        if last.file == self.file { Self { end: last.end.max(self.end), ..self } } else { self }
    }
}
