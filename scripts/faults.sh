#!/usr/bin/env bash
# Lets the system refuse every file operation of a short run in turn (strace injects the error), and looks at what comes of
# it: the run ends within a minute, either well or with exit code 2 and one line; no file under its final name is half
# written; and the same command, run again, comes to the same end as a run that nobody disturbed.
#
#   scripts/faults.sh [ERROR]...        ENOSPC EIO EACCES EINTR unless told
#
# Needs strace (Debian: apt install strace). The program is NUDGE, else the one that `make headless` builds; FAULTS_CALLS names
# the operations where not all are wanted. Ends with 1 if anything fell.
set -euo pipefail
cd "$(dirname "$0")/.."
nudge=${NUDGE:-${CARGO_TARGET_DIR:-target}/release/nudge}
errors=("$@")
[ $# -gt 0 ] || errors=(ENOSPC EIO EACCES EINTR)
command -v strace >/dev/null || { echo 'scripts/faults.sh needs strace' >&2 && exit 2; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cat >"$folder/scene.toml" <<'SCENE'
format = 1
name = "small"
[shelf]
size = [0.3, 0.2, 0.2]
voxel_m = 0.01
[[object]]
class = "tomato_can"
position = [0.0, 0.1]
SCENE
cat >"$folder/views.toml" <<'VIEWS'
format = 1
name = "two"
camera = { width = 64, height = 48, focal_px = 60.0, depth_range_m = [0.07, 1.5] }
layout = [2, 1, 1]
views = [
    { position = [0.0, -0.3, 0.3], target = [0.0, 0.1, 0.05], slot = [0, 0, 0] },
    { position = [0.1, -0.3, 0.3], target = [0.0, 0.1, 0.05], slot = [1, 0, 0] },
]
VIEWS
args=(run "$folder/scene.toml" --views "$folder/views.toml" --belief classical --policy mem-no-push --budget 2 --out)
"$nudge" "${args[@]}" "$folder/whole" >/dev/null

# Only what is done to these files is refused.
out=$folder/out
paths=(-P "$out" -P "$out/beliefs" -P "$out/truth")
while read -r name; do
    paths+=(-P "$out/$name" -P "$out/$(dirname "$name")/.partial-$(basename "$name")")
    paths+=(-P "$out/.partial-$(basename "$name")")
done < <(cd "$folder/whole" && find . -type f -printf '%P\n')

fell=0
printf '%-10s %-8s %10s %10s %10s %10s\n' operation error injected 'went on' 'exit 2' fell
for call in ${FAULTS_CALLS:-openat write rename mkdir unlink flock}; do
    for error in "${errors[@]}"; do
        injected=0 went_on=0 refused=0 fallen=0
        # The nth such call of any thread, until no thread has so many.
        for ((n = 1; n < 1000; n++)); do
            rm -rf "$out"
            code=0
            timeout 60 strace -f -qq --seccomp-bpf -o "$folder/trace" -e trace="$call" "${paths[@]}" \
                -e inject="$call:error=$error:when=$n" "$nudge" "${args[@]}" "$out" >/dev/null 2>"$folder/said" || code=$?
            grep -q INJECTED "$folder/trace" || break
            injected=$((injected + 1))
            why=
            grep -v '^warning:' "$folder/said" >"$folder/lines" || true
            case $code in
            0) went_on=$((went_on + 1)) ;;
            2)
                refused=$((refused + 1))
                [ "$(wc -l <"$folder/lines")" = 1 ] || why="said $(wc -l <"$folder/lines") lines"
                ;;
            124) why='hung' ;;
            *) why="ended with $code" ;;
            esac
            if [ -z "$why" ] && [ -e "$out" ]; then
                why=$(python3 scripts/same_episode.py "$out") || true
            fi
            if [ -z "$why" ]; then
                how=()
                [ -e "$out/episode.json" ] && how=(--resume)
                if "$nudge" "${args[@]}" "$out" "${how[@]}" >/dev/null 2>"$folder/again"; then
                    why=$(python3 scripts/same_episode.py "$folder/whole" "$out") || true
                else
                    why="cannot be gone on with: $(grep -v '^warning:' "$folder/again" || true)"
                fi
            fi
            if [ -n "$why" ]; then
                fallen=$((fallen + 1))
                echo "FELL: $call $n, $error: $why: $(tr '\n' '|' <"$folder/lines") $(grep -m1 INJECTED "$folder/trace")"
            fi
        done
        printf '%-10s %-8s %10d %10d %10d %10d\n' "$call" "$error" "$injected" "$went_on" "$refused" "$fallen"
        fell=$((fell + fallen))
    done
done
[ "$fell" = 0 ]
