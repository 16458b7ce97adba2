//! The report of a bench: one self-contained HTML page, and its charts as PNGs beside it.
//!
//! [`Results`] holds what a bench measured by set, policy and scene; `charts`, `tables` and `scenes` make of it the parts
//! of the page, [`page`](Page) puts them together, and [`markdown()`] its words and tables as Markdown. Everything is averaged over a scene's seeds first and then over scenes;
//! bands and intervals are the bootstrap's over scenes ([`nudge_core::score::Interval`]).

mod charts;
mod markdown;
mod page;
mod palette;
mod picks;
mod promises;
mod results;
mod scenes;
mod table;
mod tables;
mod words;

pub use markdown::markdown;
pub use page::{Page, write};
pub use results::{Cell, Metric, Results};
pub use scenes::Pages;
pub use words::made_by;
