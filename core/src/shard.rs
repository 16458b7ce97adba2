//! Shards: work that is shared out among processes.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// The `index`-th of every `count` pieces of some work; all of them by default. A file with any other shard is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "Stored")]
pub struct Shard {
    /// From 0.
    pub index: usize,
    /// Number of shards.
    pub count: usize,
}

/// What a file says.
#[derive(Deserialize)]
struct Stored {
    index: usize,
    count: usize,
}

impl TryFrom<Stored> for Shard {
    type Error = String;

    fn try_from(Stored { index, count }: Stored) -> Result<Self, String> {
        if index < count { Ok(Self { index, count }) } else { Err(format!("{index}/{count} is no shard")) }
    }
}

impl Shard {
    /// Whether piece number `piece` belongs to this shard.
    pub fn has(self, piece: usize) -> bool {
        piece % self.count == self.index
    }
}

impl Default for Shard {
    fn default() -> Self {
        Self { index: 0, count: 1 }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;

    /// `i/n`, `i` from 0.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is no shard: the first of four is 0/4, the last 3/4");
        let (index, count) = text.split_once('/').ok_or_else(wrong)?;
        let shard = Self { index: index.parse().map_err(|_| wrong())?, count: count.parse().map_err(|_| wrong())? };
        if shard.index < shard.count { Ok(shard) } else { Err(wrong()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shard_is_read_from_its_own_words() {
        assert_eq!("2/3".parse(), Ok(Shard { index: 2, count: 3 }));
        for wrong in ["3/3", "1", "a/b", "-1/2", "0/0"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_file_with_a_shard_of_none_is_refused() {
        let read = |text: &str| serde_json::from_str::<Shard>(text);
        assert!(read(r#"{"index":1,"count":2}"#).is_ok_and(|shard| shard == Shard { index: 1, count: 2 }));
        assert!(read(r#"{"index":0,"count":0}"#).is_err_and(|error| error.to_string().contains("0/0 is no shard")));
    }

    #[test]
    fn every_piece_belongs_to_one_shard() {
        let shards = [0, 1, 2].map(|index| Shard { index, count: 3 });
        assert!((0..10).all(|piece| shards.iter().filter(|shard| shard.has(piece)).count() == 1));
        assert!((0..10).all(|piece| Shard::default().has(piece)));
    }
}
