"""Shared context of a world's sensors: schedule, ray scenes, seed of the noise."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from robot_sim.physics.description import DescriptionError, Plugin, Sensor
from robot_sim.physics.files.sdf_parts import value
from robot_sim.physics.model import Model
from robot_sim.physics.pose import Pose
from robot_sim.sensors.noise import checked_deviation, generator
from robot_sim.sensors.rays import RayScene
from robot_sim.sensors.rendering import CameraRenderer, RayRenderer
from robot_sim.sensors.schedule import Schedule
from robot_sim.simulator import Simulator
from robot_sim.state_dict import Shared, Stateful

LARGEST_NUMBER = 1e30  # number of a plugin: messages have 32-bit floats


class Sensing(Shared, Stateful):
    """The sensors of a simulator; `seed` is that of their noise, `camera_scale` the size of pictures beside
    that in the file, and `renderer` makes them: rays without one.
    """

    non_persistent = ("collisions", "visuals", "camera_scale")

    def __init__(
        self, sim: Simulator, seed: int = 0, camera_scale: float = 1.0,
        renderer: CameraRenderer | None = None,
    ) -> None:  # fmt: skip
        self.camera_scale = camera_scale
        self.renderer = renderer or RayRenderer()
        self.schedule = Schedule(sim)
        self.collisions = RayScene(sim.world)
        self.visuals = RayScene(sim.world, visuals=True)
        self.schedule.prepare += [self.collisions.expire, self.visuals.expire]
        self._seed = seed
        self.seeds = 0  # how often it has got a seed since
        sim.reseeded.append(self._reseed)
        sim.parts["sensing"] = self

    def _reseed(self, seed: int) -> None:
        """Restarts the noise, which depends only on this seed from now on."""
        self._seed = seed
        self.seeds += 1

    def noise(self, model: Model, name: str, now: int) -> np.random.Generator:
        """Returns the noise generator of the measurement at `now` [ns] by sensor or plugin `name`.

        It depends on the moves since the seed, and the time since the last of them: episodes that begin with
        the same seed have the same noise, whenever that is.
        """
        schedule = self.schedule
        moves = schedule.moves - schedule.moves_before_seed
        return generator(self._seed, model.name, name, moves, now - max(schedule.moved_at, 0))

    def bias(self, model: Model, name: str) -> np.random.Generator:
        """Returns the generator of its biases."""
        return generator(self._seed, model.name, name, "bias")


@dataclass(frozen=True)
class Mount(Shared):
    """A sensor's place in a model, and the plugin with its parameters."""

    sim: Simulator
    model: Model
    plugin: Plugin  # of the sensor or the model
    sensing: Sensing
    sensor: Sensor | None  # the one that the plugin belongs to; None for a model's plugin

    @property
    def key(self) -> str:
        """The key of its random numbers: the same for all plugins of a sensor."""
        if self.sensor is not None:
            return f"{self.sensor.link}::{self.sensor.name}"
        return f"plugin {self.model.description.plugins.index(self.plugin)}"

    def text(self, tag: str, default: str) -> str:
        """Returns the text of the plugin's child element `tag`."""
        return (self.plugin.element.findtext(tag) or "").strip() or default

    def required(self, tag: str) -> str:
        """Returns the text of a required element; raises DescriptionError if it is missing."""
        found = self.text(tag, "")
        if not found:
            raise DescriptionError(f"<{tag}> is missing")
        return found

    def number(self, tag: str, default: float) -> float:
        """Returns the number in the plugin's child element `tag`; a faulty one is a DescriptionError."""
        found = value(self.plugin.element, tag, f"plugin {self.plugin.filename}", default)
        if found != default and abs(found) > LARGEST_NUMBER:
            raise DescriptionError(f"<{tag}> is {found:g}; it must be within ±{LARGEST_NUMBER:g}")
        return found

    def rate(self, tag: str = "updateRate", default: float = 0.0) -> float:
        """Returns the plugin's own rate [Hz]; 0 is every step. A negative one is a DescriptionError."""
        found = self.number(tag, default)
        if found < 0.0:
            raise DescriptionError(f"<{tag}> is {found:g}")
        return found

    def deviation(self) -> float:
        """Returns the plugin's `<gaussianNoise>`; an impossible one is a DescriptionError."""
        return checked_deviation(self.number("gaussianNoise", 0.0), "<gaussianNoise>")

    def among(self, tag: str, names: Sequence[str]) -> str:
        """Returns the one of its model's `names` that the element `tag` names; "" if none.

        In a nested model's plugin a plain name is one of that model's.
        """
        given = self.text(tag, "")
        scoped = f"{self.plugin.scope}::{given}"
        return next((name for name in (scoped, given) if name in names), "")

    def link(self, tag: str, required: bool = True) -> str:
        """Returns the model's link that the element `tag` names.

        Without the element it is the model's first one, unless it is `required`. Raises DescriptionError if
        there is none.
        """
        names = self.model.link_names
        if not self.text(tag, "") and not required:
            scope = self.plugin.scope
            return next((name for name in names if name.startswith(f"{scope}::")), names[0])
        given, found = self.required(tag), self.among(tag, names)
        if not found:
            raise DescriptionError(f"<{tag}>: the model has no link '{given}'")
        return found

    def link_in_world(self, tag: str) -> tuple[Model, str]:
        """Returns the link that the element `tag` names: of its own model, or else of the world.

        Raises DescriptionError if there is none.
        """
        name, own = self.required(tag), self.among(tag, self.model.link_names)
        found = (self.model, own) if own else self.sim.world.link(name)
        if found is None:
            raise DescriptionError(f"<{tag}>: there is no link '{name}'")
        return found

    def random(self, now: int, part: str = "") -> np.random.Generator:
        """Returns the noise generator of the measurement at `now` [ns]."""
        return self.sensing.noise(self.model, self.key + part, now)

    def biases(self, part: str = "") -> np.random.Generator:
        """Returns the generator of its biases, the same at each call."""
        return self.sensing.bias(self.model, self.key + part)


class Field(NamedTuple):
    """One thing that a sensor measures."""

    about: str  # its shape and unit
    is_noisy: bool = False  # whether an environment's `sensor_noise` can add to it


class Measurement(Stateful):
    """A sensor on a model; raises DescriptionError if it can't be simulated.

    Each module of this folder lists its own in `SENSORS`. `fields` are what `values` returns, by attribute of
    a `Reading`; without any, tasks can't see it.
    """

    kinds: ClassVar[Sequence[str]] = ()  # of `<sensor>` that it measures
    # Of plugins, a sensor's or a model's, that it measures for, whatever the kind.
    libraries: ClassVar[Sequence[str]] = ()
    interface: ClassVar[str] = ""  # of ros_control by which controllers have it
    fields: ClassVar[Mapping[str, Field]] = {}
    rate: float = 0.0  # of measurements [Hz of simulated time]; 0 is every step
    # The description's.
    non_persistent: ClassVar[tuple[str, ...]] = (
        "deviation",
        "rate",
        "_deviation",
        "_high",
        "_link",
        "_low",
        "_offset",
    )

    def __init__(self, mount: Mount) -> None:
        self.mount = mount

    def start(self) -> None:
        """Prepares the first measurement, for kinds that compare each with the last."""

    def measure(self, now: int) -> Any:
        """Returns a measurement at a time [ns], as its kind has it; None for nothing yet."""
        raise NotImplementedError

    def values(self, now: int) -> Mapping[str, Any] | None:
        """Returns a measurement at a time [ns], by the names of `fields`; None for nothing yet."""
        raise NotImplementedError


def sensor_of(mount: Mount, kinds: Sequence[str]) -> Sensor:
    """Returns the sensor that a plugin belongs to.

    Raises DescriptionError if it has none, or one of another kind.
    """
    sensor = mount.sensor
    if sensor is None or sensor.kind not in kinds:
        found = "a model" if sensor is None else f"the {sensor.kind} sensor '{sensor.name}'"
        raise DescriptionError(f"it belongs to {found}, not to a sensor of type {' or '.join(kinds)}")
    return sensor


def sensor_pose(model: Model, sensor: Sensor) -> Pose:
    """Returns where a sensor is in the world."""
    return model.link_state(sensor.link)[0].compose(sensor.pose)


def slower(*rates: float) -> float:
    """Returns the slowest rate [Hz]; 0 means every step."""
    return min((each for each in rates if each > 0.0), default=0.0)
