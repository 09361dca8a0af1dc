#!/usr/bin/env bash
# Make a virtual environment:  make_venv.sh PYTHON KIND STAMP
#
#   KIND wheels  pinned packages, ROS 2 Jazzy among them, all from PyPI
#        jazzy   on top of the ROS 2 Jazzy that is sourced in this shell; adds only what is missing
#        oldest  the oldest supported versions, without ROS
#
# The environment is the folder of STAMP, a file that is written last: an installation that broke
# off never counts as done.
set -euo pipefail
python=$1 kind=$2 stamp=$3
venv=$(dirname "$stamp")
cd "$(dirname "$0")/.."

fail() {
    printf 'error: %s\n' "$1" >&2
    (($# == 1)) || printf '       %s\n' "${@:2}" >&2
    exit 1
}

case $kind in
    wheels | jazzy) newest=13 ;;
    oldest)
        newest=12 # NumPy 1.26 and SciPy 1.11 have no wheels for 3.13
        unset PYTHONPATH LD_LIBRARY_PATH # of a sourced ROS
        ;;
    *) fail "ROS 2 '$kind' is sourced in this shell, and slosh_ros is for Jazzy." \
        'Use a shell where Jazzy is sourced, or one without any ROS: then Jazzy comes from PyPI.' ;;
esac

# Run it, do not look for it: pyenv's python3.x may be there and only print an error.
version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null) ||
    fail "no Python runs as '$python'; name one: make PYTHON=/path/to/python3"
[[ $version == 3.* ]] && ((${version#3.} >= 10 && ${version#3.} <= newest)) ||
    fail "'$python' is Python $version; this needs 3.10 to 3.$newest." \
        'Name another: make PYTHON=/path/to/python3'
"$python" -c 'import ensurepip, venv' 2>/dev/null ||
    fail "'$python' has no venv or pip. On Debian and Ubuntu: sudo apt install python3-venv"
if [[ $kind == jazzy ]]; then
    "$python" -c 'import rclpy' 2>/dev/null ||
        fail "ROS_DISTRO is jazzy, but '$python' cannot import rclpy." \
            'Source it (. /opt/ros/jazzy/setup.bash) and use the Python that it is made for' \
            '(make PYTHON=/usr/bin/python3), or unset ROS_DISTRO to take Jazzy from PyPI.'
fi

echo "making $venv with Python $version ($kind); this takes about a minute ..."
rm -rf "$venv"
pip() { "$venv/bin/python" -m pip --disable-pip-version-check -qq "$@"; }
# -e: the commands are in bin, the code stays here. No build isolation: the setuptools is a pinned one.
case $kind in
    wheels)
        "$python" -m venv "$venv"
        pip install -r requirements/core.txt -r requirements/ros.txt -r requirements/dev.txt
        pip install --no-deps --no-build-isolation -e .
        ;;
    jazzy)
        "$python" -m venv --system-site-packages "$venv"
        # not the pins but setup.py's lower bounds: what apt has installed is good enough
        pip install -r requirements/lint.txt -r requirements/docs.txt -e '.[test]'
        ;;
    oldest)
        "$python" -m venv "$venv"
        pip install -r requirements/oldest.txt
        pip install --no-deps --no-build-isolation -e .
        ;;
esac
touch "$stamp"
