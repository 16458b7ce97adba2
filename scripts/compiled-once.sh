#!/usr/bin/env bash
# Proves that the core's tests, the headless build, the benches and the window's build share every third-party crate: that
# `make demo`, `make workbench`, `make test` and `make lint` on one target folder compile none of them twice with other
# features. Reads cargo's own messages (a build that is there already costs seconds). Where it fails it names the crate and
# the features that unify/Cargo.toml lacks.
set -euo pipefail
cd "$(dirname "$0")/.."
LIBTORCH=$(scripts/libtorch.sh)
export LIBTORCH
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

messages() { # name, what cargo is to do
    cargo "${@:2}" --release --locked --message-format json 2>"$folder/log" >"$folder/$1.json" ||
        { cat "$folder/log" >&2; exit 2; }
}
window=(--workspace --features nudge-tests/workbench)
messages core test --no-run -p nudge-core -p nudge-unify
messages headless build --workspace
messages lint build --all-targets "${window[@]}"
messages window test --no-run "${window[@]}"

python3 - "$folder" <<'PY'
import json, sys, pathlib

def artifacts(name):
    """File name -> (crate, features) of every third-party library that a build uses."""
    found = {}
    for line in open(pathlib.Path(sys.argv[1]) / f"{name}.json"):
        message = json.loads(line)
        if message["reason"] == "compiler-artifact" and message["package_id"].startswith("registry+"):
            crate = message["package_id"].split("#")[-1]
            found[message["filenames"][0]] = (crate, frozenset(message["features"]))
    return found

builds = {name: artifacts(name) for name in ("core", "headless", "lint", "window")}
whole = builds["window"] | builds["lint"]
missing = []
for name, build in builds.items():
    for file, (crate, features) in build.items():
        if name in ("core", "headless") and file not in whole:
            others = [f for c, f in whole.values() if c == crate]
            lacks = sorted(min((o - features for o in others), key=len)) if others else []
            missing.append(f"{crate} is compiled twice: the {name} build lacks its features {lacks or '(same features, other dependencies)'}")
for line in sorted(set(missing)):
    print(f"compiled-once: {line}")
counts = ", ".join(f"{name} {len(build)}" for name, build in builds.items())
print(f"compiled-once: third-party crates: {counts}; {len(missing)} compiled twice")
sys.exit(1 if missing else 0)
PY
