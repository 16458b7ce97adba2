//! The header of a PLY file: how numbers are written, and which elements of which properties follow.

use super::Bytes;

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    Little,
    Big,
}

/// A kind of number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of a number.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The number of little-endian bytes, as many as it has.
    pub(super) fn number(self, bytes: &[u8]) -> f64 {
        let mut eight = [0; 8];
        eight[..bytes.len()].copy_from_slice(bytes);
        let [a, b, c, d, ..] = eight;
        match self {
            Self::I8 => f64::from(a as i8),
            Self::U8 => f64::from(a),
            Self::I16 => f64::from(i16::from_le_bytes([a, b])),
            Self::U16 => f64::from(u16::from_le_bytes([a, b])),
            Self::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Self::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Self::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Self::F64 => f64::from_le_bytes(eight),
        }
    }
}

/// A number of an element, or a list of numbers after their count.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub(super) name: String,
    /// Of a list, that of its count.
    pub(super) kind: Kind,
    pub(super) list_of: Option<Kind>,
}

/// What follows the header so many times.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

/// A header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
}

impl Header {
    /// Reads the lines up to `end_header`.
    pub(super) fn read(bytes: &mut Bytes<'_>) -> Result<Self, String> {
        if bytes.line().unwrap_or_default() != "ply" {
            return Err("does not begin with \"ply\"".to_owned());
        }
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        loop {
            let line = bytes.line()?;
            let words: Vec<&str> = line.split_whitespace().collect();
            let wrong = || format!("\"{line}\" is not understood");
            match words[..] {
                ["end_header"] => break,
                ["format", name, "1.0"] => {
                    encoding = Some(match name {
                        "ascii" => Encoding::Text,
                        "binary_little_endian" => Encoding::Little,
                        "binary_big_endian" => Encoding::Big,
                        _ => return Err(wrong()),
                    });
                }
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| wrong())?;
                    elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
                }
                ["property", "list", count, of, name] => {
                    let (kind, list_of) = (Kind::of(count).ok_or_else(wrong)?, Some(Kind::of(of).ok_or_else(wrong)?));
                    let element = elements.last_mut().ok_or_else(wrong)?;
                    element.properties.push(Property { name: name.to_owned(), kind, list_of });
                }
                ["property", kind, name] => {
                    let kind = Kind::of(kind).ok_or_else(wrong)?;
                    let element = elements.last_mut().ok_or_else(wrong)?;
                    element.properties.push(Property { name: name.to_owned(), kind, list_of: None });
                }
                [] | ["comment" | "obj_info", ..] => {}
                _ => return Err(wrong()),
            }
        }
        let encoding = encoding.ok_or("tells no format")?;
        let vertex = elements.iter().find(|element| element.name == "vertex").ok_or("has no element vertex")?;
        for axis in ["x", "y", "z"] {
            let is_there = |property: &Property| property.name == axis && property.list_of.is_none();
            if !vertex.properties.iter().any(is_there) {
                return Err(format!("its vertices have no {axis}"));
            }
        }
        Ok(Self { encoding, elements })
    }
}
