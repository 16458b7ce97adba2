//! Stands where a command needs the window, in a build that has none.

/// Whatever was typed: it is not looked at.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// (needs the window; `make workbench` builds it)
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "...")]
    _typed: Vec<std::ffi::OsString>,
}

/// Says that there is no window.
///
/// # Errors
/// Always.
pub fn run(_args: &Args) -> anyhow::Result<()> {
    anyhow::bail!("this program was built without the window; `make workbench` builds it with one")
}
