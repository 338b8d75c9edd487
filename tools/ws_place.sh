# shellcheck shell=bash
# Sourced by ws: where what ws makes lies, and whose turn it is to make something.
#
# WS holds what is built: .ws in the checkout, or, where that can't be written, a folder of this
# checkout's own in CARTPOLE_WS_DIR or the user's cache. STATE is what commands write to: the same
# folder, unless a workspace that is ready lies where it can't be written.

say() { echo "ws: $*" >&2; }

fail() {  # text...
    say "$*"
    exit 1
}

# shellcheck disable=SC2034  # all are for the other files
set_place() {  # folder
    WS=$1
    STATE=$1
    VENV=$WS/venv
    COMPANIONS=$WS/companions
}

can_write() {  # folder, which need not be there yet
    local folder=$1
    while [[ ! -e $folder ]]; do folder=$(dirname -- "$folder"); done
    [[ -d $folder && -w $folder ]]
}

# CMake builds where the link leads to, whatever its name, and takes these signs for its own.
can_build_in() {  # folder
    [[ $1 != *[$'\n\\;#"\'`']* ]]
}

choose_place() {  # step...: those that have to be ready
    local cache=${XDG_CACHE_HOME:-${HOME:+$HOME/.cache}} elsewhere hint
    set_place "$ROOT/.ws"
    if [[ -n ${CARTPOLE_WS_DIR-} ]]; then
        elsewhere=$CARTPOLE_WS_DIR/$CHECKSUM
    elif can_build_in "$CHECKOUT" && can_write "$WS"; then
        return 0
    else
        elsewhere=${cache:+$cache/cartpole/$CHECKSUM}
    fi
    hint="set CARTPOLE_WS_DIR to a folder that can, with its path from / on and without blanks"
    if [[ $elsewhere != /* ]] || ! is_plain "$elsewhere" || ! can_write "$elsewhere"; then
        fail "nothing can be made in $WS${elsewhere:+ or $elsewhere}; $hint"
    fi
    if [[ -z ${CARTPOLE_WS_DIR-} && $# -gt 0 ]] && are_ready "$@"; then
        # shellcheck disable=SC2034
        STATE=$elsewhere
    else
        set_place "$elsewhere"
    fi
}

make_folders() {  # folder...
    local reason
    reason=$(mkdir -p -- "$@" 2>&1) || fail "${reason#mkdir: }$(space_left "$(dirname -- "$1")")"
}

# A hint where the disk is full; ROS, pip and CMake don't always say so.
space_left() {  # folder
    local megabytes
    megabytes=$(df --output=avail --block-size=M -- "$1" 2>/dev/null | tail -n 1 | tr -dc 0-9)
    if [[ ${megabytes:-1000} -lt 100 ]]; then
        echo "; its disk has $megabytes MB left"
    fi
}

LOCK=
hold_lock() {
    [[ -z $LOCK ]] || return 0
    make_folders "$WS"
    { exec {LOCK}>"$WS/lock"; } 2>/dev/null || fail "can't write $WS/lock$(space_left "$WS")"
    if ! flock --nonblock "$LOCK"; then
        say "waiting for another ws that makes this workspace ready"
        flock "$LOCK"
    fi
}

drop_lock() {
    [[ -z $LOCK ]] || exec {LOCK}>&-
    LOCK=
}
