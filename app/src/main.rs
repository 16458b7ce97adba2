//! The binary `nudge-program`, which `nudge` starts; everything it does is in the library beside it.

fn main() -> std::process::ExitCode {
    nudge::commands::main()
}
