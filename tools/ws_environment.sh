# shellcheck shell=bash
# Sourced by ws: the environment that a command of the workspace runs in.

is_loopback() {
    [[ $1 =~ ^https?://(localhost|127\.[0-9.]+|\[::1\])(:|/|$) ]]
}

# Nothing of the caller's Python, CMake or ROS environment may decide what runs here, but for the
# caller's own packages: those on ROS_PACKAGE_PATH, and the catkin workspaces that were sourced.
leave_other_workspaces() {
    [[ -n ${CALLER_WORKSPACES-} ]] || remember_callers_packages
    LD_LIBRARY_PATH=$(filter_paths in_no_workspace "${LD_LIBRARY_PATH-}")
    export LD_LIBRARY_PATH
    unset PYTHONPATH PYTHONHOME VIRTUAL_ENV PYENV_VERSION CONDA_PREFIX CONDA_DEFAULT_ENV \
        CMAKE_PREFIX_PATH AMENT_PREFIX_PATH COLCON_PREFIX_PATH PKG_CONFIG_PATH \
        ROS_PACKAGE_PATH ROS_NAMESPACE ROS_ROOT ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION ROS_ETC_DIR \
        ROSLISP_PACKAGE_DIRECTORIES CATKIN_SHELL CATKIN_TEST_RESULTS_DIR ROS_TEST_RESULTS_DIR
    export PYTHONNOUSERSITE=1  # ~/.local would otherwise come before the venv's base
    export PATH=$VENV/bin:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin:$PATH
    export HOME=${HOME:-$STATE/home}
    if [[ -n $ROS_PREFIX ]]; then
        set +u  # setup files read unset variables
        # shellcheck disable=SC1091
        source "$ROS_PREFIX/setup.bash"
        set -u
    fi
}

declare -A CALLER=()  # of each path variable, what belongs to the caller's packages
CALLER_FOLDERS=  # folders of packages that no sourced workspace has built
remember_callers_packages() {
    CALLER_WORKSPACES=$(filter_paths is_workspace "${CMAKE_PREFIX_PATH-}"):
    CALLER_FOLDERS=$(filter_paths is_not_built "${ROS_PACKAGE_PATH-}")
    CALLER=(
        [CMAKE_PREFIX_PATH]=${CALLER_WORKSPACES%:}
        [ROS_PACKAGE_PATH]=$(filter_paths is_built_elsewhere "${ROS_PACKAGE_PATH-}")
        [PYTHONPATH]=$(filter_paths in_workspace "${PYTHONPATH-}")
        [LD_LIBRARY_PATH]=$(filter_paths in_workspace "${LD_LIBRARY_PATH-}")
        [PATH]=$(filter_paths in_workspace "$PATH")
    )
}

filter_paths() {  # test, a:b:c
    local entry kept='' entries
    IFS=: read -ra entries <<<"$2"
    for entry in "${entries[@]}"; do
        if [[ -n $entry ]] && "$1" "$entry"; then kept+=${kept:+:}$entry; fi
    done
    printf %s "$kept"
}

is_not_ours() { [[ $1/ != "$WS"/* && $1/ != "$STATE"/* ]]; }

is_not_built() { is_not_ours "$1" && ! is_built "$1"; }
is_built_elsewhere() { is_not_ours "$1" && is_built "$1"; }

# It is what a sourced workspace was built from or has installed, or is a whole ROS.
is_built() {  # entry of ROS_PACKAGE_PATH
    local workspace workspaces
    [[ ! -e $1/rospy/package.xml ]] && in_no_workspace "$1" || return 0
    IFS=: read -ra workspaces <<<"$CALLER_WORKSPACES"
    for workspace in "${workspaces[@]}"; do
        [[ -n $workspace ]] || continue
        [[ ";$(<"$workspace/.catkin");" != *";$1;"* ]] || return 0
    done
    return 1
}

# A whole ROS isn't taken: rospy and its like are Debian's.
is_workspace() { [[ -f $1/.catkin && ! -e $1/share/rospy ]] && is_not_ours "$1"; }

in_workspace() { is_below_one_of "$CALLER_WORKSPACES" "$1"; }
in_no_workspace() { ! is_below_one_of "${CMAKE_PREFIX_PATH-}" "$1"; }

is_below_one_of() {  # a:b:c, path
    local prefix prefixes
    IFS=: read -ra prefixes <<<"$1"
    for prefix in "${prefixes[@]}"; do
        [[ -n $prefix && $2 == "$prefix"/* ]] && return 0
    done
    return 1
}

# In front of the companions, so that the caller's package of the same name is the one that is found.
put_before_companions() {  # variable
    local -n paths=$1
    local theirs=${CALLER[$1]}
    if [[ -z $theirs ]]; then
        return 0
    elif [[ $paths == *"$COMPANIONS"/* ]]; then
        paths=${paths/"$COMPANIONS"/"$theirs:$COMPANIONS"}
    else
        paths+=${paths:+:}$theirs
    fi
}

bind_to_loopback() {
    # A default of ours that comes back through a nested call is no wish of the user's.
    if [[ ${ROS_MASTER_URI-} == "${CARTPOLE_WS_MASTER-}" ]]; then
        unset ROS_MASTER_URI
    fi
    if [[ -z ${ROS_MASTER_URI-} ]]; then
        export ROS_MASTER_URI=$DEFAULT_MASTER CARTPOLE_WS_MASTER=$DEFAULT_MASTER
    fi
    # With a master elsewhere, a loopback address would make our nodes unreachable.
    if [[ -z ${ROS_IP-}${ROS_HOSTNAME-} ]] && is_loopback "$ROS_MASTER_URI"; then
        export ROS_IP=127.0.0.1
    fi
}

enter_workspace() {
    leave_other_workspaces
    make_theirs_ready "$CALLER_FOLDERS"
    bind_to_loopback
    export ROS_HOME=$STATE/ros ROS_LOG_DIR=$STATE/ros/log MPLCONFIGDIR=$STATE/matplotlib \
        HYPOTHESIS_STORAGE_DIRECTORY=$STATE/hypothesis RUFF_CACHE_DIR=$STATE/ruff \
        MYPY_CACHE_DIR=$STATE/mypy CARTPOLE_WS=$ROOT/ws
    make_folders "$ROS_LOG_DIR" "$MPLCONFIGDIR" "$HOME"
    set +u  # catkin's setup file reads unset variables
    # shellcheck disable=SC1091
    source "$WS/devel/setup.bash"
    set -u
    local variable
    for variable in "${!CALLER[@]}"; do put_before_companions "$variable"; done
    enter_theirs
    # Programs of the workspaces before those that pip has put beside Python: xacro is bounded.
    export PATH=$WS/devel/bin:${CALLER[PATH]:+${CALLER[PATH]}:}$COMPANIONS/devel/bin:$VENV/bin:$PATH
}
