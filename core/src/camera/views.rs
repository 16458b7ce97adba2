//! View arrays as data: the shipped ones and files of one's own.
//!
//! A file lists every view by position, look-at target and slot (column, row, number of the target):
//!
//! ```toml
//! format = 1
//! name = "standard300"
//! description = "..."
//! camera = { width = 640, height = 480, focal_px = 433.0, depth_range_m = [0.07, 1.5] }
//! layout = [10, 10, 3]
//! views = [
//!     { position = [-0.3375, -0.2, 0.055], target = [-0.3, 0.25, 0.155], slot = [0, 0, 0] },
//! ]
//! ```
//!
//! Format 2 has room for full poses. A view has, beside `position` and `slot`, either a `target` and, if the camera is not
//! upright, `roll_deg` (about its optical axis, clockwise as the camera sees it), or a `quaternion` (x, y, z, w) of
//! `world_from_camera`:
//!
//! ```toml
//! { position = [0.0, -0.3, 0.15], target = [0.0, 0.2, 0.15], roll_deg = 90.0, slot = [0, 0, 0] },
//! { position = [0.0, -0.3, 0.15], quaternion = [-0.7071, 0.0, 0.0, 0.7071], slot = [1, 0, 0] },
//! ```

use super::{Intrinsics, Pinhole, View, ViewArray, ViewId, pose_from_quaternion};
use crate::fixed::{self, Fixed};
use crate::{Error, Point, Pose, Result, Vector};
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};
use serde::Deserialize;
use std::path::Path;
use toml::Spanned;

/// The arrays that come with the program.
const SHIPPED: [(&str, &str); 2] = [
    ("standard300", include_str!("../../../assets/views/standard300.toml")),
    ("real75", include_str!("../../../assets/views/real75.toml")),
];

/// How far ahead a camera that is given by its pose is said to look, metres.
const AHEAD_M: f32 = 0.45;

/// What was typed.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawArray {
    format: u32,
    name: String,
    #[serde(default)]
    #[expect(dead_code, reason = "for the reader of the file")]
    description: String,
    camera: Spanned<Intrinsics>,
    layout: Spanned<Fixed<usize, 3>>,
    views: Vec<Spanned<RawView>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawView {
    #[serde(deserialize_with = "fixed::array")]
    position: [f32; 3],
    target: Option<Fixed<f32, 3>>,
    roll_deg: Option<f32>,
    quaternion: Option<Fixed<f32, 4>>,
    #[serde(deserialize_with = "fixed::array")]
    slot: [u16; 3],
}

impl RawView {
    /// The camera's pose and the point that it looks at; for a pose without a target one as far ahead as the shelf's middle.
    fn pose(&self, format: u32) -> std::result::Result<(Pose, [f32; 3]), String> {
        if format == 1 && (self.roll_deg.is_some() || self.quaternion.is_some()) {
            return Err("roll_deg and quaternion need format = 2".to_owned());
        }
        match (&self.target, &self.quaternion) {
            (Some(target), None) => {
                let upright = look_at(self.position, target.0)?;
                let Some(roll_deg) = self.roll_deg else { return Ok((upright, target.0)) };
                if !(-360.0..=360.0).contains(&roll_deg) {
                    return Err(format!("roll_deg is {roll_deg}; -360 to 360 are allowed"));
                }
                let roll = UnitQuaternion::from_axis_angle(&Vector::z_axis(), roll_deg.to_radians());
                Ok((upright * roll, target.0))
            }
            (None, Some(quaternion)) => {
                if self.roll_deg.is_some() {
                    return Err("a quaternion says the roll already: leave out roll_deg".to_owned());
                }
                if !self.position.iter().all(|x| x.is_finite() && x.abs() <= 100.0) {
                    return Err("position must be finite and within 100 m".to_owned());
                }
                let given = pose_from_quaternion(self.position, quaternion.0)?;
                let rotation = UnitQuaternion::new_normalize(*given.rotation.quaternion());
                let pose = Pose::from_parts(given.translation, rotation);
                Ok((pose, (pose * Point::new(0.0, 0.0, AHEAD_M)).coords.into()))
            }
            _ => Err("a view needs either target or quaternion".to_owned()),
        }
    }
}

impl ViewArray {
    /// The name of an array of views that are not candidates of a camera but were recorded.
    pub const RECORDED: &str = "recorded";

    /// The array of a name: `standard300`, `real75`, or a path to a file of one's own (anything with a slash, or that
    /// ends in `.toml`).
    ///
    /// # Errors
    ///
    /// An unknown name, a file that cannot be read, or one whose content is wrong (see [`ViewArray::parse`]).
    pub fn named(name: &str) -> Result<Self> {
        if let Some((file, text)) = SHIPPED.iter().find(|(shipped, _)| *shipped == name) {
            return Self::parse(format!("{file}.toml"), text);
        }
        if name.contains('/') || name.ends_with(".toml") {
            return Self::read(name);
        }
        let known: Vec<&str> = Self::shipped().collect();
        Err(Error::Usage(format!("no view array {name:?}: known are {} and paths of files (.toml)", known.join(", "))))
    }

    /// The names of the arrays that come with the program.
    pub fn shipped() -> impl Iterator<Item = &'static str> {
        SHIPPED.iter().map(|(name, _)| *name)
    }

    /// The array of a file.
    ///
    /// # Errors
    ///
    /// As for [`ViewArray::named`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let text = std::fs::read_to_string(&path).map_err(|source| Error::io(&path, source))?;
        Self::parse(path, &text)
    }

    /// The array that a file's text describes; `path` is only for messages.
    ///
    /// # Errors
    ///
    /// Broken TOML, unknown keys, another format, numbers that are not finite or out of range, a camera that looks
    /// straight up or down or at its own position, a slot outside the layout or taken twice: one line that names file,
    /// line and view.
    pub fn parse(path: impl AsRef<Path>, text: &str) -> Result<Self> {
        let path = path.as_ref();
        let line = |at: usize| format!("line {}", text[..at.min(text.len())].matches('\n').count() + 1);
        let raw: RawArray = toml::from_str(text).map_err(|e| {
            let place = e.span().map(|span| line(span.start)).unwrap_or_default();
            Error::input(path, place, e.message().lines().collect::<Vec<_>>().join(" "))
        })?;
        if !(1..=2).contains(&raw.format) {
            return Err(Error::input(path, "format", format!("is {}, this version reads formats 1 and 2", raw.format)));
        }
        let camera = raw.camera.get_ref();
        check_camera(camera).map_err(|e| Error::input(path, line(raw.camera.span().start), e))?;
        let layout = raw.layout.get_ref().0;
        if layout.iter().any(|n| !(1..=1000).contains(n)) || layout.iter().product::<usize>() > usize::from(u16::MAX) {
            let place = line(raw.layout.span().start);
            return Err(Error::input(path, place, "layout must be three numbers from 1 to 1000, 65535 views in all"));
        }
        let mut taken = std::collections::BTreeMap::new();
        let mut views = Vec::with_capacity(raw.views.len());
        for (index, view) in raw.views.iter().enumerate() {
            let place = || format!("{}, view {index}", line(view.span().start));
            let view = view.get_ref();
            let (world_from_camera, target) =
                view.pose(raw.format).map_err(|words| Error::input(path, place(), words))?;
            if view.slot.iter().zip(layout).any(|(&slot, size)| usize::from(slot) >= size) {
                return Err(Error::input(path, place(), format!("slot {:?} is outside layout {layout:?}", view.slot)));
            }
            if let Some(other) = taken.insert(view.slot, index) {
                return Err(Error::input(path, place(), format!("slot {:?} is already view {other}'s", view.slot)));
            }
            let id = ViewId(index as u16);
            views.push(View { id, world_from_camera, target, slot: view.slot });
        }
        if views.is_empty() {
            return Err(Error::input(path, "views", "there is none"));
        }
        Ok(Self { name: raw.name, intrinsics: *camera, layout, views })
    }

    /// The view with an id of this array.
    pub fn view(&self, id: ViewId) -> Option<&View> {
        self.views.get(usize::from(id.0))
    }
}

pub(super) fn check_camera(camera: &Intrinsics) -> std::result::Result<(), String> {
    if !(camera.focal_px.is_finite() && camera.focal_px >= 1.0) {
        return Err(format!("focal_px is {}, at least 1 is needed", camera.focal_px));
    }
    let words = |(field, words): (&str, String)| {
        if field == "intrinsics" { words } else { format!("{field} {words}") }
    };
    Pinhole::from(*camera).check().map_err(words)
}

/// The pose of a camera at `position` that looks at `target`, upright (its x axis is level).
pub(super) fn look_at(position: [f32; 3], target: [f32; 3]) -> std::result::Result<Pose, String> {
    if position.iter().chain(&target).any(|x| !x.is_finite() || x.abs() > 100.0) {
        return Err("position and target must be finite and within 100 m".into());
    }
    let (from, to) = (Point::from(position), Point::from(target));
    let forward = (to - from).try_normalize(1e-6).ok_or("position and target are the same point")?;
    let right = forward.cross(&Vector::z()).try_normalize(1e-3).ok_or("the camera looks straight up or down")?;
    let axes = Matrix3::from_columns(&[right, forward.cross(&right), forward]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    Ok(Pose::from_parts(Translation3::from(from), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write;

    /// The text of a shipped array: `n x n` positions on a dome in front of the shelf, three targets each.
    ///
    /// With `u = i / (n - 1)` across and `v = j / (n - 1)` up: `x = -0.3375 + 0.675 u`, `z = 0.055 + 0.2 v`,
    /// `y = -0.20 - 0.10 sin(pi u) sin(pi v)`; targets at x = -0.3, 0, 0.3, y = 0.25, z = 0.155 m.
    fn dome(name: &str, description: &str, n: usize) -> String {
        let mut text = format!(
            "# {description}\n# Positions with u, v = 0 .. 1 in {n} steps: x = -0.3375 + 0.675 u, z = 0.055 + 0.2 v,\n\
             # y = -0.20 - 0.10 sin(pi u) sin(pi v); metres, shelf frame (y = 0 at the front edge, z = 0 on the board).\n\
             format = 1\nname = \"{name}\"\ndescription = \"{description}\"\n\
             camera = {{ width = 640, height = 480, focal_px = 433.0, depth_range_m = [0.07, 1.5] }}\n\
             layout = [{n}, {n}, 3]\nviews = [\n"
        );
        for j in 0..n {
            for i in 0..n {
                let (u, v) = (i as f64 / (n - 1) as f64, j as f64 / (n - 1) as f64);
                let bulge = (std::f64::consts::PI * u).sin() * (std::f64::consts::PI * v).sin();
                let (x, y, z) = (-0.3375 + 0.675 * u, -0.20 - 0.10 * bulge, 0.055 + 0.2 * v);
                for (k, target) in ["-0.3", "0.0", "0.3"].iter().enumerate() {
                    writeln!(
                        text,
                        "    {{ position = [{x:.5}, {y:.5}, {z:.5}], target = [{target}, 0.25, 0.155], slot = [{i}, {j}, {k}] }},"
                    )
                    .expect("a string takes all");
                }
            }
        }
        text + "]\n"
    }

    fn shipped_text(name: &str) -> String {
        match name {
            "standard300" => dome(name, "10 x 10 positions with three look-at targets each", 10),
            _ => super::super::reach::tests::real75(),
        }
    }

    #[test]
    fn the_shipped_files_are_what_their_formula_says() {
        for (name, text) in SHIPPED {
            assert_eq!(text, shipped_text(name), "run the ignored test write_the_shipped_files");
        }
    }

    #[test]
    #[ignore = "writes assets/views from the formula"]
    fn write_the_shipped_files() {
        for name in ["standard300", "real75"] {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../assets/views/{name}.toml"));
            std::fs::write(path, shipped_text(name)).expect("written");
        }
    }

    #[test]
    fn cameras_are_upright_and_look_at_their_targets() {
        let array = ViewArray::named("standard300").expect("shipped");
        assert_eq!((array.views.len(), array.layout), (300, [10, 10, 3]));
        assert_eq!(ViewArray::named("real75").expect("shipped").views.len(), 75);
        for view in &array.views {
            let position = view.position();
            assert!(position.y <= -0.2 && position.y >= -0.3 && position.z > 0.05);
            let axes = view.world_from_camera.rotation.to_rotation_matrix();
            let axis = |i: usize| axes.matrix().column(i).into_owned();
            let forward = (Point::from(view.target) - position).normalize();
            assert!((axis(2) - forward).norm() < 1e-5);
            assert!(axis(0).z.abs() < 1e-5 && axis(0).x > 0.0 && axis(1).z < 0.0);
        }
        // The middle of the dome bulges out; id and slot belong together.
        let slot = array.views[(4 * 10 + 5) * 3 + 1].slot;
        assert_eq!(slot, [5, 4, 1]);
        assert!(array.views[(4 * 10 + 5) * 3].position().y < -0.29);
    }

    #[test]
    fn a_view_may_be_any_pose() {
        let array = |view: &str| {
            let text = format!(
                "format = 2\nname = \"x\"\ncamera = {{ width = 64, height = 48, focal_px = 40.0, depth_range_m = [0.1, 1.5] }}\n\
                 layout = [1, 1, 1]\nviews = [\n  {{ position = [0, -0.3, 0.15], {view}, slot = [0, 0, 0] }},\n]\n"
            );
            ViewArray::parse("x.toml", &text).map(|array| array.views[0].clone())
        };
        let upright = array("target = [0, 0.2, 0.15]").expect("as in format 1");
        let rolled = array("target = [0, 0.2, 0.15], roll_deg = 90").expect("a roll");
        let axis = |view: &View, at: usize| view.world_from_camera.rotation * Vector::ith(at, 1.0);
        // The camera's right is now where its down was: on the board's side.
        assert!((axis(&rolled, 0) - axis(&upright, 1)).norm() < 1e-6 && axis(&rolled, 0).z < -0.99);
        assert!((axis(&rolled, 2) - axis(&upright, 2)).norm() < 1e-6, "it looks the same way");
        let posed = array("quaternion = [-0.70710677, 0, 0, 0.70710677]").expect("a pose");
        assert!((posed.world_from_camera.rotation.angle_to(&upright.world_from_camera.rotation)) < 1e-3);
        assert!((posed.target[1] - 0.15).abs() < 1e-4, "{:?}", posed.target);
        let cases = [
            ("quaternion = [0.5, 0, 0, 1]", "the quaternion [0.5, 0.0, 0.0, 1.0] is no rotation"),
            ("quaternion = [0, 0, 0, 1], target = [0, 1, 0]", "a view needs either target or quaternion"),
            ("quaternion = [0, 0, 0, 1], roll_deg = 5", "a quaternion says the roll already"),
            ("target = [0, 0.2, 0.15], roll_deg = nan", "roll_deg is NaN"),
        ];
        for (view, words) in cases {
            let said = array(view).expect_err(view).to_string();
            assert!(said.starts_with(&format!("x.toml: line 6, view 0: {words}")), "{said}");
        }
    }

    #[test]
    fn wrong_files_are_told_by_file_line_and_view() {
        let good = "format = 1\nname = \"x\"\ncamera = { width = 64, height = 48, focal_px = 40.0, depth_range_m = [0.1, 1.5] }\n\
                    layout = [1, 1, 2]\nviews = [\n  { position = [0, -0.2, 0.1], target = [0, 0.2, 0.1], slot = [0, 0, 0] },\n]\n";
        assert!(ViewArray::parse("x.toml", good).is_ok());
        let cases = [
            ("format = 1", "format = 3", "x.toml: format: is 3"),
            ("name = \"x\"", "nme = \"x\"", "x.toml: line 2: unknown field `nme`"),
            ("focal_px = 40.0", "focal_px = nan", "x.toml: line 3: focal_px is NaN"),
            ("width = 64", "width = 0", "x.toml: line 3: an image of 0"),
            ("[0.1, 1.5]", "[1.5, 0.1]", "x.toml: line 3: depth_range_m"),
            ("[1, 1, 2]", "[1, 0, 2]", "x.toml: line 4: layout"),
            ("slot = [0, 0, 0]", "slot = [0, 1, 0]", "x.toml: line 6, view 0: slot [0, 1, 0] is outside"),
            ("[0, -0.2, 0.1]", "[0, inf, 0.1]", "x.toml: line 6, view 0: position and target"),
            ("[0, -0.2, 0.1]", "[0, 0.2, 0.1]", "x.toml: line 6, view 0: position and target are the same"),
            ("[0, -0.2, 0.1]", "[0, 0.2, 0.3]", "x.toml: line 6, view 0: the camera looks straight"),
            ("slot = [0, 0, 0] },", "slot = [0, 0, 0] }", ""),
            (
                "  { position",
                "  { position = [0, -0.3, 0.1], target = [0, 0.2, 0.1], slot = [0, 0, 0] },\n  { position",
                "x.toml: line 7, view 1: slot [0, 0, 0] is already view 0's",
            ),
            ("views = [", "views = ", "x.toml: line "),
            ("[0, -0.2, 0.1]", "[0, -0.2, 0.1, 0]", "x.toml: line 6: 4 numbers where 3 are needed"),
            ("[0, 0.2, 0.1]", "[0, 0.2]", "x.toml: line 6: 2 numbers where 3 are needed"),
            ("slot = [0, 0, 0]", "slot = [0, 0, 0, 0]", "x.toml: line 6: 4 numbers where 3 are needed"),
            ("[1, 1, 2]", "[1, 1, 2, 1]", "x.toml: line 4: 4 numbers where 3 are needed"),
            ("[0.1, 1.5]", "[0.1, 1.5, 2]", "x.toml: line 3: 3 numbers where 2 are needed"),
        ];
        for (from, to, expected) in cases {
            let result = ViewArray::parse("x.toml", &good.replacen(from, to, 1));
            if expected.is_empty() {
                assert!(result.is_ok());
                continue;
            }
            let message = result.map(|_| ()).expect_err(to).to_string();
            assert!(message.starts_with(expected) && !message.contains('\n'), "{to}: {message}");
        }
        assert!(ViewArray::named("standrad300").is_err_and(|e| e.to_string().contains("standard300, real75")));
        assert!(ViewArray::named("/nowhere/x.toml").is_err_and(|e| e.exit_code() == 2));
    }
}
