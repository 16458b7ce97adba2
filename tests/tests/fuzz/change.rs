//! Random changes of a file: of its bytes, of its numbers and of its words.
//!
//! Positions are shares of what they point into, so that a list of changes can be shortened, as proptest does to find the
//! smallest one that fails, and still be applied.

use proptest::prelude::*;
use proptest::sample::Index;

/// Numbers at and beyond the borders of what readers expect.
const NUMBERS: [&str; 22] = [
    "0",
    "-0.0",
    "-1",
    "1",
    "2",
    "1e-9",
    "-1e-9",
    "1e-45",
    "0.05",
    "1e9",
    "-1e9",
    "1e38",
    "1e39",
    "1e308",
    "255",
    "65535",
    "65536",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "-9223372036854775808",
];

/// The same as bytes of counts, offsets and float32.
const WORDS: [u64; 12] = [
    0,
    1,
    0x7f,
    0xff,
    0xffff,
    0x7fff_ffff,
    0xffff_ffff,
    0x7f80_0000,
    0x7fc0_0000,
    0xff7f_ffff,
    0x7fff_ffff_ffff_ffff,
    0xffff_ffff_ffff_ffff,
];

/// One change.
#[derive(Clone, Debug)]
pub enum Change {
    /// A bit is turned.
    Bit { at: Index, bit: u8 },
    /// A byte becomes another.
    Byte { at: Index, value: u8 },
    /// 1, 2, 4 or 8 bytes become a number at a border, little endian.
    Binary { at: Index, size: u8, which: Index },
    /// The file ends here.
    End { at: Index },
    /// A piece is left out.
    Cut { at: Index, length: u16 },
    /// A piece comes once more, elsewhere.
    Copy { from: Index, length: u16, to: Index, times: u8 },
    /// A number in the text becomes another.
    Number { which: Index, with: Index },
    /// A number in the text is scaled: likely still a sound one.
    Scale { which: Index, factor: f64 },
    /// A word of the text becomes another of its words.
    Word { which: Index, with: Index },
    /// A word of the format is put in.
    Insert { at: Index, with: Index },
    /// Some bytes are put in.
    Bytes { at: Index, bytes: Vec<u8> },
    /// A line goes, or comes again elsewhere.
    Line { which: Index, to: Option<Index> },
}

/// Any change.
fn change() -> impl Strategy<Value = Change> {
    let at = any::<Index>;
    prop_oneof![
        1 => (at(), 0..8_u8).prop_map(|(at, bit)| Change::Bit { at, bit }),
        1 => (at(), any::<u8>()).prop_map(|(at, value)| Change::Byte { at, value }),
        1 => (at(), 0..4_u8, at()).prop_map(|(at, size, which)| Change::Binary { at, size: 1 << size, which }),
        1 => at().prop_map(|at| Change::End { at }),
        1 => (at(), 1..400_u16).prop_map(|(at, length)| Change::Cut { at, length }),
        1 => (at(), 1..400_u16, at(), 1..4_u8).prop_map(|(from, length, to, times)| Change::Copy { from, length, to, times }),
        4 => (at(), at()).prop_map(|(which, with)| Change::Number { which, with }),
        4 => (at(), -3.0..3.0).prop_map(|(which, factor)| Change::Scale { which, factor }),
        3 => (at(), at()).prop_map(|(which, with)| Change::Word { which, with }),
        2 => (at(), at()).prop_map(|(at, with)| Change::Insert { at, with }),
        1 => (at(), prop::collection::vec(any::<u8>(), 1..9)).prop_map(|(at, bytes)| Change::Bytes { at, bytes }),
        2 => (at(), prop::option::of(at())).prop_map(|(which, to)| Change::Line { which, to }),
    ]
}

/// An input: which of the sound files, and what is changed in it.
pub fn input() -> impl Strategy<Value = (Index, Vec<Change>)> {
    (any::<Index>(), prop::collection::vec(change(), 1..4))
}

/// The file after all changes; `words` are those of its format.
pub fn changed(sound: &[u8], changes: &[Change], words: &[&str]) -> Vec<u8> {
    let mut file = sound.to_vec();
    for change in changes {
        apply(&mut file, change, words);
    }
    file
}

fn apply(file: &mut Vec<u8>, change: &Change, words: &[&str]) {
    if file.is_empty() {
        return;
    }
    let length = file.len();
    match change {
        Change::Bit { at, bit } => file[at.index(length)] ^= 1 << bit,
        Change::Byte { at, value } => file[at.index(length)] = *value,
        Change::Binary { at, size, which } => {
            let (at, bytes) = (at.index(length), WORDS[which.index(WORDS.len())].to_le_bytes());
            let size = usize::from(*size).min(length - at);
            file[at..at + size].copy_from_slice(&bytes[..size]);
        }
        Change::End { at } => file.truncate(at.index(length)),
        Change::Cut { at, length: cut } => {
            let at = at.index(length);
            file.drain(at..(at + usize::from(*cut)).min(length));
        }
        Change::Copy { from, length: copied, to, times } => {
            let from = from.index(length);
            let piece = file[from..(from + usize::from(*copied)).min(length)].repeat(usize::from(*times));
            put(file, to.index(length), &piece);
        }
        Change::Number { which, with } => {
            replace(file, which, is_of_number, |_| NUMBERS[with.index(NUMBERS.len())].to_owned());
        }
        Change::Scale { which, factor } => replace(file, which, is_of_number, |number| {
            number.parse::<f64>().map_or(number.to_owned(), |value| (value * factor).to_string())
        }),
        Change::Word { which, with } => {
            let found = pieces(file, is_of_word);
            if !found.is_empty() {
                let other = found[with.index(found.len())].clone();
                let other = String::from_utf8_lossy(&file[other]).into_owned();
                replace(file, which, is_of_word, |_| other);
            }
        }
        Change::Insert { at, with } => {
            if !words.is_empty() {
                put(file, at.index(length), words[with.index(words.len())].as_bytes());
            }
        }
        Change::Bytes { at, bytes } => put(file, at.index(length), bytes),
        Change::Line { which, to } => {
            let mut lines: Vec<Vec<u8>> = file.split(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect();
            let line = lines.remove(which.index(lines.len()));
            if let Some(to) = to {
                lines.insert(to.index(lines.len() + 1), line.clone());
                lines.insert(to.index(lines.len() + 1), line);
            }
            *file = lines.join(&b'\n');
        }
    }
}

fn put(file: &mut Vec<u8>, at: usize, piece: &[u8]) {
    file.splice(at..at, piece.iter().copied());
}

fn is_of_number(byte: u8) -> bool {
    byte.is_ascii_digit() || matches!(byte, b'.' | b'-' | b'+')
}

fn is_of_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_'
}

/// The unbroken pieces of such bytes.
fn pieces(file: &[u8], is_inside: fn(u8) -> bool) -> Vec<std::ops::Range<usize>> {
    let mut found: Vec<std::ops::Range<usize>> = Vec::new();
    for (at, byte) in file.iter().enumerate() {
        match found.last_mut() {
            Some(piece) if is_inside(*byte) && piece.end == at => piece.end += 1,
            _ if is_inside(*byte) => found.push(at..at + 1),
            _ => {}
        }
    }
    found
}

fn replace(file: &mut Vec<u8>, which: &Index, is_inside: fn(u8) -> bool, with: impl FnOnce(&str) -> String) {
    let found = pieces(file, is_inside);
    if found.is_empty() {
        return;
    }
    let piece = found[which.index(found.len())].clone();
    let new = with(&String::from_utf8_lossy(&file[piece.clone()]));
    file.splice(piece, new.into_bytes());
}
