//! What a belief update computes with beside its code: weights, the library that runs them, and where.

use serde::{Deserialize, Serialize};

/// What a belief update of networks runs on.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworksUsed {
    /// The weights.
    pub weights: Weights,
    /// The files of what is the user's own.
    pub modules: ModuleFiles,
    /// Version of libtorch that the program was built with; `unknown` if its folder did not tell.
    pub libtorch: String,
    /// `cpu` or `cuda`.
    pub device: String,
}

/// The names of the files, without folders, of modules of the user's own. What they hold is told by the hashes in
/// [`Weights`]: a file may be renamed.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModuleFiles {
    /// In place of sigma_o.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_o: Option<String>,
    /// In place of sigma_m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_m: Option<String>,
}

impl ModuleFiles {
    /// Whether nothing is the user's own.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// The weights of the networks, each by the SHA-256 of its file in hexadecimal digits (what `sha256sum` prints).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Weights {
    /// Of sigma_o's file; `None` for weights that are in no file, as in training.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_o: Option<String>,
    /// Of sigma_m's file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_m: Option<String>,
    /// What the log-odds of sigma_m's probabilities of change are divided by: it stands on the card, not in the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub change_temperature: Option<f32>,
}

impl Weights {
    /// What is other than it was `before`, in words; empty for the same weights.
    pub fn differences(&self, before: &Self) -> Vec<String> {
        let file = |hash: &Option<String>| hash.as_deref().map_or("absent".to_owned(), |hash| short(hash).to_owned());
        let number = |value: Option<f32>| value.map_or("absent".to_owned(), |value| value.to_string());
        let mut words = Vec::new();
        for (name, before, now) in
            [("sigma_o", &before.sigma_o, &self.sigma_o), ("sigma_m", &before.sigma_m, &self.sigma_m)]
        {
            if before != now {
                words.push(format!("the weights {name} were {}, now they are {}", file(before), file(now)));
            }
        }
        if self.change_temperature != before.change_temperature {
            let (before, now) = (number(before.change_temperature), number(self.change_temperature));
            words.push(format!("the temperature of sigma_m was {before}, now it is {now}"));
        }
        words
    }
}

/// The first digits of a hash, to tell it from others in a line of words.
pub fn short(hash: &str) -> &str {
    hash.get(..12).unwrap_or(hash)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_that_differ_are_named_with_both_hashes() {
        let hash = |digit: &str| Some(digit.repeat(64));
        let before = Weights { sigma_o: hash("a"), sigma_m: hash("b"), change_temperature: Some(0.75) };
        assert!(before.differences(&before).is_empty());
        let now = Weights { sigma_m: hash("c"), change_temperature: Some(1.0), ..before.clone() };
        let expected = [
            "the weights sigma_m were bbbbbbbbbbbb, now they are cccccccccccc",
            "the temperature of sigma_m was 0.75, now it is 1",
        ];
        assert_eq!(now.differences(&before), expected);
        let none = Weights::default().differences(&Weights { sigma_o: hash("a"), ..Weights::default() });
        assert_eq!(none, ["the weights sigma_o were aaaaaaaaaaaa, now they are absent"]);
    }
}
