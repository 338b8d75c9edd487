# shellcheck shell=bash
# Sourced by ws: the steps that make the workspace ready.
#
# A step NAME has three functions: key_NAME prints what the step depends on, plan_NAME how much it
# will take, as far as that is known, and make_NAME makes it.

# shellcheck disable=SC2034  # read in ws_ready.sh

declare -A TITLE=(
    [debian]="Debian packages"
    [checkers]="Debian packages for ws check"
    [compiler]="Debian packages that compile"
    [oracle]="Debian packages that tests compare with"
    [rviz]="Debian packages for RViz"
    [foreign]="Debian packages that others build against"
    [venv]="Python packages"
    [test_tools]="tools for test and check"
    [doc_tools]="tools for the documentation"
    [extras]="extra Python packages"
    [mesa]="Debian packages that draw"
    [companions]="catkin workspace of the companions"
    [build]="catkin workspace"
)
NETWORK="check the network and the free disk space"
COMPILER="mend what the compiler or CMake complains of; if that is nothing of yours, ./ws clean"
# shellcheck disable=SC2034
declare -A REMEDY=(
    [debian]="$NETWORK; on other systems than Debian 12 and 13 see docs/catkin.md"
    [checkers]=$NETWORK [compiler]=$NETWORK [oracle]=$NETWORK [rviz]=$NETWORK [foreign]=$NETWORK [venv]=$NETWORK [test_tools]=$NETWORK [doc_tools]=$NETWORK [extras]=$NETWORK [mesa]=$NETWORK
    [companions]=$COMPILER [build]=$COMPILER
)

# --- what the system offers ----------------------------------------------------------------

python_version() { local link; link=$(readlink -f -- "$SYSTEM_PYTHON"); echo "${link##*python}"; }

# Debian 12's torch is too old.
uses_debians_torch() { [[ ${CARTPOLE_TORCH-} != pip && $SYSTEM == "debian 13" ]]; }

# Debian has a ROS 1 of its own. On other systems what is sourced is taken, or else what lies in
# /opt/ros/one, as for Ubuntu 24.04. Package sources are the user's: none is added here.
SYSTEM='' ROS_PREFIX=''
look_at_system() {  # os-release, folder of ROS
    local ID='' VERSION_ID='' prefix prefixes
    # shellcheck disable=SC1090
    [[ ! -r $1 ]] || source "$1"
    SYSTEM="$ID $VERSION_ID"
    [[ $ID != debian ]] || return 0
    IFS=: read -ra prefixes <<<"${CMAKE_PREFIX_PATH-}:$2"
    for prefix in "${prefixes[@]}"; do
        if [[ -e $prefix/share/rospy && -e $prefix/setup.bash ]]; then
            ROS_PREFIX=$prefix
            return 0
        fi
    done
}

# --- Debian packages -----------------------------------------------------------------------

# Two lists make what every command needs: on other systems ROS may come from elsewhere.
debian_list() {  # file
    if [[ $1 == debian.txt ]]; then
        [[ -n $ROS_PREFIX ]] || debian_list ros.txt
        ! uses_debians_torch || echo python3-torch
    fi
    sed -E 's/#.*//; s/^[[:space:]]+|[[:space:]]+$//g; /^$/d; s/[[:space:]]+/\n/g' -- "$ROOT/requirements/$1"
}

debian_missing() {  # file
    local installed
    installed=$(dpkg-query --show --showformat '${db:Status-Status} ${Package}\n' 2>/dev/null |
        sed -n 's/^installed //p' || true)
    comm -23 <(debian_list "$1" | sort -u) <(sort -u <<<"$installed")
}

# The key is what is missing, which is nothing when ready: a package removed later is noticed.
key_debian() { debian_missing debian.txt; }
key_checkers() { debian_missing check.txt; }
key_compiler() { debian_missing compiler.txt; }
key_oracle() { debian_missing oracle.txt; }
key_rviz() { debian_missing rviz.txt; }
key_foreign() { debian_missing foreign.txt; }
key_mesa() { debian_missing mesa.txt; }

AS_ROOT=()
become_root() {
    [[ $EUID -ne 0 ]] || return 0
    type -P sudo >/dev/null && { sudo -n true || { : </dev/tty; }; } 2>/dev/null || return 1
    AS_ROOT=(sudo)
}

# Not with the lock: a package may start a service that stays. dpkg has a lock of its own.
apt() {
    "${AS_ROOT[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=600 "$@" {LOCK}>&-
}

plan_debian() { plan_packages debian.txt; }
plan_checkers() { plan_packages check.txt; }
plan_compiler() { plan_packages compiler.txt; }
plan_oracle() { plan_packages oracle.txt; }
plan_rviz() { plan_packages rviz.txt; }
plan_foreign() { plan_packages foreign.txt; }
plan_mesa() { plan_packages mesa.txt; }
plan_packages() {  # file
    local missing
    mapfile -t missing < <(debian_missing "$1")
    if [[ ${#missing[@]} -eq 0 ]]; then
        echo "all there"
        return 0
    fi
    sizes_of_debian "${missing[@]}" && return 0
    # The lists of a fresh machine are empty.
    type -P apt-get >/dev/null && become_root || return 0
    say "asking for the lists of Debian packages"
    apt update >"$WS/log/debian.log" 2>&1 </dev/null || return 0  # making it will say why
    sizes_of_debian "${missing[@]}" || true
}

# From apt's own words; fails where it doesn't know one of them.
sizes_of_debian() {  # package...
    # It only prints: with --assume-no it would install what needs no question.
    LC_ALL=C apt-get -o Debug::NoLocking=1 --print-uris --no-install-recommends install "$@" \
        2>/dev/null </dev/null |
        sed -nE 's/.* ([0-9]+) newly installed,.*/\1 packages/p
            s/^Need to get ([0-9.,]+ [kMG]?B).*/\1 to fetch/p
            s/^After this operation, (.*) of additional.*/\1 on the disk/p' |
        paste --serial --delimiters ';' | sed 's/;/, /g' | grep .
}

make_debian() { make_packages debian.txt; }
make_checkers() { make_packages check.txt; }
make_compiler() { make_packages compiler.txt; }
make_oracle() { make_packages oracle.txt; }
make_rviz() { make_packages rviz.txt; }
make_foreign() { make_packages foreign.txt; }
# Not all who want the extras are root, and not all of them want this one.
make_mesa() { make_packages mesa.txt || echo "There will be no renderer:=gl."; }
make_packages() {  # file
    local missing
    mapfile -t missing < <(debian_missing "$1")
    [[ ${#missing[@]} -gt 0 ]] || return 0
    if ! type -P apt-get >/dev/null; then
        echo "This is no Debian: there is no apt-get. Needed: ${missing[*]}"
        return 1
    fi
    if ! become_root; then
        echo "Neither root nor able to use sudo. Ask an administrator to run:" \
            "apt-get install --no-install-recommends ${missing[*]}"
        return 1
    fi
    apt install --yes --no-install-recommends "${missing[@]}" && return 0
    apt update  # old lists name files that are gone
    apt install --yes --no-install-recommends "${missing[@]}"
}

# --- Python packages -----------------------------------------------------------------------

# The place counts: a virtual environment has its path written into its scripts.
key_place() { readlink -f -- "$SYSTEM_PYTHON"; echo "$ROOT${ROS_PREFIX:+ $ROS_PREFIX}"; }
key_venv() { key_place; list_of base.txt; cat -- "$(lock_file)"; }
key_test_tools() { key_venv; cat -- "$ROOT/requirements/test.txt"; }
key_doc_tools() { key_venv; cat -- "$ROOT/requirements/docs.txt"; }
key_extras() { key_venv; cat -- "$ROOT/requirements/extras.txt"; }

# Stable-Baselines3 asks for a newer torch than Debian 13's, and works with it.
list_of() { sed "$(! uses_debians_torch || echo '/^torch==/d; /^stable-baselines3==/d')" -- "$ROOT/requirements/$1"; }

lock_file() { echo "$ROOT/requirements/lock-$(python_version).txt"; }

plan_venv() {
    if compgen -G "$VENV/lib/*/site-packages/pybullet*" >/dev/null; then  # a large one, so most is there
        echo "what has changed in requirements/base.txt"
    else
        size_of base.txt "$(! uses_debians_torch || echo " with Debian's torch")"
    fi
}
plan_test_tools() { size_of test.txt; }
plan_doc_tools() { size_of docs.txt; }
plan_extras() { size_of extras.txt; }

# What was measured is written in the files.
size_of() { sed -n "s/^# Size${2-}: //p" -- "$ROOT/requirements/$1"; }  # file, case

# With base.txt, so that nothing here moves what is pinned there.
pip_install() {  # file...
    local file files=(--constraint "$(lock_file)")
    if [[ ! -f $(lock_file) ]]; then
        echo "ERROR: requirements/ has no lock file for Python $(python_version), only $(cd -- "$ROOT/requirements" && echo lock-*)"
        return 1
    fi
    for file in base.txt "$@"; do
        list_of "$file" >"$WS/$file"
        files+=(--requirement "$WS/$file")
    done
    pip_in_venv "${files[@]}"
}

pip_in_venv() {  # argument of `pip install`...
    local package
    # What pip was killed at has no INSTALLER yet and may lack its scripts, but pip would take it for installed.
    for package in "$VENV"/lib/*/site-packages/*.dist-info; do
        [[ ! -d $package || -e $package/INSTALLER ]] || rm -rf -- "$package"
    done
    env -u PIP_USER -u PIP_TARGET -u PIP_PREFIX -u PYTHONPATH -u PYTHONHOME PYTHONNOUSERSITE=1 \
        "$VENV/bin/python3" -m pip install --disable-pip-version-check --no-input --progress-bar off "$@"
}

make_venv() {
    local place=$VENV/cartpole-place
    # Pip's torch would hide Debian's.
    if [[ ! -f $place || $(<"$place") != "$(key_place)" ]] ||
        { uses_debians_torch && compgen -G "$VENV/lib/*/site-packages/torch" >/dev/null; }; then
        env -u PYTHONPATH -u PYTHONHOME \
            "$SYSTEM_PYTHON" -m venv --clear --system-site-packages "$VENV"
        key_place >"$place"
    fi
    pip_install
}

make_test_tools() { pip_install test.txt; }
make_doc_tools() { pip_install docs.txt; }
make_extras() {
    pip_install extras.txt
    # What else it needs is in base.txt.
    ! uses_debians_torch || pip_in_venv --no-deps "$(grep '^stable-baselines3==' "$ROOT/requirements/extras.txt")"
}

# --- catkin workspaces ---------------------------------------------------------------------

# Two, so that a package of the caller's can stand between them (ws_environment.sh): in front the
# package and what stands in for Gazebo, behind them the companions that the caller may have, too.
FRONT=(bullet_gazebo_msgs gazebo_ros)

# What CMake reads, and the names of what it links to; sources are used where they are.
PARTS=(CMakeLists.txt LICENSE README.md package.xml pyproject.toml setup.py
    benchmark config docs launch requirements rviz scripts src test urdf worlds)  # of the package

companions_behind() {
    local folder
    for folder in "$ROOT"/companions/*; do
        [[ " ${FRONT[*]} " == *" ${folder##*/} "* ]] || echo "${folder#"$ROOT/"}"
    done
}

plan_companions() { count "$(companions_behind | wc -l)" package; }
plan_build() { count $((${#FRONT[@]} + 1)) package; }
count() { echo "$1 $2$([[ $1 -eq 1 ]] || echo s)"; }

key_companions() {
    local folders
    mapfile -t folders < <(companions_behind)
    key_place
    hash_files tools/workspace.cmake "${folders[@]}"
}

key_build() {
    key_place
    echo "${PARTS[@]}" "${FRONT[@]}"
    cd -- "$ROOT" || return
    find scripts src -mindepth 1 -maxdepth 1 ! -name __pycache__ ! -name '*.egg-info' 2>/dev/null | sort || true
    hash_files CMakeLists.txt package.xml setup.py companions tools/workspace.cmake
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
    CMAKE_PREFIX_PATH=$COMPANIONS/devel${CMAKE_PREFIX_PATH:+:$CMAKE_PREFIX_PATH} catkin_workspace "$WS"
}

catkin_workspace() {  # folder
    local made_for=$1/build/cartpole-place wanted
    ln -s -- "$ROOT/tools/workspace.cmake" "$1/src/CMakeLists.txt"
    wanted=$(key_place; ls -- "$1/src")
    if [[ ! -f $made_for || $(<"$made_for") != "$wanted" ]]; then
        # CMake's cache holds absolute paths, and what a package left behind would still be found.
        rm -rf -- "$1/build" "$1/devel"
        mkdir -p -- "$1/build"
        echo "$wanted" >"$made_for"
    fi
    # pytest runs the tests, so catkin need not look for its test tools. Messages in C++ and Python are enough.
    ROS_LANG_DISABLE=geneus:genlisp:gennodejs "${ROS_PREFIX:-/usr}/bin/catkin_make" --directory "$1" --force-cmake \
        -DPYTHON_EXECUTABLE="$VENV/bin/python3" -DCATKIN_ENABLE_TESTING=OFF
}
