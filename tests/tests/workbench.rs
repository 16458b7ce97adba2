//! The window's own logic, driven by what a person sees and clicks: labels, keys, the pointer. Without a graphics driver.

#[path = "workbench/annotate.rs"]
mod annotate;
#[path = "workbench/author.rs"]
mod author;
#[path = "workbench/compare.rs"]
mod compare;
#[path = "workbench/ease.rs"]
mod ease;
#[path = "workbench/explain.rs"]
mod explain;
#[path = "workbench/random.rs"]
mod random;
#[path = "workbench/sight.rs"]
mod sight;
#[path = "workbench/step.rs"]
mod step;
#[path = "workbench/window.rs"]
mod window;
