# shellcheck shell=bash
# Sourced by ws: the user's own folders, of --with, CARTPOLE_WITH and ROS_PACKAGE_PATH.

WITH=()  # folders that the user named
declare -A THEIRS=()  # of each path variable, what their packages and modules need

add_folder() {  # option or variable, folder
    [[ -n $2 ]] || fail_usage "$1 needs a folder"
    [[ -d $2 ]] || fail_usage "$1: there is no folder '$2'"
    [[ ! $2 -ef / ]] || fail_usage "$1: '$2' is the whole disk; name the folder of your packages"
    [[ -r $2 && -x $2 ]] || fail_usage "$1: the folder '$2' can't be read"
    WITH+=("$2")
}

add_folders_of_the_environment() {
    local folder folders
    IFS=: read -ra folders <<<"${CARTPOLE_WITH-}"
    for folder in "${folders[@]}"; do
        [[ -z $folder ]] || add_folder CARTPOLE_WITH "$folder"
    done
}

# Looks through the folders, and builds what has to be built.
make_theirs_ready() {  # ROS_PACKAGE_PATH
    [[ ${#WITH[@]} -gt 0 || -n $1 ]] || return 0
    local lines line hint=''
    is_ready foreign || hint="./ws foreign installs what is common ($(size_of foreign.txt))"
    # The lists of the stamps tell whether what their packages are built on has changed.
    local call=(env "PYTHONPATH=$ROOT" "$SYSTEM_PYTHON" -P -m tools.user_packages
        --root "$CHECKOUT" --place "$STATE/with" --python "$VENV/bin/python3"
        --prefixes "${CALLER[CMAKE_PREFIX_PATH]:+${CALLER[CMAKE_PREFIX_PATH]}:}$WS/devel:$COMPANIONS/devel"
        --state "$(cat -- "$WS/stamp/companions" "$WS/stamp/build")" --hint "$hint" --also "$1")
    # In a workspace that can't be written no step is made; building theirs says what is missing.
    if [[ $STATE == "$WS" && -n $(debian_missing compiler.txt) ]] && "${call[@]}" --ask -- "${WITH[@]}"; then
        make_ready compiler
    fi
    lines=$("${call[@]}" -- "${WITH[@]}") || exit
    while IFS= read -r line; do
        [[ -z $line ]] || THEIRS[${line%%=*}]=${line#*=}
    done <<<"$lines"
}

# In front of all but Python's modules: those of this checkout would otherwise not be its own.
enter_theirs() {
    [[ -n ${THEIRS[CMAKE_PREFIX_PATH]-} ]] || return 0
    local variable
    for variable in CMAKE_PREFIX_PATH ROS_PACKAGE_PATH LD_LIBRARY_PATH; do
        local -n path=$variable
        export "$variable=${THEIRS[$variable]}${path:+:$path}"
    done
    export PYTHONPATH="$WS/devel/lib/python3/dist-packages:${THEIRS[PYTHONPATH]}:${PYTHONPATH#"$WS/devel/lib/python3/dist-packages":}"
    export CARTPOLE_WITH=${THEIRS[CARTPOLE_WITH]}
}
