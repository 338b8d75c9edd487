#!/usr/bin/env python3
"""What processes keep of models, robots and randomised episodes that come and go: nothing.

    ./ws extras python3 benchmark/memory.py [--out FOLDER] [--cycles 10000]

Takes the resident memory of each process after a tenth of the cycles and at their end; of this process
without what is merely free. Each path runs with both engines, in this process and over ROS. Prints a table,
writes memory.json, and ends with 1 if a process has grown by more than TARGET.
"""

import ctypes
import gc
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import gymnasium
import reporting
import rosgraph

import cartpole  # noqa: F401 - registers its environments
from robot_sim.physics.engines import make_engine
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import World, ground_plane
from ros_utils import ros_controllers, ros_gazebo, ros_params, ros_urdf
from ros_utils.simulation import Simulation

TARGET = 10_000_000  # [bytes] of growth
ENGINES = ("ode", "mujoco")
PAGE = os.sysconf("SC_PAGE_SIZE")
RANDOMISATION = {"mass": 0.3, "length": 0.3, "cart_friction": 1.0, "pole_friction": 0.01}
CONTROLLERS = ["joint_state_controller", "stand_cart_position_controller"]
LENGTHS = 100  # different ones of the cylinder
CYLINDER = """<robot name="m"><link name="a"><inertial><mass value="1"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><cylinder radius="0.1" length="{}"/></geometry></collision></link></robot>"""

Cycle = Callable[[int], object]
Growths = dict[str, int]


def resident(pid: int) -> int:
    """Resident memory of a process [bytes]."""
    if pid == os.getpid():
        gc.collect()
        ctypes.CDLL(None).malloc_trim(0)
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * PAGE


def growth(cycle: Cycle, cycles: int, processes: dict[str, int]) -> Growths:
    """What each process has grown by [bytes], from a tenth of `cycles` on."""
    before: Growths = {}
    for number in range(cycles):
        if number == cycles // 10:
            before = {name: resident(pid) for name, pid in processes.items()}
        cycle(number)
    return {name: resident(pid) - before[name] for name, pid in processes.items()}


def cylinder(number: int) -> str:
    return CYLINDER.format(0.5 + 0.001 * (number % LENGTHS))


def in_process(engine: str, cycles: int, urdf: str) -> Iterator[tuple[str, Growths]]:
    """Worlds and environments in this process."""
    here = {"this process": os.getpid()}
    world = World(make_engine(engine))
    world.spawn("ground_plane", ground_plane(), Pose())

    def come_and_go(description: Callable[[int], str]) -> Cycle:
        def cycle(number: int) -> None:
            world.spawn("m", parse_urdf(description(number)), Pose((0.0, 0.0, 1.0)))
            world.step()
            world.delete("m")

        return cycle

    yield "cylinder", growth(come_and_go(cylinder), cycles, here)
    yield "cart-pole", growth(come_and_go(lambda number: urdf), cycles, here)
    model = world.spawn("m", parse_urdf(urdf), Pose())
    link = model.link_names[-1]

    def change(number: int) -> None:
        old = model.description.links[link].inertia
        assert old is not None
        com = old.com._replace(position=(0.0, 0.0, 0.2 + 0.001 * (number % LENGTHS)))
        world.set_inertia(model, link, replace(old, com=com))
        world.step()

    yield "centre of mass", growth(change, cycles, here)
    world.close()
    env = gymnasium.make("cartpole/Balance-v0", engine=engine, randomisation=RANDOMISATION)
    yield "randomised episodes", growth(episode(env), cycles, here)
    env.close()
    envs = gymnasium.make_vec("cartpole/Balance-v0", 4, engine=engine, randomisation=RANDOMISATION, workers=0)
    yield "randomised episodes of 4", growth(episode(envs), cycles // 4, here)
    envs.close()


def episode(env: Any) -> Cycle:
    """A short one."""
    action = env.action_space.sample()

    def cycle(number: int) -> None:
        env.reset(seed=number)
        for _ in range(3):
            env.step(action)

    return cycle


def over_ros(master: rosgraph.Master, cycles: int, urdf: str) -> Iterator[tuple[str, Growths]]:
    """A simulator, and this process as its client."""
    processes = {
        "simulator": getpid(master.lookupNode("/gazebo")),
        "this process": os.getpid(),
        "master": master.getPid(),
    }

    def come_and_go(number: int) -> None:
        assert ros_gazebo.gazebo_spawn_urdf_string(cylinder(number), "m")
        assert ros_gazebo.gazebo_delete_model("m")

    yield "cylinder, over ROS", growth(come_and_go, cycles, processes)

    def control(number: int) -> None:
        assert ros_gazebo.gazebo_spawn_urdf_string(urdf, "m")
        assert ros_controllers.spawn_controllers_srv(CONTROLLERS)
        assert ros_gazebo.gazebo_delete_model("m")

    yield "robot and controllers, over ROS", growth(control, cycles // 5, processes)


def getpid(uri: str) -> int:
    answer: Any = ServerProxy(uri).getPid("/memory")
    return int(answer[2])


def measure(cycles: int) -> dict[str, Growths]:
    urdf = ros_urdf.urdf_parse_from_pkg("cartpole_gazebo", "cartpole_v1.urdf", "/robots") or ""
    found: dict[str, Growths] = {}
    for engine in ENGINES:
        for name, grown in in_process(engine, cycles, urdf):
            found[f"{engine}: {name}"] = tell(f"{engine}: {name}", grown)
        with Simulation(extra_gazebo_args=f"-e {engine}") as simulation, simulation.active():
            master = rosgraph.Master("/memory", master_uri=simulation.master_uri)
            master.setParam("/robot_description", urdf)
            ros_params.ros_load_yaml_from_pkg("cartpole_controller", "joint_position_control.yaml", "/")
            for name, grown in over_ros(master, cycles, urdf):
                found[f"{engine}: {name}"] = tell(f"{engine}: {name}", grown)
    return found


def tell(name: str, grown: Growths) -> Growths:
    for process, size in grown.items():
        print(f"{name:50} {process:14} {size / 1e6:8.1f}", flush=True)
    return grown


def main() -> int:
    options = reporting.options(__doc__ or "", cycles=10_000)
    print(f"{'growth [MB]':50} {'of':14} {'':>8} (target {TARGET / 1e6:g})")
    found = measure(options.cycles)
    reporting.write(options.out, "memory", {"cycles": options.cycles, "bytes": found})
    return int(max(size for grown in found.values() for size in grown.values()) > TARGET)


if __name__ == "__main__":
    sys.exit(main())
