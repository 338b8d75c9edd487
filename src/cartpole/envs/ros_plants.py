"""The robot in a simulator reached over ROS: in lock-step, or in real time."""

import math
import threading
import time
from collections.abc import Sequence

import genpy
import rospy
from gazebo_msgs.srv import SetModelConfiguration
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Empty

from cartpole.envs.plant import ticks_per_action
from cartpole.envs.robot_names import CART_JOINT, CONTROLLER, DESCRIPTION, MODEL, POLE_JOINT
from cartpole.envs.ros_service import ServiceClient
from cartpole.envs.ros_variation import RosVariation
from cartpole.envs.variation import Variation
from cartpole.errors import SimulatorError
from cartpole.task import CartPoleState

STEP_SERVICE = "/gazebo/step_world"
STATE_TIMEOUT = 5.0  # [s] of wall time without a joint state
RESET_WAIT = 0.5  # [s] of wall time for the joint state that a reset publishes
_SAME = 1e-6  # [m], [rad]
_EARLY = 1e-6  # [s]; of rounding


def read_state(message: JointState) -> CartPoleState:
    """The two joints of a joint-state message.

    Raises:
        SimulatorError: if a joint is missing or a value isn't finite.
    """
    try:
        cart, pole = message.name.index(CART_JOINT), message.name.index(POLE_JOINT)
        state = CartPoleState(
            message.position[cart],
            message.velocity[cart],
            message.position[pole],
            message.velocity[pole],
        )
    except (ValueError, IndexError):
        raise SimulatorError(
            f"the joint state lacks {CART_JOINT} or {POLE_JOINT}; it has: {list(message.name)}"
        ) from None
    if not math.isfinite(sum(state)):
        raise SimulatorError(f"the joint state isn't finite: {state}")
    return state


class _Resetter:
    """Puts the robot's joints in place through Gazebo's own services."""

    def __init__(self) -> None:
        self._reset_world = ServiceClient("/gazebo/reset_world", Empty)
        self._set_joints = ServiceClient("/gazebo/set_model_configuration", SetModelConfiguration)

    def __call__(self, state: CartPoleState) -> None:
        self._reset_world()
        positions = [state.cart_position, state.pole_angle]
        answer = self._set_joints(MODEL, DESCRIPTION, [CART_JOINT, POLE_JOINT], positions)
        if not answer.success:
            raise SimulatorError(f"the robot can't be reset: {answer.status_message}")


class LockstepPlant:
    """One service call for each action: command, advance, read; time stands still between.

    Args:
        ticks: physics steps of one action.
    """

    deterministic = shared = True

    def __init__(self, ticks: int | None = None) -> None:
        from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest

        from ros_utils.step_client import time_of

        self._step = ServiceClient(STEP_SERVICE, StepWorld, persistent=True)
        self._begin = StepWorldRequest(
            reset=StepWorldRequest.WORLD, joints=[CART_JOINT, POLE_JOINT]
        )
        self._advance = StepWorldRequest(
            ticks=ticks or ticks_per_action(), controllers=[CONTROLLER]
        )
        self._step.timeout += time_of(self._advance.ticks)
        self._variation = RosVariation()

    def reset(self, state: CartPoleState) -> CartPoleState:
        """See `Plant.reset`; the state asked for is the state reached, exactly."""
        self._begin.positions = [state.cart_position, state.pole_angle]
        self._begin.velocities = [state.cart_velocity, state.pole_velocity]
        return self._call(self._begin)

    def act(self, set_point: float) -> CartPoleState:
        """See `Plant.act`.

        Raises:
            SimulatorError: if the step is refused or the simulator doesn't answer.
        """
        self._advance.commands = [set_point]
        return self._call(self._advance)

    def _call(self, request: genpy.Message) -> CartPoleState:
        answer = self._step(request)
        if not answer.success:
            raise SimulatorError(f"{STEP_SERVICE}: {answer.status_message}")
        return read_state(answer.joint_states)

    def vary(self, variation: Variation) -> None:
        """See `Plant.vary`."""
        self._variation(variation)

    def close(self) -> None:
        """Closes the connection to the simulator; the robot is as it was found."""
        self._step.close()
        self._variation.undo()


class RealtimePlant:
    """As the existing script does it, with nothing but Gazebo's services and topics.

    An action unpauses the world, publishes the set-point, and takes the newest joint state; so
    how much simulated time it gets depends on the machine.

    Args:
        control_period: simulated time [s] from one joint state to the next one that is taken;
            None takes the newest one without waiting for another one.
    """

    deterministic, shared = False, True

    def __init__(self, control_period: float | None = None) -> None:
        self._period = control_period
        self._variation = RosVariation()
        self._reset = _Resetter()
        self._pause = ServiceClient("/gazebo/pause_physics", Empty)
        self._unpause = ServiceClient("/gazebo/unpause_physics", Empty)
        self._command = _offer_command()
        self._newest: tuple[JointState, float] | None = None  # with its wall time [s]
        self._arrived = threading.Condition()
        self._subscriber = rospy.Subscriber(
            "/joint_states", JointState, self._receive, queue_size=1, tcp_nodelay=True
        )

    def _receive(self, message: JointState) -> None:
        # joint_state_publisher's messages are all zero and carry no velocities.
        if message.velocity:
            with self._arrived:
                self._newest = (message, time.monotonic())
                self._arrived.notify_all()

    def reset(self, state: CartPoleState) -> CartPoleState:
        """See `Plant.reset`; leaves the world paused.

        Waits for the joint state that the reset publishes. A simulator that is silent while
        paused is believed to have done what it said.
        """
        self._wait_for_command_link()
        self._pause()
        self._reset(state)
        self._wait_for((state.cart_position, state.pole_angle))
        return state._replace(cart_velocity=0.0, pole_velocity=0.0)

    def _wait_for(self, positions: Sequence[float]) -> None:
        with self._arrived:
            if not self._arrived.wait_for(lambda: self._is_at(positions), RESET_WAIT):
                self._newest = None

    def _is_at(self, positions: Sequence[float]) -> bool:
        if self._newest is None:
            return False
        state = read_state(self._newest[0])
        distance = max(
            abs(state.cart_position - positions[0]), abs(state.pole_angle - positions[1])
        )
        return distance < _SAME

    def act(self, set_point: float) -> CartPoleState:
        """See `Plant.act`.

        Raises:
            SimulatorError: if joint states stop coming or the simulator doesn't answer.
        """
        self._unpause()
        with self._arrived:
            due = self._due()
        self._command.publish(set_point)
        with self._arrived:
            return read_state(self._wait_until(due))

    def _wait_until(self, due: float | None) -> JointState:
        """A long control period takes its time, as long as joint states come."""
        while True:
            there = self._arrived.wait_for(lambda: self._is_there(due), STATE_TIMEOUT)
            newest = self._newest
            if newest is None or time.monotonic() - newest[1] > STATE_TIMEOUT:
                raise SimulatorError(
                    f"no joint state on /joint_states for {STATE_TIMEOUT:g} s; is the world running "
                    "and joint_state_controller started?"
                )
            if there:
                return newest[0]

    def _due(self) -> float | None:
        """Simulated time [s] of the joint state to wait for; None: any will do."""
        if self._period is None or self._newest is None:
            return None
        return self._newest[0].header.stamp.to_sec() + self._period

    def _is_there(self, due: float | None) -> bool:
        if self._newest is None:
            return False
        return due is None or self._newest[0].header.stamp.to_sec() > due - _EARLY

    def _wait_for_command_link(self) -> None:
        """Offers the topic anew halfway.

        A listener that asks for it between one environment's end and the next one's beginning, in the
        same process, is turned away, and rospy doesn't ask again.
        """
        if self._is_linked(STATE_TIMEOUT / 2):
            return
        self._command.unregister()
        self._command = _offer_command()
        if not self._is_linked(STATE_TIMEOUT / 2):
            raise SimulatorError(
                f"nobody listens on {self._command.resolved_name}; is {CONTROLLER} started?"
            )

    def _is_linked(self, bound: float) -> bool:
        """Whether somebody listens to the commands, at the latest after that time [s]."""
        deadline = time.monotonic() + bound
        while self._command.get_num_connections() == 0:
            if time.monotonic() > deadline:
                return False
            time.sleep(0.01)
        return True

    def vary(self, variation: Variation) -> None:
        """See `Plant.vary`."""
        self._variation(variation)

    def close(self) -> None:
        """Leaves the topics; the world stays as it is, the robot as it was found."""
        self._subscriber.unregister()
        self._command.unregister()
        self._variation.undo()


def _offer_command() -> rospy.Publisher:
    return rospy.Publisher(f"/{CONTROLLER}/command", Float64, queue_size=1)
