//! Colours, one meaning each.
//!
//! Probability is viridis, entropy and uncertainty magma, gain cividis, differences blue - white - orange around zero
//! (the tables are those of matplotlib, sampled at 64 points; the diverging one is ColorBrewer's `PuOr` and `RdBu`
//! joined at white). Classes have the catalogue's fixed colours.

use nudge_core::scene::{Catalog, ClassId};

/// Red, green and blue, sRGB.
pub type Rgb = [u8; 3];

/// Nothing is known.
pub const UNKNOWN_RGB: Rgb = [222, 225, 231];
/// There, but not believed to be: the low end of the differences.
pub const MISSED_RGB: Rgb = [33, 102, 172];
/// Believed, but not there: the high end of the differences.
pub const HALLUCINATED_RGB: Rgb = [230, 97, 1];
/// Believed to be another class.
pub const CONFUSED_RGB: Rgb = [94, 60, 120];

/// A scale from a number to a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colormap {
    /// Probability.
    Viridis,
    /// Entropy and uncertainty.
    Magma,
    /// Gain.
    Cividis,
    /// Differences; 0.5 is no difference.
    Diverging,
}

impl Colormap {
    /// The colour at `t` in 0 to 1; beyond the ends it stays at them, NaN is the low end.
    pub fn rgb(self, t: f32) -> Rgb {
        let table: &[u32] = match self {
            Self::Viridis => &VIRIDIS,
            Self::Magma => &MAGMA,
            Self::Cividis => &CIVIDIS,
            Self::Diverging => &DIVERGING,
        };
        let at = if t > 0.0 { t.min(1.0) } else { 0.0 } * (table.len() - 1) as f32;
        let low = (at as usize).min(table.len() - 2);
        mix(from_hex(table[low]), from_hex(table[low + 1]), at - low as f32)
    }

    /// The colour of `value` on a scale from `low` to `high`.
    pub fn of(self, value: f32, [low, high]: [f32; 2]) -> Rgb {
        self.rgb(if high > low { (value - low) / (high - low) } else { 0.0 })
    }
}

/// `a` at 0, `b` at 1, in sRGB.
pub fn mix(a: Rgb, b: Rgb, t: f32) -> Rgb {
    std::array::from_fn(|i| (f32::from(a[i]) + (f32::from(b[i]) - f32::from(a[i])) * t).round() as u8)
}

/// The fixed colour of a class, background included.
pub fn of_class(catalog: &Catalog, class: ClassId) -> Rgb {
    catalog.color(class)
}

/// The name of a class as legends write it: `tomato can`.
pub fn class_title(catalog: &Catalog, class: ClassId) -> String {
    catalog.name(class).replace('_', " ")
}

/// `#rrggbb`.
pub fn hex([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn from_hex(hex: u32) -> Rgb {
    [(hex >> 16) as u8, (hex >> 8) as u8, hex as u8]
}

#[rustfmt::skip]
const VIRIDIS: [u32; 64] = [
    0x440154, 0x46075a, 0x470d60, 0x471365, 0x48186a, 0x481d6f, 0x482374, 0x482878,
    0x472d7b, 0x46327e, 0x453781, 0x443b84, 0x424086, 0x404588, 0x3e4989, 0x3d4e8a,
    0x3a538b, 0x38588c, 0x365c8d, 0x34608d, 0x32648e, 0x31688e, 0x2f6c8e, 0x2d708e,
    0x2c738e, 0x2a778e, 0x297b8e, 0x277f8e, 0x26828e, 0x24868e, 0x238a8d, 0x218e8d,
    0x20928c, 0x1f968b, 0x1f9a8a, 0x1f9e89, 0x1fa187, 0x21a585, 0x23a983, 0x26ad81,
    0x2ab07f, 0x2fb47c, 0x35b779, 0x3bbb75, 0x42be71, 0x4ac16d, 0x52c569, 0x5ac864,
    0x65cb5e, 0x6ece58, 0x77d153, 0x81d34d, 0x8bd646, 0x95d840, 0xa0da39, 0xaadc32,
    0xb5de2b, 0xc0df25, 0xcae11f, 0xd5e21a, 0xdfe318, 0xeae51a, 0xf4e61e, 0xfde725,
];
#[rustfmt::skip]
const MAGMA: [u32; 64] = [
    0x000004, 0x020109, 0x030312, 0x06051a, 0x0a0822, 0x0e0b2b, 0x130d34, 0x180f3d,
    0x1d1147, 0x221150, 0x29115a, 0x2f1163, 0x36106b, 0x3d0f71, 0x440f76, 0x4a1079,
    0x52137c, 0x59157e, 0x5f187f, 0x651a80, 0x6b1d81, 0x721f81, 0x782281, 0x7e2482,
    0x842681, 0x8b2981, 0x912b81, 0x982d80, 0x9e2f7f, 0xa5317e, 0xab337c, 0xb2357b,
    0xba3878, 0xc03a76, 0xc73d73, 0xcd4071, 0xd3436e, 0xd9466b, 0xdf4a68, 0xe44f64,
    0xe95462, 0xed5a5f, 0xf1605d, 0xf4675c, 0xf66e5c, 0xf8765c, 0xfa7d5e, 0xfb8560,
    0xfc8e64, 0xfd9668, 0xfe9d6c, 0xfea571, 0xfeac76, 0xfeb47b, 0xfebb81, 0xfec287,
    0xfeca8d, 0xfed194, 0xfed89a, 0xfde0a1, 0xfde7a9, 0xfceeb0, 0xfcf6b8, 0xfcfdbf,
];
#[rustfmt::skip]
const CIVIDIS: [u32; 64] = [
    0x00224e, 0x002554, 0x00285b, 0x002b62, 0x002e6a, 0x003070, 0x053371, 0x123570,
    0x1a386f, 0x213b6e, 0x273e6e, 0x2d416d, 0x32436d, 0x36466c, 0x3b496c, 0x3f4c6c,
    0x444f6c, 0x48526c, 0x4c556c, 0x50576c, 0x545a6d, 0x575d6d, 0x5b606e, 0x5e636f,
    0x62656f, 0x656870, 0x696b71, 0x6c6e72, 0x707173, 0x737475, 0x777776, 0x7a7a78,
    0x7e7d78, 0x828079, 0x868379, 0x8a8678, 0x8e8978, 0x928c78, 0x958f77, 0x999277,
    0x9d9576, 0xa19975, 0xa59c74, 0xa99f73, 0xada272, 0xb1a570, 0xb6a96f, 0xbaac6d,
    0xbfb06b, 0xc3b369, 0xc7b767, 0xccba64, 0xd0be62, 0xd4c15f, 0xd9c55c, 0xddc858,
    0xe1cc55, 0xe6d051, 0xead34c, 0xefd748, 0xf3db42, 0xf8df3c, 0xfde334, 0xfee838,
];
const DIVERGING: [u32; 7] = [0x2166ac, 0x67a9cf, 0xd1e5f0, 0xf7f7f7, 0xfee0b6, 0xf1a340, 0xe66101];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_end_where_matplotlib_says() {
        let ends = |map: Colormap| (hex(map.rgb(0.0)), hex(map.rgb(1.0)));
        assert_eq!(ends(Colormap::Viridis), ("#440154".into(), "#fde725".into()));
        assert_eq!(ends(Colormap::Magma), ("#000004".into(), "#fcfdbf".into()));
        assert_eq!(ends(Colormap::Cividis), ("#00224e".into(), "#fee838".into()));
        assert_eq!(ends(Colormap::Diverging), ("#2166ac".into(), "#e66101".into()));
        assert_eq!(hex(Colormap::Diverging.rgb(0.5)), "#f7f7f7");
        // The middle of viridis as matplotlib samples it with 256 entries, within a rounding of the 64.
        let middle = Colormap::Viridis.rgb(0.5);
        assert!(middle.iter().zip([0x21, 0x91, 0x8c]).all(|(a, b)| a.abs_diff(b) <= 1), "{middle:?}");
    }

    #[test]
    fn values_beyond_the_scale_stay_at_its_ends() {
        assert_eq!(Colormap::Magma.of(7.0, [0.0, 2.0]), Colormap::Magma.rgb(1.0));
        assert_eq!(Colormap::Magma.of(-1.0, [0.0, 2.0]), Colormap::Magma.rgb(0.0));
        assert_eq!(Colormap::Magma.of(f32::NAN, [0.0, 2.0]), Colormap::Magma.rgb(0.0));
        assert_eq!(Colormap::Magma.of(1.0, [3.0, 3.0]), Colormap::Magma.rgb(0.0));
    }

    #[test]
    fn scales_of_one_direction_grow_lighter() {
        let luma = |[r, g, b]: Rgb| 0.2126 * f32::from(r) + 0.7152 * f32::from(g) + 0.0722 * f32::from(b);
        for map in [Colormap::Viridis, Colormap::Magma, Colormap::Cividis] {
            for i in 0..32 {
                assert!(luma(map.rgb(i as f32 / 32.0)) < luma(map.rgb((i + 1) as f32 / 32.0)), "{map:?} at {i}");
            }
        }
    }
}
