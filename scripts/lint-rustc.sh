#!/usr/bin/env bash
# Stands in for rustc on the crates of the workspace (RUSTC_WORKSPACE_WRAPPER): Clippy compiles them, and rustdoc reads the
# libraries, both with warnings denied. Nothing that is made here is run, so nothing is optimised.
set -euo pipefail

args=() doc=() library=no test=no skip=no
for arg in "${@:2}"; do
    case $arg in
    opt-level=*) args+=("opt-level=0") ;;
    *) args+=("$arg") ;;
    esac
done
CLIPPY_ARGS='-D__CLIPPY_HACKERY__warnings__CLIPPY_HACKERY__' clippy-driver "$1" "${args[@]}"

# rustdoc takes rustc's options but for those of code generation and of what to write.
for ((i = 0; i < ${#args[@]}; i++)); do
    case ${args[i]} in
    --crate-type)
        [ "${args[i + 1]}" = lib ] && library=yes
        doc+=("${args[i]}" "${args[i + 1]}")
        i=$((i + 1))
        ;;
    --test) test=yes ;;
    -C | --out-dir) i=$((i + 1)) ;;
    -C* | --emit=* | --json=* | --error-format=* | --diagnostic-width=*) ;;
    *) doc+=("${args[i]}") ;;
    esac
done
[ "$library" = yes ] && [ "$test" = no ] || exit 0
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
rustdoc "${doc[@]}" -D warnings --out-dir "$out" >&2
