#!/usr/bin/env bash
# The one entry: makes the workspace ready, then runs a command in it. See ./ws --help.
#
# Each step keeps a stamp, the hash of what it was made from, in .ws/stamp; a step whose hash
# has not changed is not run again, and a step that failed has no stamp, so the next call resumes.
set -euo pipefail

# The sign at the end keeps a line feed at the end of the path, which $() would take away.
CHECKOUT=$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")"; echo .)
CHECKOUT=${CHECKOUT%$'\n.'}
CHECKSUM=$(printf '%s' "$CHECKOUT" | cksum)
CHECKSUM=${CHECKSUM%% *}

# The kernel takes no blanks in the path of a script's interpreter and no more than 127 bytes, rosrun
# splits paths at blanks, ROS at colons, CMake at semicolons.
is_plain() {  # path
    local LC_ALL=C
    [[ $1 != *[!A-Za-z0-9_./+@,=~-]* && ${#1} -le 90 ]]
}

# Such a checkout is used through a link with a plain name.
ROOT=$CHECKOUT
if ! is_plain "$ROOT"; then
    ROOT=/tmp/cartpole-$UID-$CHECKSUM
    for link in /tmp/cartpole-"$UID"-*; do
        # Of a checkout that is gone, without `ws clean`.
        if [[ -L $link && ! -e $link ]]; then rm -f -- "$link" 2>/dev/null || true; fi
    done
    [[ -e $ROOT || -L $ROOT ]] || ln -s -- "$CHECKOUT" "$ROOT"
    # Whoever owns the link could lead it elsewhere later.
    if [[ ! $ROOT -ef $CHECKOUT || $(stat --format %u -- "$ROOT") -ne $UID ]]; then
        echo "ws: $ROOT is in the way of a link to $CHECKOUT; remove it" >&2
        exit 1
    fi
fi
SYSTEM_PYTHON=/usr/bin/python3  # rospy is Debian's, so is the interpreter, whatever PATH says

# A port of this user and checkout for the master, so that neither two users nor two checkouts meet.
DEFAULT_MASTER=http://127.0.0.1:$((20000 + (CHECKSUM + UID) % 10000))

# shellcheck source=tools/ws_place.sh
source "$ROOT/tools/ws_place.sh"
# shellcheck source=tools/ws_ready.sh
source "$ROOT/tools/ws_ready.sh"
# shellcheck source=tools/ws_steps.sh
source "$ROOT/tools/ws_steps.sh"
# shellcheck source=tools/ws_environment.sh
source "$ROOT/tools/ws_environment.sh"
# shellcheck source=tools/ws_with.sh
source "$ROOT/tools/ws_with.sh"
# shellcheck source=tools/ws_check.sh
source "$ROOT/tools/ws_check.sh"

# The markers (pyproject.toml) of what `ws test --fast` leaves out.
NOT_FAST="rostest or slow or long or stress or extras"

usage() {
    cat <<END
usage: ws CMD [ARG...]       make the workspace ready, then run CMD in it
       ws --with FOLDER [--with FOLDER]... CMD [ARG...]
                             the same, with the catkin packages and Python modules in the user's FOLDERs
       ws test [ARG...]      run all tests; ARGs go to pytest, e.g. -k gazebo
       ws test --fast [ARG...]
                             run the tests of about a minute, without those through ROS (test/ros),
                             those that take seconds each (marked slow, long or stress), and
                             those that need requirements/extras.txt (marked extras)
       ws check [NAME...]    run the checks, or those named: ${CHECKS[*]}
       ws shell              an interactive bash in the workspace, with roscd and completion
       ws extras [CMD...]    install requirements/extras.txt too, then run CMD, if any
       ws rviz [CMD...]      install Debian's RViz too, then run CMD, if any
       ws clean              remove everything that ws made
       ws --help             this text

For example:
       ./ws rosrun cartpole pg_train.py
       ./ws roslaunch gazebo_ros empty_world.launch gui:=false
       ./ws --with ~/my_ws roslaunch my_arm arm.launch

Ready means: the packages of requirements/debian.txt are installed (apt-get, through sudo when
not root), .ws/venv holds requirements/base.txt, and .ws is a catkin workspace built from this
package and companions/. What is ready is not made again. Logs are in .ws/log.
Apart from Debian's packages everything lies in $CHECKOUT/.ws.
Where that can't be written, it lies in ~/.cache/cartpole; CARTPOLE_WS_DIR names another folder.

ROS talks over loopback only, to a master on a port of this user and checkout: $DEFAULT_MASTER
Set ROS_MASTER_URI, ROS_IP or ROS_HOSTNAME to use another master or network.
FOLDERs may also stand in CARTPOLE_WITH, with colons between them; folders on ROS_PACKAGE_PATH are
such as well. What CMake has to make of packages in them, such as messages, is built in .ws/with.
Catkin workspaces that the caller has sourced are used as they were built. Packages of the caller go
before this checkout's of the same name, all but cartpole and bullet_gazebo_msgs. All else of
PYTHONPATH and CMAKE_PREFIX_PATH, a whole ROS, ROS_NAMESPACE, conda and virtual environments are left
out.
END
}

run_tests() {  # [--fast] [ARG...]
    local argument fast='' arguments=()
    for argument in "$@"; do
        if [[ $argument == --fast ]]; then fast=yes; else arguments+=("$argument"); fi
    done
    # More processes than the two cores that are meant: those through ROS wait a quarter of their time.
    # What a file's tests share is made once, so a file stays in one process. In the order of
    # collection, so that the long ones, those through ROS, begin first.
    [[ ${#arguments[@]} -gt 0 ]] ||
        arguments=(--numprocesses 3 --dist loadfile --no-loadscope-reorder)
    [[ -z $fast ]] || arguments=(-m "not ($NOT_FAST)" "${arguments[@]}")
    cd -- "$ROOT"
    exec "$VENV/bin/python3" -m pytest --override-ini "cache_dir=$STATE/pytest" "${arguments[@]}"
}

interactive_shell() {
    export CARTPOLE_WS_CHECKS=${CHECKS[*]}
    exec bash --rcfile "$ROOT/tools/ws_shell.sh" -i
}

# What a user who has just made the workspace ready may want to know.
next_thing() {
    case ${COMMAND%% *} in
        true | extras | rviz | :) echo ". Next: ./ws rosrun cartpole pg_train.py, or ./ws --help" ;;
        *) echo ". Now: $COMMAND" ;;
    esac
}

clean() {
    if [[ -d $WS ]]; then
        hold_lock
        # The folder of the lock goes last, so that nobody builds in a half-removed one.
        find "$WS" -mindepth 1 -maxdepth 1 ! -name lock -exec rm -rf -- {} +
        rm -rf -- "$WS"
    fi
    [[ $ROOT == "$CHECKOUT" ]] || rm -f -- "$ROOT"
}

main() {
    while [[ ${1-} == --with || ${1-} == --with=* ]]; do
        if [[ $1 == --with ]]; then
            add_folder --with "${2-}"
            shift 2
        else
            add_folder --with "${1#*=}"
            shift
        fi
        [[ $# -gt 0 ]] || fail_usage "--with needs a command behind its folder"
    done
    add_folders_of_the_environment
    case ${1-} in
        '' | -h | --help | help) usage; [[ -n ${1-} ]]; return ;;
        clean) choose_place; clean; return ;;
        -*) fail_usage "unknown option $1" ;;
    esac
    COMMAND=$*
    local steps=(debian venv companions build)
    case $1 in
        test)
            steps=(debian venv test_tools extras companions build)
            # shellcheck disable=SC2206  # step names hold no blanks
            [[ " $* " != *" --fast "* ]] || steps=(${steps[@]/extras/})
            ;;
        check) steps=(debian venv test_tools companions build) ;;
        extras) steps=(debian venv extras companions build) ;;
        rviz) steps=(debian rviz venv companions build) ;;
    esac
    choose_place "${steps[@]}"
    make_ready "${steps[@]}"
    enter_workspace
    case $1 in
        test) run_tests "${@:2}" ;;
        check) check "${@:2}" ;;
        shell) interactive_shell ;;
        extras | rviz) [[ $# -eq 1 ]] || exec -- "${@:2}" ;;
        *) run "$@" ;;
    esac
}

run() {
    # Of itself it takes port 11311, where nobody else in this workspace looks for a master.
    if [[ $1 == roscore && $ROS_MASTER_URI =~ :([0-9]+)/?$ ]]; then
        set -- roscore -p "${BASH_REMATCH[1]}" "${@:2}"
    fi
    # exec, so that CMD gets the signals and its exit code is ours.
    if ! type -P -- "$1" >/dev/null; then
        echo "ws: no such command: $1" >&2
        return 127
    fi
    exec -- "$@"
}

fail_usage() {
    echo "ws: $1; see ws --help" >&2
    exit 2
}

main "$@"
