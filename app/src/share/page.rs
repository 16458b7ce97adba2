//! The page around the episodes: its words, what all episodes share, and the script and style that it carries with it.

use super::states::LOWEST;
use super::{Packed, pack};
use crate::colors::{self, Colormap, hex};
use crate::figure::escape;
use crate::picture::CellError;
use crate::record::decision::SERIES;
use nudge_core::episode::NO_TRUTH;
use nudge_core::plan::Action;
use nudge_core::scene::{BACKGROUND, CLASS_COUNT, Catalog, ClassId};
use serde::Serialize;

/// What the episodes are called in the page.
pub const LETTERS: [char; 2] = ['a', 'b'];
/// More voxels are drawn as blocks.
const MOST_VOXELS: usize = 50_000;

const HTML: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
/// In the order in which they need each other.
const SCRIPTS: [&str; 10] = [
    include_str!("unpack.js"),
    include_str!("paint.js"),
    include_str!("faces.js"),
    include_str!("space.js"),
    include_str!("maps.js"),
    include_str!("curves.js"),
    include_str!("story.js"),
    include_str!("pane.js"),
    include_str!("clock.js"),
    include_str!("page.js"),
];

/// What all episodes of a page share.
#[derive(Serialize)]
struct Common {
    classes: Vec<(String, String)>,
    unknown: String,
    viridis: Vec<String>,
    magma: Vec<String>,
    cividis: Vec<String>,
    /// Key, title, hint, colour on dark ground.
    series: Vec<[String; 4]>,
    /// Title and colour.
    errors: Vec<[String; 2]>,
    no_truth: &'static str,
    lowest: f32,
    most_voxels: usize,
    /// In what two episodes differ that makes them hard to compare.
    differences: Vec<String>,
}

impl Common {
    fn of(episodes: &[Packed]) -> Self {
        let catalog = Catalog::standard();
        let stops = |map: Colormap| (0..64).map(|at| hex(map.rgb(at as f32 / 63.0))).collect();
        let classes = (0..CLASS_COUNT).map(|class| ClassId(class as u8)).map(|class| {
            let title =
                if class == BACKGROUND { "background".to_owned() } else { colors::class_title(&catalog, class) };
            (title, hex(colors::of_class(&catalog, class)))
        });
        Self {
            classes: classes.collect(),
            unknown: hex(colors::UNKNOWN_RGB),
            viridis: stops(Colormap::Viridis),
            magma: stops(Colormap::Magma),
            cividis: stops(Colormap::Cividis),
            series: SERIES.iter().map(|s| [s.key, s.title, s.hint, &hex(s.rgb)].map(str::to_owned)).collect(),
            errors: CellError::ALL.map(|error| [error.title().to_owned(), hex(error.rgb())]).to_vec(),
            no_truth: NO_TRUTH,
            lowest: LOWEST,
            most_voxels: MOST_VOXELS,
            differences: differences(episodes),
        }
    }
}

/// In what two episodes differ that makes them hard to compare, a sentence each.
pub(super) fn differences(episodes: &[Packed]) -> Vec<String> {
    let [a, b] = episodes else { return Vec::new() };
    let (one, other) = (&a.record.scene, &b.record.scene);
    let mut found = Vec::new();
    if one != other {
        let words = if one.name == other.name {
            "scenes of one name that are not the same".to_owned()
        } else {
            format!("two scenes, {} and {}", one.name, other.name)
        };
        found.push(format!("A and B map {words}: their scores do not compare."));
    }
    if one.grid() != other.grid() {
        let size = |dims: [usize; 3]| dims.map(|n| n.to_string()).join(" × ");
        let (one, other) = (one.grid(), other.grid());
        found.push(format!(
            "Their grids differ: {} voxels of {:.1} mm in A, {} of {:.1} mm in B.",
            size(one.dims),
            1e3 * one.voxel_m,
            size(other.dims),
            1e3 * other.voxel_m
        ));
    }
    found
}

/// Two sentences on what one sees, for anyone.
fn introduction(episodes: &[Packed]) -> String {
    let moves = |packed: &Packed| packed.record.steps.iter().any(|step| matches!(step.action, Action::Manipulate(_)));
    let acts = if episodes.iter().any(moves) {
        "looks in from other sides and moves things out of the way"
    } else {
        "looks in from other sides"
    };
    match episodes {
        [_, _] => format!(
            "These are two maps of a cluttered shelf, A and B, each as a robot believes it to be: a coloured block is a \
             place where it thinks that something stands, in the colour of what it takes the thing for. Move the clock at \
             the bottom, and both show what was believed after as many actions, while the robot {acts}."
        ),
        _ => format!(
            "This is what a robot believes to stand in a cluttered shelf of which it cannot see everything: a coloured block \
             is a place where it thinks that something stands, in the colour of what it takes the thing for. Move the clock at \
             the bottom to see the belief grow step by step, while the robot {acts}."
        ),
    }
}

/// The whole page.
pub fn html(episodes: &[Packed]) -> String {
    let titles: Vec<&str> = episodes.iter().map(|episode| episode.story.title.as_str()).collect();
    let mut parts = part("common", &pack::text(&pack::json(&Common::of(episodes))));
    for (episode, letter) in episodes.iter().zip(LETTERS) {
        parts += &part(&format!("{letter}-story"), &pack::text(&pack::json(&episode.story)));
        for (name, text) in &episode.parts {
            parts += &part(name, text);
        }
    }
    let script = format!("(() => {{\n\"use strict\";\n{}}})();\n", SCRIPTS.concat());
    let fill = |name: &str| match name {
        "title" => escape(&titles.join(" and ")),
        "introduction" => escape(&introduction(episodes)),
        "style" => STYLE.to_owned(),
        "parts" => parts.clone(),
        "script" => script.clone(),
        // A name that the page does not know stays as it is, and a test finds it.
        name => format!("{{{{{name}}}}}"),
    };
    filled(HTML, fill)
}

/// The template with what stands for every `{{name}}`; what is put in is not read again.
fn filled(template: &str, fill: impl Fn(&str) -> String) -> String {
    let mut html = String::with_capacity(super::LIMIT);
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let Some((name, after)) = after.split_once("}}") else { break };
        html += before;
        html += &fill(name);
        rest = after;
    }
    html + rest
}

/// Data that the script unpacks.
fn part(name: &str, text: &str) -> String {
    format!("<script type=\"text/plain\" id=\"part-{name}\">{text}</script>\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_put_into_the_page_is_not_read_again() {
        let said = filled("<b>{{title}}</b>{{parts}}", |name| match name {
            "title" => "{{parts}}".to_owned(),
            name => format!("[{name}]"),
        });
        assert_eq!(said, "<b>{{parts}}</b>[parts]");
    }

    #[test]
    fn no_script_of_the_page_ends_it_early() {
        let text = SCRIPTS.concat();
        assert!(!text.contains("</script") && !text.contains("<!--"));
        assert!(!STYLE.contains("</style") && !STYLE.contains("url("));
    }
}
