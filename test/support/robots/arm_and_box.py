"""A two-link arm beside a falling box, in an in-process world."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import yaml
from support.robots.worlds import add_robot, start

from robot_sim.physics.engine import Twist
from robot_sim.physics.engines import make_engine
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.physics.world import World, ground_plane
from robot_sim.simulator import Simulator
from robot_sim.state import LinkQuery, StateAnswer, StateQuery, StateReader

FILES = Path(__file__).resolve().parents[2] / "data" / "robots"
ARM = FILES / "two_link_arm.urdf"
ARM_PARAMETERS = FILES / "two_link_arm.yaml"
CONTROLLERS = ("shoulder_effort_controller", "elbow_effort_controller")
MASS = 2.0  # [kg] of the box
BOX = f"""<robot name="box"><link name="box">
<inertial><mass value="{MASS}"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision name="lower"><origin xyz="0 0 -0.05"/><geometry><box size="0.2 0.2 0.1"/></geometry></collision>
<collision name="upper"><origin xyz="0 0 0.05"/><geometry><box size="0.2 0.2 0.1"/></geometry></collision>
</link></robot>"""
START = {"shoulder": (-0.4, 0.5), "elbow": (0.7, 0.0)}  # position [rad] and velocity [rad/s]
DROPPED = Pose((-0.5, 0.1, 0.25), from_rpy(0.3, 0.1, 0.2))
THROWN: Twist = ((0.2, 0.0, -0.1), (0.0, 1.0, 0.3))
SEEN = StateQuery(
    models=("box",),
    links=(LinkQuery("tip"), LinkQuery("two_link_arm::tip", "upper"), LinkQuery("box", "fore")),
    contacts_of=("box",),
)
TICKS, STEPS = 8, 60


def commands(step: int) -> tuple[float, float]:
    """Efforts [N m] of the arm's motors in a step."""
    return 2.0 * math.sin(0.3 * step), math.cos(0.2 * step)


class ArmAndBox:
    """Ground, arm with its controllers, and box, as a simulator in lock-step."""

    def __init__(self, engine: str = "bullet") -> None:
        self.sim = Simulator(World(make_engine(engine)), lockstep=True)
        world = self.sim.world
        world.spawn("ground_plane", ground_plane(), Pose())
        self.robot = add_robot(self.sim, "two_link_arm", ARM.read_text())
        parameters = yaml.safe_load(ARM_PARAMETERS.read_text())
        start(self.robot, {name: parameters[name] for name in CONTROLLERS})
        self.controllers = [self.robot.manager.get(name) for name in CONTROLLERS]
        world.spawn("box", parse_urdf(BOX), Pose((1.0, 0.0, 0.1)))

    def reset(
        self, joints: Mapping[str, tuple[float, float]] = START, pose: Pose = DROPPED, twist: Twist = THROWN
    ) -> None:
        """Begins an episode."""
        self.sim.reset(everything=False)
        self.sim.place_model(self.sim.world.models["box"], pose, twist)
        places = {name: state[0] for name, state in joints.items()}
        speeds = {name: state[1] for name, state in joints.items()}
        self.sim.set_joint_states(self.robot.model, places, speeds)

    def act(self, efforts: Sequence[float], ticks: int = TICKS) -> None:
        """Commands the arm and lets time pass."""
        for controller, effort in zip(self.controllers, efforts, strict=True):
            controller.inputs[0].receive(effort)
        self.sim.advance(ticks)

    def read(self, query: StateQuery = SEEN) -> StateAnswer:
        """What is seen after a step."""
        return StateReader(self.sim.world, query).read()

    def episode(self) -> list[StateAnswer]:
        """What is seen after each step of an episode: the box falls, tips over, and comes to rest."""
        self.reset()
        reader = StateReader(self.sim.world, SEEN)
        seen = [reader.read(stepped=False)]
        for step in range(STEPS):
            self.act(commands(step))
            seen.append(reader.read())
        return seen

    def close(self) -> None:
        self.sim.world.close()
