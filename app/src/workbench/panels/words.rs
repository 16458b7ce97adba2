//! Numbers and short sentences as the panels write them: with units, and two or three significant digits.

pub(crate) use crate::record::decision::{action, capital, thousands};

use nudge_core::grid::{Cell, Grid, Voxel};
use re_viewer::external::egui::{RichText, TextStyle};

/// What stands where a number is not one.
const NO_NUMBER: &str = "n/a";

/// A number with that many significant digits; thousands apart, the minus sign a true one.
pub fn significant(value: f64, digits: i32) -> String {
    if !value.is_finite() {
        return NO_NUMBER.to_owned();
    }
    let magnitude = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    let text = match magnitude {
        ..-3 => format!("{:.1e}", value.abs()),
        4.. => thousands(value.abs()),
        _ => {
            let decimals = (digits - 1 - magnitude).max(0) as usize;
            format!("{:.decimals$}", value.abs())
        }
    };
    if value < 0.0 { format!("−{text}") } else { text }
}

/// `312 nats`, `3.21 nats`.
pub fn nats(value: f32) -> String {
    format!("{} nats", significant(f64::from(value), 3))
}

/// A probability with two decimals.
pub fn probability(p: f32) -> String {
    if p.is_finite() { format!("{p:.2}") } else { NO_NUMBER.to_owned() }
}

/// A difference with its sign and two decimals.
pub fn signed(value: f64) -> String {
    match value {
        v if !v.is_finite() => NO_NUMBER.to_owned(),
        v if v.abs() < 0.005 => "0.00".to_owned(),
        v if v < 0.0 => format!("−{:.2}", -v),
        v => format!("+{v:.2}"),
    }
}

/// A share in percent, without decimals.
pub fn percent(share: f32) -> String {
    if share.is_finite() { format!("{:.0} %", 100.0 * share) } else { NO_NUMBER.to_owned() }
}

/// Metres with two decimals, the minus sign a true one; never `-0.00`.
pub fn metres(m: f32) -> String {
    match m {
        m if !m.is_finite() => NO_NUMBER.to_owned(),
        m if m <= -0.005 => format!("−{:.2}", -m),
        m => format!("{:.2}", m.abs()),
    }
}

/// `x 0.12, y 0.31 m`.
pub fn cell_place(grid: &Grid, cell: Cell) -> String {
    let at = grid.cell_center(cell);
    format!("x {}, y {} m", metres(at.x), metres(at.y))
}

/// `x 0.12, y 0.31, z 0.05 m`.
pub fn voxel_place(grid: &Grid, voxel: Voxel) -> String {
    let at = grid.center(voxel);
    format!("x {}, y {}, z {} m", metres(at.x), metres(at.y), metres(at.z))
}

/// A number in a column: small, with digits of one width.
pub fn figure(text: impl Into<String>) -> RichText {
    RichText::new(text).text_style(TextStyle::Monospace).small()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits_and_a_true_minus() {
        let cases = [
            (312.44, "312"),
            (31.24, "31.2"),
            (3.1, "3.10"),
            (0.0312, "0.0312"),
            (-0.5, "−0.500"),
            (12_345.6, "12,346"),
            (0.0, "0.00"),
            (0.000_04, "4.0e-5"),
            (f64::NAN, NO_NUMBER),
            (f64::INFINITY, NO_NUMBER),
        ];
        for (value, text) in cases {
            assert_eq!(significant(value, 3), text);
        }
        assert_eq!((metres(-0.001), metres(-0.25), metres(0.3)), ("0.00".into(), "−0.25".into(), "0.30".into()));
        assert_eq!((signed(0.031), signed(-0.2), signed(-0.001)), ("+0.03".into(), "−0.20".into(), "0.00".into()));
    }
}
