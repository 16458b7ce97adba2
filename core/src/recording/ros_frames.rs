//! An MCAP file of ROS 2 as a recording: what it holds, told to a person, and the frames that its topics make.

use super::Settings;
use super::bag::{Bag, Topic};
use super::entry::{Depth, Entry, Found, Labels, Place};
use super::folder::pinhole;
use super::joints::Holder;
use super::mcap_file::Address;
use super::ros::CameraInfo;
use super::topics::{Axes, Topics};
use super::transforms::{nearest, single};
use crate::camera::Pinhole;
use crate::{Error, Pose, Result};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// A line of what is in an MCAP file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TopicLine {
    /// The topic.
    pub topic: String,
    /// The type of its messages.
    pub kind: String,
    /// Number of messages.
    pub count: usize,
    /// Of images their encoding or compression, else empty.
    pub encoding: String,
}

/// What `nudge map --inspect` tells of an MCAP file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Inspection {
    /// What is in it, by topic.
    pub topics: Vec<TopicLine>,
    /// A topic map to begin with, as TOML, or what the recording lacks.
    pub proposal: std::result::Result<String, String>,
}

/// Tells what is in an MCAP file, and proposes which topics to map.
///
/// # Errors
/// Those of reading the file.
pub fn inspect(path: &Path) -> Result<Inspection> {
    let bag = Bag::read(path)?;
    let line = |(name, topic): (&String, &Topic)| TopicLine {
        topic: name.clone(),
        kind: topic.kind.clone(),
        count: topic.count,
        encoding: topic.encoding.clone(),
    };
    let topics = bag.topics.iter().map(line).collect();
    Ok(Inspection { topics, proposal: Topics::proposed(&bag).map(|topics| topics.to_toml()) })
}

/// Lists the frames.
pub(super) fn list(path: &Path, settings: &Settings) -> Result<Found> {
    let bag = Bag::read(path)?;
    let topics = match &settings.topics {
        Some(file) => Topics::read(file)?,
        None => Topics::proposed(&bag).map_err(|words| {
            Error::input(path, "", format!("{words}; --topics FILE says which topics to map, --inspect shows them"))
        })?,
    };
    let missing = |what: &str, name: &str| {
        let words = format!("no {what}: there is none on {name}; --inspect shows the topics that there are");
        Error::input(path, "", words)
    };
    let of = |name: &str| bag.topics.get(name);
    let depth = of(&topics.depth).filter(|topic| !topic.images.is_empty());
    let depth = depth.ok_or_else(|| missing("depth images", &topics.depth))?;
    let info = of(&topics.info).and_then(|topic| topic.info.as_ref());
    let info = info.ok_or_else(|| missing("CameraInfo", &topics.info))?;
    let camera = camera(info).map_err(|words| Error::input(path, topics.info.clone(), words))?;
    let labels: BTreeMap<i64, &Address> = match &topics.labels {
        Some(name) => {
            let found = of(name).ok_or_else(|| missing("labels", name))?;
            found.images.iter().map(|(time_ns, _, address)| (*time_ns, address)).collect()
        }
        None => BTreeMap::new(),
    };
    if let Some(name) = topics.pose.as_ref().filter(|name| of(name).is_none_or(|topic| topic.poses.is_empty())) {
        return Err(missing("PoseStamped", name));
    }
    if let Some(name) = topics.joints.as_ref().filter(|name| of(name).is_none_or(|topic| topic.joints.is_empty())) {
        return Err(missing("JointState", name));
    }
    let file = settings.topics.as_deref().unwrap_or(path);
    let holder =
        topics.robot.as_ref().map(|robot| Holder::read(robot, topics.camera_link.as_deref(), file)).transpose()?;
    let tolerance_s = topics.tolerance_s.unwrap_or(settings.tolerance_s);
    let first_ns = depth.images.iter().map(|(time_ns, ..)| *time_ns).min().unwrap_or(0);
    let place = |topic: &str, address: &Address| Place::Message {
        address: address.clone(),
        kind: Arc::from(of(topic).map_or("", |topic| topic.kind.as_str())),
    };
    let entry = |(number, (time_ns, frame, address)): (usize, &(i64, String, Address))| {
        let label = topics.labels.as_ref().zip(nearest(&labels, *time_ns, tolerance_s).ok());
        Entry {
            name: format!("{number:03}"),
            time_s: Some((time_ns - first_ns) as f64 * 1e-9),
            pose: pose(&bag, &topics, holder.as_ref(), frame, *time_ns, tolerance_s)
                .map(|pose| turned(pose, topics.axes)),
            camera,
            depth: Ok(Depth { place: place(&topics.depth, address), unit_m: topics.depth_unit_m.unwrap_or(0.001) }),
            labels: label.map_or(Labels::None, |(name, address)| Labels::Image(place(name, address))),
        }
    };
    Ok(Found { entries: depth.images.iter().enumerate().map(entry).collect(), warnings: Vec::new() })
}

/// The camera's pose at a time, as `topics` say where to find it.
fn pose(
    bag: &Bag,
    topics: &Topics,
    holder: Option<&Holder>,
    frame: &str,
    time_ns: i64,
    tolerance_s: f64,
) -> std::result::Result<Pose, String> {
    if let Some((holder, states)) = holder.zip(topics.joints.as_ref().and_then(|name| bag.topics.get(name))) {
        return holder.pose(&states.joints, time_ns, tolerance_s);
    }
    if let Some(poses) = topics.pose.as_ref().and_then(|name| bag.topics.get(name)) {
        return single(nearest(&poses.poses, time_ns, tolerance_s)?);
    }
    let (fixed, camera) = (topics.fixed_frame.as_deref(), topics.camera_frame.as_deref());
    bag.tree.lookup(fixed.unwrap_or_default(), camera.unwrap_or(frame), time_ns, tolerance_s)
}

/// The pose of the optical frame, where the one that is told has other axes.
fn turned(pose: Pose, axes: Axes) -> Pose {
    match axes {
        Axes::Optical => pose,
        Axes::Body => {
            // Columns: the optical x, y and z in the body's axes.
            let body_from_optical = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
            let rotation = Rotation3::from_matrix_unchecked(body_from_optical);
            pose * UnitQuaternion::from_rotation_matrix(&rotation)
        }
    }
}

fn camera(info: &CameraInfo) -> std::result::Result<Pinhole, String> {
    let bends = info.distortion.iter().any(|k| *k != 0.0);
    let (known, more) = info.distortion.split_at(info.distortion.len().min(5));
    if bends && (!matches!(info.model.as_str(), "plumb_bob" | "rational_polynomial") || more.iter().any(|k| *k != 0.0))
    {
        return Err(format!("has distortion of model {}; plumb_bob with k1, k2, p1, p2, k3 is read", info.model));
    }
    let [fx, fy, cx, cy] = info.k;
    let mut camera = pinhole(info.size, [fx, fy], [cx, cy]);
    camera.distortion = std::array::from_fn(|at| known.get(at).map_or(0.0, |k| *k as f32));
    camera.check().map(|()| camera).map_err(|(field, words)| format!("{field} {words}"))
}
