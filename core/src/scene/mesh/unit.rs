//! The unit that a mesh file is in: none of the formats says.

use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Largest edges, metres, that are taken for metres as they are.
const METRES: [f64; 2] = [0.005, 1.0];
/// Beyond [`METRES`] and up to this, numbers are inches: a tin of 2.6.
const INCHES: f64 = 3.0;
/// Largest edges, metres, that another unit must give to be believed.
const LIKELY_M: [f64; 2] = [0.02, 1.0];
/// Largest edges, metres, that millimetres may still give where nothing is likely.
const POSSIBLE_M: [f64; 2] = [0.005, 3.0];
/// A mesh is in metres unless it differs from its class by more than this factor and another unit by less than the next.
const METRES_OFF: f64 = 4.0;
const OTHER_OFF: f64 = 2.0;

/// A unit of length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    /// Metres.
    #[serde(rename = "m")]
    Metre,
    /// Decimetres.
    #[serde(rename = "dm")]
    Decimetre,
    /// Centimetres.
    #[serde(rename = "cm")]
    Centimetre,
    /// Millimetres.
    #[serde(rename = "mm")]
    Millimetre,
    /// Inches.
    #[serde(rename = "in")]
    Inch,
    /// Kilometres: metres that something has divided by a thousand.
    #[serde(rename = "km")]
    Kilometre,
}

impl Unit {
    /// All units.
    pub const ALL: [Self; 6] =
        [Self::Metre, Self::Decimetre, Self::Centimetre, Self::Millimetre, Self::Inch, Self::Kilometre];

    /// Its length in metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Decimetre => 0.1,
            Self::Centimetre => 0.01,
            Self::Millimetre => 0.001,
            Self::Inch => 0.0254,
            Self::Kilometre => 1000.0,
        }
    }

    /// `mm`, as it is typed.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Metre => "m",
            Self::Decimetre => "dm",
            Self::Centimetre => "cm",
            Self::Millimetre => "mm",
            Self::Inch => "in",
            Self::Kilometre => "km",
        }
    }

    /// `millimetres`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Metre => "metres",
            Self::Decimetre => "decimetres",
            Self::Centimetre => "centimetres",
            Self::Millimetre => "millimetres",
            Self::Inch => "inches",
            Self::Kilometre => "kilometres",
        }
    }

    /// What the file's unit must be, judged by its largest edge (in that unit) and the largest edge of its class, metres.
    ///
    /// Metres, unless they are far from the class and another unit is near. Without a class, or where no unit comes near
    /// it: metres up to the size of a shelf's objects, a little beyond inches, else millimetres, centimetres, or metres
    /// that something has divided by a thousand. `None` where no unit gives an object.
    pub(super) fn guess(edge: f64, expected: Option<f64>) -> Option<Self> {
        let within = |unit: Self, [low, high]: [f64; 2]| (low..=high).contains(&(edge * unit.metres()));
        let of_class = expected.and_then(|expected| {
            let off = |unit: Self| (edge * unit.metres() / expected).ln().abs();
            if off(Self::Metre) < METRES_OFF.ln() {
                return Some(Self::Metre);
            }
            let nearest = Self::ALL.into_iter().min_by(|a, b| off(*a).total_cmp(&off(*b)))?;
            (off(nearest) < OTHER_OFF.ln()).then_some(nearest)
        });
        of_class
            .or_else(|| within(Self::Metre, METRES).then_some(Self::Metre))
            .or_else(|| (edge > METRES[1] && edge <= INCHES).then_some(Self::Inch))
            .or_else(|| {
                let others = [Self::Millimetre, Self::Centimetre, Self::Kilometre];
                others.into_iter().find(|unit| within(*unit, LIKELY_M))
            })
            .or_else(|| within(Self::Millimetre, POSSIBLE_M).then_some(Self::Millimetre))
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.symbol())
    }
}

impl FromStr for Unit {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|unit| unit.symbol() == text).ok_or_else(|| {
            let known = Self::ALL.map(Self::symbol).join(", ");
            Error::Usage(format!("unknown unit `{text}`; there are {known}"))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tin_is_a_tin_in_any_unit() {
        for unit in Unit::ALL {
            // Its class is told, so that 0.66 is read as decimetres and 2.6 as inches.
            assert_eq!(Unit::guess(0.066 / unit.metres(), Some(0.066)), Some(unit));
            assert_eq!(unit.symbol().parse::<Unit>().expect("known"), unit);
        }
        for (edge, unit) in [(0.066, Unit::Metre), (0.9, Unit::Metre), (2.6, Unit::Inch), (6.6, Unit::Centimetre)] {
            assert_eq!(Unit::guess(edge, None), Some(unit), "{edge}");
        }
        // A large version of a class stays in metres.
        assert_eq!(Unit::guess(0.35, Some(0.1)), Some(Unit::Metre));
        assert_eq!((Unit::guess(1e8, None), Unit::guess(1e-9, Some(0.1))), (None, None));
        assert!("parsec".parse::<Unit>().is_err_and(|error| error.to_string().contains("m, dm, cm, mm, in, km")));
    }
}
