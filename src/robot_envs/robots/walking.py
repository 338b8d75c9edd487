"""Walking at a commanded velocity, for robots with legs of any package."""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np

from robot_envs.errors import TaskError
from robot_envs.robot import Robot
from robot_envs.robots import actions, numbers
from robot_envs.robots.gait import Gait
from robot_envs.task import Task
from robot_envs.world_state import Commands, InitialState, Motion, Push, StateQuery, Twist, WorldState
from robot_sim.physics.pose import Pose, Vector, conjugate, from_rpy, rotate, to_rpy

DOWN = (0.0, 0.0, -1.0)
FALLEN = 0.5  # of the height at the start, and the cosine of the tilt: below, it has fallen
COMMANDS = 4  # of an episode
STANDING = 0.1  # share of commands that ask to stand still
UNASKED = 0.3  # share of the others' numbers that are 0
SHOVED = 0.1  # [s]
TRIM = np.array((0.3, 0.3, 0.5))  # [m/s, rad/s] that an action of 1 adds to the gait's velocity
LEAST = 0.1  # [m/s] or [rad/s]; below it a command asks to stand still


class WalkByCommand(Task):
    """A legged robot walks at a commanded velocity without falling.

    It observes what a robot can measure: its joints, an IMU, its last action and the command.
    `policy_node.py` takes them from /joint_states, the IMU's topic and /cmd_vel.

    ## Action space
    `Box(-1, 1, (3 + joints,))`: what the reference gait's velocity is more than the command, 0.3 m/s ahead,
    0.3 m/s to the left, 0.5 rad/s about; and the joints' set-points around that gait, `reach` [rad] either
    way. The gait's feet step in turn, on the spot or with a stride; see `robot_envs.robots.gait`.

    ## Observation space
    `Box((3 * joints + 14,))`

    | numbers | what they are | unit |
    |---|---|---|
    | 3 | direction of gravity, seen from the trunk | 1 |
    | 3 | angular velocity of the trunk | 4 rad/s |
    | 3 | the command: speed ahead, to the left, about | m/s, rad/s |
    | joints | positions relative to the stance | rad |
    | joints | velocities | 20 rad/s |
    | 3 + joints | the last action | 1 |
    | 2 | sine and cosine of the gait's phase; 0 while the command asks to stand | 1 |

    ## Rewards
    The sum of the terms below, each times its weight and the control period; `info["rewards"]` has them.

    | term | what it is | weight |
    |---|---|---|
    | `linear` | exp(-(error of the speeds ahead and to the left)² / 0.03 m²/s²) | 1.5 |
    | `angular` | exp(-(error of the speed about)² / 0.04 rad²/s²) | 1.5 |
    | `gait` | share of feet that touch the ground when their phase asks for it | 0.5 |
    | `vertical` | square of the trunk's vertical speed [m²/s²] | -1 |
    | `tilting` | square of the trunk's other angular velocities [rad²/s²] | -0.05 |
    | `orientation` | squared sine of the trunk's tilt | -2 |
    | `height` | square of the height's error, in units of that of the stance | -10 |
    | `smoothness` | mean square of the action's change | -0.3 |
    | `posture` | mean square of the action | -0.1 |
    | `fallen` | it has fallen; once | -5 |

    These speeds are averaged over the last period of the gait, exponentially: each step shakes the trunk.

    ## Start of an episode
    In the stance, up to `push` fast in any direction, heading anywhere; the command changes three times.

    ## End of an episode
    Terminated when it falls: the trunk is below half its height, or tilted by 60 degrees. Truncated after
    1000 steps.

    ## Info
    `command`, `velocity` (ahead, to the left, about), `is_success` (never fell so far), `rewards` of the
    last step.

    Args:
        robot: The robot, whose controllers hold joints at positions.
        stance: Positions of its joints [rad]; others are 0.
        height: Height of the model in the stance, its feet on the ground [m].
        imu: Its IMU; None: it has none, and the trunk's own motion takes its place, in simulation alone.
        feet: Links of its feet, in the order of their phases.
        phases: When each foot is put down, as a share of the gait's period.
        period: Period of the gait [s].
        lift: How high the reference gait's feet swing [m]; 0: actions are relative to the stance alone.
        reach: What an action of 1 moves a joint [rad]; by default so little that no actions make a
            quadruped fall.
        ahead: Range of commanded speeds ahead [m/s], the lower one at most 0.
        aside: Largest commanded speed to either side [m/s].
        about: Largest commanded angular speed [rad/s].
        push: Largest speed of the trunk at the start [m/s].
        shove: Largest force on the trunk [N], from any side for 0.1 s, once during each command.
        weights: Other weights of terms, by name.
    """

    non_persistent = ("robot", "feet", "gait", "weights")
    max_steps = 1000
    aims_at_velocity = True
    WEIGHTS: ClassVar[Mapping[str, float]] = {
        "linear": 1.5, "angular": 1.5, "gait": 0.5, "vertical": -1.0, "tilting": -0.05,
        "orientation": -2.0, "height": -10.0, "smoothness": -0.3, "posture": -0.1, "fallen": -5.0,
    }  # fmt: skip

    def __init__(
        self, robot: Robot, stance: Mapping[str, float], height: float, imu: str | None,
        feet: Sequence[str], phases: Sequence[float], period: float = 0.4, lift: float = 0.08,
        reach: float = 0.15, ahead: tuple[float, float] = (-0.5, 0.8), aside: float = 0.6,
        about: float = 1.0, push: float = 0.2, shove: float = 0.0,
        weights: Mapping[str, float] | None = None,
    ) -> None:  # fmt: skip
        unknown = set(weights or ()) - set(self.WEIGHTS)
        if unknown or len(feet) != len(phases):
            raise TaskError(
                f"weights has {', '.join(sorted(unknown))}; terms are {', '.join(self.WEIGHTS)}"
                if unknown
                else f"{len(feet)} feet have {len(phases)} phases"
            )
        self.robot, self.height, self.imu = robot, height, imu
        links, root = robot.links, robot.links.links[robot.links.root]
        com = root.inertia.com.position if root.inertia else (0.0, 0.0, 0.0)
        self.centre = links.root_pose.compose(Pose(com))  # of the trunk's mass
        self.stands = height + self.centre.position[2]  # [m], of it in the stance
        self.feet = tuple(feet)
        self.joints = tuple(joint for port in robot.ports for joint in port.joints)
        self.reach, self.ahead, self.aside, self.about, self.push = reach, ahead, aside, about, push
        self.shove = shove
        self.weights = {**self.WEIGHTS, **(weights or {})}
        self.middle = np.array([stance.get(each, 0.0) for each in self.joints])
        self.gait = Gait(links, self.joints, self.middle, feet, phases, period, lift)
        self.query = StateQuery(sensors=(imu,)) if imu else StateQuery(models=(robot.model,))
        self.reward_query = StateQuery(models=(robot.model,), contacts_of=self.feet)
        self.commands = np.zeros((COMMANDS, 3))
        self.rewarded: dict[str, float] = {}  # the terms of the last step
        self.pace = np.zeros(3)  # the velocity, averaged
        self.last = self.action = np.zeros(3 + len(self.joints))

    def action_space(self) -> gymnasium.spaces.Box:
        return actions(3 + len(self.joints))

    def observation_space(self) -> gymnasium.spaces.Box:
        return numbers(3 * len(self.joints) + 14)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        self.rewarded, self.pace = {}, np.zeros(3)
        asked = rng.uniform(-1.0, 1.0, (COMMANDS, 3))
        asked[rng.random((COMMANDS, 3)) < UNASKED] = 0.0
        # Not all at their most.
        asked /= np.maximum(1.0, np.linalg.norm(asked, axis=1, keepdims=True))
        most, least = ((each, self.aside, self.about) for each in (self.ahead[1], -self.ahead[0]))
        self.commands = asked * np.where(asked > 0.0, most, least)
        self.commands[rng.random(COMMANDS) < STANDING] = 0.0
        self.last = self.action = np.zeros(3 + len(self.joints))
        heading, way, fast = rng.uniform((-math.pi, -math.pi, 0.0), (math.pi, math.pi, self.push))
        x, y, _ = self.robot.pose.position
        pose = Pose((x, y, self.height + 0.01), from_rpy(0.0, 0.0, float(heading)))
        twist = Twist((float(fast * math.cos(way)), float(fast * math.sin(way)), 0.0))
        off = rng.uniform(-0.05, 0.05, len(self.joints))
        joints = dict(zip(self.joints, (self.middle + off).tolist(), strict=True))
        held = self._holding(self.middle)
        trunk = f"{self.robot.model}::{self.robot.links.root}"
        length = self.max_steps * self.robot.control_period / COMMANDS
        shoves = rng.uniform(0.0, (self.shove, math.tau, length), (COMMANDS, 3)).tolist()
        pushes = [
            Push(trunk, (force * math.cos(way), force * math.sin(way), 0.0), i * length + at, SHOVED)
            for i, (force, way, at) in enumerate(shoves)
            if force
        ]
        return InitialState(joints, {self.robot.model: Motion(pose, twist)}, held, pushes)

    def aim(self, goal: Sequence[float]) -> None:
        """Sets the command: ahead, to the left [m/s], about [rad/s]; raises ValueError for any other."""
        if len(goal) != 3 or not all(map(math.isfinite, goal)):
            raise ValueError(f"a command is (ahead, left, about) [m/s, rad/s], not {tuple(goal)}")
        low = (self.ahead[0], -self.aside, -self.about)
        self.commands[:] = np.clip(goal, low, (self.ahead[1], self.aside, self.about))

    def command(self, state: WorldState) -> np.ndarray:
        """Returns the command at a state: ahead, to the left [m/s], about [rad/s]."""
        length = self.max_steps * self.robot.control_period / COMMANDS
        return self.commands[min(int(state.time / length), COMMANDS - 1)]

    def phase(self, state: WorldState) -> float | None:
        """Returns the gait's phase in [0, 1); None while the command asks to stand."""
        if float(np.abs(self.command(state)).max()) < LEAST:
            return None
        return state.time / self.gait.period % 1.0

    def apply(self, action: np.ndarray, state: WorldState) -> Commands:
        self.last, self.action = self.action, action.astype(float)
        velocity = self.command(state) + TRIM * self.action[:3]
        reference = self.middle + self.gait.offsets(self.phase(state), velocity)
        return self._holding(reference + self.reach * self.action[3:])

    def _holding(self, positions: np.ndarray) -> dict[str, float | tuple[float, ...]]:
        """Returns the commands that hold joints at positions [rad]."""
        numbers, given = iter(positions.tolist()), {}
        for port in self.robot.ports:
            values = tuple(itertools.islice(numbers, len(port.joints)))
            given[port.name] = values[0] if port.single else values
        return given

    def observe(self, state: WorldState) -> np.ndarray:
        phase = self.phase(state)
        turn = 0.0 if phase is None else math.tau * phase
        clock = (0.0, 0.0) if phase is None else (math.sin(turn), math.cos(turn))
        joints = [state.joints[name] for name in self.joints]
        places = np.array([each.position for each in joints]) - self.middle
        speeds = np.array([each.velocity for each in joints]) / 20.0
        down, turning = self._balance(state)
        parts = (down, np.array(turning) / 4.0, self.command(state), places, speeds)
        return np.concatenate((*parts, self.action, clock)).astype(np.float32)

    def _balance(self, state: WorldState) -> tuple[Vector, Sequence[float]]:
        """Returns the direction of gravity and the angular velocity [rad/s], in the trunk's frame."""
        if self.imu is None:
            pose, twist = state.models[self.robot.model]
            into = conjugate(pose.orientation)
            return rotate(into, DOWN), rotate(into, twist.angular)
        seen = state.sensors[self.imu]
        x, y, z, w = seen.orientation.tolist()
        return rotate(conjugate((x, y, z, w)), DOWN), seen.angular_velocity

    def velocity(self, state: WorldState) -> Vector:
        """Returns the trunk's speed ahead and to the left [m/s], and about [rad/s]."""
        pose, twist = state.models[self.robot.model]
        yaw = to_rpy(pose.orientation)[2]
        ahead, left, _ = rotate(from_rpy(0.0, 0.0, -yaw), twist.linear)
        return ahead, left, twist.angular[2]

    def touching(self, state: WorldState) -> list[bool]:
        """Returns which feet touch something."""
        links = {name.rpartition("::")[0] for each in state.contacts for name in (each.first, each.second)}
        return [f"{self.robot.model}::{foot}" in links for foot in self.feet]

    def terms(self, state: WorldState, velocity: np.ndarray | Vector) -> dict[str, float]:
        """Returns the reward's terms, without weights, for an averaged velocity."""
        pose, twist = state.models[self.robot.model]
        ahead, left, about = velocity
        wanted, phase = self.command(state), self.phase(state)
        sway = rotate(conjugate(pose.orientation), DOWN)
        down = self.gait.on_ground(phase)
        return {
            "linear": math.exp(-((ahead - wanted[0]) ** 2 + (left - wanted[1]) ** 2) / 0.03),
            "angular": math.exp(-((about - wanted[2]) ** 2) / 0.04),
            "gait": float(np.mean(down == np.array(self.touching(state)))),
            "vertical": twist.linear[2] ** 2,
            "tilting": twist.angular[0] ** 2 + twist.angular[1] ** 2,
            "orientation": sway[0] ** 2 + sway[1] ** 2,
            "height": (pose.compose(self.centre).position[2] / self.stands - 1.0) ** 2,
            "smoothness": float(np.square(self.action - self.last).mean()),
            "posture": float(np.square(self.action).mean()),
            "fallen": float(self.is_terminal(state)) / self.robot.control_period,
        }

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        share = min(1.0, self.robot.control_period / self.gait.period)
        self.pace += share * (np.array(self.velocity(state)) - self.pace)
        self.rewarded = terms = self.terms(state, self.pace)
        total = math.fsum(self.weights[name] * terms[name] for name in terms)
        return total * self.robot.control_period

    def is_terminal(self, state: WorldState) -> bool:
        pose = state.models[self.robot.model].pose
        upright = -rotate(conjugate(pose.orientation), DOWN)[2]
        return pose.compose(self.centre).position[2] < FALLEN * self.stands or upright < FALLEN

    def info(self, state: WorldState) -> dict[str, Any]:
        return {
            "command": tuple(self.command(state).tolist()),
            "velocity": self.velocity(state),
            "is_success": not self.is_terminal(state),
            "rewards": dict(self.rewarded),
        }
