//! The binary `nudge`; everything it does is in the library beside it.

fn main() -> std::process::ExitCode {
    nudge::commands::main()
}
