//! The object catalogue: 14 classes and background, in the fixed order of beliefs, weights and files.

use super::shape::Shape;
use crate::solid::Solid;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::{Arc, LazyLock};

/// Number of object classes.
pub const OBJECT_CLASS_COUNT: usize = 14;
/// Number of classes with background.
pub const CLASS_COUNT: usize = 15;
/// The class of a floor cell that no object covers.
pub const BACKGROUND: ClassId = ClassId(14);

/// A class by its position in the catalogue's fixed order; 14 is background.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ClassId(pub u8);

impl ClassId {
    /// Position in arrays over classes.
    pub fn index(self) -> usize {
        usize::from(self.0)
    }
}

/// What the catalogue tells of a class.
#[derive(Clone, Debug)]
pub struct Class {
    /// Its position in the fixed order.
    pub id: ClassId,
    /// Name in scene files, for example `tomato_can`.
    pub name: String,
    /// Its shape as the catalogue describes it.
    pub shape: Shape,
    /// The shape as convex parts, standing on the board, origin at the centre of the footprint.
    pub solid: Arc<Solid>,
    /// Convex outline of the footprint, counter-clockwise, metres.
    pub footprint: Vec<[f32; 2]>,
    /// Mass, kg.
    pub mass_kg: f32,
    /// Coulomb friction coefficient.
    pub friction: f32,
    /// Within this distance of a placed object, metres, its affinities hold.
    pub influence_m: f32,
    /// Classes whose weight a placed object of this class doubles.
    pub doubles: Vec<ClassId>,
    /// The share that a placed object of this class gives to its own class.
    pub own_chance: f32,
    /// Whether the generator makes it slightly likelier.
    pub large: bool,
    /// Fixed colour, sRGB.
    pub color: [u8; 3],
    /// Texts for open-vocabulary segmentation.
    pub prompts: Vec<String>,
}

/// What the catalogue tells of everything that is no object.
#[derive(Clone, Debug)]
pub struct Background {
    /// `background`.
    pub name: String,
    /// A neutral grey, sRGB.
    pub color: [u8; 3],
    /// Texts for open-vocabulary segmentation.
    pub prompts: Vec<String>,
}

/// The classes, in order. [`Catalog::standard`] is `assets/catalog.toml`.
#[derive(Clone, Debug)]
pub struct Catalog {
    /// The object classes, by id.
    pub classes: Vec<Class>,
    /// The fifteenth class.
    pub background: Background,
}

static STANDARD: LazyLock<Catalog> = LazyLock::new(|| {
    let text = include_str!("../../../assets/catalog.toml");
    Catalog::parse(text, Path::new("assets/catalog.toml")).expect("the built-in catalogue is tested")
});

impl Catalog {
    /// The built-in catalogue, `assets/catalog.toml`. Cheap: shapes are shared.
    pub fn standard() -> Self {
        STANDARD.clone()
    }

    /// Reads a catalogue; `path` is what errors name.
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let raw: RawCatalog = toml::from_str(text).map_err(|error| {
            let line = error.span().map_or(1, |span| text[..span.start].matches('\n').count() + 1);
            Error::input(path, format!("line {line}"), error.message())
        })?;
        let wrong = |place: &str, message: String| Error::input(path, place, message);
        if raw.format != 1 {
            return Err(wrong("format", format!("{} is not a known format; this version reads 1", raw.format)));
        }
        if raw.class.len() != OBJECT_CLASS_COUNT {
            let message = format!("{} classes; beliefs and weights have {OBJECT_CLASS_COUNT}", raw.class.len());
            return Err(wrong("class", message));
        }
        let names: Vec<String> = raw.class.iter().map(|class| class.name.clone()).collect();
        let id_of = |name: &str| names.iter().position(|known| known == name).map(|at| ClassId(at as u8));
        let mut classes = Vec::with_capacity(OBJECT_CLASS_COUNT);
        for (at, class) in raw.class.into_iter().enumerate() {
            let unknown = |name: &String| wrong(&class.name, format!("doubles `{name}`, which is no class"));
            let doubles = class.doubles.iter().map(|name| id_of(name).ok_or_else(|| unknown(name)));
            let doubles = doubles.collect::<Result<Vec<_>>>()?;
            let color = parse_color(&class.color).ok_or_else(|| wrong(&class.name, not_a_color(&class.color)))?;
            let solid = class.shape.solid();
            if solid.parts.is_empty() || class.mass_kg <= 0.0 || !(0.0..=1.0).contains(&class.own_chance) {
                return Err(wrong(&class.name, "shape, mass or own_chance out of range".into()));
            }
            classes.push(Class {
                id: ClassId(at as u8),
                name: class.name,
                shape: class.shape,
                footprint: solid.footprint(),
                solid: Arc::new(solid),
                mass_kg: class.mass_kg,
                friction: class.friction,
                influence_m: class.influence_m,
                doubles,
                own_chance: class.own_chance,
                large: class.large,
                color,
                prompts: class.prompts,
            });
        }
        let RawBackground { name, color, prompts } = raw.background;
        let color = parse_color(&color).ok_or_else(|| wrong("background", not_a_color(&color)))?;
        Ok(Self { classes, background: Background { name, color, prompts } })
    }

    /// An object class.
    ///
    /// # Panics
    /// For [`BACKGROUND`], which has a name and a colour but no shape; see [`Catalog::name`] and [`Catalog::color`].
    pub fn class(&self, id: ClassId) -> &Class {
        &self.classes[id.index()]
    }

    /// The object class of that name.
    pub fn by_name(&self, name: &str) -> Option<&Class> {
        self.classes.iter().find(|class| class.name == name)
    }

    /// Name of a class, background included.
    pub fn name(&self, id: ClassId) -> &str {
        self.classes.get(id.index()).map_or(&self.background.name, |class| &class.name)
    }

    /// Colour of a class, background included.
    pub fn color(&self, id: ClassId) -> [u8; 3] {
        self.classes.get(id.index()).map_or(self.background.color, |class| class.color)
    }

    /// The class name nearest to a misspelt one, when one is near.
    pub fn nearest_name(&self, name: &str) -> Option<&str> {
        let near = self.classes.iter().map(|class| (edit_distance(name, &class.name), class.name.as_str())).min()?;
        (near.0 <= 3.max(name.len() / 3)).then_some(near.1)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCatalog {
    format: u32,
    background: RawBackground,
    class: Vec<RawClass>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBackground {
    name: String,
    color: String,
    prompts: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawClass {
    name: String,
    shape: Shape,
    mass_kg: f32,
    friction: f32,
    influence_m: f32,
    doubles: Vec<String>,
    own_chance: f32,
    large: bool,
    color: String,
    prompts: Vec<String>,
}

fn parse_color(text: &str) -> Option<[u8; 3]> {
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii())?;
    let channel = |at: usize| u8::from_str_radix(&digits[at..at + 2], 16).ok();
    Some([channel(0)?, channel(2)?, channel(4)?])
}

fn not_a_color(text: &str) -> String {
    format!("color `{text}` is not like #1a2b3c")
}

/// Levenshtein's distance.
fn edit_distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.chars().count()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.chars().enumerate() {
            let change = diagonal + usize::from(from != to);
            diagonal = row[j + 1];
            row[j + 1] = change.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[row.len() - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Name, size (m), mass (kg), radius of influence (m), doubled classes, own chance, large: as the design lists them (the
    /// paper names the classes and gives no numbers).
    type Listed = (&'static str, [f32; 3], f32, f32, &'static [u8], f32, bool);

    const LISTED: [Listed; OBJECT_CLASS_COUNT] = [
        ("chips_can", [0.074, 0.074, 0.242], 0.205, 0.20, &[3, 4, 5, 7, 12, 13], 0.70, true),
        ("tomato_can", [0.066, 0.066, 0.102], 0.349, 0.15, &[0, 5, 11, 12], 0.10, false),
        ("coffee_can", [0.070, 0.070, 0.099], 0.404, 0.12, &[4, 5, 7, 12], 0.10, true),
        ("gum_tin", [0.066, 0.066, 0.080], 0.100, 0.12, &[0, 5, 10, 11, 12], 0.01, false),
        ("cleaner_bottle", [0.104, 0.068, 0.252], 0.100, 0.15, &[0, 2, 5, 7, 8, 10], 0.50, true),
        ("cracker_box", [0.062, 0.158, 0.207], 0.411, 0.20, &[0, 2, 4, 7, 8, 12], 0.70, true),
        ("gelatin_box", [0.072, 0.028, 0.087], 0.097, 0.10, &[0, 3, 5, 7, 10, 11, 12], 0.01, false),
        ("mustard_bottle", [0.059, 0.097, 0.191], 0.603, 0.20, &[0, 2, 4, 5], 0.50, false),
        ("cookie_box", [0.119, 0.061, 0.097], 0.100, 0.20, &[4, 5, 7], 0.30, false),
        ("meat_can", [0.103, 0.056, 0.084], 0.370, 0.15, &[6, 11], 0.10, false),
        ("baking_powder", [0.080, 0.051, 0.170], 0.411, 0.15, &[4, 8, 12], 0.10, true),
        ("pasta_box", [0.185, 0.087, 0.220], 0.411, 0.15, &[8, 12], 0.70, true),
        ("cereal_box", [0.060, 0.140, 0.220], 0.411, 0.15, &[3, 4, 5, 7, 10, 11, 12], 0.70, true),
        ("milk_carton", [0.070, 0.070, 0.230], 0.411, 0.15, &[3, 4, 5, 10, 11, 12], 0.10, true),
    ];

    #[test]
    fn every_class_is_as_the_design_lists_it() {
        let catalog = Catalog::standard();
        assert_eq!(catalog.classes.len(), OBJECT_CLASS_COUNT);
        for (class, (name, size, mass, influence, doubles, own, large)) in catalog.classes.iter().zip(LISTED) {
            assert_eq!(class.name, name);
            assert_eq!(catalog.by_name(name).map(|c| c.id), Some(class.id));
            let bounds = class.solid.bounds();
            for (measured, listed) in bounds.size().iter().zip(size) {
                assert!((measured - listed).abs() < 1e-6, "{name} {:?}", bounds.size());
            }
            assert!(bounds.min.z.abs() < 1e-7 && (bounds.min.x + bounds.max.x).abs() < 1e-6, "{name} stands centred");
            let doubled: Vec<u8> = class.doubles.iter().map(|id| id.0).collect();
            assert_eq!((doubled.as_slice(), class.large), (doubles, large), "{name}");
            assert_eq!(
                (class.mass_kg, class.influence_m, class.own_chance, class.friction),
                (mass, influence, own, 0.5)
            );
            assert!(class.prompts.iter().all(|prompt| !prompt.is_empty()) && !class.prompts.is_empty());
        }
        assert_eq!(catalog.name(BACKGROUND), "background");
    }

    #[test]
    fn colours_differ() {
        let catalog = Catalog::standard();
        let colors: Vec<[u8; 3]> = (0..CLASS_COUNT).map(|k| catalog.color(ClassId(k as u8))).collect();
        for i in 0..CLASS_COUNT {
            for j in 0..i {
                let distance: i32 = (0..3).map(|c| (i32::from(colors[i][c]) - i32::from(colors[j][c])).abs()).sum();
                assert!(distance > 60, "classes {i} and {j}");
            }
        }
    }

    #[test]
    fn a_misspelt_class_is_recognised() {
        let catalog = Catalog::standard();
        assert_eq!(catalog.nearest_name("tomatoe_can"), Some("tomato_can"));
        assert_eq!(catalog.nearest_name("zebra"), None);
    }

    #[test]
    fn a_broken_catalogue_names_its_place() {
        let text = include_str!("../../../assets/catalog.toml");
        let text = text.replace("\"gelatin_box\", \"pasta_box\"", "\"jelly_box\", \"pasta_box\"");
        let message = Catalog::parse(&text, Path::new("c.toml")).expect_err("unknown class").to_string();
        assert_eq!(message, "c.toml: meat_can: doubles `jelly_box`, which is no class");
    }
}
