//! Convex outlines in the floor plan: area, separation, Minkowski sums, and the smallest rectangle around.
//!
//! An outline is a convex polygon, counter-clockwise, metres; see [`crate::solid::Solid::footprint`].

/// A rectangle in the floor plan.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Rectangle {
    /// Its centre, metres.
    pub center: [f32; 2],
    /// Its longer and its shorter side, metres.
    pub size_m: [f32; 2],
    /// Direction of the longer side against x, degrees in [0, 180).
    pub angle_deg: f32,
}

type Edge = ([f32; 2], [f32; 2]);

/// The outline's edges: where each starts, and where it ends.
fn edges(outline: &[[f32; 2]]) -> impl Iterator<Item = Edge> + '_ {
    (0..outline.len()).map(|i| (outline[i], outline[(i + 1) % outline.len()]))
}

fn dot(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[0] + a[1] * b[1]
}

/// Outward unit normal of an edge of a counter-clockwise outline.
fn outward((from, to): Edge) -> Option<[f32; 2]> {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = dx.hypot(dy);
    (length > 1e-9).then(|| [dy / length, -dx / length])
}

/// Area inside, square metres.
pub fn area(outline: &[[f32; 2]]) -> f32 {
    let twice: f64 =
        edges(outline).map(|(a, b)| f64::from(a[0]) * f64::from(b[1]) - f64::from(b[0]) * f64::from(a[1])).sum();
    (0.5 * twice) as f32
}

/// The outline turned by `yaw_deg` about the origin and moved to `position`.
pub fn placed(outline: &[[f32; 2]], position: [f32; 2], yaw_deg: f32) -> Vec<[f32; 2]> {
    let (sin, cos) = yaw_deg.to_radians().sin_cos();
    outline.iter().map(|[x, y]| [position[0] + cos * x - sin * y, position[1] + sin * x + cos * y]).collect()
}

/// The outline with every side moved outwards by `margin` (corners mitred).
pub fn grown(outline: &[[f32; 2]], margin: f32) -> Vec<[f32; 2]> {
    let normals: Vec<[f32; 2]> = edges(outline).map(|edge| outward(edge).unwrap_or([0.0, 0.0])).collect();
    let count = outline.len();
    (0..count)
        .map(|i| {
            let (before, after) = (normals[(i + count - 1) % count], normals[i]);
            let stretch = margin / (1.0 + dot(before, after)).max(0.1);
            [outline[i][0] + stretch * (before[0] + after[0]), outline[i][1] + stretch * (before[1] + after[1])]
        })
        .collect()
}

/// Signed distance of two outlines by the separating-axis theorem: the depth of penetration as a negative number, or
/// a lower bound of the gap.
pub fn separation(a: &[[f32; 2]], b: &[[f32; 2]]) -> f32 {
    let one_sided = |a: &[[f32; 2]], b: &[[f32; 2]]| {
        edges(a)
            .filter_map(|edge| {
                let normal = outward(edge)?;
                let nearest = b.iter().map(|p| dot(normal, *p)).fold(f32::INFINITY, f32::min);
                Some(nearest - dot(normal, edge.0))
            })
            .fold(f32::NEG_INFINITY, f32::max)
    };
    one_sided(a, b).max(one_sided(b, a))
}

/// The shortest move of `b` that takes it out of `a`, metres; `None` if they do not overlap.
pub fn way_out(a: &[[f32; 2]], b: &[[f32; 2]]) -> Option<[f32; 2]> {
    let deepest = |a: &[[f32; 2]], b: &[[f32; 2]]| {
        edges(a)
            .filter_map(|edge| {
                let normal = outward(edge)?;
                let nearest = b.iter().map(|p| dot(normal, *p)).fold(f32::INFINITY, f32::min);
                Some((nearest - dot(normal, edge.0), normal))
            })
            .max_by(|one, other| one.0.total_cmp(&other.0))
    };
    let ((from_a, normal_a), (from_b, normal_b)) = (deepest(a, b)?, deepest(b, a)?);
    let (gap, move_of_b) =
        if from_a >= from_b { (from_a, normal_a.map(|n| -from_a * n)) } else { (from_b, normal_b.map(|n| from_b * n)) };
    (gap < 0.0).then_some(move_of_b)
}

/// Where the origin of `moving` may not be if it is to stay clear of `fixed`: the Minkowski sum of `fixed` and the
/// mirrored `moving`, a convex outline whose edges are the edges of both, sorted by direction.
pub fn obstacle(fixed: &[[f32; 2]], moving: &[[f32; 2]]) -> Vec<[f32; 2]> {
    let mirrored: Vec<[f32; 2]> = moving.iter().map(|[x, y]| [-x, -y]).collect();
    let lowest = |outline: &[[f32; 2]]| {
        let order = |i: &usize, j: &usize| {
            outline[*i][1].total_cmp(&outline[*j][1]).then(outline[*i][0].total_cmp(&outline[*j][0]))
        };
        (0..outline.len()).min_by(order).unwrap_or(0)
    };
    let (from_a, from_b) = (lowest(fixed), lowest(&mirrored));
    let a = |i: usize| fixed[(from_a + i) % fixed.len()];
    let b = |j: usize| mirrored[(from_b + j) % mirrored.len()];
    let (mut i, mut j) = (0, 0);
    let mut sum = Vec::with_capacity(fixed.len() + mirrored.len());
    while i < fixed.len() || j < mirrored.len() {
        let (p, q) = (a(i), b(j));
        sum.push([p[0] + q[0], p[1] + q[1]]);
        let (step_a, step_b) = ([a(i + 1)[0] - p[0], a(i + 1)[1] - p[1]], [b(j + 1)[0] - q[0], b(j + 1)[1] - q[1]]);
        let turn = step_a[0] * step_b[1] - step_a[1] * step_b[0];
        if j >= mirrored.len() || (i < fixed.len() && turn >= 0.0) {
            i += 1;
        } else {
            j += 1;
        }
    }
    sum
}

/// The rectangle of smallest area around an outline; one of its sides lies along a side of the outline.
pub fn smallest_rectangle(outline: &[[f32; 2]]) -> Option<Rectangle> {
    let mut best: Option<(f32, Rectangle)> = None;
    for edge in edges(outline) {
        let Some(normal) = outward(edge) else { continue };
        let along = [-normal[1], normal[0]];
        let span = |axis: [f32; 2]| {
            outline
                .iter()
                .map(|p| dot(axis, *p))
                .fold([f32::INFINITY, f32::NEG_INFINITY], |[lo, hi], v| [lo.min(v), hi.max(v)])
        };
        let ([u0, u1], [v0, v1]) = (span(along), span(normal));
        let area = (u1 - u0) * (v1 - v0);
        // A hair smaller does not count, so that rounding does not pick among the equal sides of a regular polygon.
        if best.is_some_and(|(smallest, _)| area > smallest * (1.0 - 1e-4)) {
            continue;
        }
        let (u, v) = (0.5 * (u0 + u1), 0.5 * (v0 + v1));
        let center = [u * along[0] + v * normal[0], u * along[1] + v * normal[1]];
        let (long, size_m) =
            if u1 - u0 >= v1 - v0 { (along, [u1 - u0, v1 - v0]) } else { (normal, [v1 - v0, u1 - u0]) };
        let angle = long[1].atan2(long[0]).to_degrees().rem_euclid(180.0);
        let angle_deg = if angle > 179.95 { 0.0 } else { angle };
        best = Some((area, Rectangle { center, size_m, angle_deg }));
    }
    best.map(|(_, rectangle)| rectangle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SQUARE: [[f32; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

    #[test]
    fn the_way_out_is_the_shortest_and_leaves_them_touching() {
        let moved = |[x, y]: [f32; 2]| SQUARE.map(|p| [p[0] + x, p[1] + y]);
        assert_eq!(way_out(&SQUARE, &moved([2.1, 0.0])), None);
        let close = |a: Option<[f32; 2]>, b: [f32; 2]| {
            let a = a.expect("they overlap");
            assert!((a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-5, "{a:?} is not {b:?}");
        };
        close(way_out(&SQUARE, &moved([1.5, 0.2])), [0.5, 0.0]);
        close(way_out(&SQUARE, &moved([0.1, -1.7])), [0.0, -0.3]);
        let diamond = [[1.5, 0.0], [2.5, 1.0], [1.5, 2.0], [0.5, 1.0]];
        close(way_out(&SQUARE, &diamond), [0.25, 0.25]);
        close(way_out(&diamond, &SQUARE), [-0.25, -0.25]);
    }

    #[test]
    fn area_and_growth_of_a_square() {
        assert_eq!(area(&SQUARE), 4.0);
        assert!((area(&grown(&SQUARE, 0.5)) - 9.0).abs() < 1e-5);
    }

    #[test]
    fn squares_part_and_overlap_by_the_right_amount() {
        let at = |x: f32| placed(&SQUARE, [x, 0.0], 0.0);
        assert!((separation(&SQUARE, &at(2.5)) - 0.5).abs() < 1e-6);
        assert!((separation(&SQUARE, &at(1.75)) + 0.25).abs() < 1e-6);
    }

    #[test]
    fn the_smallest_rectangle_follows_a_turned_box() {
        let long = [[-2.0, -0.5], [2.0, -0.5], [2.0, 0.5], [-2.0, 0.5]];
        let rectangle = smallest_rectangle(&placed(&long, [3.0, 4.0], 42.0)).expect("rectangle");
        assert!((rectangle.angle_deg - 42.0).abs() < 0.01, "{rectangle:?}");
        assert!((rectangle.center[0] - 3.0).abs() < 1e-4 && (rectangle.center[1] - 4.0).abs() < 1e-4);
        assert!((rectangle.size_m[0] - 4.0).abs() < 1e-4 && (rectangle.size_m[1] - 1.0).abs() < 1e-4);
    }

    proptest! {
        /// A point is in the obstacle exactly when the moved outline meets the fixed one.
        #[test]
        fn obstacles_are_where_outlines_meet(
            yaws in prop::array::uniform2(0.0_f32..360.0), x in -4.0_f32..4.0, y in -4.0_f32..4.0, sides in 3_usize..9,
        ) {
            let ring = (0..sides).map(|i| (std::f32::consts::TAU * i as f32 / sides as f32).sin_cos());
            let polygon: Vec<[f32; 2]> = ring.map(|(sin, cos)| [cos, 0.6 * sin]).collect();
            let fixed = placed(&SQUARE, [0.3, -0.2], yaws[0]);
            let moving = placed(&polygon, [0.0, 0.0], yaws[1]);
            let gap = separation(&fixed, &placed(&moving, [x, y], 0.0));
            prop_assume!(gap.abs() > 1e-3);
            let sum = obstacle(&fixed, &moving);
            let inside = edges(&sum).all(|(a, b)| {
                (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) >= -1e-5
            });
            prop_assert_eq!(inside, gap < 0.0);
        }
    }
}
