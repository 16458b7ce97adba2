//! How a manipulation is told and drawn, whatever its skill.

use super::{Manipulation, Rejection};
use crate::{Point, Vector};

/// A manipulation in words and numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// What is done, in one line: `push 100 mm towards 90°`.
    pub words: String,
    /// The same without the skill's name, and from where: `100 mm at 90° from (0.10, 0.20)`.
    pub short: String,
    /// What there is to know about it, for people.
    pub facts: Vec<Fact>,
    /// Its numbers, for tables and files.
    pub parameters: Vec<Parameter>,
}

/// One thing to know about a manipulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Fact {
    /// What it is, in a word.
    pub name: &'static str,
    /// Its value with unit.
    pub text: String,
    /// What it means.
    pub hint: &'static str,
}

/// One number of a manipulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its name in tables that are filed: `length_m`. Parameters of the same name share a column.
    pub field: &'static str,
    /// What it is, in a word.
    pub name: &'static str,
    /// The title of its column where a table has little room; `None` where such a table leaves it out.
    pub column: Option<&'static str>,
    /// Its value, metres or degrees.
    pub value: f32,
    /// In what it is told to people.
    pub unit: Unit,
    /// What it means.
    pub hint: &'static str,
}

/// In what a number is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Metres, two places.
    Metres,
    /// Whole millimetres.
    Millimetres,
    /// Whole degrees.
    Degrees,
}

impl Parameter {
    /// The value as it is told, without the unit.
    pub fn number(&self) -> String {
        match self.unit {
            Unit::Metres => format!("{:.2}", self.value),
            Unit::Millimetres => format!("{:.0}", self.value * 1e3),
            Unit::Degrees => format!("{:.0}", self.value),
        }
    }

    /// The sign of the unit.
    pub fn sign(&self) -> &'static str {
        match self.unit {
            Unit::Metres => "m",
            Unit::Millimetres => "mm",
            Unit::Degrees => "°",
        }
    }
}

impl Description {
    /// The number of that name in files.
    pub fn value(&self, field: &str) -> Option<f32> {
        self.parameters.iter().find(|parameter| parameter.field == field).map(|parameter| parameter.value)
    }

    /// What goes along a straight line, by the skill's name: where the tip starts, its direction, and how far it goes.
    pub(super) fn of_line(name: &str, start: [f32; 3], direction_deg: f32, length_m: f32) -> Self {
        let [x, y, z] = start;
        let (mm, degrees) = (format!("{:.0} mm", length_m * 1e3), format!("{direction_deg:.0}°"));
        let number = |field, name, value| Parameter {
            field,
            name,
            column: None,
            value,
            unit: Unit::Metres,
            hint: "Where the tip starts",
        };
        Self {
            words: format!("{name} {mm} towards {degrees}"),
            short: format!("{mm} at {degrees} from ({x:.2}, {y:.2})"),
            facts: vec![
                Fact {
                    name: "from",
                    text: format!("x {}, y {} m", metres(x), metres(y)),
                    hint: "Where the tip starts",
                },
                Fact {
                    name: "length",
                    text: format!("{mm} to {degrees}"),
                    hint: "Planned length and direction; 90° is into the shelf",
                },
            ],
            parameters: vec![
                number("start_x_m", "from x", x),
                number("start_y_m", "from y", y),
                number("start_z_m", "from z", z),
                Parameter {
                    field: "direction_deg",
                    name: "towards",
                    column: Some("To"),
                    value: direction_deg,
                    unit: Unit::Degrees,
                    hint: "Direction, degrees; 90 is into the shelf, 0 to the right",
                },
                Parameter {
                    field: "length_m",
                    name: "length",
                    column: Some("mm"),
                    value: length_m,
                    unit: Unit::Millimetres,
                    hint: "Planned length of the way in contact, millimetres",
                },
            ],
        }
    }
}

/// Metres with two places, without the sign of a zero.
fn metres(m: f32) -> String {
    format!("{:.2}", if m > -0.005 { m.abs() } else { m })
}

/// The shape of a manipulation in the shelf's frame, metres.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outline {
    /// Ways of the tool in contact; the first one stands for the whole where there is room for one only.
    pub arrows: Vec<Arrow>,
    /// Lines beside them: how the tool stands, or where something is set down.
    pub lines: Vec<Vec<Point>>,
}

/// A straight way, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrow {
    /// Where it begins.
    pub start: Point,
    /// Where it ends, from its start.
    pub way: Vector,
}

impl Arrow {
    /// Where it ends.
    pub fn end(&self) -> Point {
        self.start + self.way
    }
}

impl Manipulation {
    /// It in words and numbers; see [`Skill::describe`](super::Skill::describe).
    pub fn describe(&self) -> Description {
        self.skill().describe()
    }

    /// Its shape; see [`Skill::outline`](super::Skill::outline).
    pub fn outline(&self) -> Outline {
        self.skill().outline()
    }

    /// The way that stands for the whole.
    pub fn arrow(&self) -> Arrow {
        let first = self.outline().arrows.first().copied();
        first.unwrap_or(Arrow { start: Point::origin(), way: Vector::zeros() })
    }

    /// What stood against it, in words.
    pub fn against(&self, rejection: &Rejection) -> String {
        rejection.words(self.kind())
    }
}
