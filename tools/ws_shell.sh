# shellcheck shell=bash
# What `ws shell` reads in place of ~/.bashrc, which it reads first.

# ~/.bashrc may put another Python first on PATH, or source another workspace.
declare -A _ws_kept=()
for _ws_name in PATH PYTHONPATH LD_LIBRARY_PATH PKG_CONFIG_PATH CMAKE_PREFIX_PATH PYTHONNOUSERSITE \
    MPLCONFIGDIR VIRTUAL_ENV PYTHONHOME CARTPOLE_WS CARTPOLE_WITH "${!ROS@}"; do
    [[ -z ${!_ws_name+x} ]] || _ws_kept[$_ws_name]=${!_ws_name}
done
# shellcheck disable=SC1090
[[ ! -r ~/.bashrc ]] || source ~/.bashrc
for _ws_name in PYTHONHOME VIRTUAL_ENV "${!ROS@}"; do
    unset "$_ws_name"
done
for _ws_name in "${!_ws_kept[@]}"; do
    export "$_ws_name=${_ws_kept[$_ws_name]}"
done
unset _ws_name _ws_kept
hash -r

roscore() {  # as ws does
    command "$CARTPOLE_WS" roscore "$@"
}

gzserver() { rosrun gazebo_ros gzserver "$@"; }
gzclient() { rosrun gazebo_ros gzclient "$@"; }
if ! command -v check_urdf >/dev/null; then
    check_urdf() {
        echo "check_urdf: apt-get install liburdfdom-tools; spawn_model says, too, what is wrong with a URDF" >&2
        return 127
    }
fi

PS1="(cartpole) ${PS1-\$ }"

# roscd, rosls, rosed, ..., and the completion of all ROS commands. They leave out what lies below a
# hidden folder, as our packages do.
_ws_rosbash=/usr/share/bash-completion/completions/rosbash
if [[ -r $_ws_rosbash ]]; then
    # shellcheck disable=SC1090
    source <(sed -E 's@! -regex ("?\.\*/\[\.\][^ ]*)@! \\( -regex \1 ! -path "*/.ws/*" ! -path "*/.cache/*" \\)@g' "$_ws_rosbash")
fi
unset _ws_rosbash

_ws_complete() {
    local word=${COMP_WORDS[COMP_CWORD]} commands=(test check shell extras rviz foreign clean --with --help)
    COMPREPLY=()
    if [[ $COMP_CWORD -eq 1 ]]; then
        mapfile -t COMPREPLY < <(compgen -W "${commands[*]}" -- "$word"; compgen -c -- "$word")
    elif [[ ${COMP_WORDS[1]} == check ]]; then
        mapfile -t COMPREPLY < <(compgen -W "$CARTPOLE_WS_CHECKS" -- "$word")
    elif [[ ${COMP_WORDS[1]} == test && $word == -* ]]; then
        mapfile -t COMPREPLY < <(compgen -W "--fast" -- "$word")
    fi
}
complete -o default -F _ws_complete ws
