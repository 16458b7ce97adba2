#!/usr/bin/env bash
# Installs what a bare Debian lacks. `setup.sh build`: the compilers that some crates need, and pip, which fetches
# libtorch. `setup.sh graphics`: what the window needs to build, and to draw without a display. `setup.sh python DIR`: a
# virtual environment with NumPy, zstandard, the stock Rerun tools, two writers of ROS 2 recordings, MuJoCo and OctoMap, with which the
# tests read what Nudge writes, write what it reads, and run its episodes in another simulator.
set -euo pipefail

fail() { echo "setup: $*" >&2; exit 2; }

apt_install() {
    local sudo=
    [ "$(id -u)" = 0 ] || sudo=sudo
    command -v apt-get >/dev/null || fail "please install: $*"
    echo "setup: installing $*"
    { $sudo apt-get update -qq && DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends "$@"; } >/dev/null ||
        fail "apt-get could not install $*"
}

case "${1:-build}" in
build)
    command -v cargo >/dev/null || fail "no cargo found; install Rust from https://rustup.rs"
    { command -v cc && command -v c++; } >/dev/null || apt_install build-essential
    # Whoever names a libtorch needs no pip.
    if [ -z "${LIBTORCH:-}" ]; then
        command -v python3 >/dev/null || apt_install python3 python3-pip
        python3 -m pip --version >/dev/null 2>&1 || apt_install python3-pip
    fi
    ;;
graphics)
    # The window: libudev for Rerun's viewer; Xvfb and Mesa's software Vulkan to draw without a display or a GPU.
    command -v dpkg >/dev/null || exit 0
    missing=()
    for package in libudev-dev pkg-config mesa-vulkan-drivers libvulkan1 xvfb xauth; do
        dpkg -s "$package" >/dev/null 2>&1 || missing+=("$package")
    done
    [ "${#missing[@]}" = 0 ] || apt_install "${missing[@]}"
    ;;
python)
    venv=${2:?setup.sh python DIR}
    [ -e "$venv/ready-5" ] && exit 0
    command -v python3 >/dev/null || apt_install python3
    python3 -c 'import ensurepip, venv' 2>/dev/null || apt_install python3-venv
    rm -rf "$venv"
    mkdir -p "$(dirname "$venv")"
    python3 -m venv "$venv"
    echo "setup: NumPy, zstandard, the stock Rerun tools, mcap-ros2-support, rosbags, MuJoCo and pyoctomap into $venv"
    "$venv/bin/pip" install -q --disable-pip-version-check numpy==2.2.6 zstandard==0.25.0 rerun-sdk==0.36.3 \
        pillow==13.0.0 mcap==1.6.0 mcap-ros2-support==0.6.0 rosbags==0.11.9 mujoco==3.17.0 pyoctomap==1.2.2 ||
        fail "pip could not install numpy, zstandard, rerun-sdk, pillow, mcap-ros2-support, rosbags, mujoco and pyoctomap"
    touch "$venv/ready-5"
    ;;
*) fail "unknown part: $1" ;;
esac
