//! Choices that have names: parsed from what they display as.

use std::fmt::Display;

/// The one of `all` that displays as `text`.
///
/// # Errors
/// The names that there are.
pub(crate) fn parse<T: Copy + Display>(all: &[T], text: &str) -> Result<T, String> {
    let named = all.iter().copied().find(|one| one.to_string() == text);
    named.ok_or_else(|| format!("there are {}", all.iter().map(T::to_string).collect::<Vec<_>>().join(", ")))
}

#[cfg(test)]
mod tests {
    use crate::plan::Counted;
    use crate::skill::PushSampler;

    #[test]
    fn names_are_read_back_and_others_are_answered_with_them() {
        assert!(Counted::ALL.into_iter().all(|counted| counted.to_string().parse() == Ok(counted)));
        assert!(PushSampler::ALL.into_iter().all(|sampler| sampler.to_string().parse() == Ok(sampler)));
        assert_eq!("some".parse::<Counted>(), Err("there are all, unseen".to_owned()));
    }
}
