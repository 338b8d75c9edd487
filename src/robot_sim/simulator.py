"""The clockwork: physics and control, tick by tick (docs/architecture.md, "One tick")."""

import contextlib
import threading
from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Any

from file_access.text import one_line
from robot_sim.applied_forces import AppliedForces
from robot_sim.constants import NANOSECONDS
from robot_sim.fingerprint import check_foreign, fingerprint, misfits
from robot_sim.grippers import PidFollower
from robot_sim.moves import Moves
from robot_sim.physics.engine import Twist
from robot_sim.physics.model import Model
from robot_sim.physics.pose import Pose
from robot_sim.physics.projection import place_link
from robot_sim.physics.world import World
from robot_sim.plain_data import resolve
from robot_sim.robot import ControlledRobot
from robot_sim.snapshot import Snapshot, SnapshotError
from robot_sim.state_dict import Shared, StateError, load, state_of, undoable
from robot_sim.timing import FairLock, Holds, Outbox, Pacer

STALL_CHECK = 100_000_000  # [ns]
IDLE_POLL = 0.2  # [s]; how soon an idle run() notices stop()


def _refusal(error: Exception) -> SnapshotError:
    return SnapshotError(one_line(f"the snapshot can't be restored: {error!s:.300}"))


class NotInLockstep(RuntimeError):
    """A client wants to step a world in real time."""


class Simulator(Shared):
    """Clockwork of a world and its robots; every access holds its lock.

    In real time `run` ticks, at most `max_update_rate` times a second of wall time. In lock-step only
    `advance` does.
    """

    def __init__(
        self, world: World, *, lockstep: bool = False, max_update_rate: float = 1000.0, relatch: bool = True
    ) -> None:
        """
        Args:
            lockstep: Whether only advance() moves time.
            max_update_rate: Ticks a second of wall time; 0 is as fast as possible.
            relatch: Whether controllers start over when a service moves joints or resets the world.
        """
        self.world = world
        self.lock = FairLock()
        self.lockstep = lockstep
        self.max_update_rate = max_update_rate
        self.relatch = relatch
        self.now = 0  # [ns] of simulated time
        world.clock = lambda: (self.now - self.began) / NANOSECONDS
        self.elapsed = 0  # [ns] of simulated time in all; no reset sets it back
        self.robots: list[ControlledRobot] = []
        self._robots_of: dict[Model, list[ControlledRobot]] = {}
        self._robots_version = 0
        self.applied = AppliedForces()
        # Called with `now` before each physics step, under the lock: topics, plugins and sensors.
        self.listeners: list[Callable[[int], None]] = []
        self.moves = Moves(world)
        self.parts: dict[str, Any] = {}  # by name; snapshots include their state
        self.restored: list[Callable[[], None]] = []  # called under the lock after a restore
        self.before_advance: list[Callable[[], None]] = []  # called under the lock
        self.resets = 0  # of the world or the simulation
        self.began = 0  # [ns]: when actors began
        self.reseeded: list[Callable[[int], None]] = []  # called under the lock with a new seed
        # Senders of messages after ticks, and whether callers that step the world run them.
        self.outboxes: list[Outbox] = []
        self.deliver_with_steps = False
        self._fits: dict[str, Any] = {}
        self._fits_version: tuple[object, ...] = ()
        self._period = round(world.time_step * NANOSECONDS)
        self.paused = False  # by `pause` and `unpause` alone
        self._flowing = threading.Event()  # set while time runs by itself
        self._stopping = threading.Event()
        self.holds = Holds(self.lock, self._update_flow)
        self._update_flow()

    @property
    def sim_time(self) -> float:
        """Simulated time [s]."""
        return self.now / NANOSECONDS

    @property
    def version(self) -> tuple[int, int, int]:
        """Changes whenever models, robots or controllers come or go. The caller holds the lock."""
        controllers = sum([robot.manager.version for robot in self.robots])
        return self.world.version, self._robots_version, controllers

    @property
    def outruns_the_clock(self) -> bool:
        """Whether ticks may come faster than real time: in lock-step, by step(), and beyond factor 1."""
        rate = self.max_update_rate
        return self.lockstep or self.paused or rate <= 0.0 or rate * self.world.time_step > 1.0001

    def pause(self) -> None:
        """Stops time; no step is in progress once this returns."""
        with self.lock:
            self.paused = True
            self._update_flow()

    def unpause(self) -> None:
        """Lets time run, unless it runs in lock-step."""
        with self.lock:
            self.paused = False
            self._update_flow()

    def run(self) -> None:
        """Lets time pass until stop(), in a thread of its own."""
        pacer = Pacer()
        while not self._stopping.is_set():
            if not self._flowing.is_set():
                self._flowing.wait(IDLE_POLL)
                pacer.restart()
                continue
            with self.lock:
                if self._flowing.is_set():
                    self._tick()
            self._keep_pace(pacer)

    def _keep_pace(self, pacer: Pacer) -> None:
        """Waits until the next tick is due, or a service changes the rate or stops time."""
        rate = self.max_update_rate
        due = pacer.wait(1.0 / rate if rate > 0.0 else 0.0, IDLE_POLL)
        while not due:
            due = pacer.wait_on(IDLE_POLL)
            if rate != self.max_update_rate or self._stopping.is_set() or not self._flowing.is_set():
                pacer.restart()
                return

    def stop(self) -> None:
        """Makes run() return after the tick in progress."""
        self._stopping.set()

    def advance(self, ticks: int, until: Callable[[], bool] | None = None) -> int:
        """Advances by `ticks` physics steps; ends early, after one at least, once `until` returns true.

        The caller holds the lock. Returns the number of ticks that have passed. Raises NotInLockstep if time
        runs by itself, ValueError for less than one tick.
        """
        if not self.lockstep:
            raise NotInLockstep("the world runs in real time; start it with lockstep:=true to step it")
        if ticks < 1:
            raise ValueError(f"ticks is {ticks}: at least 1 is needed")
        for prepare in self.before_advance:
            prepare()
        passed = 0
        for passed in range(1, ticks + 1):  # noqa: B007 - used behind the loop
            self._tick()
            if until is not None and until():
                break
        for robot in self.robots:
            robot.read_ahead()
        return passed

    def step(self, ticks: int) -> None:
        """Pauses the world and runs `ticks` physics steps, as fast as they can be computed.

        The lock is taken for each tick, so services are answered in between.
        """
        self.pause()
        for done in range(ticks):
            if self._stopping.is_set():
                return
            if done:
                self.lock.between()
            with self.lock:
                self.await_holds()
                self._tick()
        with self.lock:
            for robot in self.robots:
                robot.read_ahead()

    def await_holds(self) -> None:
        """Waits until nobody holds time, for a caller that steps the world; releases its lock meanwhile."""
        if self.holds:
            self.holds.await_end(self._stopping)

    def add_robot(self, robot: ControlledRobot) -> None:
        """Puts a robot under control; the caller holds the lock."""
        # Its controllers may start before time moves on.
        robot.joints_moved(self.now, relatch=False)
        self.robots.append(robot)
        self._robots_of.setdefault(robot.model, []).append(robot)
        self._robots_version += 1

    def remove_robot(self, robot: ControlledRobot) -> None:
        """Ends control of a robot; the caller holds the lock."""
        self.robots.remove(robot)
        same = self._robots_of[robot.model]
        same.remove(robot)
        if not same:
            del self._robots_of[robot.model]
        self._robots_version += 1

    def set_joint_states(
        self,
        model: Model,
        positions: Mapping[str, float],
        velocities: Mapping[str, float] = MappingProxyType({}),
    ) -> None:
        """Puts joints of `model` at `positions` [rad, m], with `velocities` [rad/s, m/s].

        What the joints carry is at rest, but for joints in `velocities`. The caller holds the lock.
        """
        model.set_joint_positions(positions)
        if velocities:
            model.set_joint_velocities(velocities)
        self._joints_moved(model)
        self.moves.tell([model])

    def place_model(self, model: Model, pose: Pose, twist: Twist) -> None:
        """Moves `model` rigidly, its joints at rest as in Gazebo; the caller holds the lock."""
        before = model.joint_states()
        model.place(pose, twist)
        model.rest_joints()
        if model.joint_states() != before:
            self._joints_moved(model)
        self.moves.tell([model])

    def place_link(self, model: Model, link: str, pose: Pose, twist: Twist) -> None:
        """Moves one link as close as its joints allow; the caller holds the lock."""
        before = model.joint_states()
        place_link(model, link, pose, twist)
        if model.joint_states() != before:
            self._joints_moved(model)
        self.moves.tell([model])

    def delete_model(self, model: Model) -> None:
        """Removes a model and whatever acts on it; the caller holds the lock."""
        self.applied.forget(model)
        self.world.delete(model.name)

    def set_time_step(self, time_step: float) -> None:
        """Sets the length of a tick [s], to the nanosecond; the caller holds the lock."""
        self._period = round(time_step * NANOSECONDS)
        self.world.set_time_step(time_step)
        for robot in self.robots:
            robot.review_gains()

    def reset_world(self) -> None:
        """Returns models to their initial poses, at rest; time and joint positions stay."""
        with self.lock:
            self.reset(everything=False)

    def reset_simulation(self) -> None:
        """Resets the world, and returns time and joint positions to zero."""
        with self.lock:
            self.reset(everything=True)

    def reset_time(self) -> None:
        """Sets the time to zero; models and controllers continue from where they are."""
        with self.lock:
            self.now = self.began = 0
            for robot in self.robots:
                robot.joints_moved(self.now, relatch=False)
            self.moves.tell(None)

    def save_state(self) -> Snapshot:
        """Returns everything that decides the future; the caller holds the lock.

        Raises StateError if the state of a user's controller or plugin can't be saved.
        """
        state = {
            "robots": [robot.state_dict() for robot in self._by_name],
            "parts": {name: state_of(part) for name, part in self.parts.items()},
            "applied": self.applied.state_dict(), "now": self.now, "began": self.began, "resets": self.resets,
            "world": self.world.state_dict(),
        }  # fmt: skip
        return Snapshot(self.fits, state)

    def restore_state(self, snapshot: Snapshot) -> None:
        """Returns to what `save_state` has returned: the same commands lead to the same bits.

        The caller holds the lock.

        Raises:
            SnapshotError: If engine, models, running controllers or properties aren't those of the
                snapshot, or a foreign one is wrong; nothing changes then.
            StateError: If a user's `load_state_dict` has raised; all else is restored then.
        """
        if snapshot.fits is not self.fits and (fault := misfits(snapshot.fits, self.fits)):
            raise SnapshotError(fault)
        if not snapshot.is_foreign:
            self._check(snapshot.state)
            try:
                self._load(snapshot.state)
            finally:
                self._tell_restored()
            return
        before = self.save_state().state
        try:
            state = resolve(snapshot.state)
            check_foreign(self._by_name, self.parts, before, state)
            self._check(state)
        except Exception as error:  # whatever a forged state raises
            raise _refusal(error) from error
        try:
            with undoable():
                self._load(state)
        except BaseException as error:  # Ctrl-C, too
            with contextlib.suppress(StateError):  # of a user's class
                self._load(before)
            if not isinstance(error, Exception):
                raise
            raise _refusal(error) from error
        self._tell_restored()

    @property
    def _by_name(self) -> list[ControlledRobot]:
        """The robots in an order that doesn't depend on when they came."""
        return sorted(self.robots, key=lambda robot: (robot.model.name, robot.namespace))

    def _check(self, state: Mapping[str, Any]) -> None:
        pushed = [(name, link) for name, link, *_ in state["applied"]["wrenches"]]
        self.world.check_state(state["world"], pushed)

    def _load(self, state: Mapping[str, Any]) -> None:
        self.world.load_state_dict(state["world"])
        self.now, self.began, self.resets = state["now"], state["began"], state["resets"]
        self.applied.load_state_dict(state["applied"], self.world.models)
        parts, faults = state["parts"], []
        # One after the other: "steps" may put other "readers" in the place of the present ones.
        there = ((self.parts[name], own) for name, own in parts.items() if name in self.parts)
        robots = zip(self._by_name, state["robots"], strict=True)
        for loads in (*(partial(robot.load_state_dict, own) for robot, own in robots), partial(load, there)):
            try:
                loads()
            except StateError as error:  # of a user's class; all else is restored
                faults.append(str(error))
        if faults:
            raise StateError("; ".join(faults))

    def _tell_restored(self) -> None:
        for robot in self.robots:
            robot.manager.restored()
        for listener in self.restored:
            listener()

    @property
    def fits(self) -> dict[str, Any]:
        """What a world must share to restore its snapshots. The caller holds the lock."""
        followers = {name: each for name, each in self.parts.items() if isinstance(each, PidFollower)}
        version = self.version, [robot.manager.running for robot in self.robots], [*followers]
        if self._fits_version != version:
            self._fits_version, self._fits = version, fingerprint(self.world, self._by_name, followers)
        return self._fits

    def reseed(self, seed: int) -> None:
        """Seeds everything that draws random numbers; the caller holds the lock."""
        for listener in self.reseeded:
            listener(seed)

    def _joints_moved(self, model: Model) -> None:
        for robot in self._robots_of.get(model, ()):
            robot.joints_moved(self.now, self.relatch)

    def reset(self, everything: bool) -> None:
        """Resets the world, or the simulation with `everything`; the caller holds the lock."""
        if everything:
            self.now = self.began = 0
        self.resets += 1
        self.world.reset(joints=everything)
        for robot in self.robots:
            robot.joints_moved(self.now, self.relatch)
        self.moves.tell(None)

    def _update_flow(self) -> None:
        if self.paused or self.lockstep or self.holds:
            self._flowing.clear()
        else:
            self._flowing.set()

    def _tick(self) -> None:
        """One physics step, in Gazebo's order: the state before the step carries the time after it."""
        self.now = now = self.now + self._period
        self.elapsed += self._period
        dt = self.world.time_step
        applied = self.applied
        if applied.efforts or applied.wrenches:
            applied.apply(now)
        for robot in self.robots:
            robot.update(now, dt)
        if now % STALL_CHECK < self._period:
            for robot in self.robots:
                robot.watch.report_stalls(now, self.world.contacts)
        for listener in self.listeners:
            listener(now)
        for robot in self.robots:
            robot.write(dt)
        self.world.step()
