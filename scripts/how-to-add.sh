#!/usr/bin/env bash
# Adds a policy, a setting, a belief update, a skill, an environment, a panel and a layout to a copy of the sources, each in exactly the files that
# "Where to add" in ARCHITECTURE.md lists, counts those files, and compiles the copy. The sources stay as they are.
#
#   scripts/how-to-add.sh            counts and compiles (some minutes)
#   scripts/how-to-add.sh --count    counts only
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
git ls-files -z --cached --others --exclude-standard | xargs -0 tar -cf - --ignore-failed-read | tar -xf - -C "$copy"
cd "$copy"

what='' own='' edited=()

# begin WHAT LIKE FILE: something of this kind, like an example whose own file is now FILE ('' if it has none).
begin() {
    what=$1 own=$3 edited=()
    listed=$(grep -F "| $what | \`$2\` |" ARCHITECTURE.md | cut -d'|' -f5 | grep -oE '`[a-z_]+/[a-z_/]+\.rs`' | tr -d '`')
    [ -n "$listed" ] || { echo "how-to-add: ARCHITECTURE.md has no row for $what like $2" >&2; exit 1; }
    [ -z "$own" ] || listed=$(sed "s#/$2\.rs\$#/scratch.rs#" <<<"$listed")
}

# after FILE LINE TEXT: puts TEXT behind the first line of FILE that has LINE in it.
after() {
    grep -qF -- "$2" "$1" || { echo "how-to-add: $1 has no line with: $2" >&2; exit 1; }
    LINE=$2 TEXT=$3 awk '{ print } !done && index($0, ENVIRON["LINE"]) { print ENVIRON["TEXT"]; done = 1 }' "$1" >scratch.new
    mv scratch.new "$1"
    edited+=("$1")
}

# change FILE FROM TO: writes TO in place of the first FROM of FILE.
change() {
    grep -qF -- "$2" "$1" || { echo "how-to-add: $1 does not have: $2" >&2; exit 1; }
    FROM=$2 TO=$3 awk '{ at = done ? 0 : index($0, ENVIRON["FROM"]) }
        at { $0 = substr($0, 1, at - 1) ENVIRON["TO"] substr($0, at + length(ENVIRON["FROM"])); done = 1 } { print }' "$1" >scratch.new
    mv scratch.new "$1"
    edited+=("$1")
}

# The files that were edited are those that are listed.
end() {
    [ -z "$own" ] || edited+=("$own")
    local found wanted
    found=$(printf '%s\n' "${edited[@]}" | sort -u)
    wanted=$(sort -u <<<"$listed")
    if [ "$found" != "$wanted" ]; then
        echo "how-to-add: $what: ARCHITECTURE.md lists other files (>) than have to change (<):" >&2
        diff <(echo "$found") <(echo "$wanted") >&2 || true
        exit 1
    fi
    echo "$what: $(wc -l <<<"$found") files"
}

begin 'a policy' saturation ''
policies=$(grep -oE 'ALL: \[Self; [0-9]+\]' core/src/plan/policy.rs)
count=$(grep -oE '[0-9]+' <<<"$policies")
change core/src/plan/policy.rs "$policies" "ALL: [Self; $((count + 1))]"
after core/src/plan/policy.rs '    Saturation,' $'    /// Scratch.\n    Scratch,'
after core/src/plan/policy.rs '        Self::Saturation,' '        Self::Scratch,'
after core/src/plan/policy.rs 'Self::Saturation =>' '            Self::Scratch => "scratch",'
after core/src/plan/decide.rs 'PolicyKind::MemNoPush => (),' '        PolicyKind::Scratch => (),'
change core/src/plan/because.rs 'PolicyKind::MemNoPush =>' 'PolicyKind::MemNoPush | PolicyKind::Scratch =>'
after app/src/report/palette.rs 'PolicyKind::Saturation =>' '        PolicyKind::Scratch => ([0, 0, 0], [1.0, 1.0]),'
end

begin 'a planner setting' quiet_steps ''
after core/src/plan/settings.rs 'planner_settings! {' \
    $'    scratch: usize = [3, 3], Thresholds, "scratch", "scratch", "steps", "N",\n        (whole 0 to 1000),\n        "Scratch";'
change core/src/plan/rule.rs 'step < settings.quiet_steps' 'step < settings.quiet_steps.max(settings.scratch)'
change core/src/plan/because.rs 'settings.quiet_steps' 'settings.quiet_steps.max(settings.scratch)'
end

begin 'a belief update' classical core/src/belief/scratch.rs
cat >core/src/belief/scratch.rs <<'RUST'
//! Scratch.

use super::{Belief, BeliefUpdate, Classical, SCRATCH};

/// Scratch.
pub struct Scratch;
RUST
# The trait's required methods, each handed to the classical update.
awk '/^pub trait BeliefUpdate/ { inside = 1 }
    inside && /^}/ { exit }
    inside && /fn .*;$/ { sub(/^ */, ""); sub(/;$/, ""); print }' core/src/belief.rs >scratch.methods
{
    echo 'impl BeliefUpdate for Scratch {'
    while read -r method; do
        name=$(sed -E 's/^fn ([a-z_]+).*/\1/' <<<"$method")
        given=$(grep -oE '[a-z_]+:' <<<"$method" | tr -d ':' | paste -sd, || true)
        case $name in
        name) echo "    $method { SCRATCH }" ;;
        *) echo "    $method { Classical.$name($given) }" ;;
        esac
    done <scratch.methods
    echo '}'
} >>core/src/belief/scratch.rs
types=$(grep -oE '\b(MapObservation|Intervention|Prediction)\b' scratch.methods | sort -u)
for type in $types; do
    path=$(grep -qE "^use crate::camera::.*\b$type\b" core/src/belief.rs && echo crate::camera || echo super)
    after core/src/belief/scratch.rs 'use super::{Belief' "use $path::$type;"
done
after core/src/belief.rs 'mod classical;' 'mod scratch;'
after core/src/belief.rs 'pub use classical::' 'pub use scratch::Scratch;'
after core/src/belief.rs 'pub const CLASSICAL' $'/// Scratch.\npub const SCRATCH: &str = "scratch";'
change app/src/driver.rs 'BELIEFS: [&str; 2] = [CLASSICAL' 'BELIEFS: [&str; 3] = [nudge_core::belief::SCRATCH, CLASSICAL'
after app/src/driver.rs '    match name {' \
    '        nudge_core::belief::SCRATCH => Ok(Ok(Arc::new(nudge_core::belief::Scratch))),'
end

begin 'a skill' drag core/src/skill/scratch.rs
awk '/^#\[cfg\(test\)\]/ { exit } { print }' core/src/skill/drag.rs | sed 's/\bDrag\b/Scratch/g' >core/src/skill/scratch.rs
after core/src/skill.rs 'mod drag;' 'mod scratch;'
after core/src/skill.rs 'use drag::Drag;' 'use scratch::Scratch;'
after core/src/skill.rs '    Drag(Drag):' '    Scratch(Scratch): "scratch", "scratches", "scratches";'
end

begin 'an environment' simulated core/src/environment/scratch.rs
cat >core/src/environment/scratch.rs <<'RUST'
//! Scratch.

use super::Environment;
use crate::arm::{Arm, PhasedMotion};
use crate::camera::{Intrinsics, Sensed, View};
use crate::world::{ManipulationOutcome, TruthMap};
use crate::{Error, Result};

/// Scratch.
pub struct Scratch;

impl Environment for Scratch {
    fn frame(&mut self, _: &View, _: &Intrinsics) -> Result<Sensed> {
        Err(Error::Usage(String::new()))
    }

    fn carry_out(&mut self, _: &Arm, _: &PhasedMotion) -> Result<ManipulationOutcome> {
        Err(Error::Usage(String::new()))
    }

    fn truth(&self) -> Option<&TruthMap> {
        None
    }

    fn branch(&self) -> Option<Box<dyn Environment>> {
        None
    }
}
RUST
after core/src/environment.rs 'mod simulated;' 'mod scratch;'
after core/src/environment.rs 'pub use simulated::' 'pub use scratch::Scratch;'
end

panels=app/src/workbench/panels
begin 'a panel' gains $panels/scratch.rs
cat >$panels/scratch.rs <<'RUST'
//! Scratch.

use super::Panel;
use crate::workbench::command::Command;
use crate::workbench::model::Model;
use re_viewer::external::egui::Ui;

/// What the panel remembers.
#[derive(Default)]
pub struct State {
    drawn: usize,
}

impl Panel for State {
    fn show(&mut self, ui: &mut Ui, _model: &mut Model, _ask: &mut Vec<Command>) {
        self.drawn += 1;
        ui.label(format!("{}", self.drawn));
    }
}
RUST
after $panels.rs 'pub mod scenes;' 'pub mod scratch;'
after app/src/workbench/app/shown.rs 'pub gains: gains::State,' '    pub scratch: crate::workbench::panels::scratch::State,'
after app/src/workbench/app/around.rs 'self.panels.decision.show(' '                        self.panels.scratch.show(ui, &mut self.model, ask);'
end

begin 'a layout' gains ''
kinds=app/src/workbench/layout_kind.rs
layouts=$(grep -oE 'ALL: \[Self; [0-9]+\] = \[' $kinds)
count=$(grep -oE '[0-9]+' <<<"$layouts")
change $kinds "$layouts" "ALL: [Self; $((count + 1))] = [Self::Scratch, "
after $kinds '    Gains,' $'    /// Scratch.\n    Scratch,'
after $kinds 'Self::Gains => "Gains",' '            Self::Scratch => "Scratch",'
after $kinds 'Self::Gains => "The' '            Self::Scratch => "Scratch",'
change $kinds 'Self::Episode | Self::Author => 3' 'Self::Episode | Self::Author | Self::Scratch => 3'
after app/src/workbench/menu.rs 'Some(M::Layout(LayoutKind::Gains)),' '            Some(M::Layout(LayoutKind::Scratch)),'
after app/src/workbench/app/around.rs 'LayoutKind::Gains =>' \
    '                    LayoutKind::Scratch => self.panels.scratch.show(ui, &mut self.model, ask),'
change app/src/workbench/space/layout.rs 'LayoutKind::Author => return None' 'LayoutKind::Author | LayoutKind::Scratch => return None'
change app/src/workbench/shot.rs 'LayoutKind::Compare | LayoutKind::Author' 'LayoutKind::Compare | LayoutKind::Author | LayoutKind::Scratch'
end

[ "${1:-}" != --count ] || exit 0
# Nothing of it is run, so nothing is optimised; libraries alone, so that no program is replaced.
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$root/target}
LIBTORCH=${LIBTORCH:-$("$root/scripts/libtorch.sh")} cargo build --release --locked --workspace --lib --features nudge-tests/workbench \
    --config 'profile.release.package.nudge-core.opt-level=0' --config 'profile.release.package.nudge.opt-level=0'
echo 'and it compiles'
