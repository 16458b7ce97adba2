//! Where things come to rest: on a grid of the board, at round angles, and always at lengths that a file writes short.

/// The grid that positions snap to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Snap {
    /// Nothing but a tenth of a millimetre and a tenth of a degree.
    Off,
    /// 5 mm, one voxel of the design's grid, and 15 degrees.
    #[default]
    FiveMillimetres,
    /// 10 mm and 15 degrees.
    TenMillimetres,
}

impl Snap {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Off, Self::FiveMillimetres, Self::TenMillimetres];

    /// As the choice names it.
    pub fn title(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::FiveMillimetres => "5 mm, 15°",
            Self::TenMillimetres => "10 mm, 15°",
        }
    }

    /// The grid's step, metres.
    pub fn step_m(self) -> Option<f32> {
        match self {
            Self::Off => None,
            Self::FiveMillimetres => Some(0.005),
            Self::TenMillimetres => Some(0.01),
        }
    }

    /// A coordinate on the grid, metres.
    pub fn position(self, value_m: f32) -> f32 {
        rounded(self.step_m().map_or(value_m, |step| (value_m / step).round() * step))
    }

    /// An angle in -180 to 180 degrees.
    pub fn angle(self, degrees: f32) -> f32 {
        let step = if self == Self::Off { 0.1 } else { 15.0 };
        normal_angle((degrees / step).round() * step)
    }
}

/// A length to a tenth of a millimetre.
pub fn rounded(value_m: f32) -> f32 {
    // In f64, so that the result is the number that is nearest to the short decimal.
    ((f64::from(value_m) * 1e4).round() / 1e4) as f32 + 0.0
}

/// An angle in -180 (not included) to 180 degrees, to a tenth.
pub fn normal_angle(degrees: f32) -> f32 {
    let turned = (f64::from(degrees) * 10.0).round().rem_euclid(3600.0);
    ((if turned > 1800.0 { turned - 3600.0 } else { turned }) / 10.0) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_and_angles_come_to_rest_at_short_numbers() {
        assert_eq!(Snap::FiveMillimetres.position(0.1234), 0.125);
        assert_eq!(Snap::TenMillimetres.position(-0.1234), -0.12);
        assert_eq!(Snap::Off.position(0.123_449), 0.1234);
        assert_eq!(format!("{:?}", Snap::Off.position(-0.000_01)), "0.0", "no negative zero in files");
        assert_eq!(Snap::FiveMillimetres.angle(52.0), 45.0);
        assert_eq!(Snap::FiveMillimetres.angle(-173.0), 180.0);
        assert_eq!(Snap::Off.angle(359.96), 0.0);
        assert_eq!(normal_angle(-190.0), 170.0);
    }
}
