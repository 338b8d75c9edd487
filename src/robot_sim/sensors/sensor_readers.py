"""Sensor readings by name: for steps over ROS, in-process environments, and controllers."""

import copy
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from importlib import import_module
from itertools import chain
from pkgutil import iter_modules
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from file_access.text import did_you_mean
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import RobotHardware, SensorHandle
from robot_sim.physics.description import DescriptionError, Plugin, Sensor, library_of
from robot_sim.physics.model import Model
from robot_sim.plain_data import misfit
from robot_sim.sensors.schedule import SensorClock
from robot_sim.sensors.sensing import Measurement, Mount, Sensing
from robot_sim.simulator import Simulator
from robot_sim.state import SCOPE, UnknownName
from robot_sim.state_dict import StateError, Stateful, attributes_of, put_attributes

WITHOUT = Plugin("", "", Element("plugin"))
MOST_SIZED = 8  # cameras read in sizes of the reader's: a picture of full HD takes a second


@cache
def measurements() -> tuple[type[Measurement], ...]:
    """Returns the sensors that the modules of this folder list in `SENSORS`."""
    folder = import_module(__package__ or "")
    names = [f"{folder.__name__}.{found.name}" for found in iter_modules(folder.__path__)]
    listed = [getattr(module, "SENSORS", ()) for module in map(import_module, names)]
    return tuple(chain.from_iterable(listed))


def noisy_fields() -> list[str]:
    """Returns the attributes of readings that `sensor_noise` can add to."""
    fields = [item for each in measurements() for item in each.fields.items()]
    return list(dict.fromkeys(name for name, field in fields if field.is_noisy))


class Taken(NamedTuple):
    """A measurement: its time [ns], and values by the attributes of a `Reading`."""

    now: int
    values: Mapping[str, Any]


class SensorReaders(Stateful):
    """Sensors that measure by their own clocks, with or without subscribers.

    The caller holds the simulator's lock. Names are plain or model::sensor; of a model's IMU, the plugin's.
    Raises UnknownName if a name refers to none, or several, or can't be read, or names are too many.
    """

    non_persistent = ("_schedule", "_parts", "_mounts")

    def __init__(self, sim: Simulator, sensing: Sensing, names: Sequence[str]) -> None:
        self.names = tuple(names)
        if len({*names}) < len(names) or sum("@" in name for name in names) > MOST_SIZED:
            raise UnknownName(f"a sensor is read twice, or more than {MOST_SIZED} cameras in another size")
        self._schedule = sensing.schedule
        self._taken: dict[str, Taken] = {}
        made = [(name, *find_sensor(sim, sensing, name)) for name in self.names]
        self._mounts = [mount for _, mount, _ in made]
        self._clocks: list[SensorClock] = []
        self._sensors: list[Measurement] = []
        self._parts = sim.parts
        for name, mount, maker in made:
            try:
                sensor = maker(mount)
            except DescriptionError as error:
                self.end()
                raise UnknownName(f"the sensor '{name}' can't be simulated: {error}") from error
            self._sensors.append(sensor)
            take = self._taker(name, mount, sensor)
            self._clocks.append(self._schedule.begin(mount.model, sensor.rate, take, lambda: True))
        self._schedule.review()
        self._parts["readers"] = self

    def serves(self, names: Sequence[str]) -> bool:
        """Returns whether these are the sensors, all on models that are there: then their clocks go on."""
        return self.names == tuple(names) and not any(map(_is_gone, self._mounts))

    def _taker(self, name: str, mount: Mount, sensor: Measurement) -> Callable[[int], None]:
        sensor.start()

        def take(now: int) -> None:
            if _is_gone(mount):
                return
            values = sensor.values(now)
            for array in (values or {}).values():
                if isinstance(array, np.ndarray):
                    array.setflags(write=False)
            if values is not None:
                self._taken[name] = Taken(now, values)

        return take

    def read(self) -> list[Taken]:
        """Returns the last measurement of each, in the order of the names."""
        return [self._taken[name] for name in self.names]

    def load_state_dict(self, state: Any) -> None:
        """Takes back what `state_dict` has returned; raises StateError if it is of other sensors."""
        own, clocks = attributes_of(self), "_clocks"
        fault = misfit(own, state, "readers") or misfit(own[clocks], state[clocks], clocks, exactly=True)
        fits = all(name in self.names and type(now) is int for name, (now, _) in state["_taken"].items())
        if fault or not fits or own.keys() != state.keys() or own["names"] != state["names"]:
            raise StateError(fault or "its measurements aren't those of these sensors")
        put_attributes(self, state)

    def end(self) -> None:
        """Ends the measurements."""
        for clock in self._clocks:
            self._schedule.fail(clock)
        if self._parts.get("readers") is self:
            del self._parts["readers"]


def _is_gone(mount: Mount) -> bool:
    """Returns whether the sensor's model was deleted."""
    return mount.sim.world.models.get(mount.model.name) is not mount.model


def find_sensor(sim: Simulator, sensing: Sensing, name: str) -> tuple[Mount, type[Measurement]]:
    """Returns the sensor of a name, and what makes it; raises UnknownName.

    A name may ask for a camera's picture in another size: front_camera@640x480.
    """
    name, is_sized, size = name.partition("@")
    known: dict[str, list[tuple[Mount, type[Measurement]]]] = {}
    for plain, mount, maker in _sensors(sim, sensing):
        for each in (plain, f"{mount.model.name}{SCOPE}{plain}"):
            known.setdefault(each, []).append((mount, maker))
    found = known.get(name, [])
    if len(found) > 1:
        raise UnknownName(f"there are several sensors '{name}'; write model{SCOPE}sensor")
    if not found:
        there = [each for each in known if SCOPE not in each]
        near = did_you_mean(name, known) or f"; there are: {', '.join(there) or 'none'}"
        raise UnknownName(f"there is no sensor '{name}' that can be read{near}")
    mount, maker = found[0]
    return replace(mount, sensor=_sized(mount.sensor, size)) if is_sized else mount, maker


def _sized(sensor: Sensor | None, size: str) -> Sensor:
    """Returns a camera whose picture has a size, as 640x480; raises UnknownName."""
    sides = size.split("x")
    if len(sides) != 2 or not all(side.isdecimal() and side.isascii() for side in sides):
        raise UnknownName(f"the size of a camera's picture is WIDTHxHEIGHT, not '{size}'")
    element = copy.deepcopy(sensor.element) if sensor else WITHOUT.element
    camera = element.find("camera")
    if sensor is None or camera is None:
        raise UnknownName(f"only a camera has a size, as @{size}: '{sensor and sensor.name}' is none")
    image = camera.find("image")
    image = SubElement(camera, "image") if image is None else image
    for tag, side in zip(("width", "height"), sides, strict=True):
        found = image.find(tag)
        (SubElement(image, tag) if found is None else found).text = side
    return replace(sensor, element=element)


def _sensors(sim: Simulator, sensing: Sensing) -> Iterator[tuple[str, Mount, type[Measurement]]]:
    """Yields all sensors that can be read, with their plain names."""
    seen = [each for each in measurements() if each.fields]
    by_library = {library: each for each in seen for library in each.libraries}
    by_kind = {kind: each for each in seen for kind in each.kinds}
    for model in sim.world.models.values():
        for sensor in model.description.sensors:
            plugin = next(iter(sensor.plugins), WITHOUT)
            found = by_library.get(library_of(plugin.filename), by_kind.get(sensor.kind))
            if found is not None:
                yield sensor.name, Mount(sim, model, plugin, sensing, sensor), found
        for plugin in model.description.plugins:
            found = by_library.get(library_of(plugin.filename))
            if found is not None:
                yield plugin.name, Mount(sim, model, plugin, sensing, None), found


class MeasuringHandle(SensorHandle):
    """A sensor that measures by its own clock while a controller has begun it.

    Raises ControlError if it can't be simulated.
    """

    non_persistent = ("_told",)

    def __init__(self, mount: Mount, kind: type[Measurement], frame: str) -> None:
        assert mount.sensor is not None
        super().__init__(mount.sensor.name, frame)
        try:
            self._sensor = kind(mount)
        except DescriptionError as error:
            raise ControlError(f"the sensor '{self.name}' can't be simulated: {error}") from error
        self._sensor.start()
        self._model, self._schedule = mount.model, mount.sensing.schedule
        self._clock: SensorClock | None = None

    def begin(self, moved: Callable[[int], None]) -> None:
        self._told = moved
        if self._clock is None:
            rate = self._sensor.rate
            self._clock = self._schedule.begin(self._model, rate, self._take, lambda: True)
            self._schedule.review()

    def end(self) -> None:
        if self._clock is not None:
            self._schedule.fail(self._clock)
        self._clock = self.value = None

    def _take(self, now: int) -> None:
        self.value = self._sensor.measure(now)
        if now == self._schedule.last_move(self._model).at:
            self._told(now)


def offer_sensors(hardware: RobotHardware, sim: Simulator, model: Model, sensing: Sensing | None) -> None:
    """Gives controllers a model's IMUs and force-torque sensors.

    Without `sensing` they measure nothing.
    """
    if not model.description.sensors:
        return
    kinds = {kind: each for each in measurements() if each.interface for kind in each.kinds}
    for sensor in model.description.sensors:
        if sensor.kind in kinds:
            measurement = kinds[sensor.kind]
            plugin = next(iter(sensor.plugins), WITHOUT)
            link = sensor.link.rpartition(SCOPE)[2]
            frame = (plugin.element.findtext("frameName") or link).strip().lstrip("/")
            hardware.sensors[measurement.interface].append(
                partial(SensorHandle, sensor.name, frame)
                if sensing is None
                else partial(MeasuringHandle, Mount(sim, model, plugin, sensing, sensor), measurement, frame)
            )
