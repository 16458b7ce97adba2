//! From where three-dimensional views look.

/// From where an eye looks, and at what, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Eye {
    pub(super) position: [f32; 3],
    pub(super) target: [f32; 3],
}

impl Eye {
    /// The whole shelf, in a view that is at least as wide as high.
    pub(crate) const SHELF: Self = Self { position: [0.0, -0.78, 0.60], target: [0.0, 0.16, 0.11] };
    /// Beside the robot, so that arm and shelf are both in sight.
    pub(crate) const ROBOT: Self = Self { position: [1.05, -1.10, 0.85], target: [0.0, -0.22, 0.18] };

    /// The same look from `factor` times as far.
    #[cfg(feature = "workbench")]
    pub(crate) fn farther(self, factor: f32) -> Self {
        let back = |axis: usize| self.target[axis] + factor * (self.position[axis] - self.target[axis]);
        Self { position: std::array::from_fn(back), ..self }
    }
}

#[cfg(feature = "workbench")]
mod framing {
    use super::Eye;
    use nalgebra::{Point3, Vector3};

    /// The viewer's field of view from top to bottom, radians.
    const FIELD_OF_VIEW: f32 = 55.0 * std::f32::consts::PI / 180.0;
    /// Share of a view's width and height that is left free around the shelf.
    const MARGIN: f32 = 0.05;
    /// Share of a view's area that the shelf should fill.
    const ENOUGH: f32 = 0.35;
    /// Elevations that are tried, degrees: from that of [`Eye::SHELF`] up to where the panes of the shelf hide nothing more.
    const ELEVATIONS_DEG: [f32; 7] = [27.5, 32.5, 37.5, 42.5, 47.5, 52.5, 57.5];

    impl Eye {
        /// The eye before the middle of a shelf, slightly above, from which the whole shelf just shows in a view. `size` is the
        /// shelf's width, depth and height, metres; `aspect` is the view's width over its height.
        ///
        /// It looks from the lowest elevation at which the shelf fills 35 % of the view, or from the one at which it fills most:
        /// a narrow view looks from higher up, for the shelf is wider than high.
        pub(crate) fn framing(size: [f32; 3], aspect: f32) -> Self {
            let framed = ELEVATIONS_DEG.map(|deg| framed(size, aspect, deg.to_radians()));
            let most = framed.iter().map(|(_, share)| *share).fold(0.0, f32::max);
            let enough = |(_, share): &&(Eye, f32)| *share >= most.min(ENOUGH);
            framed.iter().find(enough).map_or(Self::SHELF, |(eye, _)| *eye)
        }
    }

    /// The eye of an elevation, and the share of the view that the rectangle around the shelf takes.
    fn framed(size: [f32; 3], aspect: f32, elevation: f32) -> (Eye, f32) {
        let forward = Vector3::new(0.0, elevation.cos(), -elevation.sin());
        let up = Vector3::new(0.0, elevation.sin(), elevation.cos());
        let mut target = Point3::new(0.0, 0.5 * size[1], 0.5 * size[2]);
        let mut distance = 1.0;
        let mut share = 0.0;
        // Centring and distance depend on each other through perspective; a few rounds settle both.
        for _ in 0..24 {
            let [low, high] = extent(size, aspect, &(target - distance * forward), &forward, &up);
            let half = [0, 1].map(|axis| 0.5 * (high[axis] - low[axis]));
            share = half[0] * half[1];
            let reach = distance * (0.5 * FIELD_OF_VIEW).tan();
            target += 0.5 * (low[1] + high[1]) * reach * up;
            distance *= half[0].max(half[1]) / (1.0 - 2.0 * MARGIN);
        }
        let position = target - distance * forward;
        (Eye { position: position.into(), target: target.into() }, share)
    }

    /// The rectangle around a shelf's corners in a view: from -1 at the left and bottom to 1 at the right and top.
    fn extent(
        size: [f32; 3],
        aspect: f32,
        eye: &Point3<f32>,
        forward: &Vector3<f32>,
        up: &Vector3<f32>,
    ) -> [[f32; 2]; 2] {
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        let tangent = (0.5 * FIELD_OF_VIEW).tan();
        for corner in 0..8_u8 {
            let end = |bit: u8| f32::from(corner >> bit & 1);
            let point = Point3::new((end(0) - 0.5) * size[0], end(1) * size[1], end(2) * size[2]);
            let ray = point - eye;
            let deep = ray.dot(forward).max(1e-3) * tangent;
            for (axis, at) in [ray.x / (deep * aspect), ray.dot(up) / deep].into_iter().enumerate() {
                (low[axis], high[axis]) = (low[axis].min(at), high[axis].max(at));
            }
        }
        [low, high]
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        /// The rectangle that a shelf takes in the view of the eye that frames it.
        fn seen(size: [f32; 3], aspect: f32) -> [[f32; 2]; 2] {
            let eye = Eye::framing(size, aspect);
            let forward = (Point3::from(eye.target) - Point3::from(eye.position)).normalize();
            let up = Vector3::new(0.0, -forward.z, forward.y);
            extent(size, aspect, &eye.position.into(), &forward, &up)
        }

        #[test]
        fn the_shelf_just_fits_into_views_of_every_shape() {
            for size in [[0.8, 0.4, 0.4], [0.4, 0.4, 0.6], [1.6, 0.3, 0.3]] {
                for aspect in [0.4, 0.9, 1.3, 2.0, 4.0] {
                    let [low, high] = seen(size, aspect);
                    let widest = (high[0] - low[0]).max(high[1] - low[1]);
                    assert!((widest - 2.0 * (1.0 - 2.0 * MARGIN)).abs() < 0.02, "{size:?} {aspect}: {low:?} {high:?}");
                    assert!(
                        (low[1] + high[1]).abs() < 0.02 && (low[0] + high[0]).abs() < 1e-3,
                        "{size:?} {aspect}: centred"
                    );
                }
            }
        }

        #[test]
        fn the_shelf_fills_a_third_of_a_view_as_wide_as_high() {
            let share = |aspect| {
                let [low, high] = seen([0.8, 0.4, 0.4], aspect);
                0.25 * (high[0] - low[0]) * (high[1] - low[1])
            };
            for aspect in [0.9, 1.0, 1.3, 1.6, 2.0] {
                assert!(share(aspect) >= 0.35, "{aspect}: {}", share(aspect));
            }
        }
    }
}
