//! What is on the topics of an MCAP file of ROS 2, without its images.

use super::joints::JointPositions;
use super::mcap_file::{Address, scan};
use super::ros::{self, CameraInfo, Placed};
use super::transforms::Tree;
use crate::{Error, Result};
use std::collections::BTreeMap;
use std::path::Path;

/// What is on one topic.
#[derive(Debug, Default)]
pub(super) struct Topic {
    pub(super) kind: String,
    pub(super) count: usize,
    /// Of images: when, in which frame, and where the message is.
    pub(super) images: Vec<(i64, String, Address)>,
    /// Of images: the encoding of the first.
    pub(super) encoding: String,
    pub(super) info: Option<CameraInfo>,
    pub(super) poses: BTreeMap<i64, Placed>,
    pub(super) joints: BTreeMap<i64, JointPositions>,
}

/// What is in a file, without its images.
#[derive(Debug, Default)]
pub(super) struct Bag {
    pub(super) topics: BTreeMap<String, Topic>,
    pub(super) tree: Tree,
}

impl Bag {
    pub(super) fn read(path: &Path) -> Result<Self> {
        let mut bag = Self::default();
        scan(path, &mut |channel, address, message| {
            let topic = bag.topics.entry(channel.topic.clone()).or_default();
            topic.kind.clone_from(&channel.kind);
            topic.count += 1;
            let number = topic.count;
            topic
                .take(&mut bag.tree, address, message)
                .map_err(|words| Error::input(path, format!("{}, message {number}", channel.topic), words))
        })?;
        Ok(bag)
    }

    /// Topics of depth images, the likeliest first.
    pub(super) fn depth_topics(&self) -> Vec<String> {
        let is_depth = |name: &str, topic: &Topic| {
            let told = &topic.encoding;
            let numbers = told.starts_with("16UC1") || told.starts_with("mono16") && name.contains("depth");
            told.contains("compressedDepth") || told.starts_with("32FC1") || (numbers && !is_of_labels(name))
        };
        let rank = |name: &str| {
            (!name.contains("aligned"), !name.contains("depth"), name.contains("compressed"), name.to_owned())
        };
        self.ranked(&is_depth, &rank)
    }

    /// Topics of label images, the likeliest first.
    pub(super) fn label_topics(&self, depth: &str) -> Vec<String> {
        let whole = ["mono8", "8UC1", "mono16", "16UC1"];
        let is_labels = |name: &str, topic: &Topic| {
            let numbers = whole.contains(&topic.encoding.as_str()) || topic.kind.ends_with("/CompressedImage");
            numbers && name != depth && is_of_labels(name)
        };
        self.ranked(&is_labels, &|name: &str| (false, false, false, name.to_owned()))
    }

    /// Topics of cameras, the ones whose names share most with the depth topic's first.
    pub(super) fn info_topics(&self, depth: &str) -> Vec<String> {
        let frame = self.frame_of(depth);
        let alike = |name: &str| name.bytes().zip(depth.bytes()).take_while(|(a, b)| a == b).count();
        let mut found: Vec<&String> =
            self.topics.iter().filter(|(_, topic)| topic.info.is_some()).map(|(name, _)| name).collect();
        let same_frame = |name: &str| self.topics[name].info.as_ref().map(|info| &info.frame) == frame.as_ref();
        found.sort_by_key(|name| (!same_frame(name), usize::MAX - alike(name)));
        found.into_iter().cloned().collect()
    }

    /// Topics of poses.
    pub(super) fn pose_topics(&self) -> Vec<String> {
        self.ranked(&|_, topic| !topic.poses.is_empty(), &|name| {
            (!name.contains("camera"), false, false, name.to_owned())
        })
    }

    /// The frame that a topic's images are in.
    pub(super) fn frame_of(&self, topic: &str) -> Option<String> {
        Some(self.topics.get(topic)?.images.first()?.1.clone())
    }

    fn ranked(
        &self,
        keep: &dyn Fn(&str, &Topic) -> bool,
        rank: &dyn Fn(&str) -> (bool, bool, bool, String),
    ) -> Vec<String> {
        let mut found: Vec<&String> =
            self.topics.iter().filter(|(name, topic)| keep(name, topic)).map(|(name, _)| name).collect();
        found.sort_by_key(|name| rank(name));
        found.into_iter().cloned().collect()
    }
}

fn is_of_labels(name: &str) -> bool {
    ["label", "segment", "semantic", "mask", "class"].iter().any(|word| name.contains(word))
}

impl Topic {
    fn take(&mut self, tree: &mut Tree, address: Address, message: &[u8]) -> std::result::Result<(), String> {
        let kind = self.kind.rsplit('/').next().unwrap_or_default();
        match kind {
            "Image" | "CompressedImage" => {
                let header = ros::header_of(message)?;
                if self.images.is_empty() {
                    self.encoding = ros::encoding(&self.kind, message)?;
                }
                self.images.push((header.time_ns, header.frame, address));
            }
            "CameraInfo" if self.info.is_none() => self.info = Some(ros::camera_info(message)?),
            "PoseStamped" => {
                let (header, placed) = ros::pose_stamped(message)?;
                self.poses.insert(header.time_ns, placed);
            }
            "JointState" => {
                let (header, positions) = ros::joint_state(message)?;
                self.joints.insert(header.time_ns, positions);
            }
            "TFMessage" => {
                let is_fixed = address.topic.ends_with("tf_static");
                for (header, child, placed) in ros::transforms(message)? {
                    tree.add(&header.frame, &child, (!is_fixed).then_some(header.time_ns), placed);
                }
            }
            _ => {}
        }
        Ok(())
    }
}
