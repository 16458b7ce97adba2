//! The planner's numbers on the command line, both ways: read from what was typed, and told as what to type.

use nudge_core::plan::{Counted, PlannerSettings};
use nudge_core::push::PushSampler;

/// What is weighed how.
#[derive(clap::Args, Debug)]
pub struct PlannerArgs {
    /// Which voxels a view's gain counts: all that it may see, with the paper's rule, or those that no look has seen yet
    /// (default: unseen with the cnabu belief, else all)
    #[arg(long, value_name = "all|unseen")]
    gain: Option<Counted>,
    /// Push candidates drawn per decision
    #[arg(long, default_value_t = PlannerSettings::default().candidates)]
    candidates: usize,
    /// Where they are drawn: at the frontier, as in the paper, or at what stands before space that no look has seen
    #[arg(long, value_name = "frontier|hidden", default_value_t)]
    push_sampler: PushSampler,
    /// How many times what looking promises a push has to promise, 0.1 to 100 (default: 10 where only unseen voxels count,
    /// else 1)
    #[arg(long, value_name = "X", value_parser = patience)]
    patience: Option<f32>,
    /// What a push has to promise at least, 0 to 100000 nats (default: 2000 where only unseen voxels count, else 0)
    #[arg(long, value_name = "NATS", value_parser = push_floor)]
    push_floor: Option<f32>,
    /// Looks that follow a push before the next one, and at the end (default: 4 where only unseen voxels count, else 1)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1000))]
    closing_steps: Option<u16>,
}

fn patience(text: &str) -> Result<f32, String> {
    let number = text.parse().ok().filter(|number| (0.1..=100.0).contains(number));
    number.ok_or_else(|| "a number from 0.1 to 100 is needed".to_owned())
}

fn push_floor(text: &str) -> Result<f32, String> {
    let nats = text.parse().ok().filter(|nats| (0.0..=1e5).contains(nats));
    nats.ok_or_else(|| "a number of nats from 0 to 100000 is needed".to_owned())
}

impl PlannerArgs {
    /// The planner's settings: the way to count that was asked for, or the one that serves the belief best, and what goes
    /// with it where nothing else was asked for.
    pub fn settings(&self, belief: &str) -> PlannerSettings {
        let (candidates, push_sampler) = (self.candidates, self.push_sampler);
        let counted = self.gain.unwrap_or_else(|| Counted::of_belief(belief));
        let settings = PlannerSettings { candidates, push_sampler, ..PlannerSettings::default() }.counting(counted);
        PlannerSettings {
            patience: self.patience.unwrap_or(settings.patience),
            closing_steps: self.closing_steps.map_or(settings.closing_steps, usize::from),
            push_floor: self.push_floor.unwrap_or(settings.push_floor),
            ..settings
        }
    }
}

/// Every option with its value in some settings.
pub fn options(planner: &PlannerSettings) -> [(&'static str, String); 6] {
    [
        ("--gain", planner.counted.to_string()),
        ("--push-sampler", planner.push_sampler.to_string()),
        ("--candidates", planner.candidates.to_string()),
        ("--patience", planner.patience.to_string()),
        ("--push-floor", planner.push_floor.to_string()),
        ("--closing-steps", planner.closing_steps.to_string()),
    ]
}

/// What to type for these settings with a belief update, beside its name: nothing where they are its own.
pub fn to_type(planner: &PlannerSettings, belief: &str) -> String {
    let own = options(&PlannerSettings::default().counting(Counted::of_belief(belief)));
    let differing = options(planner).into_iter().zip(own).filter(|(asked, own)| asked != own);
    differing.map(|((name, value), _)| format!(" {name} {value}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use nudge_core::belief::{CLASSICAL, CNABU};

    #[derive(Parser)]
    struct Typed {
        #[command(flatten)]
        planner: PlannerArgs,
    }

    fn settings(typed: &str, belief: &str) -> PlannerSettings {
        let words = std::iter::once("nudge").chain(typed.split_whitespace());
        Typed::try_parse_from(words).expect("well typed").planner.settings(belief)
    }

    #[test]
    fn what_is_told_to_type_means_the_same_settings() {
        let cases = [
            "",
            "--gain all",
            "--gain unseen --patience 3 --push-floor 500",
            "--push-sampler hidden --closing-steps 10 --candidates 7",
        ];
        for (typed, belief) in cases.into_iter().flat_map(|typed| [(typed, CNABU), (typed, CLASSICAL)]) {
            let meant = settings(typed, belief);
            assert_eq!(settings(&to_type(&meant, belief), belief), meant, "{typed} with {belief}");
        }
        assert_eq!(to_type(&settings("", CNABU), CNABU), "");
        assert_eq!(to_type(&settings("--patience 3", CNABU), CNABU), " --patience 3");
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        for wrong in ["--patience 0", "--patience nan", "--patience 101", "--closing-steps 0", "--push-floor -1"] {
            assert!(
                Typed::try_parse_from(std::iter::once("nudge").chain(wrong.split_whitespace())).is_err(),
                "{wrong}"
            );
        }
    }
}
