//! Where the program finds what comes with it: weights and scenes.
//!
//! Looked for in this order:
//!
//! 1. the folder that an environment variable names ([`Shipped::variable`]);
//! 2. `share/nudge` beside the folder of the program, as `make install` lays it out (`libexec/nudge-program`, `share/nudge/models`);
//! 3. the checkout that the program lies in, or that it was built from, as long as it is there.
//!
//! What the working directory holds plays no part: an installed program does the same from any folder. View arrays, the
//! catalogue and the arm are inside the program.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// A folder that comes with the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shipped {
    /// Its name below `share/nudge` and in a checkout.
    pub folder: &'static str,
    /// The environment variable that names another one.
    pub variable: &'static str,
    /// What must lie in it.
    proof: &'static str,
}

/// Weights of the networks.
pub const MODELS: Shipped = Shipped { folder: "models", variable: "NUDGE_MODELS", proof: "sigma_o.safetensors" };
/// Scenes, one set a folder.
pub const SCENES: Shipped = Shipped { folder: "scenes", variable: "NUDGE_SCENES", proof: "demo" };

/// How a folder was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FoundBy {
    /// An environment variable names it; nobody has looked whether it is there.
    Variable(&'static str),
    /// It was installed with the program.
    Installed,
    /// It is part of a checkout.
    Checkout,
}

impl std::fmt::Display for FoundBy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Variable(name) => write!(f, "named by {name}"),
            Self::Installed => f.write_str("installed with the program"),
            Self::Checkout => f.write_str("of the checkout"),
        }
    }
}

/// A folder that was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// The folder.
    pub path: PathBuf,
    /// How it was found.
    pub by: FoundBy,
}

impl Shipped {
    /// The folder, if there is one.
    pub fn find(&self) -> Option<Found> {
        let program = std::env::current_exe().ok();
        let built_from = Path::new(env!("CARGO_MANIFEST_DIR")).parent();
        self.find_from(std::env::var_os(self.variable), program.as_deref(), built_from)
    }

    /// [`Shipped::find`] for a value of the variable, a program's path, and the checkout that it was built from.
    fn find_from(&self, named: Option<OsString>, program: Option<&Path>, built_from: Option<&Path>) -> Option<Found> {
        if let Some(named) = named.filter(|named| !named.is_empty()) {
            return Some(Found { path: named.into(), by: FoundBy::Variable(self.variable) });
        }
        let is_checkout = |folder: &&Path| folder.join("core/Cargo.toml").is_file();
        let installed = program.and_then(Path::parent).and_then(Path::parent).map(|prefix| prefix.join("share/nudge"));
        let around = program.into_iter().flat_map(|program| program.ancestors().skip(1)).filter(is_checkout);
        let checkouts = around.chain(built_from).map(|checkout| (checkout.to_owned(), FoundBy::Checkout));
        installed
            .map(|share| (share, FoundBy::Installed))
            .into_iter()
            .chain(checkouts)
            .map(|(above, by)| Found { path: above.join(self.folder), by })
            .find(|found| found.path.join(self.proof).exists())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{create_dir_all, write};

    /// A prefix with a program and a checkout with another one, both with weights.
    fn stage() -> (tempfile::TempDir, PathBuf, PathBuf) {
        let folder = tempfile::tempdir().expect("folder");
        let (prefix, checkout) = (folder.path().join("pre fix"), folder.path().join("checkout"));
        for weights in [prefix.join("share/nudge/models"), checkout.join("models")] {
            create_dir_all(&weights).expect("made");
            write(weights.join(MODELS.proof), b"w").expect("written");
        }
        create_dir_all(checkout.join("core")).expect("made");
        write(checkout.join("core/Cargo.toml"), b"").expect("written");
        (folder, prefix, checkout)
    }

    #[test]
    fn a_variable_goes_before_the_installation_and_that_before_the_checkout() {
        let (_folder, prefix, checkout) = stage();
        let program = prefix.join("bin/nudge");
        let find =
            |named: Option<&str>, built_from| MODELS.find_from(named.map(Into::into), Some(&program), built_from);
        let found = find(Some("/no/where"), Some(checkout.as_path())).expect("named");
        assert_eq!((found.path.as_path(), found.by), (Path::new("/no/where"), FoundBy::Variable("NUDGE_MODELS")));
        for empty in [None, Some("")] {
            let found = find(empty, Some(checkout.as_path())).expect("installed");
            assert_eq!((found.path, found.by), (prefix.join("share/nudge/models"), FoundBy::Installed));
        }
        std::fs::remove_dir_all(prefix.join("share")).expect("removed");
        let found = find(None, Some(checkout.as_path())).expect("of the checkout");
        assert_eq!((found.path, found.by), (checkout.join("models"), FoundBy::Checkout));
    }

    #[test]
    fn an_installed_program_finds_its_weights_when_the_checkout_is_gone() {
        let (_folder, prefix, checkout) = stage();
        std::fs::remove_dir_all(&checkout).expect("removed");
        let find = |program: &Path| MODELS.find_from(None, Some(program), Some(&checkout));
        assert_eq!(find(&prefix.join("bin/nudge")).map(|found| found.by), Some(FoundBy::Installed));
        assert_eq!(find(&checkout.join("target/release/nudge")), None);
    }

    #[test]
    fn a_program_built_elsewhere_finds_the_checkout_that_it_lies_in() {
        let (folder, _, checkout) = stage();
        let gone = folder.path().join("gone");
        let found = MODELS.find_from(None, Some(&checkout.join("target/release/nudge")), Some(&gone));
        assert_eq!(found.map(|found| found.path), Some(checkout.join("models")));
        // A folder above it that is no checkout does not count, whatever lies in it.
        create_dir_all(folder.path().join("models")).expect("made");
        write(folder.path().join("models").join(MODELS.proof), b"w").expect("written");
        assert_eq!(MODELS.find_from(None, Some(&folder.path().join("tools/nudge")), Some(&gone)), None);
    }
}
