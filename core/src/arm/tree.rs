//! Links and what joins them, checked to be one tree.

use super::description::{Description, JointElement, Link, Named};
use crate::{Error, Result};
use std::collections::BTreeMap;
use std::path::Path;

pub(super) struct Tree<'r> {
    pub links: BTreeMap<&'r str, &'r Link>,
    /// The joint above each link but the root.
    pub above: BTreeMap<&'r str, &'r JointElement>,
    pub root: &'r str,
}

/// `line 12, joint elbow`.
pub(super) fn place(element: &str, at: &Named) -> String {
    format!("line {}, {element} {}", at.line, at.name)
}

impl<'r> Tree<'r> {
    /// The tree of a file's links.
    ///
    /// # Errors
    /// Links that are there twice, joints to links that are not there, loops, more than one root.
    pub(super) fn new(robot: &'r Description, path: &Path) -> Result<Self> {
        let mut links = BTreeMap::new();
        for link in &robot.links {
            if links.insert(link.at.name.as_str(), link).is_some() {
                return Err(Error::input(path, place("link", &link.at), "is there twice"));
            }
        }
        if links.is_empty() {
            return Err(Error::input(path, "", "has no links"));
        }
        let mut above: BTreeMap<&str, &JointElement> = BTreeMap::new();
        for joint in &robot.joints {
            let wrong = |message: String| Err(Error::input(path, place("joint", &joint.at), message));
            for (end, name) in [("parent", &joint.parent), ("child", &joint.child)] {
                if !links.contains_key(name.as_str()) {
                    return wrong(format!("its {end} link `{name}` is not in the file"));
                }
            }
            if let Some(other) = above.insert(&joint.child, joint) {
                let child = &joint.child;
                return wrong(format!("closes a loop: link `{child}` already hangs from joint `{}`", other.at.name));
            }
        }
        for joint in &robot.joints {
            let mut at = joint.child.as_str();
            for _ in 0..=links.len() {
                match above.get(at) {
                    Some(above) => at = &above.parent,
                    None => break,
                }
            }
            if above.contains_key(at) {
                let message = "is part of a loop: its links have no root";
                return Err(Error::input(path, place("joint", &joint.at), message));
            }
        }
        let roots: Vec<&str> = links.keys().copied().filter(|link| !above.contains_key(link)).collect();
        match roots[..] {
            [root] => Ok(Self { links, above, root }),
            _ => {
                let message = format!("has {} links that hang from nothing: {}", roots.len(), roots.join(", "));
                Err(Error::input(path, "", message))
            }
        }
    }

    /// Whether a link is `ancestor` or hangs from it.
    pub(super) fn hangs_from(&self, link: &str, ancestor: Option<&str>) -> bool {
        let mut at = link;
        loop {
            if Some(at) == ancestor {
                return true;
            }
            match self.above.get(at) {
                Some(joint) => at = &joint.parent,
                None => return false,
            }
        }
    }
}
