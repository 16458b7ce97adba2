#!/usr/bin/env bash
# Kills runs at random moments and goes on with them: what a kill leaves must be whole, must be gone on with, and must end as a
# run that nobody disturbed.
#
#   scripts/kills.sh [KILLS] [OPTION OF `nudge run`]...
#
# 200 kills unless told, of the shipped demo scene with the networks and 40 actions. Options come behind these, so that
# `scripts/kills.sh 20 --belief classical --budget 8` is a short one. The program is NUDGE, else the one that `make headless`
# builds. KILLS_SEED sets the moments. Ends with 1 if anything fell.
set -euo pipefail
cd "$(dirname "$0")/.."
nudge=${NUDGE:-${CARGO_TARGET_DIR:-target}/release/nudge}
kills=${1:-200}
[ $# -gt 0 ] && shift
args=(run scenes/demo/behind-the-boxes.toml --policy mem --belief cnabu --budget 40 --seed 1)
# Of an option that is given twice the later one holds.
for option in "$@"; do
    case $option in
    --*) name=$option ;;
    *)
        for i in "${!args[@]}"; do [ "${args[i]}" = "$name" ] && args[i + 1]=$option; done
        ;;
    esac
done
RANDOM=${KILLS_SEED:-1}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
now() { date +%s%N; }

echo "$nudge ${args[*]}"
began=$(now)
"$nudge" "${args[@]}" --out "$folder/whole" >/dev/null
whole_ms=$((($(now) - began) / 1000000))
echo "undisturbed: $((whole_ms / 1000)).$((whole_ms % 1000 / 100)) s"

done_kills=0 resumed=0 ended=0 equal=0 fell=0 before_first=0
fall() {
    fell=$((fell + 1))
    echo "FELL: $*"
    rm -rf "$folder/killed"
}
while [ "$done_kills" -lt "$kills" ] || [ -e "$folder/killed" ]; do
    how=()
    [ -e "$folder/killed/episode.json" ] && how=(--resume)
    "$nudge" "${args[@]}" --out "$folder/killed" "${how[@]}" >/dev/null 2>"$folder/said" &
    run=$!
    if [ "$done_kills" -lt "$kills" ]; then
        wait_ms=$(((RANDOM * 32768 + RANDOM) % whole_ms))
        # Wakes up when the run ends before.
        timeout "$((wait_ms / 1000)).$(printf %03d $((wait_ms % 1000)))" tail -s 0.05 --pid "$run" -f /dev/null || true
        kill -KILL "$run" 2>/dev/null || true
    fi
    code=0
    wait "$run" 2>/dev/null || code=$?
    if [ "$code" = 137 ]; then
        done_kills=$((done_kills + 1))
        [ ${#how[@]} -gt 0 ] && resumed=$((resumed + 1))
        if [ -e "$folder/killed" ]; then
            python3 scripts/same_episode.py "$folder/killed" >"$folder/why" || fall "$(cat "$folder/why")"
            [ -e "$folder/killed/episode.json" ] || before_first=$((before_first + 1))
        fi
        continue
    fi
    if [ "$code" != 0 ]; then
        fall "ended with $code: $(grep -v '^warning:' "$folder/said" | tail -1)"
        continue
    fi
    ended=$((ended + 1))
    if python3 scripts/same_episode.py "$folder/whole" "$folder/killed" >"$folder/why"; then
        equal=$((equal + 1))
        rm -rf "$folder/killed"
    else
        fall "$(cat "$folder/why")"
    fi
done
printf '%-52s %6d\n' 'kills' "$done_kills" 'of them while the run was being gone on with' "$resumed" \
    'of them before the first state was written' "$before_first" 'episodes that came to their end' "$ended" \
    'of them equal to the undisturbed one' "$equal" 'fell' "$fell"
[ "$fell" = 0 ]
