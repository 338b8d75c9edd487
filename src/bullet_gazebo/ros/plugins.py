"""Model plugins: what stands in for the shared libraries that a model file names."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import rospy

from bullet_gazebo.physics.description import Plugin
from bullet_gazebo.physics.model import Model
from bullet_gazebo.simulator import Simulator


@dataclass(frozen=True)
class PluginContext:
    """What a plugin is given: its element in the file, its model, and the namespace to work in."""

    sim: Simulator
    model: Model
    plugin: Plugin
    namespace: str

    def text(self, tag: str, default: str) -> str:
        """Returns the text of the plugin's child element `tag`."""
        return (self.plugin.element.findtext(tag) or "").strip() or default


class LoadedPlugin(Protocol):
    """A plugin at work."""

    def shutdown(self) -> None:
        """Ends it; its model is about to be deleted. Not called under the simulator's lock."""


Factory = Callable[[PluginContext], LoadedPlugin]


class PluginRegistry:
    """Makes plugins by the file name of their library."""

    def __init__(self, sim: Simulator, factories: dict[str, Factory]) -> None:
        self._sim = sim
        self._factories = dict(factories)
        self._loaded: dict[Model, list[LoadedPlugin]] = {}

    def load(self, model: Model, robot_namespace: str) -> None:
        """Starts the plugins of `model`. An unknown one is a warning (gazebo_api.md section 2.4)."""
        plugins = self._loaded.setdefault(model, [])
        for plugin in model.description.plugins:
            factory = self._factories.get(os.path.basename(plugin.filename))
            if factory is None:
                rospy.logwarn(
                    "Model '%s': there is no stand-in for the plugin %s; it is left out",
                    model.name, plugin.filename or "without a filename",
                )  # fmt: skip
                continue
            default = robot_namespace or model.name
            own = (plugin.element.findtext("robotNamespace") or "").strip()
            plugins.append(factory(PluginContext(self._sim, model, plugin, own or default)))

    def unload(self, model: Model) -> None:
        """Ends the plugins of `model`."""
        for plugin in self._loaded.pop(model, []):
            plugin.shutdown()
