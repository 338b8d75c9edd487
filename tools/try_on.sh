#!/usr/bin/env bash
# Makes a root of another Debian, clones this checkout into it, and runs the README's two commands there:
#
#     tools/try_on.sh [--container] [--base FOLDER] [--keep] SUITE [ARG...]     e.g. trixie --fast
#
# ARGs go to `ws test`. --container prepares the root as the Containerfile does, and runs the commands as its
# user. --base copies a root that debootstrap has made, with the packages in its cache;
# --keep leaves the root.
# It needs root and debootstrap. What it mounts lies in the new root, and no other process sees it.
set -euo pipefail
CHECKOUT=$(dirname -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")")
EPISODES=40

say() { printf '== %s\n' "$*"; }

make_root() {
    if [[ -n $BASE ]]; then
        cp --archive -- "$BASE/." "$PLACE"
    else
        debootstrap --variant=minbase "$SUITE" "$PLACE" >"$PLACE.log"
    fi
    cp -- /etc/resolv.conf /etc/hosts "$PLACE/etc/"
    # Of the machine only how it reaches the network; its bundle lies where ca-certificates doesn't write.
    if [[ -n ${PIP_CERT-} ]]; then cp -L -- "$PIP_CERT" "$PLACE/etc/pip.crt"; fi
    inside "apt-get update" >"$PLACE.log"
    inside "apt-get install --yes --no-install-recommends git ca-certificates" >>"$PLACE.log"
}

inside() {  # command
    local settings=(HOME=/root LANG=C.UTF-8 PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin
        DEBIAN_FRONTEND=noninteractive)
    local name
    [[ -z ${PIP_CERT-} ]] || settings+=(PIP_CERT=/etc/pip.crt)
    for name in PIP_INDEX_URL PIP_DEFAULT_TIMEOUT http_proxy https_proxy no_proxy CARTPOLE_TORCH OMP_NUM_THREADS; do
        [[ -z ${!name-} ]] || settings+=("$name=${!name}")
    done
    # The mounts end with the last process of this namespace. Its first one has to reap orphans: bash does.
    # shellcheck disable=SC2016
    unshare --mount --pid --fork --kill-child --propagation private bash -euc '
        mount -t proc proc "$1/proc"
        mount -t tmpfs -o mode=1777 tmpfs "$1/dev/shm"
        mount -t devpts -o newinstance,ptmxmode=0666,mode=620 devpts "$1/dev/pts"
        chroot "$@"
        exit' bash "$PLACE" /usr/bin/env -i "${settings[@]}" bash -euo pipefail -c "$1" </dev/null
}

size() { du --summarize --block-size=1MB --one-file-system -- "$PLACE" | cut -f 1; }

timed() {  # title, command
    local begin=$SECONDS status=0
    say "$1: $2"
    inside "$2" || status=$?
    say "$1: exit code $status after $((SECONDS - begin)) s; the root has $(size) MB"
    return "$status"
}

fetched_by_pip() {  # checkout
    inside "cat $1/.ws/log/*.log" | awk '
        /^ *Downloading .*\([0-9.]+ [kMG]?B\)/ {
            gsub(/[()]/, ""); factor = $NF == "GB" ? 1000 : $NF == "kB" ? 0.001 : 1; sum += $(NF - 1) * factor
        }
        END { printf "%.0f", sum }'
}

as_readme() {
    local failed=0 place=/opt/cartpole set_up="./ws true" as_user=""
    if [[ -n $CONTAINER ]]; then
        set_up=tools/container.sh as_user="runuser --user cartpole -- env HOME=/home/cartpole"
    fi
    git clone --quiet -- "$CHECKOUT" "$PLACE$place"
    chown --recursive root:root "$PLACE$place"
    timed set-up "cd $place && $set_up"
    say "pip has fetched $(fetched_by_pip "$place") MB; ws has named what apt fetches"
    timed train "cd /tmp && $as_user $place/ws rosrun cartpole pg_train.py --episodes $EPISODES --run-dir /tmp/runs/try" ||
        failed=1
    timed test "cd $place && $as_user ./ws test ${*@Q}" || failed=1
    return "$failed"
}

BASE="" KEEP="" CONTAINER=""
while [[ ${1-} == --* ]]; do
    case $1 in
        --base) BASE=${2:?a folder}; shift ;;
        --container) CONTAINER=yes ;;
        --keep) KEEP=yes ;;
        *) echo "try_on.sh: unknown option $1" >&2; exit 2 ;;
    esac
    shift
done
SUITE=${1:?"usage: try_on.sh [--container] [--base FOLDER] [--keep] SUITE [ARG...]"}
shift
[[ $EUID -eq 0 ]] || { echo "try_on.sh: needs root" >&2; exit 1; }

PLACE=$(mktemp --directory "/var/tmp/try-$SUITE.XXXXXX")
chmod 755 "$PLACE"
take_away() {
    [[ -z $KEEP ]] || { say "left in $PLACE"; return; }
    rm --recursive --force --one-file-system -- "$PLACE" "$PLACE.log"
}
trap take_away EXIT
say "a root of $SUITE in $PLACE"
make_root
say "it has $(size) MB"
as_readme "$@"
