# shellcheck shell=bash
# Sourced by ws: the documentation as a site (mkdocs.yml).

# A page of the site has the place that it has in the repository, so the same links work in both.
PAGES=(README.md CONTRIBUTING.md CHANGELOG.md CITATION.cff docs examples)
# Pages and what is on each. Public names come from a module's __all__.
API=(
    "robot_envs robot_envs.vector robot_envs.variation.variation.Variation robot_envs.backends.backend.side_by_side
        robot_envs.backends.ros.session.RosSession"
    "robot_envs.testing"
    "rl_workbench rl_workbench.agents.dqn_agent.DQNAgent rl_workbench.agents.settings rl_workbench.tools.policies
        rl_workbench.tools.runs rl_workbench.training.demonstrations rl_workbench.training.options"
    "robot_sim"
    "bullet_gazebo.plugins.plugin_loader.PluginContext bullet_gazebo.plugins.sensor_topics.SensorPlugin"
    "ros_utils ros_utils.readiness ros_utils.ros_controllers ros_utils.ros_gazebo ros_utils.ros_launch
        ros_utils.ros_node ros_utils.ros_params ros_utils.ros_spawn ros_utils.ros_urdf ros_utils.simulation
        ros_utils.step_client ros_utils.testing ros_calls.service"
    "cartpole.environment cartpole.robot cartpole.tasks"
)

members() {  # name
    # A lazy package makes its __all__ as it runs, which mkdocstrings can't read.
    local file=$ROOT/src/${1//.//}/__init__.py
    [[ ! -f $file ]] || ! grep -q "= attach(" "$file" || PYTHONPATH=$ROOT/src "$VENV/bin/python3" -c '
import importlib, sys
print(f"    options:\n      members: {importlib.import_module(sys.argv[1]).__all__}")' "$1"
}

mkdocs() {  # command, argument...
    local source=$WS/docs/source
    rm -rf -- "$source"
    mkdir -p -- "$source/api"
    ln -s -- "${PAGES[@]/#/$ROOT/}" "$source/"
    local page on_page name
    for page in "${API[@]}"; do
        read -rd '' -a on_page <<<"$page" || true
        printf '# %s\n' "${on_page[0]}" >"$source/api/${on_page[0]}.md"
        for name in "${on_page[@]}"; do
            printf '\n::: %s\n%s\n' "$name" "$(members "$name")" >>"$source/api/${on_page[0]}.md"
        done
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
