#!/usr/bin/env bash
# The only entry point: makes the workspace ready, then runs a command in it. See ./ws --help.
#
# Each step keeps a stamp in .ws/stamp, the hash of its inputs. A step runs again only if its hash has
# changed. A step that failed leaves no stamp, so the next call resumes there.
set -euo pipefail

# The dot at the end protects a trailing line feed, which $() would strip.
CHECKOUT=$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")"; echo .)
CHECKOUT=${CHECKOUT%$'\n.'}
CHECKSUM=$(printf '%s' "$CHECKOUT" | cksum)
CHECKSUM=${CHECKSUM%% *}

# The kernel allows no blanks and at most 127 bytes in the path of a script's interpreter; rosrun splits
# paths at blanks, ROS at colons, CMake at semicolons.
is_plain() {  # path
    local LC_ALL=C
    [[ $1 != *[!A-Za-z0-9_./+@,=~-]* && ${#1} -le 90 ]]
}

# A checkout with such a path is used through a link with a plain name.
ROOT=$CHECKOUT
if ! is_plain "$ROOT"; then
    ROOT=/tmp/cartpole-$UID-$CHECKSUM
    for link in /tmp/cartpole-"$UID"-*; do
        # Left behind by a checkout that was removed without `ws clean`.
        if [[ -L $link && ! -e $link ]]; then rm -f -- "$link" 2>/dev/null || true; fi
    done
    [[ -e $ROOT || -L $ROOT ]] || ln -s -- "$CHECKOUT" "$ROOT"
    # Another owner of the link could redirect it later.
    if [[ ! $ROOT -ef $CHECKOUT || $(stat --format %u -- "$ROOT") -ne $UID ]]; then
        echo "ws: $ROOT is in the way of a link to $CHECKOUT; remove it" >&2
        exit 1
    fi
fi
SYSTEM_PYTHON=/usr/bin/python3  # rospy is Debian's, so is the interpreter, whatever PATH says

# The master's port depends on user and checkout, so two of them never share a master.
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
# shellcheck source=tools/ws_docs.sh
source "$ROOT/tools/ws_docs.sh"

# The markers (pyproject.toml) that `ws test --fast` deselects.
NOT_FAST="rostest or slow or long or stress or extras"

usage() {
    cat <<END
usage: ws CMD [ARG...]       make the workspace ready, then run CMD in it
       ws --with FOLDER [--with FOLDER]... CMD [ARG...]
                             the same, with the catkin packages and Python modules in your FOLDERs
       ws test [ARG...]      run all tests; ARGs go to pytest, e.g. -k gazebo
       ws test --fast [ARG...]
                             run the quick tests (about a minute): none over ROS (test/ros), none
                             marked slow, long or stress, none that need requirements/extras.txt
       ws check [NAME...]    run all checks, or those named: ${CHECKS[*]}
       ws docs [FOLDER]      build the documentation as a site and serve it, or write it to FOLDER
       ws shell              open an interactive bash in the workspace, with roscd and completion
       ws extras [CMD...]    install requirements/extras.txt and Mesa too, then run CMD, if any
       ws rviz [CMD...]      install Debian's RViz too, then run CMD, if any
       ws foreign [CMD...]   install compilers and what other people's packages commonly build against, then
                             run CMD, if any
       ws clean              remove everything that ws made
       ws --help             show this text

For example:
       ./ws rosrun cartpole pg_train.py
       ./ws roslaunch gazebo_ros empty_world.launch gui:=false
       ./ws --with ~/my_ws roslaunch my_arm arm.launch

To make the workspace ready, ws installs the packages of requirements/debian.txt and ros.txt (apt-get,
through sudo unless you are root), installs requirements/base.txt into .ws/venv as the lock file of
its Python says, and builds the catkin workspace .ws from this package and companions/. It does each
step once; logs are in .ws/log.
On Debian 13 torch is Debian's unless CARTPOLE_TORCH=pip. Where the system isn't Debian, ws uses the
ROS 1 that is sourced or lies in /opt/ros/one.
Apart from Debian's packages everything lies in $CHECKOUT/.ws.
If that can't be written, ws uses ~/.cache/cartpole; CARTPOLE_WS_DIR names another folder.

ROS uses loopback only, and a master on a port of this user and checkout: $DEFAULT_MASTER
To use another master or network, set ROS_MASTER_URI, ROS_IP or ROS_HOSTNAME.

CARTPOLE_WITH (with colons) and ROS_PACKAGE_PATH may name FOLDERs, too. ws builds what CMake has to
make of their packages, such as messages, in .ws/with, for which it installs compilers
(requirements/compiler.txt); it uses sourced catkin workspaces as they were built. Your packages win
over this checkout's of the same name, except cartpole and bullet_gazebo_msgs. ws ignores the rest of
PYTHONPATH and CMAKE_PREFIX_PATH, a whole ROS, ROS_NAMESPACE, conda and virtual environments.
END
}

run_tests() {  # [--fast] [ARG...]
    local argument fast='' arguments=()
    for argument in "$@"; do
        if [[ $argument == --fast ]]; then fast=yes; else arguments+=("$argument"); fi
    done
    # Four processes for two cores, because tests over ROS wait half of their time. Each file stays
    # in one process, which makes its fixtures once. Without reordering, long files start first.
    if [[ ${#arguments[@]} -eq 0 ]]; then
        [[ -n $fast ]] || say "all tests take up to two hours, ./ws test --fast takes a minute or two"
        arguments=(--numprocesses 4 --dist loadfile --no-loadscope-reorder)
    fi
    [[ -z $fast ]] || arguments=(-m "not ($NOT_FAST)" "${arguments[@]}")
    cd -- "$ROOT"
    unset PYTHONDONTWRITEBYTECODE  # hundreds of processes import the same modules
    export PYTHONUNBUFFERED=1      # tests wait for lines that rospy and roslaunch don't flush into a pipe
    exec "$VENV/bin/python3" -m pytest --override-ini "cache_dir=$STATE/pytest" "${arguments[@]}"
}

interactive_shell() {
    export CARTPOLE_WS_CHECKS=${CHECKS[*]}
    exec bash --rcfile "$ROOT/tools/ws_shell.sh" -i
}

# What to do next, once the workspace is ready.
next_thing() {
    case ${COMMAND%% *} in
        true | extras | rviz | foreign | :) echo ". Next: ./ws rosrun cartpole pg_train.py, or ./ws --help" ;;
        *) echo ". Now: $COMMAND" ;;
    esac
}

clean() {
    if [[ -d $WS ]]; then
        hold_lock
        # Remove the lock last, so that no one builds in a half-removed folder.
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
        docs) [[ ${2-} != -* ]] || fail_usage "docs: unknown option $2" ;;
        *) ask_about "$1" ;;
    esac
    COMMAND=$*
    local steps=(debian venv companions build)
    case $1 in
        test)
            steps=(debian venv test_tools companions build)
            [[ " $* " == *" --fast "* ]] || steps+=(compiler extras mesa)
            [[ " $* " == *" --fast "* || $SYSTEM != "debian 12" ]] || steps+=(oracle)
            ;;
        check)
            look_for_checks "${@:2}"
            steps=(debian checkers venv test_tools doc_tools companions build)
            ;;
        docs) steps=(debian venv doc_tools companions build) ;;
        extras) steps=(debian venv extras mesa companions build) ;;
        rviz) steps=(debian rviz venv companions build) ;;
        foreign) steps=(debian compiler foreign venv companions build) ;;
    esac
    look_at_system /etc/os-release /opt/ros/one
    choose_place "${steps[@]}"
    make_ready "${steps[@]}"
    enter_workspace
    case $1 in
        test) run_tests "${@:2}" ;;
        check) check "${@:2}" ;;
        docs) docs "${@:2}" ;;
        shell) interactive_shell ;;
        extras | rviz | foreign) [[ $# -eq 1 ]] || exec -- "${@:2}" ;;
        *) run "$@" ;;
    esac
}

run() {
    # roscore would take port 11311, where nothing in this workspace looks for a master.
    if [[ $1 == roscore && $ROS_MASTER_URI =~ :([0-9]+)/?$ ]]; then
        set -- roscore -p "${BASH_REMATCH[1]}" "${@:2}"
    fi
    # exec, so that CMD gets the signals and ws ends with its exit code.
    if ! type -P -- "$1" >/dev/null; then
        echo "ws: no such command: $1" >&2
        return 127
    fi
    exec -- "$@"
}

# A slip of the finger would run another program: Debian has a tset.
ask_about() {  # command
    local own i head tail program
    for own in test check docs shell extras rviz foreign clean; do
        [[ $1 != "$own" ]] || return 0
    done
    for own in test check docs shell extras rviz foreign clean; do
        for ((i = 0; i <= ${#own}; i++)); do
            head=${own:0:i} tail=${own:i}
            case $1 in
                "$head"?"$tail" | "$head${tail:1}" | "$head"?"${tail:1}" | \
                    "$head${tail:1:1}${tail:0:1}${tail:2}")
                    program=$(type -P -- "$1") || program=/path/to/$1
                    fail_usage "did you mean: ws $own? If not: ws $program"
                    ;;
            esac
        done
    done
}

fail_usage() {
    echo "ws: $1; see ws --help" >&2
    exit 2
}

main "$@"
