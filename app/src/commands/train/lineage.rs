//! The history of weights that a run started with: kept beside the run, and written to the card of its own weights.

use nudge_core::Result;
use nudge_core::cnabu::Card;
use nudge_core::files::remove_if_there;
use std::path::{Path, PathBuf};

/// Name on a card of the data and updates of the runs before.
const BEFORE: &str = "train_before";
/// Name on a card of the data of its own run.
const TRAIN: &str = "train";

/// Where that card is kept: beside the run, as if the weights that it started with lay there.
fn kept(run: &Path) -> PathBuf {
    let name = run.file_name().unwrap_or_default().to_string_lossy();
    run.with_file_name(format!("{name}-before.safetensors"))
}

/// Keeps the card of the finished weights that a run begins with; of a run that begins with none, that there was none.
pub(super) fn keep(run: &Path, weights: Option<&Path>, network: &str) -> Result<()> {
    match weights {
        Some(weights) => Card::read(weights, network)?.write(&kept(run)),
        None => remove_if_there(&nudge_core::cnabu::card_path(&kept(run))),
    }
}

/// Writes to a card what was trained on before its run.
pub(super) fn tell(run: &Path, card: &mut Card) -> Result<()> {
    if !nudge_core::cnabu::card_path(&kept(run)).exists() {
        return Ok(());
    }
    let before = Card::read(&kept(run), &card.network)?;
    let data = before.data.get(TRAIN).map_or("data that is not told", String::as_str);
    let last = format!("{data}: to {} updates", before.updates());
    let earlier = before.data.get(BEFORE).map(|earlier| format!("{earlier}; "));
    card.data.insert(BEFORE.to_owned(), earlier.unwrap_or_default() + &last);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cards_tell_all_that_was_trained_on_before() {
        let folder = tempfile::tempdir().expect("a folder");
        let [weights, run] = ["first.safetensors", "run"].map(|name| folder.path().join(name));
        let mut card = Card::new("sigma_o", 32, 1);
        card.data.insert(TRAIN.to_owned(), "a".to_owned());
        card.training.insert("updates".to_owned(), "100".to_owned());
        card.write(&weights).expect("written");
        let told = |weights: Option<&Path>, card: &mut Card| {
            keep(&run, weights, "sigma_o").expect("kept");
            tell(&run, card).expect("told");
            card.data.get(BEFORE).cloned()
        };
        let mut second = Card::new("sigma_o", 32, 1);
        assert_eq!(told(Some(&weights), &mut second).as_deref(), Some("a: to 100 updates"));
        second.data.insert(TRAIN.to_owned(), "b".to_owned());
        second.training.insert("updates".to_owned(), "300".to_owned());
        second.write(&weights).expect("written");
        let mut third = Card::new("sigma_o", 32, 1);
        assert_eq!(told(Some(&weights), &mut third).as_deref(), Some("a: to 100 updates; b: to 300 updates"));
        assert_eq!(told(None, &mut Card::new("sigma_o", 32, 1)), None);
    }
}
