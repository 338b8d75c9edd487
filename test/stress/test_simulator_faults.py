"""A simulator is stopped, its clock jumps, it runs out of files, memory or disk: it serves again."""

import contextlib
import os
import random
import resource
import signal
import socket
import threading
import time
from pathlib import Path

import pytest
from gazebo_msgs.srv import GetModelState
from support.stress.connections import SERVICE
from support.stress.disks import can_mount, small_disk
from support.stress.places import BOUND, ended, launch, place, send, waits
from support.stress.robots import random_robot
from support.stress.scenario import Scenario
from support.stress.worlds import World, world

from cartpole.robot import ROBOT
from robot_envs.backends.ros.bringup import bring_up
from robot_envs.scene import Scene
from ros_calls.service import ServiceClient, ServiceFailed, ServiceHangs
from ros_utils.step_client import StepClient

CLOCK = Path(__file__).resolve().parents[1] / "support/stress/jumping_clock"
CART = "stand_cart_position_controller"
STEPS = 100  # of an episode
CROWD = 40  # connections
ROOM = 30 << 20  # [bytes]
full = pytest.mark.stress(full=True)
ENGINES = [
    pytest.param("ode", marks=full),
    pytest.param("mujoco", marks=[full, pytest.mark.extras("mujoco")]),
]


def episode(client: StepClient, commands: list[float]) -> list[tuple[float, ...]]:
    """The joints' positions and velocities in an episode with these commands."""
    answers = [client.reset({"stand_cart": 0.0, "cart_pole": 0.1}, seed=1, everything=True)]
    answers += [client.step(2, {CART: command}) for command in commands]
    return [(*a.joint_states.position, *a.joint_states.velocity) for a in answers]


@pytest.mark.parametrize("engine", ENGINES)
def test_stopped_while_a_client_steps(scenario: Scenario, engine: str) -> None:
    """A client waits for it, or is told within its time limit; the episode is the same bits."""
    with world(engine, "lockstep:=true") as here, here.active():
        bring_up(Scene([ROBOT]), lambda text: None)
        client, hasty = StepClient(timeout=BOUND), StepClient(timeout=0.2)

        def case(number: int, dice: random.Random) -> None:
            commands = [dice.uniform(-0.1, 0.1) for _ in range(STEPS)]
            undisturbed = episode(client, commands)
            stops = [dice.uniform(0.0, 0.1) for _ in range(5)]

            def stop() -> None:
                for moment in stops:
                    time.sleep(moment)
                    send(here.pid, signal.SIGSTOP, random.Random(moment))

            stopper = threading.Thread(target=stop)
            stopper.start()
            try:
                while stopper.is_alive():
                    assert episode(client, commands) == undisturbed
            finally:
                stopper.join()
            os.kill(here.pid, signal.SIGSTOP)
            try:
                with pytest.raises(ServiceHangs):
                    episode(hasty, commands)
            finally:
                os.kill(here.pid, signal.SIGCONT)
            # What the hasty one has asked for may still be carried out, once, in between.
            assert any(episode(client, commands) == undisturbed for _ in range(3))

        scenario.run(f"SIGSTOP while a client steps: {engine}", 12, case, unit=6)
        for each in (client, hasty):
            each.close()


@full
def test_a_clock_that_jumps(scenario: Scenario) -> None:
    """For a simulator and a training over ROS: simulated time goes on, and nothing ends."""

    def case(number: int, dice: random.Random) -> None:
        with place() as here:
            here.environment["PYTHONPATH"] = f"{CLOCK}:{here.environment['PYTHONPATH']}"
            here.environment["STRESS_CLOCK"] = str(dice.random())
            training = here.train("--episodes=3", "--backend=ros")
            assert training.end(BOUND) == 0, training.output
            assert "Traceback" not in training.output
            launched = launch(here)
            made = World(here, launched)
            made.wait()
            for _ in range(20):
                made.check_time()
            made.check()
            launched.interrupt()
            ended(launched, here)

    scenario.run("clocks that jump by hours", 6, case)


@contextlib.contextmanager
def limited(here: World, kind: int, most: int):
    """A block in which the simulator has no more than that of a resource."""
    before = resource.prlimit(here.pid, kind)
    resource.prlimit(here.pid, kind, (most, before[1]))
    try:
        yield
    finally:
        with contextlib.suppress(ProcessLookupError):  # it has ended
            resource.prlimit(here.pid, kind, before)


@pytest.mark.parametrize("engine", ENGINES)
def test_no_more_files(scenario: Scenario, engine: str) -> None:
    """A crowd takes the last file descriptors: who comes is served once it has gone."""
    with world(engine) as here, here.active():
        places = here.doors()

        def case(number: int, dice: random.Random) -> None:
            room = here.usage().files + dice.randrange(10)
            with limited(here, resource.RLIMIT_NOFILE, room), contextlib.ExitStack() as held:
                for _ in range(CROWD):
                    client = held.enter_context(socket.socket())
                    client.settimeout(1.0)
                    with contextlib.suppress(OSError):
                        client.connect(dice.choice(places))
                        client.sendall(b"\x10")
                hasty = ServiceClient(SERVICE, GetModelState, timeout=1.0)
                with contextlib.suppress(ServiceFailed):  # it may be one of the crowd
                    assert hasty("ground_plane", "").success
            here.check_time()

        scenario.run(f"no more file descriptors: {engine}", 20, case)


@full
def test_no_more_memory(scenario: Scenario) -> None:
    """Spawning robots until there is none: refused, or it ends and says so, never silence."""
    ended = [0]

    def case(number: int, dice: random.Random) -> None:
        with world("ode", complains=True) as here:
            size = int(Path(f"/proc/{here.pid}/statm").read_text().split()[0])
            most = size * resource.getpagesize() + dice.randrange(ROOM)
            with limited(here, resource.RLIMIT_AS, most):
                for robot in range(60):
                    try:
                        if not here.spawn(f"robot_{robot}", random_robot(dice)).success:
                            break
                    except ServiceFailed as fault:
                        assert not isinstance(fault, ServiceHangs), fault
                        break
            try:
                for name in here.models():
                    if name != "ground_plane":
                        assert here.delete(name).success
                here.check_time()
            except ServiceFailed as fault:
                assert waits(lambda: not here.is_alive()), f"{fault}, and the node lives on"
                ended[0] += 1

    row = scenario.run("no more memory for a simulator", 10, case)
    row.notes.append(f"{ended[0]} ended and said so")


@full
def test_full_disks(scenario: Scenario, tmp_path: Path) -> None:
    """Of temporary files and logs: what is asked for is done, or refused in words."""
    if not can_mount(tmp_path / "probe"):
        pytest.skip("only root makes file systems")

    def case(number: int, dice: random.Random) -> None:
        with (
            small_disk(tmp_path / str(number), dice.choice([1 << 20, 1 << 17])) as disk,
            world("ode", folder=disk.folder) as here,
        ):
            filler = disk.folder / "filler"
            with contextlib.suppress(OSError), filler.open("wb") as file:
                while True:
                    file.write(bytes(4096))
                    file.flush()
            for robot in range(5):
                answer = here.spawn(f"robot_{robot}", random_robot(dice))
                assert answer.success or answer.status_message
            filler.unlink()
            disk.grow(1 << 24)
            here.check_time()
            assert here.spawn("last", random_robot(dice)).success

    scenario.run("full disk of a simulator's files", 8, case)
