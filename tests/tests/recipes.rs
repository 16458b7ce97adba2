//! The recipes of the shipped weights: what `make train` and `make train-push` do is what the cards tell.

use nudge_tests::root;
use std::collections::BTreeMap;

/// The strings of a table of a card.
fn table(card: &str, name: &str) -> BTreeMap<String, String> {
    let text = std::fs::read_to_string(root().join("models").join(card)).expect("a card");
    let after = text.split(&format!("[{name}]\n")).nth(1).expect("the table is there").to_owned();
    let lines = after.lines().take_while(|line| !line.starts_with('['));
    lines
        .filter_map(|line| line.split_once(" = "))
        .map(|(key, value)| (key.to_owned(), value.trim_matches('"').to_owned()))
        .collect()
}

/// The commands of a target of the Makefile, each on one line.
fn commands(target: &str) -> Vec<String> {
    let makefile = std::fs::read_to_string(root().join("Makefile")).expect("a Makefile").replace("\\\n", " ");
    let lines = makefile.lines().skip_while(|line| !line.starts_with(&format!("{target}:"))).skip(1);
    lines
        .take_while(|line| line.starts_with('\t'))
        .map(|line| line.replace("$(NUDGE)", "nudge").trim().to_owned())
        .collect()
}

/// The words of a command without the places that it reads and writes.
fn words(command: &str) -> Vec<&str> {
    let places = ["--out", "--data", "--val", "--test"];
    let all: Vec<&str> = command.split_whitespace().collect();
    let is_place = |at: usize| places.contains(&all[at]) || at > 0 && places.contains(&all[at - 1]);
    (0..all.len()).filter(|at| !is_place(*at)).map(|at| all[at]).collect()
}

#[test]
fn the_makefile_trains_on_the_data_and_with_the_settings_that_the_cards_tell() {
    for (target, card, train) in
        [("train", "sigma_o.toml", "train observe"), ("train-push", "sigma_m.toml", "train push")]
    {
        let commands = commands(target);
        assert!(commands.len() > 4, "{target}: {commands:?}");
        for (name, told) in table(card, "data") {
            // A run before ends with the number of its updates.
            let (command, updates) = told.split_once(": to ").unwrap_or((&told, ""));
            let made = commands.iter().any(|line| words(line) == words(command));
            assert!(made, "{target} does not make the {name} data of {card}: {command}");
            let updates = updates.trim_end_matches(" updates");
            let option = format!("--updates {updates}");
            let trains = commands.iter().any(|line| line.contains(train) && line.contains(&option));
            assert!(updates.is_empty() || trains, "no {train} of {target} has {option}");
        }
        let last = commands.iter().rfind(|line| line.contains(train)).expect("a training run");
        let settings = table(card, "training");
        let options = [
            ("batch", "--batch"),
            ("learning_rate", "--learning-rate"),
            ("max_views", "--max-views"),
            ("move_share", "--move-share"),
            ("seed", "--seed"),
            ("updates", "--updates"),
            ("width", "--width"),
        ];
        for (name, option) in options {
            let Some(told) = settings.get(name) else { continue };
            let mut words = last.split_whitespace();
            let typed = words.find(|word| *word == option).and_then(|_| words.next());
            // sigma_m's views are those of its samples; no option says how many.
            if (target, name) != ("train-push", "max_views") {
                let number = |text: &str| text.parse::<f64>().expect("a number");
                assert_eq!(typed.map(number), Some(number(told)), "{option} of {target}, {name} of {card}");
            }
        }
    }
}
