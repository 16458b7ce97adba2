//! The closed-form inverse of arms like the UR5: six turning joints, axes 2, 3 and 4 parallel, axes 5 and 6 crossing.
//!
//! Written with products of exponentials and the canonical subproblems of Elias and Wen, "IK-Geo: Unified robot inverse
//! kinematics using subproblem decomposition" (2022), so that it holds for any such arm in whatever frames its URDF file
//! is written, and not for one maker's table of parameters.

use super::{Frame, Joints};
use nalgebra::{Rotation3, Unit, UnitQuaternion, Vector3};

type V = Vector3<f64>;

/// Axes and points of the arm at zero, in the base's frame.
#[derive(Clone, Debug)]
pub(super) struct ThreeParallel {
    /// Unit axes.
    h: [V; 6],
    /// +1 or -1: whether axes 3 and 4 point the way of axis 2.
    sign: [f64; 2],
    /// A point on axis 1.
    p1: V,
    /// From a point on axis 1 to one on axis 2, and so on; axes 5 and 6 cross in one point.
    p12: V,
    p23: V,
    p34: V,
    p45: V,
    /// From that point to the tool.
    p6t: V,
    /// Rotation of the tool.
    tool: UnitQuaternion<f64>,
}

impl ThreeParallel {
    /// Of six turning joints: axes `h` and points `p` on them at zero, and the tool at zero, all in the base's frame;
    /// `None` if the arm is not built that way.
    pub(super) fn of(h: [V; 6], p: [V; 6], tool: &Frame) -> Option<Self> {
        let parallel = |a: V, b: V| (a.dot(&b).abs() > 1.0 - 1e-9).then(|| a.dot(&b).signum());
        let sign = [parallel(h[1], h[2])?, parallel(h[1], h[3])?];
        if parallel(h[0], h[1]).is_some() || parallel(h[3], h[4]).is_some() {
            return None;
        }
        let wrist = crossing(p[4], h[4], p[5], h[5])?;
        Some(Self {
            h,
            sign,
            p1: p[0],
            p12: p[1] - p[0],
            p23: p[2] - p[1],
            p34: p[3] - p[2],
            p45: wrist - p[3],
            p6t: tool.translation.vector - wrist,
            tool: tool.rotation,
        })
    }

    /// All configurations that put the tool there, angles from minus to plus pi. Where the wrist is stretched (axes 4
    /// and 6 parallel) only the sum of two angles is determined, and joint 6 stays as it is in `near`.
    pub(super) fn inverse(&self, base_from_tool: &Frame, near: &Joints) -> Vec<Joints> {
        let [h1, h2, h3, _, h5, h6] = self.h;
        // Rotation that joints 1 to 6 make together, and the way from axis 1 to the wrist.
        let r06 = base_from_tool.rotation * self.tool.inverse();
        let to_wrist = base_from_tool.translation.vector - r06 * self.p6t - self.p1;
        let offset = h2.dot(&(self.p12 + self.p23 + self.p34 + self.p45));
        let mut found = Vec::with_capacity(8);
        for q1 in angles_for_height(h2, to_wrist, -h1, offset) {
            let r10 = rotation(-h1, q1);
            let (r16, wrist) = (r10 * r06, r10 * to_wrist);
            for q5 in angles_for_height(h2, h6, h5, h2.dot(&(r16 * h6))) {
                let r45 = rotation(h5, q5);
                let a6 = r45 * h6;
                let (q6, bend) = if h2.cross(&a6).norm() > 1e-7 {
                    let q6 = angle_between(-h6, r45.inverse() * h2, r16.inverse() * h2);
                    (q6, angle_between(h2, a6, r16 * h6))
                } else {
                    let q6 = near.get(5).copied().unwrap_or(0.0);
                    let across = perpendicular(h2);
                    let r46 = r45 * rotation(h6, q6);
                    (q6, angle_between(h2, across, r16 * (r46.inverse() * across)))
                };
                // What is left for the planar arm of joints 2 and 3.
                let reach = wrist - self.p12 - rotation(h2, bend) * self.p45;
                let square = 0.5 * (reach.norm_squared() - self.p23.norm_squared() - self.p34.norm_squared());
                for q3 in angles_for_height(self.p23, self.p34, h3, square) {
                    let q2 = angle_between(h2, self.p23 + rotation(h3, q3) * self.p34, reach);
                    let q4 = self.sign[1] * (bend - q2 - self.sign[0] * q3);
                    found.push(Joints::of(&[q1, q2, q3, wrapped(q4), q5, q6]));
                }
            }
        }
        found
    }
}

/// Where two lines cross, if they do.
fn crossing(p: V, h: V, q: V, k: V) -> Option<V> {
    let normal = h.cross(&k);
    if normal.norm() < 1e-6 {
        return None;
    }
    let along = |from: V, other: V| (from.cross(&other)).dot(&normal) / normal.norm_squared();
    let (a, b) = (p + h * along(q - p, k), q + k * along(q - p, h));
    ((a - b).norm() < 1e-7).then_some(a)
}

fn rotation(axis: V, angle: f64) -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Unit::new_unchecked(axis), angle)
}

/// Subproblem 1: the angle that turns `from` about `axis` nearest to `to`.
fn angle_between(axis: V, from: V, to: V) -> f64 {
    let side = axis.cross(&from);
    side.dot(&to).atan2(-axis.cross(&side).dot(&to))
}

/// Subproblem 4: the angles at which `direction . (from turned about axis)` is `height`; none where it never is.
fn angles_for_height(direction: V, from: V, axis: V, height: f64) -> impl Iterator<Item = f64> {
    /// What rounding may lack to a stretched arm, relative.
    const SLACK: f64 = 1e-9;
    let side = axis.cross(&from);
    let (sine, cosine) = (direction.dot(&side), -direction.dot(&axis.cross(&side)));
    let rest = height - direction.dot(&axis) * axis.dot(&from);
    let square = sine * sine + cosine * cosine;
    let room = square - rest * rest;
    let count = if square < 1e-18 || room < -SLACK * square {
        0
    } else if room <= 0.0 {
        1
    } else {
        2
    };
    let root = room.max(0.0).sqrt();
    [1.0, -1.0].into_iter().take(count).map(move |branch: f64| {
        let (s, c) = (sine * rest + branch * cosine * root, cosine * rest - branch * sine * root);
        s.atan2(c)
    })
}

fn perpendicular(v: V) -> V {
    let axis = if v.x.abs() < 0.6 { V::x() } else { V::y() };
    v.cross(&axis).normalize()
}

fn wrapped(angle: f64) -> f64 {
    use std::f64::consts::TAU;
    angle - TAU * (angle / TAU).round()
}
