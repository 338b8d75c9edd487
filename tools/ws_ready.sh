# shellcheck shell=bash
# Sourced by ws: makes steps (ws_steps.sh) that aren't ready, and says what it does meanwhile.

PERIOD=15  # [s] between two lines about a step that runs

# Of what a step depends on, in the order of files that is the same in every language.
hash_of() (  # step
    export LC_ALL=C
    "key_$1" | sha256sum | cut -d ' ' -f 1
)

is_ready() {  # step
    local stamp=$WS/stamp/$1
    [[ -f $stamp && $(<"$stamp") == "$(hash_of "$1")" ]]
}

are_ready() {  # step...
    local step
    for step in "$@"; do
        is_ready "$step" || return 1
    done
}

make_ready() {  # step...
    local step number=0 begin=$SECONDS todo=()
    are_ready "$@" && return 0
    hold_lock
    for step in "$@"; do  # another call may just have made them
        is_ready "$step" || todo+=("$step")
    done
    if [[ ${#todo[@]} -gt 0 ]]; then
        make_folders "$WS/stamp" "$WS/log"
        tell_plan "${todo[@]}"
        for step in "${todo[@]}"; do
            number=$((number + 1))
            make_step "$step" "[$number/${#todo[@]}] ${TITLE[$step]}"
        done
        say "ready after $(duration $((SECONDS - begin)))$(next_thing)"
    fi
    drop_lock
}

tell_plan() {  # step...
    local step number=0 size
    say "this has to be made ready once, in $WS; later calls start at once:"
    for step in "$@"; do
        number=$((number + 1))
        size=$("plan_$step") || true
        say "[$number/$#] ${TITLE[$step]}${size:+: $size}"
    done
}

make_step() {  # step, title
    local log=$WS/log/$1.log begin=$SECONDS watcher status
    rm -f -- "$WS/stamp/$1"
    { : >"$log"; } 2>/dev/null || fail "can't write $log$(space_left "$WS")"
    say "$2 ... (log: $log)"
    watch_step "$log" "$begin" {LOCK}>&- &
    watcher=$!
    # shellcheck disable=SC2064  # this watcher
    trap "kill $watcher 2>/dev/null" EXIT
    # The lock is the step's, too: pip or catkin_make may outlive a ws that is killed. The status is
    # asked for afterwards, because `set -e` is off in a function that is tested with ||.
    set +e
    (set -e; "make_$1") >"$log" 2>&1
    status=$?
    kill "$watcher" 2>/dev/null
    wait "$watcher" 2>/dev/null
    trap - EXIT
    [[ $status -ne 0 ]] || { hash_of "$1" >"$WS/stamp/$1"; } 2>/dev/null || status=$?
    set -e
    [[ $status -eq 0 ]] || tell_failure "$1" "$2" "$status" "$((SECONDS - begin))"
    say "$2: done in $(duration $((SECONDS - begin)))"
}

tell_failure() {  # step, title, exit code, seconds
    local log=$WS/log/$1.log
    if [[ $1 == build || $1 == companions ]]; then  # compilers and CMake say it in several lines
        say "the last lines of $log:"
        tail -n 15 -- "$log" | sed 's/^/    /' >&2
    fi
    say "$2: failed after $(duration "$4") (exit code $3): $(reason_in "$log")$(space_left "$WS")"
    say "what to do: ${REMEDY[$1]}; then call ws again, which continues from here (log: $log)"
    exit 1
}

# Its last line that looks like a reason, or else its last one.
reason_in() {  # log
    grep -aE '^(E:|ERROR:|CMake Error)|[Ee]rror:' -- "$1" | tail -n 1 | grep . ||
        tail -n 1 -- "$1" | grep . || echo "it said nothing"
}

# Tells now and then how far a step is, until it is killed or ws is gone. That pip leaves Debian's NumPy
# where it is ("Can't uninstall 'numpy'") is no matter.
watch_step() {  # log, begin
    local last
    # Reading from a pipe into which no one writes waits without a process of its own.
    exec {silence}<> <(:)
    while ! read -rt "$PERIOD" -u "$silence" && kill -0 $$ 2>/dev/null; do
        last=$(tail -c 2000 -- "$1" | tr '\r' '\n' | grep -a '[[:alnum:]]' | grep -Eav 'uninstall|existing installation' | tail -n 1 | cut -c 1-100) || true
        last=${last#"${last%%[![:space:]]*}"}
        say "    $(duration $((SECONDS - $2))): ${last:-nothing said so far}"
    done
}

duration() {  # seconds
    if [[ $1 -lt 120 ]]; then echo "$1 s"; else echo "$(($1 / 60)) min $(($1 % 60)) s"; fi
}
