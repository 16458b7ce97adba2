//! Bytes that are read from front to back, and lines of a header before them.

/// What is left of a file.
pub(super) struct Bytes<'a> {
    whole: &'a [u8],
    at: usize,
}

impl<'a> Bytes<'a> {
    pub(super) fn new(whole: &'a [u8]) -> Self {
        Self { whole, at: 0 }
    }

    /// Where the next byte is.
    pub(super) fn position(&self) -> usize {
        self.at
    }

    /// How many bytes are left.
    pub(super) fn left(&self) -> usize {
        self.whole.len() - self.at
    }

    /// The next bytes.
    ///
    /// # Errors
    /// In words, where the file ends before.
    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let end = self.at.checked_add(count).filter(|end| *end <= self.whole.len());
        let end = end.ok_or_else(|| format!("the file ends in the middle, after {} bytes", self.whole.len()))?;
        let taken = &self.whole[self.at..end];
        self.at = end;
        Ok(taken)
    }

    /// The next bytes as an array.
    ///
    /// # Errors
    /// As [`Bytes::take`].
    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    /// The next line without its end, where it is text of a bearable length.
    ///
    /// # Errors
    /// In words.
    pub(super) fn line(&mut self) -> Result<&'a str, String> {
        const LONGEST: usize = 4096;
        let rest = &self.whole[self.at..];
        let end = rest.iter().take(LONGEST).position(|byte| *byte == b'\n').ok_or("a line has no end")?;
        let line = std::str::from_utf8(&rest[..end]).map_err(|_| "a line is no text")?;
        self.at += end + 1;
        Ok(line.trim_end_matches('\r'))
    }
}
