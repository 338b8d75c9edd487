#!/usr/bin/env python3
"""How fast scripts for robots on wheels run under lockstep.py: simulated by wall time.

    ./ws python3 benchmark/scripts_on_wheels.py [--out FOLDER] [--rounds 3] [--episodes 10] [--steps 60]

Runs three scripts of test/data/scripts and one of on_wheels that know a laser (360 rays at 5 Hz) or a cloud
(16 x 360 rays at 10 Hz), unchanged, each in a world of its own; wait_for_scan.py has five helper nodes.
Prints a table of all rounds and writes scripts_on_wheels.json. A script says by itself how fast it was, from
its first episode to its last one.
"""

import os
import re
import signal
import subprocess
from pathlib import Path

import reporting

from ros_calls import master
from ros_calls.waiting import wait_until
from ros_utils import ros_gazebo
from ros_utils.simulation import reserved_port

HERE = Path(__file__).resolve().parent
SCRIPTS = HERE.parent / "test/data/scripts"
TARGETS = {"goal_model": ">= 8", "state_topic": ">= 8", "newest_cloud": ">= 4",
           "wait_for_scan": ">= 10"}  # fmt: skip
BOUND = 600.0  # [s]


def times_real_time(name: str, *arguments: object) -> float:
    """Runs a script in lock-step; returns simulated by wall time."""
    port = str(reserved_port())
    uri = f"http://127.0.0.1:{port}"
    environment = {**os.environ, "ROS_MASTER_URI": uri, "GZSERVER_ARGS": "--lockstep --seed 0"}
    helped = name == "wait_for_scan"
    script = (HERE / "on_wheels" if helped else SCRIPTS) / f"{name}.py"
    command = ["rosrun", "cartpole", "lockstep.py", "--seed", "0", str(script)]
    if name == "state_topic":  # starts its world by itself
        environment.update(ROS_MASTER_URI=f"http://127.0.0.1:{reserved_port()}", GZSERVER_ARGS="")
        return _run([*command, port, *map(str, arguments)], environment)
    file = script.with_name("helped.launch") if helped else SCRIPTS / "scout.launch"
    launch = subprocess.Popen(
        ["roslaunch", "-p", port, str(file)],
        env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        with master.using(uri):
            wait_until(master.is_up, BOUND, "the master")
            wait_until(lambda: "scout" in ros_gazebo.gazebo_get_model_names(), BOUND, "the scout")
        return _run([*command, *map(str, arguments)], environment)
    finally:
        launch.send_signal(signal.SIGINT)
        launch.wait(BOUND)


def _run(command: list[str], environment: dict[str, str]) -> float:
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=BOUND, check=True)
    found = re.search(r"times real time (\S+)", done.stderr)
    assert found, done.stderr
    return float(found[1])


def main() -> None:
    assert __doc__ is not None
    chosen = reporting.options(__doc__, rounds=3, episodes=10, steps=60)
    results = {}
    print("| script | times real time | wanted |\n|---|---|---|")
    for name, target in TARGETS.items():
        runs = [times_real_time(name, chosen.episodes, chosen.steps) for _ in range(chosen.rounds)]
        results[name] = runs
        print(f"| {name}.py | {', '.join(f'{each:.1f}' for each in runs)} | {target} |", flush=True)
    reporting.write(chosen.out, "scripts_on_wheels", results)


if __name__ == "__main__":
    main()
