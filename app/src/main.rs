//! `nudge`: the command line of the workbench.

fn main() {}
