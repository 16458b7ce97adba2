//! What is made of the list of skills in the module above: one type for a manipulation of any skill, the skills by name, and
//! sets of them.

use super::{Manipulation, SkillKind};
use serde::{Deserialize, Serialize};

/// Makes [`Manipulation`] and [`SkillKind`] of the list of skills: a variant, the type that implements [`Skill`], its name in
/// files and on the command line, what its candidates are called, the name of its stream of random numbers.
macro_rules! skills {
    ($($kind:ident($type:ty): $name:literal, $plural:literal, $stream:literal;)*) => {
        /// One manipulation, of whatever skill; in files `kind` is the skill's name.
        #[derive(Clone, Copy, Debug, PartialEq, Serialize)]
        #[serde(tag = "kind")]
        pub enum Manipulation {
            $(#[doc = concat!("A ", $name, ".")] #[serde(rename = $name)] $kind($type),)*
        }

        /// A skill.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum SkillKind {
            $(#[doc = concat!("To ", $name, ".")] $kind,)*
        }

        $(impl From<$type> for Manipulation {
            fn from(of: $type) -> Self {
                Self::$kind(of)
            }
        })*

        impl Manipulation {
            /// What can be asked of it.
            pub fn skill(&self) -> &dyn Skill {
                match self {
                    $(Self::$kind(of) => of,)*
                }
            }

            /// Its skill.
            pub fn kind(&self) -> SkillKind {
                match self {
                    $(Self::$kind(_) => SkillKind::$kind,)*
                }
            }

            /// A manipulation of a skill from what a file has of it.
            fn read(kind: SkillKind, value: serde_json::Value) -> serde_json::Result<Self> {
                Ok(match kind {
                    $(SkillKind::$kind => Self::$kind(serde_json::from_value(value)?),)*
                })
            }
        }

        impl SkillKind {
            /// All of them, the one that every arm has first.
            pub const ALL: &'static [Self] = &[$(Self::$kind),*];

            /// Their names, in the same order.
            pub const NAMES: &'static [&'static str] = &[$($name),*];

            /// Its name: what it does, in one word.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)*
                }
            }

            /// Several of its manipulations.
            pub fn plural(self) -> &'static str {
                match self {
                    $(Self::$kind => $plural,)*
                }
            }

            /// The stream that its candidates are drawn from.
            pub fn stream(self) -> &'static str {
                match self {
                    $(Self::$kind => $stream,)*
                }
            }

            /// Draws candidates; see [`Skill::sample`].
            pub fn sample(self, ground: &Ground<'_>, count: usize, rng: &mut ChaCha8Rng) -> Vec<Candidate> {
                match self {
                    $(Self::$kind => <$type>::sample(ground, count, rng),)*
                }
            }
        }
    };
}

impl SkillKind {
    /// The skill of that name.
    ///
    /// # Errors
    /// One line that names the skills there are.
    pub fn named(name: &str) -> Result<Self, String> {
        let found = Self::ALL.iter().copied().find(|kind| kind.name() == name);
        found.ok_or_else(|| format!("this program has no skill `{name}`; it has {}", Self::NAMES.join(", ")))
    }
}

impl Default for SkillKind {
    fn default() -> Self {
        Self::ALL[0]
    }
}

impl<'de> Deserialize<'de> for Manipulation {
    /// Without a `kind` it is of the first skill: candidates of before there were others do not tell.
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        use serde::de::Error as _;
        let mut fields = serde_json::Map::<String, serde_json::Value>::deserialize(deserializer)?;
        let kind = match fields.remove("kind") {
            None => SkillKind::default(),
            Some(serde_json::Value::String(name)) => SkillKind::named(&name).map_err(D::Error::custom)?,
            Some(other) => return Err(D::Error::custom(format!("`kind` is the name of a skill, not {other}"))),
        };
        Self::read(kind, fields.into()).map_err(|error| D::Error::custom(format!("{}: {error}", kind.name())))
    }
}

/// The skills that may be used, at least one, in the order of [`SkillKind::ALL`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SkillSet(u32);

impl Default for SkillSet {
    /// The first skill alone.
    fn default() -> Self {
        Self::of(&[SkillKind::default()])
    }
}

impl SkillSet {
    /// These skills.
    pub fn of(kinds: &[SkillKind]) -> Self {
        Self(kinds.iter().fold(0, |bits, kind| bits | 1 << *kind as u32))
    }

    /// Whether a skill may be used.
    pub fn has(self, kind: SkillKind) -> bool {
        self.0 & 1 << kind as u32 != 0
    }

    /// The skills that may be used.
    pub fn kinds(self) -> impl Iterator<Item = SkillKind> {
        SkillKind::ALL.iter().copied().filter(move |kind| self.has(*kind))
    }

    /// How many there are.
    pub fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    /// Whether there is none; never of one that was read.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }
}

impl std::fmt::Display for SkillSet {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.kinds().map(SkillKind::name).collect::<Vec<_>>().join(","))
    }
}

impl std::str::FromStr for SkillSet {
    type Err = String;

    /// Names with commas between, in any order.
    fn from_str(text: &str) -> Result<Self, String> {
        let kinds = text.split(',').map(|name| SkillKind::named(name.trim())).collect::<Result<Vec<_>, _>>()?;
        Ok(Self::of(&kinds))
    }
}

impl Serialize for SkillSet {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.kinds().map(SkillKind::name))
    }
}

impl<'de> Deserialize<'de> for SkillSet {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Vec::<String>::deserialize(deserializer)?.join(",").parse().map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::skill::Push;
    use serde_json::json;

    #[test]
    fn a_push_is_in_files_as_it_was_before_there_were_other_skills() {
        let push = Push { start: [0.1, 0.2, 0.06], direction_deg: 87.3, length_m: 0.1 };
        let text = r#"{"kind":"push","start":[0.1,0.2,0.06],"direction_deg":87.3,"length_m":0.1}"#;
        assert_eq!(serde_json::to_string(&Manipulation::Push(push)).expect("JSON"), text);
        assert_eq!(serde_json::from_str::<Manipulation>(text).expect("a push"), push.into());
        let without = text.replace(r#""kind":"push","#, "");
        assert_eq!(serde_json::from_str::<Manipulation>(&without).expect("a push"), push.into());
    }

    #[test]
    fn a_skill_that_this_program_lacks_is_named_with_those_it_has() {
        let error = serde_json::from_value::<Manipulation>(json!({ "kind": "fly", "start": [0, 0, 0] }));
        assert_eq!(
            error.expect_err("no skill").to_string(),
            "this program has no skill `fly`; it has push, drag, pick"
        );
        let error = serde_json::from_value::<Manipulation>(json!({ "kind": "push", "start": [0, 0, 0] }));
        assert!(error.expect_err("incomplete").to_string().starts_with("push: missing field"));
    }

    /// The files of the library and of the program that name the skill of a type, its tests left out.
    fn files_that_name(of: &str) -> Vec<std::path::PathBuf> {
        let lower = of.to_lowercase();
        let said = [
            format!("{of}("),
            format!("{of} {{"),
            format!("::{of}"),
            format!("\"{lower}\""),
            format!("{lower}::"),
            format!("mod {lower};"),
        ];
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let (mut found, mut folders) = (Vec::new(), vec![root.join("src"), root.join("../app/src")]);
        while let Some(folder) = folders.pop() {
            let Ok(entries) = std::fs::read_dir(folder) else { continue };
            for path in entries.map(|entry| entry.expect("listed").path()) {
                if path.is_dir() {
                    folders.push(path);
                    continue;
                }
                let is_code =
                    path.extension().is_some_and(|end| end == "rs") && !path.to_string_lossy().contains("tests");
                let text = if is_code { std::fs::read_to_string(&path).expect("a source file") } else { String::new() };
                let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
                // `DragValue(` is not `Drag(`.
                let whole = |said: &String| {
                    code.match_indices(said.as_str()).any(|(at, _)| {
                        let before = code[..at].chars().next_back();
                        said.starts_with(':') || !before.is_some_and(|c| c.is_alphanumeric() || c == '_')
                    })
                };
                if said.iter().any(whole) {
                    found.push(path);
                }
            }
        }
        found
    }

    #[test]
    fn a_second_skill_is_named_by_at_most_eight_files() {
        let files = files_that_name("Drag");
        assert!(files.iter().any(|path| path.ends_with("skill/drag.rs")), "{files:?}");
        assert!(files.len() <= 8, "{files:?}");
    }

    #[test]
    fn sets_of_skills_are_told_and_read_in_one_order() {
        let both: SkillSet = "drag,push".parse().expect("known");
        assert_eq!((both.to_string().as_str(), both.len()), ("push,drag", 2));
        assert_eq!(SkillSet::default().to_string(), "push");
        assert!("".parse::<SkillSet>().is_err() && "push,".parse::<SkillSet>().is_err());
        let text = serde_json::to_string(&both).expect("JSON");
        assert_eq!(
            (text.as_str(), serde_json::from_str::<SkillSet>(&text).expect("a set")),
            (r#"["push","drag"]"#, both)
        );
        assert!(
            serde_json::from_str::<SkillSet>("[]").is_err() && serde_json::from_str::<SkillSet>(r#"["fly"]"#).is_err()
        );
    }
}
