//! Arrays of a fixed length in files, checked from both sides.
//!
//! serde reads an array of `N` as a tuple and stops after the last element that it needs. The TOML reader does not look
//! behind that, so that `[0.1, 0.2, 0.15]` would pass for two numbers, and `[0,1, 0,2]` for `[0, 1]`.

use serde::de::{Deserialize, Deserializer, Error, IgnoredAny, SeqAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;

/// An array of exactly `N` elements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fixed<T, const N: usize>(pub [T; N]);

impl<T, const N: usize> Deref for Fixed<T, N> {
    type Target = [T; N];

    fn deref(&self) -> &[T; N] {
        &self.0
    }
}

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for Fixed<T, N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        array(deserializer).map(Self)
    }
}

/// The same for a field that keeps its plain type: `#[serde(deserialize_with = "crate::fixed::array")]`.
pub(crate) fn array<'de, D, T, const N: usize>(deserializer: D) -> Result<[T; N], D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    struct Exactly<T, const N: usize>(PhantomData<T>);

    impl<'de, T: Deserialize<'de>, const N: usize> Visitor<'de> for Exactly<T, N> {
        type Value = [T; N];

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "an array of {N} numbers")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<[T; N], A::Error> {
            let mut kept = Vec::with_capacity(N);
            while kept.len() < N
                && let Some(element) = elements.next_element()?
            {
                kept.push(element);
            }
            let mut count = kept.len();
            while elements.next_element::<IgnoredAny>()?.is_some() {
                count += 1;
            }
            let hint = if count == 2 * N { " (the decimal mark is a point, as in 0.1)" } else { "" };
            let wrong = |_| A::Error::custom(format!("{count} numbers where {N} are needed{hint}"));
            // One more than needed is counted, not kept.
            if count > N { Err(wrong(Vec::<T>::new())) } else { <[T; N]>::try_from(kept).map_err(wrong) }
        }
    }

    deserializer.deserialize_seq(Exactly(PhantomData))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    struct Document {
        pair: Fixed<f64, 2>,
        #[serde(deserialize_with = "array")]
        triple: [f32; 3],
    }

    #[test]
    fn numbers_too_many_are_counted_and_not_dropped() {
        let read = |pair: &str, triple: &str| {
            toml::from_str::<Document>(&format!("pair = [{pair}]\ntriple = [{triple}]\n"))
                .map(|document| (document.pair.0, document.triple))
                .map_err(|error| error.message().to_owned())
        };
        assert_eq!(read("1, 2.5", "1, 2, 3"), Ok(([1.0, 2.5], [1.0, 2.0, 3.0])));
        assert_eq!(read("1, 2, 3", "1, 2, 3"), Err("3 numbers where 2 are needed".to_owned()));
        assert_eq!(read("1", "1, 2, 3"), Err("1 numbers where 2 are needed".to_owned()));
        assert_eq!(read("1, 2", "1, 2, 3, 4"), Err("4 numbers where 3 are needed".to_owned()));
        assert!(read("0,1, 0,2", "1, 2, 3").is_err_and(
            |message| message.contains("4 numbers where 2") && message.contains("the decimal mark is a point")
        ));
        assert!(read("1, 2", "1, 2, \"three\"").is_err());
        assert!(serde_json::from_str::<Fixed<u8, 2>>("[1, 2, 3]").is_err());
    }
}
