//! `nudge settings`: the planner's settings as a table, from the list that the command line and the window are made of.

use nudge_core::belief::{CLASSICAL, CNABU};
use nudge_core::plan::{PlannerSettings, SETTINGS, Setting, Values};
use nudge_core::skill::SkillKind;
use serde_json::{Value, json};

/// What was typed.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Print one JSON document instead of a table
    #[arg(long, conflicts_with = "markdown")]
    json: bool,
    /// Print a table in Markdown
    #[arg(long)]
    markdown: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let text = match (args.json, args.markdown) {
        (true, _) => super::to_json(&SETTINGS.iter().map(document).collect::<Vec<Value>>())?,
        (_, true) => markdown(),
        _ => table(),
    };
    super::print(&text)
}

fn document(setting: &Setting) -> Value {
    let values = match &setting.values {
        Values::Whole { range, .. } => json!({ "kind": "whole", "range": range }),
        Values::Real { range, .. } => json!({ "kind": "real", "range": range.map(exact) }),
        Values::Choice { choices, .. } => {
            json!({ "kind": "choice", "choices": choices.iter().map(|choice| choice.name).collect::<Vec<_>>() })
        }
        Values::Skills { .. } => json!({ "kind": "names", "choices": SkillKind::NAMES }),
    };
    let default = |belief: &str| {
        let text = setting.value(&PlannerSettings::of_belief(belief));
        text.parse::<u64>().map(Value::from).or_else(|_| text.parse::<f64>().map(Value::from)).unwrap_or(text.into())
    };
    json!({
        "option": format!("--{}", setting.name),
        "field": setting.field,
        "label": setting.label,
        "unit": setting.unit,
        "values": values,
        "default": { CLASSICAL: default(CLASSICAL), CNABU: default(CNABU) },
        "help": setting.help,
    })
}

/// The number that a reader of decimal digits takes a single-precision one for: 0.1 and not 0.10000000149.
fn exact(number: f32) -> f64 {
    number.to_string().parse().unwrap_or(f64::from(number))
}

fn table() -> String {
    let mut text = format!("{:<16} {:<12} {:<18} {}\n", "option", "unit", "range", "default");
    for setting in SETTINGS {
        let option = format!("--{}", setting.name);
        text += &format!(
            "{option:<16} {:<12} {:<18} {}\n    {}\n",
            setting.unit,
            setting.range(),
            setting.default_words(),
            setting.help
        );
    }
    text
}

fn markdown() -> String {
    let mut text =
        "| option | in the window | unit | range | default | what it means |\n|---|---|---|---|---|---|\n".to_owned();
    for setting in SETTINGS {
        text += &format!(
            "| `--{}` | {} | {} | {} | {} | {} |\n",
            setting.name,
            setting.label,
            setting.unit,
            setting.range(),
            setting.default_words(),
            setting.help.replace('|', "\\|")
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_is_in_every_form_of_the_table() {
        let (plain, marked) = (table(), markdown());
        assert_eq!(marked.lines().count(), SETTINGS.len() + 2);
        for setting in SETTINGS {
            for text in [&plain, &marked] {
                let all = [setting.help, &setting.range(), &setting.default_words(), setting.unit, setting.name];
                assert!(all.into_iter().all(|part| text.contains(part)), "{} is not whole in {text}", setting.name);
            }
        }
        let columns = |line: &str| line.matches(" |").count();
        assert!(marked.lines().skip(2).all(|line| columns(line) == 6), "{marked}");
    }

    #[test]
    fn numbers_are_those_that_a_person_types() {
        let of = |name: &str| document(SETTINGS.iter().find(|setting| setting.name == name).expect("there"));
        let patience = of("patience");
        assert_eq!(patience["values"]["range"].to_string(), "[0.1,100.0]");
        assert_eq!(patience["default"], json!({ "classical": 1, "cnabu": 10 }));
        assert_eq!(of("gain")["default"], json!({ "classical": "all", "cnabu": "unseen" }));
        assert_eq!(of("gamma")["default"]["cnabu"].to_string(), "0.2");
    }
}
