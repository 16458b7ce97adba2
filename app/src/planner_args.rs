//! The planner's settings on the command line, both ways: read from what was typed, and told as what to type. Which options
//! there are is [`SETTINGS`]' business.

use clap::{Arg, ArgMatches, Command};
use nudge_core::Result;
use nudge_core::plan::{PlannerSettings, SETTINGS, Setting, Values};
use std::collections::BTreeMap;

/// What was typed of the planner's settings, one option for each of [`SETTINGS`].
///
/// Values are read by [`PlannerArgs::settings`] and not by clap, so that a wrong one is told in one line as all other bad
/// input is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlannerArgs {
    typed: BTreeMap<&'static str, String>,
}

/// The same where nothing typed means what was chosen last: in the window.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChosenLastArgs(pub PlannerArgs);

impl PlannerArgs {
    /// The settings on a belief: what was typed, and the belief's defaults for the rest.
    ///
    /// # Errors
    /// For a value that its option does not take: names the option and what it may be.
    pub fn settings(&self, belief: &str) -> Result<PlannerSettings> {
        PlannerSettings::of_belief(belief).with(&self.typed)
    }

    /// Other settings with what was typed.
    ///
    /// # Errors
    /// As [`PlannerArgs::settings`].
    pub fn onto(&self, settings: PlannerSettings) -> Result<PlannerSettings> {
        settings.with(&self.typed)
    }
}

/// The option of a setting; `default` is what its help says of that.
fn option(setting: &'static Setting, default: &str) -> Arg {
    let range = match &setting.values {
        Values::Choice { .. } => String::new(),
        _ => format!("{}; ", setting.limits()),
    };
    Arg::new(setting.name)
        .long(setting.name)
        .value_name(setting.placeholder)
        .help(format!("{} [{range}default: {default}]", setting.help))
        .help_heading("Planner settings")
        .allow_negative_numbers(true)
}

impl clap::Args for PlannerArgs {
    fn augment_args(command: Command) -> Command {
        SETTINGS.iter().fold(command, |command, setting| command.arg(option(setting, &setting.default_words())))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl clap::FromArgMatches for PlannerArgs {
    fn from_arg_matches(matches: &ArgMatches) -> std::result::Result<Self, clap::Error> {
        let typed = |setting: &Setting| Some((setting.name, matches.get_one::<String>(setting.name)?.clone()));
        Ok(Self { typed: SETTINGS.iter().filter_map(typed).collect() })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> std::result::Result<(), clap::Error> {
        self.typed.extend(Self::from_arg_matches(matches)?.typed);
        Ok(())
    }
}

impl clap::Args for ChosenLastArgs {
    fn augment_args(command: Command) -> Command {
        SETTINGS.iter().fold(command, |command, setting| command.arg(option(setting, "the one chosen last")))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl clap::FromArgMatches for ChosenLastArgs {
    fn from_arg_matches(matches: &ArgMatches) -> std::result::Result<Self, clap::Error> {
        PlannerArgs::from_arg_matches(matches).map(Self)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> std::result::Result<(), clap::Error> {
        self.0.update_from_arg_matches(matches)
    }
}

/// What to type for these settings with a belief update, beside its name: nothing where they are its own.
pub fn to_type(planner: &PlannerSettings, belief: &str) -> String {
    let mut own = PlannerSettings::of_belief(belief);
    let mut words = String::new();
    // What goes with the way to count need not be typed once that is.
    for setting in SETTINGS {
        let value = setting.value(planner);
        if setting.value(&own) != value {
            words += &format!(" --{} {value}", setting.name);
            let _ = setting.set(&mut own, &value);
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{CommandFactory, Parser};
    use nudge_core::belief::{CLASSICAL, CNABU};

    #[derive(Parser)]
    struct Typed {
        #[command(flatten)]
        planner: PlannerArgs,
    }

    fn settings(typed: &str, belief: &str) -> Result<PlannerSettings> {
        let words = std::iter::once("nudge").chain(typed.split_whitespace());
        Typed::try_parse_from(words).expect("options that there are").planner.settings(belief)
    }

    #[test]
    fn what_is_told_to_type_means_the_same_settings() {
        let cases = [
            "",
            "--gain all",
            "--gain unseen --patience 3 --push-floor 500",
            "--push-sampler hidden --closing-steps 10 --candidates 7",
            "--closing-steps 1 --gain unseen --gamma 0.35 --certain 0.9 --complete 1 --quiet-steps 0 --saturation 0.1",
        ];
        for (typed, belief) in cases.into_iter().flat_map(|typed| [(typed, CNABU), (typed, CLASSICAL)]) {
            let meant = settings(typed, belief).expect("allowed");
            assert_eq!(settings(&to_type(&meant, belief), belief).expect("allowed"), meant, "{typed} with {belief}");
        }
        let told = |typed: &str| to_type(&settings(typed, CNABU).expect("allowed"), CNABU);
        assert_eq!(told(""), "");
        assert_eq!(told("--patience 3"), " --patience 3");
        assert_eq!(told("--gain all"), " --gain all", "what goes with it is understood");
    }

    #[test]
    fn numbers_out_of_range_are_refused_by_option_and_range() {
        let cases = [
            ("--patience 0", "--patience 0: must be a number from 0.1 to 100"),
            ("--gamma nan", "--gamma nan: must be a number from 0 to 10"),
            ("--gamma -0.5", "--gamma -0.5: must be a number from 0 to 10"),
            ("--closing-steps 0", "--closing-steps 0: must be a whole number of looks from 1 to 1000"),
            ("--push-floor -1", "--push-floor -1: must be a number of nats from 0 to 100000"),
            ("--certain 1.5", "--certain 1.5: must be a probability from 0 to 1"),
            ("--saturation inf", "--saturation inf: must be a share from 0 to 1"),
            ("--candidates 1e3", "--candidates 1e3: must be a whole number from 0 to 1000"),
            ("--gain some", "--gain some: must be all or unseen"),
        ];
        for (typed, said) in cases {
            assert_eq!(settings(typed, CLASSICAL).expect_err(typed).to_string(), said);
        }
    }

    #[test]
    fn help_tells_every_setting_with_its_range_and_default() {
        let mut command = Typed::command();
        let help = command.render_long_help().to_string();
        let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
        for setting in SETTINGS {
            assert!(help.contains(&format!("--{} <", setting.name)), "{} is not in {help}", setting.name);
            let end = format!("default: {}]", setting.default_words());
            assert!(help.contains(&end) && help.contains(setting.help), "{end} is not in {help}");
        }
        assert!(help.contains("[a number of nats from 0 to 100000; default: 0, or 2000 with --gain unseen]"), "{help}");
    }
}
