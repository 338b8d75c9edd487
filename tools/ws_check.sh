# shellcheck shell=bash
# Sourced by ws: what `ws check` looks at.
#
# A check NAME has a function check_NAME and a title; all of them run, also after one that failed.

CHECKS=(lint format imports types shell catkin dead_code links site)
declare -A CHECK_TITLE=(
    [lint]="ruff check"
    [format]="ruff format --check"
    [imports]="lint-imports"
    [types]="mypy"
    [shell]="shellcheck"
    [catkin]="catkin_lint"
    [dead_code]="vulture"
    [links]="links and paths in the documentation"
    [site]="mkdocs build --strict"
)

check_lint() { "$VENV/bin/ruff" check .; }
check_format() { "$VENV/bin/ruff" format --check .; }
check_imports() { PYTHONPATH=src "$VENV/bin/lint-imports" --no-cache; }  # devel space hides packages
check_types() { "$VENV/bin/mypy"; }
check_shell() { /usr/bin/shellcheck --external-sources ws .ci/run tools/*.sh; }
check_catkin() { /usr/bin/catkin_lint --quiet --offline --ignore env_var --strict -W2 "$WS/src" "$COMPANIONS/src"; }
check_dead_code() { "$VENV/bin/vulture"; }
check_site() { mkdocs build --site-dir "$WS/docs/site"; }
check_links() { "$VENV/bin/python3" tools/check_links.py; }

look_for_checks() {  # [check...]
    local name
    for name in "$@"; do
        [[ -n ${CHECK_TITLE[$name]-} ]] ||
            fail_usage "there is no check '$name', only ${CHECKS[*]}"
    done
}

check() {  # [check...]
    local name failed=()
    [[ $# -gt 0 ]] || set -- "${CHECKS[@]}"
    cd -- "$ROOT" || return
    for name in "$@"; do
        echo "== $name: ${CHECK_TITLE[$name]}"
        "check_$name" || failed+=("$name")
    done
    if [[ ${#failed[@]} -gt 0 ]]; then
        echo "ws check: failed: ${failed[*]}"
        return 1
    fi
    echo "ws check: passed: $*"
}
