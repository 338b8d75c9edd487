# shellcheck shell=bash
# Sourced by ws: the environment that a command of the workspace runs in.

is_loopback() {
    [[ $1 =~ ^https?://(localhost|127\.[0-9.]+|\[::1\])(:|/|$) ]]
}

# Nothing of the caller's Python, CMake or ROS environment may decide what runs here.
leave_other_workspaces() {
    local prefix kept='' entry
    callers_packages=${callers_packages-${ROS_PACKAGE_PATH-}}
    IFS=: read -ra prefixes <<<"${CMAKE_PREFIX_PATH-}"
    IFS=: read -ra entries <<<"${LD_LIBRARY_PATH-}"
    for entry in "${entries[@]}"; do
        for prefix in "${prefixes[@]}"; do
            [[ -n $prefix && $entry == "$prefix"/* ]] && continue 2
        done
        kept+=${entry:+${kept:+:}$entry}
    done
    export LD_LIBRARY_PATH=$kept
    unset PYTHONPATH PYTHONHOME VIRTUAL_ENV PYENV_VERSION CONDA_PREFIX CONDA_DEFAULT_ENV \
        CMAKE_PREFIX_PATH AMENT_PREFIX_PATH COLCON_PREFIX_PATH PKG_CONFIG_PATH \
        ROS_PACKAGE_PATH ROS_NAMESPACE ROS_ROOT ROS_DISTRO ROS_VERSION ROS_PYTHON_VERSION ROS_ETC_DIR \
        ROSLISP_PACKAGE_DIRECTORIES CATKIN_SHELL CATKIN_TEST_RESULTS_DIR ROS_TEST_RESULTS_DIR
    export PYTHONNOUSERSITE=1  # ~/.local would otherwise come before the venv's base
    export PATH=$VENV/bin:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin:$PATH
    export HOME=${HOME:-$WS/home}
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
    bind_to_loopback
    export ROS_HOME=$WS/ros ROS_LOG_DIR=$WS/ros/log MPLCONFIGDIR=$WS/matplotlib \
        HYPOTHESIS_STORAGE_DIRECTORY=$WS/hypothesis CARTPOLE_WS=$ROOT/ws
    mkdir -p -- "$ROS_LOG_DIR" "$MPLCONFIGDIR" "$HOME"
    set +u  # catkin's setup file reads unset variables
    # shellcheck disable=SC1091
    source "$WS/devel/setup.bash"
    set -u
    # Behind ours: the caller's own packages are found, and none of them hides one of ours.
    export ROS_PACKAGE_PATH=$ROS_PACKAGE_PATH${callers_packages:+:$callers_packages}
    # Programs of the workspace before those that pip has put beside Python: xacro is bounded.
    export PATH=$WS/devel/bin:$VENV/bin:$PATH
}
