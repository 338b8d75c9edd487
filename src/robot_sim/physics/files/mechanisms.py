"""Mimic joints and disabled links, from a URDF's `<mimic>` and plugins.

In this process it is the same as over ROS, so it belongs to the model, not to plugins at work. A fault is a
warning, and what has it is left out.
"""

import math
from collections.abc import Callable, Iterator
from functools import partial
from xml.etree.ElementTree import Element

from robot_sim.physics.description import DescriptionError, Joint, Mimic, ModelDescription, Plugin, library_of
from robot_sim.physics.files.elements import finite, shown
from robot_sim.physics.files.sdf_parts import value

MIMIC_LIBRARIES = (
    "libgazebo_mimic_joint_plugin.so",
    "libroboticsgroup_gazebo_mimic_joint_plugin.so",
    "libroboticsgroup_upatras_gazebo_mimic_joint_plugin.so",
)
DISABLE_LINK_LIBRARY = "libroboticsgroup_gazebo_disable_link_plugin.so"
Found = tuple[str, Mimic]
"""The follower's name, and what makes it follow."""


def add_mechanisms(model: ModelDescription, robot: Element | None = None) -> None:
    """Adds to `model` what its plugins say, and the `<mimic>` elements of a URDF's `robot`."""
    mimics: dict[str, Mimic] = {}
    for plugin in model.plugins:
        library = library_of(plugin.filename)
        if library in MIMIC_LIBRARIES:
            _keep(model, mimics, partial(_of_plugin, model, plugin))
        elif library == DISABLE_LINK_LIBRARY:
            _disable(model, plugin)
    if model.static:
        return
    if robot is not None:
        # What controllers move doesn't follow by `<mimic>`, too.
        driven = {*mimics, *(each.get("name", "") for each in robot.findall("transmission/joint"))}
        for element in robot.findall("joint"):
            mimic = element.find("mimic")
            if mimic is not None and element.get("name", "") not in driven:
                _keep(model, mimics, partial(_of_urdf, model, element, mimic))
    model.mimics = dict(_drivers_first(model, mimics))


def _keep(model: ModelDescription, found: dict[str, Mimic], read: Callable[[], Found]) -> None:
    try:
        name, mimic = read()
    except DescriptionError as error:
        model.warnings.append(str(error))
        return
    found.setdefault(name, mimic)


def _of_urdf(model: ModelDescription, element: Element, mimic: Element) -> Found:
    name = element.get("name", "")
    place = f"joint '{shown(name)}': <mimic>"
    joint, driver = _joint(model, name, place), _joint(model, mimic.get("joint", ""), place)
    multiplier, offset = (
        finite(mimic.get(key, default), f"{place}, {key}")
        for key, default in (("multiplier", "1"), ("offset", "0"))
    )
    return name, Mimic(driver.name, multiplier, offset, _strength(joint))


def _of_plugin(model: ModelDescription, plugin: Plugin) -> Found:
    def named(tag: str) -> Joint:
        given = (plugin.element.findtext(tag) or "").strip()
        scoped = f"{plugin.scope}::{given}"
        return _joint(model, scoped if scoped in model.joints else given, f"{place}, <{tag}>")

    place = f"plugin {shown(plugin.filename)}"
    driver, joint = named("joint"), named("mimicJoint")
    multiplier, offset, sensitiveness, effort = (
        value(plugin.element, tag, place, default)
        for tag, default in (
            ("multiplier", 1.0),
            ("offset", 0.0),
            ("sensitiveness", 0.0),
            ("maxEffort", _strength(joint)),
        )
    )
    if effort < 0.0:
        raise DescriptionError(f"{place}: <maxEffort> is {effort:g}")
    pid = plugin.element.find("hasPID")
    gains = None if pid is None else (pid.text or "").strip()
    return joint.name, Mimic(driver.name, multiplier, offset, effort, gains, sensitiveness)


def _joint(model: ModelDescription, name: str, place: str) -> Joint:
    joint = model.joints.get(name)
    if joint is None or not joint.movable:
        raise DescriptionError(f"{place}: '{shown(name)}' is no joint of the model that moves")
    return joint


def _strength(joint: Joint) -> float:
    """Returns a joint's effort limit [N m, N]; files say 0 where they know none."""
    return joint.effort if joint.effort > 0.0 else math.inf


def _drivers_first(model: ModelDescription, found: dict[str, Mimic]) -> Iterator[Found]:
    """Yields followers, each after the one that it follows, and leaves out those in a circle."""
    left = dict(found)
    while left:
        ready = [name for name, mimic in left.items() if mimic.driver not in left]
        if not ready:
            names = ", ".join(shown(name) for name in list(left)[:10])
            model.warnings.append(f"joints follow each other in a circle, and so none: {names}")
            return
        yield from ((name, left.pop(name)) for name in ready)


def _disable(model: ModelDescription, plugin: Plugin) -> None:
    """Switches a link off: it touches nothing, and has no weight."""
    given = (plugin.element.findtext("link") or "").strip()
    scoped = f"{plugin.scope}::{given}"
    link = model.links.get(scoped, model.links.get(given))
    if link is None:
        model.warnings.append(
            f"plugin {shown(plugin.filename)}, <link>: the model has no link '{shown(given)}'"
        )
    else:
        link.collisions, link.gravity = [], False
