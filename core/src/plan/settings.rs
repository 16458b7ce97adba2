//! The planner's settings: one list, from which the type, its defaults, the command line, the window, what benches and
//! episodes compare, and the documentation are made.
//!
//! A new setting is one entry of `planner_settings!` below. Whoever reads, shows or compares settings walks [`SETTINGS`].

use super::Counted;
use crate::belief::{CERTAIN, CLASSICAL, CNABU, COMPLETE_SHARE};
use crate::skill::{PushSampler, SkillKind, SkillSet};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Weight of the disturbance term.
pub const GAMMA: f32 = 0.2;

/// A setting of the planner: what it is called, what it may be, and what it means.
#[derive(Debug)]
pub struct Setting {
    /// Its name on the command line, without the dashes: `push-floor`.
    pub name: &'static str,
    /// Its name in files, which is that of the field: `push_floor`.
    pub field: &'static str,
    /// What it is called in the window.
    pub label: &'static str,
    /// What it is counted in; empty for what has no unit.
    pub unit: &'static str,
    /// What stands for a value in help texts: `NATS`, `all|unseen`.
    pub placeholder: &'static str,
    /// Where the window shows it.
    pub place: Place,
    /// What it means, without range and default.
    pub help: &'static str,
    /// What it may be, and how it is read and written.
    pub values: Values,
}

/// Where the window shows a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Among the first choices of a new episode.
    Form,
    /// Among the thresholds, which are folded away.
    Thresholds,
}

/// What a setting may be, and how it is read and written.
#[derive(Debug)]
pub enum Values {
    /// A whole number.
    Whole {
        /// The smallest and the largest that are taken.
        range: [usize; 2],
        /// The field.
        of: fn(&mut PlannerSettings) -> &mut usize,
    },
    /// A number.
    Real {
        /// The smallest and the largest that are taken.
        range: [f32; 2],
        /// A small change, for a hand that drags.
        step: f32,
        /// The field.
        of: fn(&mut PlannerSettings) -> &mut f32,
    },
    /// One of some choices.
    Choice {
        /// The choices.
        choices: &'static [Choice],
        /// The position of the one that is chosen.
        get: fn(&PlannerSettings) -> usize,
        /// Chooses the one at a position, and what goes with it.
        set: fn(&mut PlannerSettings, usize),
    },
    /// One or more skills, by name with commas between.
    Skills {
        /// The field.
        of: fn(&mut PlannerSettings) -> &mut SkillSet,
    },
}

/// One of the choices that a setting has.
#[derive(Debug)]
pub struct Choice {
    /// Its name on the command line and in files.
    pub name: &'static str,
    /// What it is called in the window.
    pub label: &'static str,
}

const COUNTED: [Choice; 2] =
    [Choice { name: "all", label: "all voxels" }, Choice { name: "unseen", label: "unseen voxels" }];
const SAMPLERS: [Choice; 2] =
    [Choice { name: "frontier", label: "at the frontier" }, Choice { name: "hidden", label: "before the hidden" }];

/// Makes [`PlannerSettings`], its defaults where all and where only unseen voxels count, and [`SETTINGS`] of one list.
macro_rules! planner_settings {
    ($($field:ident: $type:ty = [$all:expr, $unseen:expr], $place:ident, $name:literal, $label:literal, $unit:literal,
        $placeholder:literal, $values:tt, $help:literal;)*) => {
        /// Numbers and choices of the planner that a user may change; [`SETTINGS`] lists them.
        #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(default)]
        pub struct PlannerSettings {
            $(#[doc = $help] pub $field: $type,)*
        }

        /// Every setting, in the order in which they are shown.
        pub static SETTINGS: &[Setting] = &[$(Setting {
            name: $name,
            field: stringify!($field),
            label: $label,
            unit: $unit,
            placeholder: $placeholder,
            place: Place::$place,
            help: $help,
            values: planner_settings!(@values $field $values),
        },)*];

        impl PlannerSettings {
            /// The defaults for a way to count.
            pub fn of(counted: Counted) -> Self {
                Self { $($field: match counted { Counted::All => $all, Counted::Unseen => $unseen },)* }
            }

            /// These settings with what goes with a way to count: its defaults, where the two ways have different ones.
            pub fn counting(self, counted: Counted) -> Self {
                let ([all, unseen], of) = (Counted::ALL.map(Self::of), Self::of(counted));
                Self { $($field: if all.$field == unseen.$field { self.$field } else { of.$field },)* }
            }
        }
    };
    (@values $field:ident (whole $low:literal to $high:literal)) => {
        Values::Whole { range: [$low, $high], of: |settings| &mut settings.$field }
    };
    (@values $field:ident (real $low:literal to $high:literal by $step:literal)) => {
        Values::Real { range: [$low, $high], step: $step, of: |settings| &mut settings.$field }
    };
    (@values $field:ident (skills)) => {
        Values::Skills { of: |settings| &mut settings.$field }
    };
    (@values $field:ident ($choices:ident of $type:ty, $set:expr)) => {
        Values::Choice {
            choices: &$choices,
            get: |settings| <$type>::ALL.iter().position(|one| *one == settings.$field).unwrap_or(0),
            set: |settings, at| {
                let set: fn(&mut PlannerSettings, $type) = $set;
                set(settings, <$type>::ALL[at]);
            },
        }
    };
}

// The field and its type; the defaults where all voxels count and where only unseen ones do; the place in the window; the
// names on the command line and in the window; the unit and what stands for a value; what it may be; what it means.
planner_settings! {
    counted: Counted = [Counted::All, Counted::Unseen], Form, "gain", "gain of", "", "all|unseen",
        (COUNTED of Counted, |settings, counted| *settings = settings.counting(counted)),
        "Which voxels a view's gain counts: all that it may see, with the paper's rule, or those that no look has seen yet; \
         by default what serves the belief of a policy best";
    candidates: usize = [80, 80], Form, "candidates", "candidates", "", "N",
        (whole 0 to 1000),
        "Push candidates drawn per decision (the paper's k, for which it gives no number)";
    skills: SkillSet = [SkillSet::default(), SkillSet::default()], Form, "skills", "skills", "", "NAMES",
        (skills),
        "What the arm may do beside looking: names of skills with commas between; in the paper it pushes alone";
    push_sampler: PushSampler = [PushSampler::Frontier, PushSampler::Frontier], Form, "push-sampler", "drawn", "", "frontier|hidden",
        (SAMPLERS of PushSampler, |settings, sampler| settings.push_sampler = sampler),
        "Where push candidates are drawn: at the frontier, as in the paper, or at what stands before space that no look has \
         seen; policies that push at random draw at the frontier all the same";
    gamma: f32 = [GAMMA, GAMMA], Form, "gamma", "γ", "", "X",
        (real 0.0 to 10.0 by 0.01),
        "Weight of the disturbance term: look if IGV > IGM + gamma Reg (the paper gives no number)";
    patience: f32 = [1.0, 10.0], Thresholds, "patience", "patience", "", "X",
        (real 0.1 to 100.0 by 0.1),
        "How many times what looking promises a push has to promise: look if patience IGV > IGM + gamma Reg; 1 is the \
         paper's rule";
    push_floor: f32 = [0.0, 2000.0], Thresholds, "push-floor", "a push promises", "nats", "NATS",
        (real 0.0 to 100_000.0 by 10.0),
        "What a push has to promise at least, since it also costs looks that make good what it disturbs: look if \
         max(patience IGV, push-floor) > IGM + gamma Reg; 0 is the paper's rule";
    certain: f32 = [CERTAIN, CERTAIN], Thresholds, "certain", "certain above", "probability", "P",
        (real 0.0 to 1.0 by 0.005),
        "A floor cell whose likeliest class is more probable than this is certain; 0.85 in the paper";
    complete: f32 = [COMPLETE_SHARE, COMPLETE_SHARE], Thresholds, "complete", "complete at", "share", "SHARE",
        (real 0.0 to 1.0 by 0.005),
        "The map is complete, and nothing is pushed any more, once this share of the floor cells is certain; 0.95 in the \
         paper";
    quiet_steps: usize = [3, 3], Thresholds, "quiet-steps", "no push before", "steps", "N",
        (whole 0 to 1000),
        "The first steps, in which nothing is pushed: the map is still too empty to push by (not in the paper)";
    closing_steps: usize = [1, 4], Thresholds, "closing-steps", "looks after a push", "looks", "N",
        (whole 1 to 1000),
        "Looks that close a push, making good what it disturbs and seeing what it opens: none is made in the last so many \
         steps, and mem makes none before so many looks followed the one before (not in the paper)";
    saturation: f32 = [0.02, 0.02], Thresholds, "saturation", "saturated below", "share", "SHARE",
        (real 0.0 to 1.0 by 0.005),
        "The policy saturation pushes once two consecutive best gains differ by less than this share; 0.02 in the paper";
}

impl Default for PlannerSettings {
    fn default() -> Self {
        Self::of(Counted::default())
    }
}

impl PlannerSettings {
    /// The defaults on a belief, by the belief update's name: those of the way to count that serves it best.
    pub fn of_belief(belief: &str) -> Self {
        Self::of(Counted::of_belief(belief))
    }

    /// These settings with what was asked for, as texts by [`Setting::name`]. The way to count comes first, since others go
    /// with it.
    ///
    /// # Errors
    /// [`Error::Usage`] for what is no value of its setting: names the option and what it may be.
    pub fn with(mut self, asked: &BTreeMap<&'static str, String>) -> Result<Self> {
        for setting in SETTINGS {
            if let Some(text) = asked.get(setting.name) {
                setting.set(&mut self, text)?;
            }
        }
        Ok(self)
    }

    /// What is wrong with the first of these settings that is no value of its own, as a file may have them.
    ///
    /// # Errors
    /// [`Error::Usage`]: names the option and what it may be.
    pub fn check(&self) -> Result<()> {
        SETTINGS.iter().try_for_each(|setting| setting.set(&mut { *self }, &setting.value(self)))
    }

    /// The first setting in which these differ from those of `before`, with the value there and the one here.
    pub fn difference(&self, before: &Self) -> Option<(&'static Setting, String, String)> {
        let mut values = SETTINGS.iter().map(|setting| (setting, setting.value(before), setting.value(self)));
        values.find(|(_, before, now)| before != now)
    }
}

impl Setting {
    /// Its value in some settings, as it is typed.
    pub fn value(&self, settings: &PlannerSettings) -> String {
        let mut settings = *settings;
        match &self.values {
            Values::Whole { of, .. } => of(&mut settings).to_string(),
            Values::Real { of, .. } => of(&mut settings).to_string(),
            Values::Choice { choices, get, .. } => choices[get(&settings)].name.to_owned(),
            Values::Skills { of } => of(&mut settings).to_string(),
        }
    }

    /// Sets it to what was typed, and what goes with that.
    ///
    /// # Errors
    /// [`Error::Usage`] for what it cannot be: names the option and what it may be. Nothing is changed then.
    pub fn set(&self, settings: &mut PlannerSettings, text: &str) -> Result<()> {
        let refused = || Error::Usage(format!("--{} {text}: must be {}", self.name, self.limits()));
        match &self.values {
            Values::Whole { range: [low, high], of } => {
                let number = text.parse::<usize>().ok().filter(|number| (*low..=*high).contains(number));
                *of(settings) = number.ok_or_else(refused)?;
            }
            Values::Real { range: [low, high], of, .. } => {
                let number = text.parse::<f32>().ok().filter(|number| (*low..=*high).contains(number));
                *of(settings) = number.ok_or_else(refused)?;
            }
            Values::Choice { choices, set, .. } => {
                let at = choices.iter().position(|choice| choice.name == text);
                set(settings, at.ok_or_else(refused)?);
            }
            Values::Skills { of } => *of(settings) = text.parse().map_err(|_| refused())?,
        }
        Ok(())
    }

    /// What it may be: `0 to 100000`, `all or unseen`, `one or more of the skills, with commas between`.
    pub fn range(&self) -> String {
        match &self.values {
            Values::Whole { range: [low, high], .. } => format!("{low} to {high}"),
            Values::Real { range: [low, high], .. } => format!("{low} to {high}"),
            Values::Choice { choices, .. } => choices.iter().map(|choice| choice.name).collect::<Vec<_>>().join(" or "),
            Values::Skills { .. } => format!("one or more of {}, with commas between", SkillKind::NAMES.join(", ")),
        }
    }

    /// The same with its kind and unit: `a number of nats from 0 to 100000`.
    pub fn limits(&self) -> String {
        let number = match (&self.values, self.unit) {
            (Values::Choice { .. } | Values::Skills { .. }, _) => return self.range(),
            (_, share @ ("share" | "probability")) => share.to_owned(),
            (Values::Whole { .. }, "") => "whole number".to_owned(),
            (Values::Whole { .. }, unit) => format!("whole number of {unit}"),
            (Values::Real { .. }, "") => "number".to_owned(),
            (Values::Real { .. }, unit) => format!("number of {unit}"),
        };
        format!("a {number} from {}", self.range())
    }

    /// Its default, in words, and on what that depends: `1, or 10 with --gain unseen`.
    pub fn default_words(&self) -> String {
        let [classical, cnabu] = [CLASSICAL, CNABU].map(|belief| self.value(&PlannerSettings::of_belief(belief)));
        if classical == cnabu {
            classical
        } else if matches!(self.values, Values::Choice { .. }) {
            format!("{classical}, or {cnabu} with the {CNABU} belief")
        } else {
            let [all, unseen] = Counted::ALL.map(|counted| self.value(&PlannerSettings::of(counted)));
            format!("{all}, or {unseen} with --gain unseen")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every setting at both ends of its range, or at each of its choices.
    fn values(setting: &Setting) -> Vec<String> {
        match &setting.values {
            Values::Whole { range, .. } => range.iter().map(usize::to_string).collect(),
            Values::Real { range, .. } => range.iter().map(f32::to_string).collect(),
            Values::Choice { choices, .. } => choices.iter().map(|choice| choice.name.to_owned()).collect(),
            Values::Skills { .. } => vec![SkillSet::default().to_string(), SkillSet::of(SkillKind::ALL).to_string()],
        }
    }

    #[test]
    fn every_value_that_is_allowed_can_be_set_and_told() {
        for setting in SETTINGS {
            for text in values(setting) {
                let mut settings = PlannerSettings::default();
                setting.set(&mut settings, &text).expect("an allowed value");
                assert_eq!(setting.value(&settings), text, "{}", setting.name);
            }
            assert!(values(setting).len() > 1 && setting.help.ends_with(|end: char| end != '.'), "{}", setting.name);
        }
    }

    #[test]
    fn numbers_out_of_range_are_refused_in_one_line_with_option_and_range() {
        for setting in SETTINGS {
            let mut wrong = vec!["nan".to_owned(), "inf".to_owned(), "-1".to_owned(), String::new(), "many".to_owned()];
            if let Values::Whole { range: [_, high], .. } = &setting.values {
                wrong.extend([(high + 1).to_string(), "1.5".to_owned()]);
            }
            if let Values::Real { range: [_, high], .. } = &setting.values {
                wrong.extend([(high * 1.01).to_string(), "-inf".to_owned()]);
            }
            for text in wrong {
                let mut settings = PlannerSettings::default();
                let said = setting.set(&mut settings, &text).expect_err(setting.name).to_string();
                assert!(said.starts_with(&format!("--{} {text}: must be ", setting.name)), "{said}");
                assert!(said.ends_with(&setting.limits()) && !said.contains('\n'), "{said}");
                assert_eq!(settings, PlannerSettings::default(), "nothing is changed");
            }
        }
    }

    #[test]
    fn choices_have_the_names_that_files_have() {
        assert!(COUNTED.iter().zip(Counted::ALL).all(|(choice, counted)| choice.name == counted.to_string()));
        assert!(SAMPLERS.iter().zip(PushSampler::ALL).all(|(choice, sampler)| choice.name == sampler.to_string()));
        let document = serde_json::to_value(PlannerSettings::default()).expect("JSON");
        let fields: Vec<&str> = SETTINGS.iter().map(|setting| setting.field).collect();
        assert_eq!(document.as_object().expect("an object").len(), fields.len());
        assert!(fields.iter().all(|field| document.get(field).is_some()));
    }

    #[test]
    fn the_way_to_count_brings_its_numbers_and_leaves_the_others() {
        let mine = PlannerSettings { gamma: 0.5, quiet_steps: 7, patience: 3.0, ..PlannerSettings::default() };
        let unseen = mine.counting(Counted::Unseen);
        assert_eq!((unseen.patience, unseen.push_floor, unseen.closing_steps), (10.0, 2000.0, 4));
        assert_eq!((unseen.gamma, unseen.quiet_steps, unseen.counted), (0.5, 7, Counted::Unseen));
        assert_eq!(PlannerSettings::of_belief(CNABU), PlannerSettings::default().counting(Counted::Unseen));
        assert_eq!(PlannerSettings::of_belief(CLASSICAL), PlannerSettings::default());
        // What was asked for holds, in whatever order it was typed.
        let asked = BTreeMap::from([("closing-steps", "9".to_owned()), ("gain", "unseen".to_owned())]);
        let both = PlannerSettings::default().with(&asked).expect("allowed");
        assert_eq!((both.closing_steps, both.push_floor), (9, 2000.0));
    }

    #[test]
    fn the_first_difference_is_told_with_both_values() {
        let before = PlannerSettings::default();
        assert!(before.difference(&before).is_none());
        for setting in SETTINGS {
            let other =
                values(setting).into_iter().find(|text| *text != setting.value(&before)).expect("another value");
            let mut now = before;
            setting.set(&mut now, &other).expect("allowed");
            let (found, was, is) = now.difference(&before).expect("a difference");
            assert_eq!((found.name, was, is), (setting.name, setting.value(&before), other));
        }
    }

    #[test]
    fn defaults_are_told_with_what_they_depend_on() {
        let words = |name: &str| SETTINGS.iter().find(|setting| setting.name == name).expect("there").default_words();
        assert_eq!(words("gamma"), "0.2");
        assert_eq!(words("gain"), "all, or unseen with the cnabu belief");
        assert_eq!(words("push-floor"), "0, or 2000 with --gain unseen");
    }
}
