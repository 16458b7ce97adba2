//! Names of belief updates that are put together: one part observes, the other predicts manipulations, and at least one of
//! them is a module of the user's own.
//!
//! `own+classical` observes with the user's module and predicts by the classical rule, `cnabu+own` observes with the
//! networks that came with the program.

use super::{CLASSICAL, CNABU};

/// Stands for a module of the user's own in the name of a belief update.
pub const OWN: &str = "own";

/// The name of an update of whose halves, sigma_o and sigma_m, those that are true are the user's own and the others are
/// `rest`'s; `rest` itself where none is.
pub fn mixed_name(own_sigma_o: bool, own_sigma_m: bool, rest: &str) -> String {
    if !own_sigma_o && !own_sigma_m {
        return rest.to_owned();
    }
    let part = |own: bool| if own { OWN } else { rest };
    format!("{}+{}", part(own_sigma_o), part(own_sigma_m))
}

/// What observes and what predicts in an update of that name: `own`, `classical` or `cnabu` each, at least one of them
/// `own`. `None` for every other name.
pub fn mixed_parts(name: &str) -> Option<[&str; 2]> {
    let (observes, predicts) = name.split_once('+')?;
    let parts = [observes, predicts];
    (parts.contains(&OWN) && parts.iter().all(|part| [OWN, CLASSICAL, CNABU].contains(part))).then_some(parts)
}

/// Whether the update of that name observes with the networks that came with the program.
pub fn observes_with_networks(name: &str) -> bool {
    mixed_parts(name).map_or(name, |[observes, _]| observes) == CNABU
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_tells_who_observes_and_who_predicts() {
        for (own, rest, name) in [
            ([true, false], CLASSICAL, "own+classical"),
            ([false, true], CNABU, "cnabu+own"),
            ([true, true], CNABU, "own+own"),
        ] {
            assert_eq!(mixed_name(own[0], own[1], rest), name);
            let parts = mixed_parts(name).expect(name);
            assert_eq!(parts.map(|part| part == OWN), own);
        }
        assert_eq!(mixed_name(false, false, CNABU), CNABU);
        for other in [CLASSICAL, CNABU, "own", "classical+cnabu", "own+", "own+mine", "+own", "own+own+own"] {
            assert_eq!(mixed_parts(other), None, "{other}");
        }
        let with: Vec<&str> = ["cnabu", "cnabu+own", "own+cnabu", "classical"]
            .into_iter()
            .filter(|name| observes_with_networks(name))
            .collect();
        assert_eq!(with, ["cnabu", "cnabu+own"]);
    }
}
