//! One colour and one dash per policy, everywhere in a report.
//!
//! After Okabe and Ito's palette, whose colours stay apart for colour-blind readers; the light ones are darkened so that
//! they can be read as text. Dashes tell lines apart in print.

use crate::colors::Rgb;
use nudge_core::plan::PolicyKind;

/// Colour, and lengths of dash and gap.
pub fn of(policy: PolicyKind) -> (Rgb, [f32; 2]) {
    match policy {
        PolicyKind::Mem => ([213, 94, 0], [0.0, 0.0]),
        PolicyKind::MemNoPush => ([0, 114, 178], [0.0, 0.0]),
        PolicyKind::RandomCnabu => ([0, 142, 104], [7.0, 3.0]),
        PolicyKind::Random => ([110, 110, 110], [0.0, 0.0]),
        PolicyKind::RandomPush5 => ([178, 88, 142], [0.0, 0.0]),
        PolicyKind::RandomPush5Blind => ([128, 40, 90], [6.0, 3.0]),
        PolicyKind::RandomViewPush5 => ([158, 112, 0], [2.0, 4.0]),
        PolicyKind::Saturation => ([40, 130, 190], [6.0, 3.0]),
        PolicyKind::MemPick => ([120, 60, 170], [0.0, 0.0]),
        PolicyKind::RandomPick5 => ([150, 110, 190], [7.0, 3.0]),
        PolicyKind::GreedyFrontPick => ([90, 90, 150], [2.0, 4.0]),
        PolicyKind::Oracle => ([0, 0, 0], [3.0, 3.0]),
        PolicyKind::ClairvoyantPush => ([0, 0, 0], [9.0, 3.0]),
    }
}
