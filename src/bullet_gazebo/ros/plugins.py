"""Model plugins: what stands in for the shared libraries that a model file names.

How to add one's own: docs/plugins.md. It is a user's code, and caught wherever it is called, sys.exit() and
KeyboardInterrupt included: in this process a Ctrl-C raises nothing (ros/wire/signals.py).
"""

import ast
import importlib
import os
import traceback
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

import rospy

from bullet_gazebo.definitions import Definition, defines, find_file
from bullet_gazebo.physics.description import Plugin
from bullet_gazebo.physics.model import Model
from bullet_gazebo.simulator import Simulator

PATIENCE = 10.0  # [s of wall time]
PARAMETER = "~plugins"  # library's file name: "module:Factory"
Update = Callable[[int], None]


@dataclass(frozen=True)
class PluginContext:
    """What a plugin is given: its element in the file, its model, and the namespace to work in."""

    sim: Simulator
    model: Model
    plugin: Plugin
    namespace: str
    _updates: list[Update] = field(default_factory=list, repr=False)

    def text(self, tag: str, default: str) -> str:
        """Returns the text of the plugin's child element `tag`."""
        return (self.plugin.element.findtext(tag) or "").strip() or default

    def on_update(self, update: Update) -> None:
        """Has `update` called before each physics step with the simulated time after it [ns].

        It is called under the simulator's lock: it may touch the model, and must not wait for
        anything. One that raises is reported, and not called again. It ends with the plugin.
        """

        def guarded(now: int) -> None:
            try:
                update(now)
            except BaseException:  # noqa: BLE001 - a user's code must not stop the world
                self._report("is not called any more, because it raised")
                self.sim.listeners = [each for each in self.sim.listeners if each is not guarded]

        self._updates.append(guarded)
        with self.sim.lock:
            # A new list: the old one may be in use by the tick that removes an update.
            self.sim.listeners = [*self.sim.listeners, guarded]

    def release(self) -> None:
        """Ends the updates."""
        with self.sim.lock:
            self.sim.listeners = [each for each in self.sim.listeners if each not in self._updates]

    def _report(self, what: str) -> None:
        rospy.logerr(
            "Plugin %s of model '%s' %s:\n%s",
            self.plugin.filename, self.model.name, what, traceback.format_exc(),
        )  # fmt: skip


class LoadedPlugin(Protocol):
    """A plugin at work."""

    def shutdown(self) -> None:
        """Ends it; its model is about to be deleted. Not called under the simulator's lock."""


Factory = Callable[[PluginContext], LoadedPlugin | None]


class PluginRegistry:
    """Makes plugins by the file name of their library.

    The built-in ones come first, then those of the parameter `~plugins`.
    """

    def __init__(self, sim: Simulator, factories: dict[str, Factory]) -> None:
        self._sim = sim
        self._factories = dict(factories)
        self._loaded: dict[Model, list[tuple[PluginContext, LoadedPlugin | None]]] = {}

    def time_held(self, models: str) -> AbstractContextManager[None]:
        """Lets no time pass while a model comes and its plugins are loaded: as in Gazebo, it has its drives
        before its first step.

        A plugin that waits for time to pass is waited for, but not for ever.
        """
        return self._sim.holds.hold(PATIENCE, partial(_tell_late, models))

    def load(self, model: Model, robot_namespace: str) -> None:
        """Starts the plugins of `model`. One that is unknown or fails is a message, and left out
        (docs/contract/gazebo.md 2.4)."""
        loaded = self._loaded.setdefault(model, [])
        places = _registered() if model.description.plugins else {}
        for plugin in model.description.plugins:
            factory = self._find(plugin, model, places)
            if factory is None:
                continue
            default = robot_namespace or model.name
            own = (plugin.element.findtext("robotNamespace") or "").strip()
            context = PluginContext(self._sim, model, plugin, own or default)
            try:
                loaded.append((context, factory(context)))
            except BaseException:  # noqa: BLE001 - a user's code must not leave the model half there
                context._report("is left out, because it raised")
                context.release()

    def unload(self, model: Model) -> None:
        """Ends the plugins of `model`."""
        for context, plugin in self._loaded.pop(model, []):
            context.release()
            try:
                if plugin is not None:
                    plugin.shutdown()
            except BaseException:  # noqa: BLE001 - a user's code must not keep a model from going
                context._report("raised when it was ended")

    def _find(self, plugin: Plugin, model: Model, places: dict[str, object]) -> Factory | None:
        """Returns the plugin's factory; None if there is none."""
        library = os.path.basename(plugin.filename)
        if library in self._factories:
            return self._factories[library]
        place = places.get(library)
        if place is None:
            # One warning will name it together with the sensors (spawn_services.warn).
            unknown = f"plugin {plugin.filename or 'without a filename'}"
            model.description.left_out.append(unknown)
            return None
        try:
            return _imported(place)
        except BaseException as error:  # noqa: BLE001 - importing runs a user's code
            rospy.logerr(
                "Model '%s': the plugin %s is left out: %s of the parameter %s can't be imported: %r",
                model.name, library, place, rospy.resolve_name(PARAMETER), error,
            )  # fmt: skip
            return None


def _tell_late(models: str) -> None:
    rospy.logwarn(
        "The plugins of %s have been loading for %g s; time goes on without them", models, PATIENCE
    )


def _registered() -> dict[str, object]:
    """Read for each model, so that a plugin can be added while the simulator runs."""
    try:
        places = rospy.get_param(PARAMETER, {})
    except OSError as error:  # the master; the model is in the world already
        rospy.logerr("The parameter %s can't be read: %s", rospy.resolve_name(PARAMETER), error)
        return {}
    if isinstance(places, dict):
        return places
    rospy.logwarn(
        "The parameter %s is no table of libraries and what stands for them: %r",
        rospy.resolve_name(PARAMETER), places,
    )  # fmt: skip
    return {}


def _imported(place: object) -> Factory:
    """Returns what `module:name` stands for; the module is imported only if its source has that."""
    module, _, name = str(place).partition(":")
    if not defines(module, name, _may_make_plugins):
        file = find_file(module)
        raise ImportError(
            f"{module} (of {file}) has no function or class {name}" if file
            else f"there is no Python source of a module {module}"
        )  # fmt: skip
    factory: Factory = getattr(importlib.import_module(module), name)
    if not callable(factory):
        raise TypeError(f"{place} can't be called")
    return factory


def _may_make_plugins(definition: Definition) -> bool:
    """A function, a class, or what is called or looked up to get one, such as functools.partial(...)."""
    return isinstance(
        definition, (ast.FunctionDef, ast.ClassDef, ast.Lambda, ast.Call, ast.Attribute)
    )
