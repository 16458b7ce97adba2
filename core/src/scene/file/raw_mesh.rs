//! How a scene names a mesh: `"tin.stl"`, or `{ file = "tin.stl", unit = "in" }`.

use crate::scene::mesh::Unit;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserialize, Deserializer, Error, MapAccess, Visitor};
use std::fmt;

/// A mesh as it was typed.
pub(super) struct RawMesh {
    pub file: String,
    pub unit: Option<Unit>,
}

impl<'de> Deserialize<'de> for RawMesh {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Table {
            file: String,
            unit: Option<Unit>,
        }

        struct Either;

        impl<'de> Visitor<'de> for Either {
            type Value = RawMesh;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a mesh file's name, or {{ file = \"...\", unit = \"mm\" }}")
            }

            fn visit_str<E: Error>(self, file: &str) -> Result<RawMesh, E> {
                Ok(RawMesh { file: file.to_owned(), unit: None })
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<RawMesh, A::Error> {
                let Table { file, unit } = Table::deserialize(MapAccessDeserializer::new(map))?;
                Ok(RawMesh { file, unit })
            }
        }

        deserializer.deserialize_any(Either)
    }
}

/// The same as TOML.
pub(super) fn to_toml(file: &str, unit: Option<Unit>) -> String {
    let file = toml::Value::String(file.to_owned());
    match unit {
        None => file.to_string(),
        Some(unit) => format!("{{ file = {file}, unit = \"{unit}\" }}"),
    }
}
