#!/usr/bin/env python3
"""What the window costs: the tick rate with a page open against without, and the window's own process.

    ./ws python3 benchmark/window.py [--out FOLDER] [--seconds 3] [--pairs 6] [--connects 1000]

The page is a client of the window's server in a process of its own, which takes what a browser is sent and
draws nothing: as over SSH, where the browser has a machine of its own. Prints a table and writes window.json.
It starts simulators on masters of their own.
"""

import contextlib
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path

import msgspec
import reporting
import zstandard
from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest
from cartpole_world import CART, add_cartpole
from realtime import factor, processor_time, simulator_process
from websockets.sync.client import connect
from websockets.sync.connection import Connection

from ros_calls.service import ServiceClient
from ros_utils import ros_gazebo
from ros_utils.simulation import Simulation

WINDOW = "import sys; from bullet_gazebo.clients.gzclient import main; sys.exit(main())"
VIEWER = "import sys; sys.path.insert(0, {!r}); import window; window.view({!r})"
CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1.0, 0.0, 0.0, 0.0], "position": [3.0, 0.0, 1.0], "fov": 1.0,
    "near": 0.01, "far": 1000.0, "image_height": 600, "image_width": 800, "look_at": [0.0, 0.0, 0.0],
    "up_direction": [0.0, 0.0, 1.0],
}  # fmt: skip
TICKS = 8  # in a request
LINKS = 50
HEADER = 16  # [bytes] in front of what viser sends: its lengths
BOUND = 60.0  # [s]
MANY, THOUSANDS = 200, 300  # models
PART = 12  # [bytes] of a position
BOX = """<robot name="box"><link name="box"><inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><box size="0.2 0.2 0.2"/></geometry></visual></link>
<gazebo><static>true</static></gazebo></robot>"""
TARGETS = {
    "lock-step, with / without": ">= 0.97",
    "real time, with / without": ">= 0.97",
    "real-time factor with a page": "1 +- 0.002",
    "50 moving links: share of a core": "< 0.5",
    "50 moving links: frames a second": "30",
    "memory after all connects [MB]": "no growth",
    "memory after a tenth of them [MB]": "",
    "200 models: shown after [s]": "",
    "3,000 links: shown after [s]": "",
    "3,000 links: share of a core": "",
    "3,000 links: pictures a second": "30",
}


def open_page(address: str) -> Connection:
    """Connects as a browser does, and says where it looks from."""
    protocol = f"viser-v{version('viser')}"
    page = connect(address, subprotocols=[protocol], max_size=None)  # type: ignore[list-item]
    page.send(msgspec.msgpack.encode(CAMERA))
    return page


def told(page: Connection, timeout: float) -> bytes:
    """What the page is told next; empty where that is nothing within `timeout` [s]."""
    try:
        content = page.recv(timeout=timeout)
    except TimeoutError:
        return b""
    assert isinstance(content, bytes)
    length = int.from_bytes(content[8:HEADER], "little")
    return zstandard.ZstdDecompressor().decompress(content[HEADER : HEADER + length])


def wait_for_shapes(page: Connection, count: int) -> float:
    """Waits until a page has been told of so many shapes; returns how long it took [s]."""
    begin = time.perf_counter()
    shapes: dict[str, int] = {}
    while sum(shapes.values()) < count:
        assert time.perf_counter() - begin < BOUND, shapes
        content = told(page, 1.0)
        found = msgspec.msgpack.decode(content) if content else {"messages": ()}
        for message in found["messages"]:
            values = message.get("props") or message.get("updates") or {}
            if "batched_positions" in values:
                place = values["batched_positions"]["__binary_index"]
                shapes[message["name"]] = found["binaryBufferLengths"][place] // PART
    return time.perf_counter() - begin


def view(address: str) -> None:
    """Takes all that a page is sent, and tells once a second how often links have moved."""
    with open_page(address) as page:
        told(page, BOUND)
        begin, moves = time.monotonic(), 0
        print("open", flush=True)
        while True:
            moves += b"batched_wxyzs" in told(page, 1.0)
            if time.monotonic() - begin >= 1.0:
                print(moves, flush=True)
                begin, moves = time.monotonic(), 0


@contextlib.contextmanager
def window(simulation: Simulation) -> Iterator[tuple[int, str]]:
    """The window's process, and the address of its socket."""
    process = subprocess.Popen(
        [sys.executable, "-c", WINDOW, "--no-browser"], env=simulation.environment(),
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert process.stdout is not None
        line = next(line for line in process.stdout if "is the page" in line)
        yield process.pid, line.split()[-1].replace("http:", "ws:")
    finally:
        process.terminate()
        process.communicate()


@contextlib.contextmanager
def page(address: str) -> Iterator[Callable[[], int]]:
    """A page in a process of its own; what it yields returns how often links moved in the next second."""
    code = VIEWER.format(str(Path(__file__).parent), address)
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    try:
        stdout = process.stdout
        assert stdout is not None
        stdout.readline()  # it is open
        yield lambda: int(stdout.readline())
    finally:
        process.terminate()
        process.communicate()


def tick_rate(seconds: float) -> float:
    """Ticks a second of the cart-pole in lock-step, commanded every few of them."""
    step = ServiceClient("/gazebo/step_world", StepWorld, persistent=True)
    begin, ticks = time.perf_counter(), 0
    while time.perf_counter() - begin < seconds:
        target = 0.02 * (ticks // TICKS % 5)
        assert step(StepWorldRequest(ticks=TICKS, controllers=[CART], commands=[target])).success
        ticks += TICKS
    step.close()
    return ticks / (time.perf_counter() - begin)


def compare(measure: Callable[[], float], address: str, pairs: int) -> tuple[float, float]:
    """Returns the figure with a page over that without, taken in turns; and the one with it."""
    measure()
    without = alongside = 0.0
    for _ in range(pairs):
        without += measure()
        with page(address):
            alongside += measure()
    return alongside / without, alongside / pairs


def swinging(links: int = LINKS) -> str:
    """A robot of pendulums on a fixed beam."""
    inertial = (
        '<inertial><origin xyz="0 0 -0.3"/><mass value="1"/>'
        '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    parts = ['<link name="world"/>', f'<link name="beam">{inertial}</link>',
             '<joint name="fixed" type="fixed"><parent link="world"/><child link="beam"/>'
             '<origin xyz="0 0 2"/></joint>']  # fmt: skip
    for index in range(links):
        parts.append(
            f'<link name="l{index}">{inertial}<visual><origin xyz="0 0 -0.15"/><geometry>'
            f'<box size="0.02 0.02 0.3"/></geometry></visual></link>'
            f'<joint name="j{index}" type="continuous"><parent link="beam"/><child link="l{index}"/>'
            f'<origin xyz="0 {0.1 * index} 0"/><axis xyz="0 1 0"/></joint>'
        )
    return f'<robot name="swinging">{"".join(parts)}</robot>'


def memory(process: int) -> float:
    """Resident memory [MB]."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith("VmRSS")).split()[1]) / 1e3


def many_connects(process: int, address: str, count: int) -> tuple[float, float]:
    """The window's memory [MB] after a tenth of the connects, and after all."""
    first = 0.0
    for index in range(count):
        with open_page(address) as opened:
            told(opened, BOUND)
        if index == count // 10:
            first = memory(process)
    return first, memory(process)


def moving_links(results: dict[str, float], seconds: float, connects: int) -> None:
    with Simulation() as simulation, simulation.active(), window(simulation) as (process, address):
        assert ros_gazebo.gazebo_spawn_urdf_string(swinging(), model_name="swinging")[0]
        joints = [f"j{index}" for index in range(LINKS)]
        ros_gazebo.gazebo_set_model_configuration("swinging", joints, [1.0] * LINKS)
        with page(address) as moves:
            used, begin = processor_time(process), time.perf_counter()
            counts = [moves() for _ in range(max(1, round(3 * seconds)))]
            share = (processor_time(process) - used) / (time.perf_counter() - begin)
        results["50 moving links: share of a core"] = share
        results["50 moving links: frames a second"] = sum(counts) / len(counts)
        first, last = many_connects(process, address, connects)
        results["memory after a tenth of them [MB]"] = first
        results["memory after all connects [MB]"] = last


def many_models(results: dict[str, float]) -> None:
    with Simulation() as simulation, simulation.active(), window(simulation) as (_, address):
        for index in range(MANY):
            assert ros_gazebo.gazebo_spawn_urdf_string(
                BOX, model_name=f"box{index}", pos_x=float(index % 20), pos_y=float(index // 20)
            )[0]
        with open_page(address) as opened:
            results["200 models: shown after [s]"] = wait_for_shapes(opened, MANY)


def thousands_of_links(results: dict[str, float], seconds: float) -> None:
    """Robots of ten pendulums each, all of which swing; the simulator has a core of its own."""
    robot, joints = swinging(10), [f"j{index}" for index in range(10)]
    with Simulation() as simulation, simulation.active(), window(simulation) as (process, address):
        for index in range(THOUSANDS):
            name = f"robot{index}"
            assert ros_gazebo.gazebo_spawn_urdf_string(
                robot, model_name=name, pos_x=float(index % 20), pos_y=1.5 * (index // 20)
            )[0]
            ros_gazebo.gazebo_set_model_configuration(name, joints, [1.0] * 10)
        with open_page(address) as opened:
            results["3,000 links: shown after [s]"] = wait_for_shapes(opened, 10 * THOUSANDS)
        with page(address) as moves:
            used, begin = processor_time(process), time.perf_counter()
            counts = [moves() for _ in range(max(1, round(3 * seconds)))]
            share = (processor_time(process) - used) / (time.perf_counter() - begin)
        results["3,000 links: share of a core"] = share
        results["3,000 links: pictures a second"] = sum(counts) / len(counts)


def measure(seconds: float, pairs: int, connects: int) -> dict[str, float]:
    results: dict[str, float] = {}
    with Simulation(lockstep=True) as simulation, simulation.active():
        add_cartpole()
        with window(simulation) as (_, address):
            found = compare(lambda: tick_rate(seconds), address, pairs)
        results["lock-step, with / without"], results["lock-step, ticks a second with a page"] = found
    with Simulation() as simulation, simulation.active():
        add_cartpole()
        process = simulator_process(simulation)
        with window(simulation) as (_, address):
            found = compare(lambda: factor(seconds, process)[0], address, 2)
        results["real time, with / without"], results["real-time factor with a page"] = found
    moving_links(results, seconds, connects)
    many_models(results)
    thousands_of_links(results, seconds)
    return results


def main() -> None:
    options = reporting.options(__doc__ or "", seconds=3.0, pairs=6, connects=1000)
    results = measure(options.seconds, options.pairs, options.connects)
    print(f"{'':38} {'':>9} {'target':>12}")
    for name, value in results.items():
        print(f"{name:38} {value:9.3f} {TARGETS.get(name, ''):>12}")
    reporting.write(options.out, "window", results)


if __name__ == "__main__":
    main()
