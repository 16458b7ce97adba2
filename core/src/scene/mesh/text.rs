//! Mesh files that are text, line by line.

use std::borrow::Cow;

/// The UTF-8 byte order mark, which some programs put before their text.
const MARK: &[u8] = b"\xef\xbb\xbf";

/// `bytes` without a byte order mark.
pub fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(MARK).unwrap_or(bytes)
}

/// The lines with their numbers from one, whatever ends them. Names and comments may be in any 8-bit encoding: what is no
/// UTF-8 is replaced, since only ASCII matters to the shape.
///
/// # Errors
/// Text in UTF-16.
pub fn lines(bytes: &[u8]) -> Result<impl Iterator<Item = (usize, Cow<'_, str>)>, String> {
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return Err("the text is in UTF-16; save it as UTF-8 or ASCII".to_owned());
    }
    let bytes = without_mark(bytes);
    let end = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    let lines = bytes.split(move |byte| *byte == end).enumerate();
    Ok(lines.map(|(at, line)| (at + 1, String::from_utf8_lossy(line))))
}

/// A number of line `line`.
pub fn number(word: &str, line: usize) -> Result<f64, String> {
    word.parse().map_err(|_| format!("line {line}: `{word}` is no number"))
}
