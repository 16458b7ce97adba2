#!/usr/bin/env bash
# Assembles a CPU libtorch 2.13.0 (what tch 0.26 wants) from PyPI's wheels, and prints its folder. Linux x86-64.
# `libtorch.sh [DIR]`; DIR is $NUDGE_LIBTORCH, else ~/.cache/nudge/libtorch. Whoever sets LIBTORCH (a system's or a CUDA
# libtorch) needs none of this: then that folder is printed and nothing is downloaded.
# Every wheel is checked against its SHA-256. What is downloaded stays in DIR.wheels until DIR is complete, so a run that was
# interrupted goes on with the next wheel (pip from 25.1 on also within one).
set -euo pipefail

fail() { echo "libtorch: $*" >&2; exit 2; }

if [ -n "${LIBTORCH:-}" ]; then
    [ -d "$LIBTORCH/lib" ] || fail "LIBTORCH=$LIBTORCH has no lib folder"
    echo "$LIBTORCH"
    exit 0
fi
dir=$(realpath -m "${1:-${NUDGE_LIBTORCH:-$HOME/.cache/nudge/libtorch}}")
if [ -e "$dir/build-version" ]; then echo "$dir"; exit 0; fi
[ "$(uname -sm)" = "Linux x86_64" ] || fail "no recipe for $(uname -sm); please set LIBTORCH to a libtorch 2.13.0"
for tool in python3 gcc; do command -v $tool >/dev/null || fail "no $tool found"; done
python3 -m pip --version >/dev/null 2>&1 || fail "python3 has no pip (on Debian: apt-get install python3-pip)"

wheels=$dir.wheels part=$dir.part
mkdir -p "$wheels" || fail "cannot write to $(dirname "$dir")"
free_mb=$(df -Pm "$wheels" | awk 'NR == 2 { print $4 }')
[ "$free_mb" -ge 2000 ] || fail "$wheels: 2 GB are needed, $free_mb MB are free"
resume=()
if python3 -m pip download --help | grep -q -- --resume-retries; then resume=(--resume-retries 20); fi

fetch() { # name==version, SHA-256
    echo "libtorch: $1" >&2
    echo "$1 --hash=sha256:$2" >"$wheels/wanted.txt"
    python3 -m pip download -q --no-deps --only-binary=:all: --python-version 3.12 --implementation cp \
        --platform manylinux_2_28_x86_64 --platform manylinux_2_25_x86_64 --platform manylinux2014_x86_64 \
        --platform manylinux_2_17_x86_64 --require-hashes "${resume[@]}" -r "$wheels/wanted.txt" -d "$wheels" \
        2>"$wheels/pip.log" >&2 || fail "could not download $1: $(tail -n 1 "$wheels/pip.log")"
}
fetch nvidia-cuda-runtime==13.0.96 7f82250d7782aa23b6cfe765ecc7db554bd3c2870c43f3d1821f1d18aebf0548
fetch nvidia-cuda-cupti==13.0.85 4eb01c08e859bf924d222250d2e8f8b8ff6d3db4721288cf35d14252a4d933c8
fetch torch==2.13.0 796633c4cdf0fe2cdced72d8f88f22e73dbcfce83132763162f6d4bff13b820b

rm -rf "$part"
mkdir -p "$part/lib"
python3 - "$part" "$wheels"/*.whl <<'PY' || fail "could not unpack the wheels into $part"
import os, shutil, sys, zipfile

part = sys.argv[1]
libraries = ("torch/lib/libtorch_cpu.so", "torch/lib/libc10.so", "torch/lib/libgomp")
for wheel in sys.argv[2:]:
    with zipfile.ZipFile(wheel) as archive:
        for name in archive.namelist():
            if name.startswith("torch/include/"):
                archive.extract(name, part + "/x")
            elif name.startswith(libraries) or name.endswith(("libcudart.so.13", "libcupti.so.13")):
                with archive.open(name) as source, open(os.path.join(part, "lib", os.path.basename(name)), "wb") as out:
                    shutil.copyfileobj(source, out)
os.rename(part + "/x/torch/include", part + "/include")
shutil.rmtree(part + "/x")
PY
# PyTorch's own libtorch.so is an empty library that needs libtorch_cpu (and, in this wheel, libtorch_cuda): one without CUDA.
(cd "$part/lib" && gcc -shared -o libtorch.so -Wl,--no-as-needed -L. -l:libtorch_cpu.so -l:libc10.so \
    -Wl,-rpath,'$ORIGIN' -Wl,--allow-shlib-undefined) || fail "gcc could not link $part/lib/libtorch.so"
# Last: whoever finds it finds the rest.
echo 2.13.0 >"$part/build-version"
rm -rf "$dir"
mv "$part" "$dir"
rm -rf "$wheels"
echo "$dir"
