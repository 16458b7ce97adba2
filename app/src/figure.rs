//! Figures for slides and pages: composed as SVG, drawn at twice the resolution.
//!
//! [`summary`] shows one episode: the scene from the front and from above with its pushes, what was believed, how
//! unsure and how wrong after the first, the middle and the last step, and the scores over the steps. A [`Chart`] has the
//! lines of several policies, with bands; [`calibration`] shows belief updates on a set of scenes.

mod calibration;
mod chart;
mod plot;
mod summary;
mod svg;

pub use calibration::{Calibrated, VIEWS, VIEWS_AFTER_PUSH, Views, calibration};
pub use chart::{Chart, Series};
pub use plot::{Curve, Plot, nice_ticks};
pub use summary::{Moment, Summary, summary};
pub use svg::{Anchor, HAIRLINE, INK, RasterStyle, SOFT_INK, Stroke, Svg, Text, escape, text_width};

/// Pixels per unit of a figure: twice the resolution of a screen.
pub const PIXELS_PER_UNIT: f32 = 2.0;
