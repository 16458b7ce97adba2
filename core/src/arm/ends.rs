//! The two ends of an arm that have no shape of their own: the tool's tip and the camera in hand, by their links' names.
//!
//! A file that names them otherwise can be told (`tool` and `camera` of [`crate::scene::RobotFile`]).

use super::tree::Tree;
use crate::{Error, Result};
use std::path::Path;

/// What the link at the finger tip is usually called, the likeliest first.
const TOOLS: [&str; 12] = [
    "tool",
    "tool_tip",
    "tcp",
    "tool0",
    "hand_tcp",
    "gripper_tcp",
    "gripper_tip",
    "tool_frame",
    "tool_link",
    "end_effector_link",
    "end_effector",
    "ee_link",
];
/// What the camera's own frame (x right, y down, z forward) is usually called.
const CAMERAS: [&str; 5] =
    ["camera", "camera_optical_frame", "camera_color_optical_frame", "camera_rgb_optical_frame", "optical_frame"];
/// Names that a message lists at most.
const LISTED: usize = 12;

/// The link at the finger tip: the one that was named, else the one with a usual name, also behind a prefix
/// (`panda_hand_tcp`).
///
/// # Errors
/// None of that is in the file, or two are as likely; the message lists what is there.
pub(super) fn tool<'r>(tree: &Tree<'r>, named: Option<&str>, path: &Path) -> Result<&'r str> {
    if let Some(name) = named {
        return link(tree, "tool", name, path);
    }
    let wrong = |message: String| Err(Error::input(path, "", message));
    let words = "the frame at the finger tip, z ahead, x along the gripper's broad side";
    match usual(tree, &TOOLS)[..] {
        [] => wrong(format!(
            "has no tool link ({words}): call it `tool`, or name one of its links with --tool or in the scene's [robot]; \
             at its ends are {}",
            listed(&ends(tree))
        )),
        [tool] => Ok(tool),
        ref several => wrong(format!(
            "has several links that may be the tool ({words}): {}; name one with --tool or in the scene's [robot]",
            listed(several)
        )),
    }
}

/// The link of the camera in hand, and whether it certainly is meant to be that; `None` where there is none.
///
/// # Errors
/// The one that was named is not in the file.
pub(super) fn camera<'r>(tree: &Tree<'r>, named: Option<&str>, path: &Path) -> Result<Option<(&'r str, bool)>> {
    if let Some(name) = named {
        return link(tree, "camera", name, path).map(|link| Some((link, true)));
    }
    Ok(match usual(tree, &CAMERAS)[..] {
        [camera] => Some((camera, CAMERAS[..2].contains(&camera))),
        _ => None,
    })
}

/// The links with the likeliest of some names that is there at all: exactly so, else behind a prefix.
fn usual<'r>(tree: &Tree<'r>, names: &[&str]) -> Vec<&'r str> {
    let exact = |name: &&str| tree.links.get_key_value(*name).map(|(link, _)| vec![*link]);
    let prefixed = |name: &&str| {
        let end = format!("_{name}");
        let links: Vec<&str> = tree.links.keys().copied().filter(|link| link.ends_with(&end)).collect();
        (!links.is_empty()).then_some(links)
    };
    names.iter().find_map(exact).or_else(|| names.iter().find_map(prefixed)).unwrap_or_default()
}

fn link<'r>(tree: &Tree<'r>, what: &str, name: &str, path: &Path) -> Result<&'r str> {
    match tree.links.get_key_value(name) {
        Some((link, _)) => Ok(*link),
        None => {
            let all: Vec<&str> = tree.links.keys().copied().collect();
            let message = format!("has no link `{name}`, which is named as its {what}; there are {}", listed(&all));
            Err(Error::input(path, "", message))
        }
    }
}

/// The links that nothing hangs from.
fn ends<'r>(tree: &Tree<'r>) -> Vec<&'r str> {
    let is_parent = |link: &str| tree.above.values().any(|joint| joint.parent == link);
    tree.links.keys().copied().filter(|link| !is_parent(link)).collect()
}

fn listed(links: &[&str]) -> String {
    let shown: Vec<String> = links.iter().take(LISTED).map(|link| format!("`{link}`")).collect();
    let more = if links.len() > LISTED { format!(" and {} more", links.len() - LISTED) } else { String::new() };
    shown.join(", ") + &more
}
