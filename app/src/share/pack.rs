//! Bytes made small and put into text: runs of what changed, deflate, base64.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde::Serialize;
use std::io::Write;

/// Runs of changes with no more than so many equal bytes between them become one.
const GAP: usize = 3;

/// Appends what changed from `old` to `new`, which are as long: the number of runs, and for each how many bytes stay before
/// it, how long it is, and its new bytes. Numbers are in the base 128, least significant digit first (LEB128).
pub fn runs(old: &[u8], new: &[u8], into: &mut Vec<u8>) {
    let mut found: Vec<std::ops::Range<usize>> = Vec::new();
    for at in (0..new.len()).filter(|at| old[*at] != new[*at]) {
        match found.last_mut() {
            Some(run) if at - run.end <= GAP => run.end = at + 1,
            _ => found.push(at..at + 1),
        }
    }
    number(found.len(), into);
    let mut done = 0;
    for run in found {
        number(run.start - done, into);
        number(run.len(), into);
        done = run.end;
        into.extend_from_slice(&new[run]);
    }
}

fn number(mut value: usize, into: &mut Vec<u8>) {
    while value >= 128 {
        into.push((value & 127) as u8 | 128);
        value >>= 7;
    }
    into.push(value as u8);
}

/// Bytes compressed as browsers unpack them (`DecompressionStream("deflate")`: RFC 1950).
pub fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes).and_then(|()| encoder.finish()).expect("bytes are compressed in memory")
}

/// A document as compressed JSON.
pub fn json(document: &impl Serialize) -> Vec<u8> {
    deflated(&serde_json::to_vec(document).expect("plain data becomes JSON"))
}

/// Bytes as text of letters, digits, `+`, `/` and `=` alone.
pub fn text(bytes: &[u8]) -> String {
    STANDARD.encode(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_number(bytes: &mut impl Iterator<Item = u8>) -> usize {
        let (mut value, mut shift) = (0, 0);
        loop {
            let byte = bytes.next().expect("a digit");
            value |= usize::from(byte & 127) << shift;
            shift += 7;
            if byte < 128 {
                return value;
            }
        }
    }

    /// As the page's script does it.
    fn applied(mut old: Vec<u8>, packed: &[u8]) -> Vec<u8> {
        let mut bytes = packed.iter().copied();
        let mut at = 0;
        for _ in 0..read_number(&mut bytes) {
            at += read_number(&mut bytes);
            for _ in 0..read_number(&mut bytes) {
                old[at] = bytes.next().expect("a value");
                at += 1;
            }
        }
        assert_eq!(bytes.next(), None);
        old
    }

    #[test]
    fn what_changed_leads_from_the_old_bytes_to_the_new() {
        let old: Vec<u8> = (0..1000).map(|at| (at % 7) as u8).collect();
        let mut new = old.clone();
        for at in [0, 1, 5, 400, 403, 408, 999] {
            new[at] = 200;
        }
        let mut packed = Vec::new();
        runs(&old, &new, &mut packed);
        assert_eq!(packed[0], 4, "0 to 1 and 5 (three equal ones between), 400 to 403, 408, 999: {packed:?}");
        assert_eq!(applied(old.clone(), &packed), new);
        let mut nothing = Vec::new();
        runs(&old, &old, &mut nothing);
        assert_eq!(nothing, [0]);
    }

    #[test]
    fn text_holds_nothing_that_html_reads() {
        let text = text(&json(&"</script><script>alert(1)</script>"));
        assert!(text.bytes().all(|letter| letter.is_ascii_alphanumeric() || b"+/=".contains(&letter)), "{text}");
    }
}
