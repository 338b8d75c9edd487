"""Discovery, start and end of the plugins that a model file names by their shared libraries.

A user's plugin is registered by a parameter (docs/plugins.md). Its exceptions are caught wherever it is
called, SystemExit and KeyboardInterrupt included: a Ctrl-C raises nothing in this process
(common/node_process.py).
"""

import importlib
import pkgutil
import re
import threading
import traceback
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Protocol

import rospy
from bullet_gazebo_msgs.msg import SceneSensor

from bullet_gazebo.common.messages import to_pose_msg
from bullet_gazebo.common.publishing import Thinner
from robot_sim.physics.description import CONTROL_PLUGIN, DescriptionError, Plugin, Sensor, library_of
from robot_sim.physics.model import Model
from robot_sim.physics.pose import Pose
from robot_sim.sensors.rendering import CameraRenderer
from robot_sim.sensors.schedule import SensorClock
from robot_sim.sensors.sensing import Mount, Sensing
from robot_sim.simulator import Simulator

CONTROL = re.compile("plugin .*(control|drive|steer|planar_move|hw_sim)", re.IGNORECASE)
PARAMETER = "~plugins"  # users' plugins: library: "module:Factory"
LOADING_PATIENCE = 10.0  # [s of wall time]
# The same in lock-step: a step in the middle of a spawn can't be repeated, and a script waits 30 s for one.
LOCKSTEP_LOADING_PATIENCE = 25.0
Update = Callable[[int], None]


@dataclass(frozen=True)
class PluginContext(Mount):
    """What a plugin gets: its element in the file, its model, and the namespace to work in.

    Publish fast topics as a `ThinnedTopic` of `thinner`, measurements by a clock of `sensing`.

    Attributes:
        namespace: Its `<robotNamespace>`, else that of the spawn request, else the model's name.
        given_namespace: The first two of these; None if there is neither.
    """

    namespace: str
    given_namespace: str | None
    thinner: Thinner
    _shown: list[SceneSensor] = field(default_factory=list, repr=False)
    _updates: list[Callable[..., None]] = field(default_factory=list, repr=False)
    _clocks: list[SensorClock] = field(default_factory=list, repr=False)
    _closers: list[Callable[[], None]] = field(default_factory=list, repr=False)
    _is_made: threading.Event = field(default_factory=threading.Event, repr=False)

    def clock(
        self, rate: float, measure: Update, listens: Callable[[], bool] = lambda: True,
        at_once: bool = True,
    ) -> SensorClock:  # fmt: skip
        """Calls `measure` with the simulated time [ns], at a rate in Hz, while somebody listens.

        It begins when the plugin is made. See `Schedule.begin` for the arguments, and else `on_update`.
        """

        fault = "measures no more, because it raised"
        guarded = self._guarded(measure, fault, lambda: self.sensing.schedule.fail(clock))
        with self.sim.lock:
            clock = self.sensing.schedule.begin(
                self.model, rate, guarded, lambda: self._is_made.is_set() and listens(), at_once
            )
        self._clocks.append(clock)
        return clock

    def _guarded(self, call: Callable[..., None], what: str, end: Callable[[], None]) -> Callable[..., None]:
        """Returns `call` in a form that reports an exception, and ends further calls by `end`."""

        def guarded(*args: int) -> None:
            try:
                call(*args)
            except BaseException:  # noqa: BLE001 - a user's code must not stop the world
                self.report(what)
                end()

        return guarded

    def closing(self, close: Callable[[], None]) -> None:
        """Calls `close` when the plugin ends, or can't be made; the last one first."""
        self._closers.append(close)

    def show(
        self, topic: str, kind: type, link: str, pose: Pose, view: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Has windows offer to draw a topic's measurements in axes at `pose` in a link.

        `view` is a camera's horizontal field of view [rad] and its picture's width by height.
        """
        name = kind._type  # type: ignore[attr-defined]
        shown = SceneSensor(topic, name, self.model.name, link, to_pose_msg(pose), *view)

        def close() -> None:
            with self.sim.lock:
                self._shown.remove(shown)
                self.sim.world.version += 1

        with self.sim.lock:
            self._shown.append(shown)
            self.sim.world.version += 1
        self.closing(close)

    def made(self) -> None:
        """Lets the clocks begin: the plugin can measure now."""
        self._is_made.set()
        for clock in self._clocks:
            clock.look()

    def on_update(self, update: Update) -> None:
        """Calls `update` before each physics step with the simulated time after it [ns].

        The call is under the simulator's lock: it may touch the model, and must not wait for anything.
        An update that raises is reported, and not called again. Updates end with the plugin.
        """

        def end() -> None:
            self.sim.listeners = [each for each in self.sim.listeners if each is not guarded]

        guarded = self._guarded(update, "is not called any more, because it raised", end)
        self._updates.append(guarded)
        with self.sim.lock:
            # A new list: the old one may be in use by the tick that removes an update.
            self.sim.listeners = [*self.sim.listeners, guarded]

    def on_move(self, moved: Callable[[], None]) -> None:
        """Calls `moved`, as `on_update` its update, when a service has moved the model, or what is attached
        to it, or reset world or time.
        """

        def end() -> None:
            self.sim.moves.forget(listener)

        def close() -> None:
            with self.sim.lock:
                end()

        fault = "raised; its on_move is disabled"
        with self.sim.lock:
            listener = self.sim.moves.on_move_of(self.model, self._guarded(moved, fault, end))
        self._updates.append(listener)
        self.closing(close)

    def save(self, name: str, plugin: object) -> None:
        """Lets snapshots save the clocks, and the plugin, if time or moves call it."""
        parts, called = self.sim.parts, [plugin] if self._updates or self._clocks else []
        with self.sim.lock:
            own = {f"{name}.{number}": each for number, each in enumerate([*called, *self._clocks])}
            parts.update(own)

        def close() -> None:
            with self.sim.lock:
                for each in own:
                    del parts[each]

        self.closing(close)

    def release(self) -> None:
        """Ends the updates and clocks, and closes what was opened."""
        for clock in self._clocks:
            clock.end()
        for close in self._closers[::-1]:
            close()
        self._closers.clear()
        with self.sim.lock:
            self.sim.listeners = [each for each in self.sim.listeners if each not in self._updates]

    def report(self, what: str) -> None:
        """Logs the current exception; `what` says what became of the plugin."""
        rospy.logerr(
            "Plugin %s of model '%s' %s:\n%s",
            self.plugin.filename, self.model.name, what, traceback.format_exc(),
        )  # fmt: skip


class LoadedPlugin(Protocol):
    """A plugin at work."""

    def shutdown(self) -> None:
        """Ends it before its model is deleted. Not called under the simulator's lock."""


Factory = Callable[[PluginContext], LoadedPlugin | None]


class PluginRegistry:
    """Starts and ends plugins by the file names of their libraries: built-in ones, then users'."""

    def __init__(
        self, sim: Simulator, thinner: Thinner, seed: int = 0,
        shown: list[SceneSensor] | None = None, camera_scale: float = 1.0,
        renderer: CameraRenderer | None = None,
    ) -> None:  # fmt: skip
        """`seed`, `camera_scale` and `renderer` as of `Sensing`; to `shown` come the topics that windows can
        draw.
        """
        self._sim = sim
        self._shown = [] if shown is None else shown
        self._thinner = thinner
        self.sensing = Sensing(sim, seed, camera_scale, renderer)
        # Imported now, so that no spawn waits for it.
        self._built_in = built_in("LIBRARIES")
        self._of_worlds = built_in("WORLD_LIBRARIES")
        self._loaded_of_world: list[object] = []
        self._loaded: dict[Model, list[tuple[PluginContext, LoadedPlugin | None]]] = {}

    def time_held(self, models: str) -> AbstractContextManager[None]:
        """Holds time while a model comes and its plugins start: as in Gazebo, it has its drives before its
        first step. And while it goes.

        If a plugin waits for time to pass, the hold ends after a while.
        """
        patience = LOCKSTEP_LOADING_PATIENCE if self._sim.lockstep else LOADING_PATIENCE
        text = f"The plugins of {models} have been starting or ending for {patience:g} s"
        late = partial(rospy.logwarn, "%s; time passes from now on", text)
        return self._sim.holds.hold(patience, late)

    def load(self, model: Model, robot_namespace: str) -> None:
        """Starts the plugins of `model`. An unknown one and one that fails is logged and left out
        (docs/contract/gazebo.md 2.4)."""
        loaded = self._loaded.setdefault(model, [])
        description = model.description
        of_sensors = [(plugin, each) for each in description.sensors for plugin in each.plugins]
        plugins = [*((plugin, None) for plugin in description.plugins), *of_sensors]
        places = _registered() if plugins else {}
        for plugin, sensor in plugins:
            factory = self._find(plugin, sensor, model, places)
            if factory is None:
                continue
            own = plugin.element.findtext("robotNamespace")
            given = own.strip() if own is not None else robot_namespace or None
            context = PluginContext(
                self._sim, model, plugin, self.sensing, sensor,
                given or robot_namespace or model.name, given, self._thinner, self._shown,
            )  # fmt: skip
            try:
                loaded.append((context, factory(context)))
                context.save(f"{model.name}::plugin {len(loaded)}", loaded[-1][1])
                context.made()
            except DescriptionError as error:
                rospy.logerr("Model '%s': the plugin %s is left out: %s", model.name, plugin.filename, error)
                context.release()
            except BaseException:  # noqa: BLE001 - a user's code must not leave the model half loaded
                context.report("is left out, because it raised")
                context.release()
        _tell_missing_control(model)

    def load_of_world(self, plugin: Plugin) -> bool:
        """Starts a world's own plugin; returns False for an unknown one."""
        factory = self._of_worlds.get(library_of(plugin.filename))
        if factory is not None:
            self._loaded_of_world.append(factory(self._sim))
        return factory is not None

    def unload(self, model: Model) -> None:
        """Ends the plugins of `model`."""
        for context, plugin in self._loaded.pop(model, []):
            context.release()
            try:
                if plugin is not None:
                    plugin.shutdown()
            except BaseException:  # noqa: BLE001 - a user's code must not keep a model from going
                context.report("raised when it was ended")

    def _find(
        self, plugin: Plugin, sensor: Sensor | None, model: Model, places: dict[str, object]
    ) -> Factory | None:
        """Returns the plugin's factory; None, after a message, if there is none."""
        library = library_of(plugin.filename)
        if library in self._built_in:
            return self._built_in[library]
        place = places.get(library, places.get(plugin.filename))
        if place is None:
            # The spawn services log all that is left out together.
            unknown = f"plugin {plugin.filename or 'without a filename'}"
            unknown += f" of sensor '{sensor.name}'" if sensor else ""
            model.description.left_out.append(unknown)
            return None
        try:
            return _import(place)
        except BaseException as error:  # noqa: BLE001 - importing runs a user's code
            rospy.logerr(
                "Model '%s': the plugin %s is left out: %s of the parameter %s can't be imported: %r",
                model.name, library, place, rospy.resolve_name(PARAMETER), error,
            )  # fmt: skip
            return None


def built_in(table: str) -> dict[str, Callable[[Any], Any]]:
    """Returns the plugins of this folder: each module's `table`, file names of libraries and a factory."""
    modules = [
        importlib.import_module(f"{__package__}.{found.name}")
        for found in pkgutil.iter_modules(importlib.import_module(__package__ or "").__path__)
    ]
    return {library: factory for module in modules for library, factory in getattr(module, table, {}).items()}


def _tell_missing_control(model: Model) -> None:
    """Says in a line of its own if a plugin that is left out was to control the robot."""
    foreign = next(filter(CONTROL.match, model.description.left_out), None)
    libraries = {library_of(plugin.filename) for plugin in model.description.plugins}
    if foreign is not None and CONTROL_PLUGIN not in libraries:
        rospy.logwarn(
            "Model '%s': %s is not simulated: this robot has no control here (docs/plugins.md)",
            model.name, foreign,
        )  # fmt: skip


def _registered() -> dict[str, object]:
    """Reads users' plugins, again for each model, so that one can be added while the simulator runs."""
    try:
        places = rospy.get_param(PARAMETER, {})
    except OSError as error:  # the master; the model is in the world already
        rospy.logerr("The parameter %s can't be read: %s", rospy.resolve_name(PARAMETER), error)
        return {}
    if isinstance(places, dict):
        return places
    rospy.logwarn(
        "The parameter %s is no table of libraries and plugins: %r",
        rospy.resolve_name(PARAMETER), places,
    )  # fmt: skip
    return {}


def _import(place: object) -> Factory:
    """Imports the factory `module:name`."""
    module, _, name = str(place).partition(":")
    if not name:
        raise ImportError("it must be 'module:Name'")
    factory: Factory = getattr(importlib.import_module(module), name)
    if not callable(factory):
        raise TypeError(f"{place} can't be called")
    return factory
