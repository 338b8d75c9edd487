# shellcheck shell=bash
# Sourced by ws: the steps that make the workspace ready.
#
# A step NAME has two functions: key_NAME prints what the step depends on, make_NAME makes it.

say() { echo "ws: $*" >&2; }

hash_of() { sha256sum | cut -d ' ' -f 1; }

is_ready() {  # step
    local stamp=$WS/stamp/$1
    [[ -f $stamp && $(<"$stamp") == "$("key_$1" | hash_of)" ]]
}

make_ready() {  # step...
    local step
    for step in "$@"; do
        is_ready "$step" && continue
        hold_lock
        is_ready "$step" || make_step "$step"  # somebody else may just have made it
    done
    drop_lock
}

make_step() {  # step
    local log=$WS/log/$1.log status
    mkdir -p -- "$WS/stamp" "$WS/log"
    rm -f -- "$WS/stamp/$1"
    say "${TITLE[$1]} (log: .ws/log/$1.log)"
    # The lock stays with ws: a process that a step leaves behind must not keep it. The status is
    # asked for afterwards, because `set -e` is off in a function that is tested with ||.
    set +e
    (set -e; "make_$1") >"$log" 2>&1 {LOCK}>&-
    status=$?
    set -e
    if [[ $status -ne 0 ]]; then
        say "failed (exit code $status): ${TITLE[$1]}. The last lines of $log:"
        tail -n 15 -- "$log" | sed 's/^/    /' >&2
        say "what to do: ${REMEDY[$1]}"
        say "then call ws again: it goes on from here"
        exit 1
    fi
    "key_$1" | hash_of >"$WS/stamp/$1"
}

LOCK=
hold_lock() {
    [[ -z $LOCK ]] || return 0
    mkdir -p -- "$WS"
    exec {LOCK}>"$WS/lock"
    if ! flock --nonblock "$LOCK"; then
        say "waiting for another ws that makes this workspace ready"
        flock "$LOCK"
    fi
}

drop_lock() {
    [[ -z $LOCK ]] || exec {LOCK}>&-
    LOCK=
}

declare -A TITLE=(
    [debian]="installing Debian packages"
    [venv]="installing Python packages into .ws/venv"
    [test_tools]="installing the tools for test and check into .ws/venv"
    [extras]="installing the extra Python packages (requirements/extras.txt) into .ws/venv"
    [companions]="building the companions' catkin workspace"
    [build]="building the catkin workspace"
)
NETWORK="check the network, the free disk space and that the file under requirements/ is right"
COMPILER="mend what the compiler or CMake complains of; if that is nothing of yours, ./ws clean"
declare -A REMEDY=(
    [debian]="see the lines above; on other systems than Debian 12 build the package in a catkin workspace of your own"
    [venv]=$NETWORK [test_tools]=$NETWORK [extras]=$NETWORK
    [companions]=$COMPILER [build]=$COMPILER
)

# --- Debian packages -----------------------------------------------------------------------

debian_list() { sed 's/#.*//' -- "$ROOT/requirements/debian.txt" | xargs -n 1; }

debian_missing() {
    local installed
    installed=$(dpkg-query --show --showformat '${db:Status-Status} ${Package}\n' 2>/dev/null |
        sed -n 's/^installed //p' || true)
    comm -23 <(debian_list | sort -u) <(sort -u <<<"$installed")
}

# The key is what is missing, which is nothing when ready: a package removed later is noticed.
key_debian() { debian_missing; }

make_debian() {
    local missing as_root=()
    mapfile -t missing < <(debian_missing)
    [[ ${#missing[@]} -gt 0 ]] || return 0
    if ! type -P apt-get >/dev/null; then
        echo "This is no Debian: there is no apt-get. Needed: ${missing[*]}"
        return 1
    fi
    if [[ $EUID -ne 0 ]]; then
        if ! type -P sudo >/dev/null || { ! sudo -n true && ! { : </dev/tty; }; } 2>/dev/null; then
            echo "Neither root nor able to use sudo. Ask an administrator to run:"
            echo "    apt-get install --no-install-recommends ${missing[*]}"
            return 1
        fi
        as_root=(sudo)
    fi
    apt() {
        "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=600 "$@"
    }
    # The lists of a fresh machine are empty, those of an old one name files that are gone.
    apt install --yes --no-install-recommends "${missing[@]}" && return 0
    apt update
    apt install --yes --no-install-recommends "${missing[@]}"
}

# --- Python packages -----------------------------------------------------------------------

# The place counts: a virtual environment has its path written into its scripts.
key_place() { readlink -f -- "$SYSTEM_PYTHON"; echo "$ROOT"; }
key_venv() { key_place; cat -- "$ROOT/requirements/base.txt"; }
key_test_tools() { key_venv; cat -- "$ROOT/requirements/test.txt"; }
key_extras() { key_venv; cat -- "$ROOT/requirements/extras.txt"; }

pip_install() {  # file...
    local files=()
    for file in "$@"; do files+=(--requirement "$ROOT/requirements/$file"); done
    env -u PIP_USER -u PIP_TARGET -u PIP_PREFIX -u PYTHONPATH -u PYTHONHOME PYTHONNOUSERSITE=1 \
        "$VENV/bin/python3" -m pip install --disable-pip-version-check --no-input "${files[@]}"
}

make_venv() {
    local place=$VENV/cartpole-place
    if [[ ! -f $place || $(<"$place") != "$(key_place)" ]]; then
        env -u PYTHONPATH -u PYTHONHOME \
            "$SYSTEM_PYTHON" -m venv --clear --system-site-packages "$VENV"
        key_place >"$place"
    fi
    pip_install base.txt
}

# With base.txt, so that nothing here moves what is pinned there.
make_test_tools() { pip_install base.txt test.txt; }
make_extras() { pip_install base.txt extras.txt; }

# --- catkin workspaces ---------------------------------------------------------------------

# Two, so that a package of the caller's can stand between them (ws_environment.sh): in front the
# package and what stands in for Gazebo, behind them the companions that the caller may have, too.
COMPANIONS=$WS/companions
FRONT=(bullet_gazebo_msgs gazebo_ros)

# What CMake reads, and the names of what it links to; sources are used where they are.
PARTS=(CMakeLists.txt LICENSE README.md package.xml pyproject.toml setup.py
    benchmark config docs launch rviz scripts src test urdf)  # of the package

companions_behind() {
    local folder
    for folder in "$ROOT"/companions/*; do
        [[ " ${FRONT[*]} " == *" ${folder##*/} "* ]] || echo "${folder#"$ROOT/"}"
    done
}

key_companions() {
    local folders
    mapfile -t folders < <(companions_behind)
    key_place
    hash_files "${folders[@]}"
}

key_build() {
    key_place
    echo "${PARTS[@]}" "${FRONT[@]}"
    cd -- "$ROOT"
    find scripts src -mindepth 1 -maxdepth 1 ! -name __pycache__ ! -name '*.egg-info' 2>/dev/null | sort || true
    hash_files CMakeLists.txt package.xml setup.py companions
}

hash_files() {  # path...
    (cd -- "$ROOT" && find "$@" -type f ! -name '*.pyc' -print0 | sort -z | xargs -0 sha256sum)
}

make_companions() {
    local folder
    rm -rf -- "$COMPANIONS/src"
    mkdir -p -- "$COMPANIONS/src"
    companions_behind | while read -r folder; do ln -s -- "$ROOT/$folder" "$COMPANIONS/src/"; done
    leave_other_workspaces
    catkin_workspace "$COMPANIONS"
}

# The package is a folder of links to its parts, not a link to the root: rosrun looks for executables
# everywhere below a package, and would find those in .ws, and in whatever folder a training leaves in
# the root, as well.
make_build() {
    local entry
    rm -rf -- "$WS/src"
    mkdir -p -- "$WS/src/cartpole"
    for entry in "${PARTS[@]}"; do
        ln -s -- "$ROOT/$entry" "$WS/src/cartpole/"
    done
    ln -s -- "${FRONT[@]/#/$ROOT/companions/}" "$WS/src/"
    leave_other_workspaces
    CMAKE_PREFIX_PATH=$COMPANIONS/devel catkin_workspace "$WS"
}

catkin_workspace() {  # folder
    local made_for=$1/build/cartpole-place wanted
    wanted=$(key_place; ls -- "$1/src")
    if [[ ! -f $made_for || $(<"$made_for") != "$wanted" ]]; then
        # CMake's cache holds absolute paths, and what a package left behind would still be found.
        rm -rf -- "$1/build" "$1/devel"
        mkdir -p -- "$1/build"
        echo "$wanted" >"$made_for"
    fi
    # pytest runs the tests, so catkin need not look for its test tools.
    /usr/bin/catkin_make --directory "$1" --force-cmake \
        -DPYTHON_EXECUTABLE="$VENV/bin/python3" -DCATKIN_ENABLE_TESTING=OFF \
        -DCMAKE_BUILD_TYPE=Release
}
