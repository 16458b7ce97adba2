#!/usr/bin/env bash
# Assembles a CPU libtorch 2.13.0 (what tch 0.26 wants) from PyPI's wheels, and prints its folder. Linux x86-64.
# `libtorch.sh [DIR]`; DIR is $NUDGE_LIBTORCH, else ~/.cache/nudge/libtorch. Whoever sets LIBTORCH (a system's or a CUDA
# libtorch of the same version) needs none of this: then that folder is printed and nothing is downloaded.
# Every wheel is checked against its SHA-256. What is downloaded stays in DIR.wheels until DIR is complete, so a run that was
# interrupted goes on with the next wheel (pip from 25.1 on also within one); a run that fails leaves nothing else.
# `libtorch.sh --version-of DIR` prints the version of a libtorch, or nothing where no file tells it.
set -euo pipefail

wanted=2.13.0
# Wheels and what is unpacked of them, together.
need_mb=1200

fail() { echo "libtorch: $*" >&2; exit 2; }

version_of() { # folder
    local header
    if [ -f "$1/build-version" ]; then head -n 1 "$1/build-version"; return; fi
    for header in "$1/include/torch/headeronly/version.h" "$1/include/torch/version.h"; do
        [ -f "$header" ] || continue
        awk '$1 == "#define" && $2 ~ /^TORCH_VERSION_(MAJOR|MINOR|PATCH)$/ { part[$2] = $3 }
            END { print part["TORCH_VERSION_MAJOR"] "." part["TORCH_VERSION_MINOR"] "." part["TORCH_VERSION_PATCH"] }' "$header"
        return
    done
}

is_wanted() { # version; a build's own mark, as in 2.13.0+cu130, does not matter
    [ "${1%%+*}" = "$wanted" ]
}

if [ "${1:-}" = --version-of ]; then version_of "${2:?libtorch.sh --version-of DIR}"; exit 0; fi

if [ -n "${LIBTORCH:-}" ]; then
    compgen -G "$LIBTORCH/lib/libtorch*" >/dev/null ||
        fail "LIBTORCH=$LIBTORCH has no lib/libtorch*; name the folder of a libtorch $wanted, or unset it to have one fetched"
    version=$(version_of "$LIBTORCH")
    if [ -z "$version" ]; then
        echo "libtorch: warning: LIBTORCH=$LIBTORCH does not tell its version; $wanted is needed" >&2
    elif ! is_wanted "$version"; then
        fail "LIBTORCH=$LIBTORCH is libtorch $version, and $wanted is needed; name another, or unset it to have one fetched"
    fi
    echo "$LIBTORCH"
    exit 0
fi

dir=$(realpath -m "${1:-${NUDGE_LIBTORCH:-$HOME/.cache/nudge/libtorch}}")
is_complete() { [ -e "$dir/build-version" ] && is_wanted "$(version_of "$dir")"; }
if is_complete; then echo "$dir"; exit 0; fi
# What is there is replaced only if it is a libtorch of another version.
if [ -e "$dir" ] && [ ! -e "$dir/build-version" ] && [ -n "$(ls -A "$dir" 2>&1)" ]; then
    fail "$dir is there already and is no libtorch; name a folder that is not there"
fi
[ "$(uname -sm)" = "Linux x86_64" ] || fail "no recipe for $(uname -sm); set LIBTORCH to a libtorch $wanted"
for tool in python3 gcc; do command -v $tool >/dev/null || fail "no $tool found"; done
python3 -m pip --version >/dev/null 2>&1 || fail "python3 has no pip (on Debian: apt-get install python3-pip)"

wheels=$dir.wheels part=$dir.part
mkdir -p "$wheels" 2>/dev/null && [ -w "$wheels" ] ||
    fail "cannot write to $(dirname "$dir"); name another folder with NUDGE_LIBTORCH"
# One run at a time: the next one finds what the first has made.
exec 9<"$wheels"
if command -v flock >/dev/null; then flock 9; fi
if is_complete; then echo "$dir"; exit 0; fi
mkdir -p "$wheels"
trap 'rm -rf "$part"' EXIT
trap 'exit 130' INT TERM

free_mb() { df -Pm "$wheels" | awk 'NR == 2 { print $4 }'; }
no_room() { # MB
    fail "no room in $(dirname "$dir"): $1 MB are needed and $(free_mb) MB are free; make room and run again," \
        "or name another folder with NUDGE_LIBTORCH"
}
left_mb=$((need_mb - $(du -sm "$wheels" | cut -f 1)))
[ "$(free_mb)" -ge "$left_mb" ] || no_room "$left_mb"
resume=()
if python3 -m pip download --help | grep -q -- --resume-retries; then resume=(--resume-retries 20); fi

fetched=()
fetch() { # name==version, SHA-256
    local log=$wheels/pip.log name=${1%%==*}
    echo "libtorch: $1" >&2
    echo "$1 --hash=sha256:$2" >"$wheels/wanted.txt" || no_room "$left_mb"
    # pip's temporary files on the same disk, which is known to have room.
    if TMPDIR=$wheels python3 -m pip download -q --no-deps --only-binary=:all: --python-version 3.12 --implementation cp \
        --platform manylinux_2_28_x86_64 --platform manylinux_2_25_x86_64 --platform manylinux2014_x86_64 \
        --platform manylinux_2_17_x86_64 --require-hashes "${resume[@]}" -r "$wheels/wanted.txt" -d "$wheels" \
        2>"$log" >&2; then
        fetched+=("$wheels/${name//-/_}-${1##*==}"-*.whl)
        return
    fi
    if grep -q 'No space left on device' "$log"; then no_room "$left_mb"; fi
    if grep -qiE 'connection|name resolution|timed? ?out|unreachable|proxy|from versions: none' "$log"; then
        fail "could not download $1: no package index that has it can be reached; check the network and run again, which" \
            "goes on where it stopped, or set LIBTORCH to a libtorch $wanted"
    fi
    fail "could not download $1: $(grep -m 1 '^ERROR: ' "$log" || tail -n 1 "$log")"
}
fetch nvidia-cuda-runtime==13.0.96 7f82250d7782aa23b6cfe765ecc7db554bd3c2870c43f3d1821f1d18aebf0548
fetch nvidia-cuda-cupti==13.0.85 4eb01c08e859bf924d222250d2e8f8b8ff6d3db4721288cf35d14252a4d933c8
fetch torch==$wanted 796633c4cdf0fe2cdced72d8f88f22e73dbcfce83132763162f6d4bff13b820b

rm -rf "$part"
mkdir -p "$part/lib" || no_room "$left_mb"
# Prints how many MB are needed where the disk is too full for them.
too_full=$(
    python3 - "$part" "${fetched[@]}" <<'PY'
import errno, os, shutil, sys, zipfile

part = sys.argv[1]
libraries = ("torch/lib/libtorch_cpu.so", "torch/lib/libc10.so", "torch/lib/libgomp")


def place(name):
    """Where a wheel's file goes; None for one that is not needed."""
    if name.startswith("torch/include/") and not name.endswith("/"):
        return os.path.join(part, "include", name.removeprefix("torch/include/"))
    if name.startswith(libraries) or name.endswith(("libcudart.so.13", "libcupti.so.13")):
        return os.path.join(part, "lib", os.path.basename(name))
    return None


needed = 0
try:
    archives = []
    for wheel in sys.argv[2:]:
        try:
            archives.append(zipfile.ZipFile(wheel))
        except zipfile.BadZipFile:
            sys.exit(f"libtorch: {wheel} is damaged; remove it and run again")
    needed = sum(info.file_size for archive in archives for info in archive.infolist() if place(info.filename))
    for archive in archives:
        for info in archive.infolist():
            if to := place(info.filename):
                os.makedirs(os.path.dirname(to), exist_ok=True)
                with archive.open(info) as source, open(to, "wb") as out:
                    shutil.copyfileobj(source, out)
except OSError as error:
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        print(-(-needed // 2**20))
    else:
        sys.exit(f"libtorch: could not unpack into {part}: {error.strerror}")
PY
) || exit 2
if [ -n "$too_full" ]; then
    rm -rf "$part"
    no_room "$too_full"
fi
# PyTorch's own libtorch.so is an empty library that needs libtorch_cpu (and, in this wheel, libtorch_cuda): one without CUDA.
(cd "$part/lib" && gcc -shared -o libtorch.so -Wl,--no-as-needed -L. -l:libtorch_cpu.so -l:libc10.so \
    -Wl,-rpath,'$ORIGIN' -Wl,--allow-shlib-undefined) || fail "gcc could not link $part/lib/libtorch.so"
# Last: whoever finds it finds the rest.
echo $wanted >"$part/build-version" || no_room 1
rm -rf "$dir"
mv "$part" "$dir"
rm -rf "$wheels"
echo "$dir"
