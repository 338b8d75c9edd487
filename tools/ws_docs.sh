# shellcheck shell=bash
# Sourced by ws: the documentation as a site (mkdocs.yml).

# A page of the site has the place that it has in the repository, so the same links work in both.
PAGES=(README.md CONTRIBUTING.md CHANGELOG.md CITATION.cff docs examples)
# Public names come from a module's __all__.
API=(robot_envs robot_envs.testing rl_workbench bullet_gazebo ros_utils)

mkdocs() {  # command, argument...
    local module source=$WS/docs/source
    rm -rf -- "$source"
    mkdir -p -- "$source/api"
    ln -s -- "${PAGES[@]/#/$ROOT/}" "$source/"
    for module in "${API[@]}"; do
        printf '# %s\n\n::: %s\n' "$module" "$module" >"$source/api/$module.md"
    done
    cd -- "$ROOT" || return
    CARTPOLE_DOCS=$source NO_MKDOCS_2_WARNING=true "$VENV/bin/python3" -m mkdocs "$1" --strict --quiet "${@:2}"
}

docs() {  # [folder]
    local folder
    if [[ $# -gt 0 ]]; then
        folder=$(realpath -- "$1")
        mkdocs build --site-dir "$folder"
        echo "the site is in $folder"
    else
        echo "serving the documentation on http://127.0.0.1:8000; Ctrl-C ends it"
        mkdocs serve --dev-addr 127.0.0.1:8000
    fi
}
