"""Backend for a simulator over ROS that moves in lock-step."""

import contextlib
import secrets
import weakref
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from bullet_gazebo_msgs.msg import SensorReading
from bullet_gazebo_msgs.srv import (
    RestoreState,
    RestoreStateRequest,
    SaveState,
    SaveStateRequest,
    StepWorld,
    StepWorldRequest,
)
from geometry_msgs.msg import Point, Quaternion, Vector3
from geometry_msgs.msg import Pose as PoseMsg
from geometry_msgs.msg import Twist as TwistMsg

from bullet_gazebo.common.messages import from_contact_state
from robot_envs.backends.backend import RobotBackend
from robot_envs.backends.ros.bringup import full_name, ready
from robot_envs.backends.ros.properties import RosVariation
from robot_envs.backends.ros.running import (
    STEP_SERVICE,
    JointStateReader,
    RunningSimulator,
    SharedWorld,
    SimulatorService,
    check_success,
)
from robot_envs.backends.world_files import loose_joints
from robot_envs.errors import RestoreRefused, SimulatorError
from robot_envs.scene import Scene
from robot_envs.snapshot import WorldSnapshot, whole_of
from robot_envs.variation import Variation
from robot_envs.world_state import (
    Commands,
    InitialState,
    LinkQuery,
    Links,
    Models,
    Motion,
    Reading,
    Sensors,
    StateQuery,
    Twist,
    WorldState,
    link_keys,
)
from robot_sim.physics.pose import Pose
from robot_sim.snapshot import Snapshot
from ros_calls.service import TIMEOUT
from ros_utils.step_client import MOTION, PreparedSteps, StepAnswer, StepNames, StepRefused, time_of


@dataclass(eq=False)
class KeptSnapshot:
    """A snapshot that the simulator keeps under a name."""

    of: "LockstepWorld"
    name: str
    begun: int  # [ns], of the episode
    held: dict[str, Any]  # what controllers were commanded

    def whole(self) -> Snapshot:
        """See `WorldSnapshot.whole`."""
        return self.of.read(self)


class LockstepWorld(RobotBackend):
    """One service call for each action: command, advance, read; time stands still between.

    `begin` sends the request, `act` takes the answer; so several simulators move at the same time. `timeout`
    is the wall time [s] that an answer may take, on top of 10 ms for each tick.
    """

    deterministic = complete = shared = True

    def __init__(self, scene: Scene, ticks: int, world: SharedWorld, timeout: float = TIMEOUT) -> None:
        self.scene, self._ticks, self._world = scene, ticks, world
        self._simulator = RunningSimulator()
        self._reset = SimulatorService(
            STEP_SERVICE, StepWorld, persistent=True, timeout=timeout + time_of(ticks)
        )
        self._steps = PreparedSteps(STEP_SERVICE, timeout, SimulatorService)
        self._save = SimulatorService("/gazebo/save_state", SaveState, persistent=True)
        self._restore = SimulatorService("/gazebo/restore_state", RestoreState, persistent=True)
        self._kept: set[str] = set()  # names of snapshots that the simulator keeps
        self._dropped: list[str] = []  # of them, those that nobody has any more
        moved = ((robot.model, name) for robot, name in scene.moved.values())
        loose = loose_joints(scene.robots[0].world, scene.objects)
        self._moved = [f"{model}::{name}" for model, name in (*moved, *loose)]
        self._at_rest = [(0.0, 0.0)] * len(loose)
        self._full = {name: full_name(robot, port.name) for name, (robot, port) in scene.ports.items()}
        self._read = JointStateReader(scene)
        self._query = StateQuery()
        self._names = StepNames()  # of the query, without controllers
        self._begun = 0  # simulated time at the reset [ns]
        self._held: dict[str, Any] = {}
        self._is_pending = False  # whether a step was begun
        self._answer: StepAnswer | None = None  # to it, if it was taken before `act`
        self._variation = RosVariation(scene, timeout)
        world.join(self)

    def look(self, query: StateQuery) -> None:
        link_keys(query)
        with self._simulator:
            its_turn = self._world.claim_if_free(self)
        names = _names(query)
        if query != StateQuery() and its_turn:  # otherwise the reset reports unknown names
            self._take()
            self._look(names)
        self._query, self._names = query, names

    def reset(self, initial: InitialState, seed: int = 0) -> WorldState:
        """See `RobotBackend.reset`; the state asked for is the state reached, exactly."""
        joints = [*self.scene.placed_joints(initial).values(), *self._at_rest]
        self._drop()
        request = StepWorldRequest(reset=StepWorldRequest.WORLD, joints=self._moved, seed=seed)
        request.positions = [position for position, _ in joints]
        request.velocities = [velocity for _, velocity in joints]
        placed = self.scene.placed_models(initial)
        request.models = list(placed)
        for (place, turn), (line, spin) in placed.values():
            request.poses.append(PoseMsg(Point(*place), Quaternion(*turn)))
            request.twists.append(TwistMsg(Vector3(*line), Vector3(*spin)))
        with self._simulator:
            self._world.claim(self)
        answer = self._call(self._reset, request)
        if not answer.success:
            raise self._refusal(answer.status_message)
        begun = self._look(self._names)
        self._begun = begun.now
        self._variation.push(initial.pushes, self._begun)
        state = self._state(begun)
        self._held = self.scene.starting_commands(state.joints)
        return state._replace(commands=self._held)

    def begin(self, commands: Commands) -> None:
        self._world.check_holder(self)
        numbers: list[float] = []
        for command in commands.values():
            if isinstance(command, float):
                numbers.append(command)
            else:
                numbers += command
        names = self._names._replace(controllers=tuple([self._full[name] for name in commands]))
        self._send(names, self._ticks, numbers)
        self._is_pending = True

    def act(self, commands: Commands) -> WorldState:
        if not self._is_pending:
            self.begin(commands)
        answer = self._answer or self._receive()
        self._is_pending, self._answer = False, None
        self._held = {**self._held, **commands}
        return self._state(answer)

    def _state(self, answer: StepAnswer) -> WorldState:
        numbers, count = answer.numbers, len(answer.joints)
        joints = self._read.read(
            answer.joints, numbers[:count], numbers[count : 2 * count], numbers[2 * count : 3 * count]
        )
        time = (answer.now - self._begun) / 1e9  # [s]
        if len(numbers) == 3 * count and not answer.contacts and not answer.sensors:
            return WorldState(time, joints, self._held)
        motions = list(_motions_of(numbers[3 * count :]))
        models = len(answer.models)
        return WorldState(
            time,
            joints,
            self._held,
            Links(zip(link_keys(self._query), motions[models:], strict=True)),
            Models(zip(answer.models, motions[:models], strict=True)),
            [from_contact_state(each) for each in answer.contacts],
            Sensors(
                (name, self._reading(each))
                for name, each in zip(self._query.sensors, answer.sensors, strict=True)
            ),
        )

    def _reading(self, found: SensorReading) -> Reading:
        values: dict[str, Any] = {
            each.name: np.frombuffer(each.data, each.type).reshape(each.shape) for each in found.values
        } or {"contacts": [from_contact_state(each) for each in found.contacts]}
        return Reading((found.now - self._begun) / 1e9, values)

    def _send(self, names: StepNames, ticks: int, commands: Sequence[float]) -> None:
        self._call(self._steps.begin, names, ticks, commands)

    def _receive(self) -> StepAnswer:
        begun, self._is_pending = self._is_pending, False  # nothing is under way after a failure
        answer: StepAnswer = self._call(self._steps.end)
        self._is_pending = begun
        return answer

    def _call(self, call: Callable[..., Any], *arguments: Any) -> Any:
        try:
            with self._simulator:
                return call(*arguments)
        except StepRefused as error:
            raise self._refusal(str(error)) from error
        except SimulatorError:
            self._hang_up()  # all were to the same simulator
            raise

    def _hang_up(self) -> None:
        for each in (self._reset, self._steps, self._save, self._restore):
            each.close()

    def _look(self, names: StepNames) -> StepAnswer:
        """Reads the world; no time passes."""
        self._send(names, 0, ())
        return self._receive()

    def _refusal(self, fault: str) -> SimulatorError:
        with self._simulator:
            return SimulatorError(f"{STEP_SERVICE}: {ready(self.scene).missing() or fault}")

    def _take(self) -> None:
        """Takes the answer to a step that was begun, so that others can be sent; `act` finds it."""
        if self._is_pending and self._answer is None:
            self._answer = self._receive()

    def _drop(self) -> None:
        """Takes the answer to a step that was begun, and forgets it."""
        with contextlib.suppress(SimulatorError):
            self._take()
        self._is_pending, self._answer = False, None

    def vary(self, variation: Variation) -> None:
        self._drop()
        with self._simulator:
            self._world.claim(self)  # undoes what others have varied, before this one varies
        self._variation(variation)

    def restore(self) -> None:
        """See `SharedBackend.restore`."""
        self._drop()  # before the next one's reset: the simulator takes requests as they come
        self._variation.undo()

    def save_state(self) -> KeptSnapshot:
        """See `RobotBackend.save_state`; the simulator keeps it until nobody has it any more."""
        self._world.check_holder(self)
        kept = KeptSnapshot(self, secrets.token_hex(8), self._begun, self._held)
        self._save_and_forget(kept.name, list(self._dropped))
        self._kept.add(kept.name)
        weakref.finalize(kept, self._dropped.append, kept.name).atexit = False
        return kept

    def _save_and_forget(self, name: str, forgotten: Sequence[str]) -> None:
        self._succeed(self._save, SaveStateRequest(name, forgotten, ""))
        self._kept.difference_update(forgotten)
        del self._dropped[: len(forgotten)]

    def read(self, kept: KeptSnapshot) -> Snapshot:
        """Returns a snapshot that the simulator keeps."""
        answer = self._succeed(self._save, SaveStateRequest(read=kept.name))
        whole = Snapshot.from_bytes(answer.data)
        whole.state["episode"] = {"begun": kept.begun, "held": kept.held}
        return whole

    def restore_state(self, state: WorldSnapshot, seed: int = 0) -> str:
        """See `RobotBackend.restore_state`; another simulator's goes there as bytes."""
        self._drop()
        if isinstance(state, KeptSnapshot) and state.of is self:
            self._world.check_holder(self)
            fault = self._restored(RestoreStateRequest(name=state.name, seed=seed))
            begun, held = state.begun, state.held
        else:
            whole, begun, held = whole_of(state, self.scene.ports, self._query.sensors)
            with self._simulator:
                self._world.claim(self)
            self._look(self._names)  # sensors that states have are read from now on
            fault = self._restored(RestoreStateRequest(data=whole.to_bytes(), seed=seed))
            wrenches = whole.state["applied"]["wrenches"]
            self._variation.pushed.update(f"{model}::{link}" for model, link, *_ in wrenches)
        self._begun, self._held = begun, held
        return fault

    def _restored(self, request: RestoreStateRequest) -> str:
        answer = self._call(self._restore, request)
        if not answer.restored:
            raise RestoreRefused(f"{self._restore.name}: {answer.status_message}")
        return "" if answer.success else answer.status_message

    def begin_at(self, state: WorldSnapshot, seed: int = 0) -> WorldState:
        if fault := self.restore_state(state, seed):
            raise SimulatorError(fault)
        begun = self._look(self._names)
        self._begun = begun.now
        return self._state(begun)

    def _succeed(self, call: SimulatorService, request: Any) -> Any:
        answer = self._call(call, request)
        check_success(answer, call.name)
        return answer

    def poses(self, links: Sequence[str]) -> list[Pose]:
        """See `RobotBackend.poses`; one call, however many there are."""
        self._take()
        answer = self._look(_names(StateQuery(links=tuple(map(LinkQuery, links)))))
        return [pose for pose, _ in _motions_of(answer.numbers[3 * len(answer.joints) :])]

    def close(self) -> None:
        """Closes the connection to the simulator; robots and objects are as they were found."""
        self._drop()
        with contextlib.suppress(SimulatorError):  # one that is gone keeps none
            if self._kept:
                self._save_and_forget("", list(self._kept))
        self._hang_up()
        self._variation.undo()
        with contextlib.suppress(SimulatorError):  # one that is gone has no objects any more
            self._world.leave(self)

    def disconnect(self) -> None:
        """Closes connections alone, where the simulator has ended, or will, with all that is in it."""
        self._hang_up()
        self._variation.disconnect()


def _names(query: StateQuery) -> StepNames:
    return StepNames(
        all_models=query.all_models,
        models=tuple(query.models),
        links=tuple([each.link for each in query.links]),
        frames=tuple([each.frame for each in query.links]),
        all_contacts=query.all_contacts,
        contacts_of=tuple(query.contacts_of),
        sensors=tuple(query.sensors),
    )


def _motions_of(numbers: Sequence[float]) -> Iterator[Motion]:
    """Reads links and models from the numbers of a prepared step."""
    for i in range(0, len(numbers), MOTION):
        x, y, z, qx, qy, qz, qw, vx, vy, vz, wx, wy, wz = numbers[i : i + MOTION]
        yield Motion(Pose((x, y, z), (qx, qy, qz, qw)), Twist((vx, vy, vz), (wx, wy, wz)))
