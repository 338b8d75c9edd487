"""Executable `spawn_model` of package gazebo_ros (docs/contract/gazebo_launch.md 4.3)."""

import argparse
import contextlib
import math
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import rospy
from gazebo_msgs.srv import DeleteModel, GetWorldProperties
from gazebo_ros.gazebo_interface import (
    set_model_configuration_client,
    spawn_sdf_model_client,
    spawn_urdf_model_client,
    wait_for_service,
)
from geometry_msgs.msg import Point, Pose, Quaternion
from std_srvs.srv import Empty

from bullet_gazebo.common.node_process import SignalHandler, init_node
from file_access.content import MAX_BYTES, FileError, read_file
from file_access.xml_text import decode
from file_access.xml_text import parse as parse_xml
from robot_sim.physics.pose import from_rpy
from ros_calls.service import ServiceClient, ServiceFailed
from ros_calls.waiting import wait_until

FAREWELL = 3.0  # [s] for the end of spawning and for a call during shutdown
INTERRUPTED = -1
INCLUDE = '<sdf version="1.6"><world name="default"><include><uri>model://{}</uri></include></world></sdf>'
REMIND = 10.0  # [s of wall time]


class CannotSpawn(Exception):
    """Nothing can be spawned; the text says why."""


def main(argv: Sequence[str] | None = None) -> int:
    """Spawns one model; returns the exit code: 0, 1 if that failed, 2 for a wrong command line."""
    command_line = list(sys.argv if argv is None else argv)
    options = parse(rospy.myargv(command_line)[1:])
    # Here, because a thread that waits for standard input can't be ended.
    piped = sys.stdin.buffer.read(MAX_BYTES + 1) if options.stdin else b""

    def work() -> int:
        init_node("spawn_model", command_line)
        try:
            return _run(options, piped)
        except CannotSpawn as fault:
            if rospy.is_shutdown():  # then every call fails
                return INTERRUPTED
            rospy.logerr("spawn_model: %s", fault)
            return 1

    code = SignalHandler().run(work, interrupted=INTERRUPTED)
    if code == INTERRUPTED:
        print("spawn_model: interrupted before it was done", file=sys.stderr)
        return 1
    return code


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Reads the command line; a wrong one ends the program with exit code 2."""
    parser = argparse.ArgumentParser(prog="spawn_model", description="Spawn a model.")
    kind = parser.add_mutually_exclusive_group(required=True)
    kind.add_argument("-urdf", action="store_true", help="the model is a URDF")
    kind.add_argument("-sdf", action="store_true", help="the model is an SDF")
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("-file", help="read it from a file")
    source.add_argument("-param", help="read it from a parameter")
    source.add_argument("-database", metavar="MODEL", help="model://MODEL, on GAZEBO_MODEL_PATH")
    source.add_argument("-stdin", action="store_true", help="read it from standard input")
    parser.add_argument("-model", required=True, metavar="NAME", help="name of the new model")
    parser.add_argument("-reference_frame", default="", help="model or link of the pose")
    parser.add_argument("-gazebo_namespace", default="/gazebo", help="namespace of the simulator's services")
    parser.add_argument("-robot_namespace", help="namespace of the model's plugins (default: the node's)")
    parser.add_argument("-unpause", action="store_true", help="unpause the world afterwards")
    parser.add_argument("-wait", metavar="MODEL", help="wait for another model first")
    for name, what in zip("xyzRPY", ("[m]",) * 3 + ("[rad]",) * 3, strict=True):
        parser.add_argument(f"-{name}", type=float, default=0.0, help=what)
    parser.add_argument(
        "-J", nargs=2, action="append", default=[], dest="joints", metavar=("JOINT", "POSITION"),
        help="initial position of a joint [rad, m]; may be repeated",
    )  # fmt: skip
    parser.add_argument("-package_to_model", action="store_true",
                        help="meshes: model:// instead of package://")  # fmt: skip
    parser.add_argument("-b", dest="bond", action="store_true", help="stay, and delete the model at the end")
    options = parser.parse_args([_not_an_option(argument) for argument in arguments])
    options.joints = [(name, _position(parser, text)) for name, text in options.joints]
    return options


def _not_an_option(argument: str) -> str:
    """Puts a space before a negative number: argparse would take -1e-05 for an option."""
    try:
        float(argument)
    except ValueError:
        return argument
    return f" {argument}" if argument.startswith("-") else argument


def _position(parser: argparse.ArgumentParser, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        parser.error(f"argument -J: {text!r} is not a number")


def _run(options: argparse.Namespace, piped: bytes) -> int:
    gazebo = options.gazebo_namespace.rstrip("/")
    if options.wait:
        _wait_for_model(gazebo, options.wait)
    xml = _prepared(_read(options, piped), options.package_to_model)
    wait_for_service(f"{gazebo}/spawn_{'urdf' if options.urdf else 'sdf'}_model")
    with _Bond(gazebo, options.model) if options.bond else contextlib.nullcontext():
        _spawn(options, xml, gazebo)
    placed = True
    if options.joints:
        names, positions = zip(*options.joints, strict=True)
        placed = bool(set_model_configuration_client(options.model, "", names, positions, gazebo))
    if options.unpause:
        wait_for_service(f"{gazebo}/unpause_physics")
        _call(f"{gazebo}/unpause_physics", Empty)
    if options.bond:
        rospy.loginfo("spawn_model: '%s' stays until this node is shut down", options.model)
        rospy.spin()
    return 0 if placed else 1


def _spawn(options: argparse.Namespace, xml: str, gazebo: str) -> None:
    spawn = spawn_urdf_model_client if options.urdf else spawn_sdf_model_client
    namespace = options.robot_namespace
    if namespace is None:
        namespace = rospy.get_namespace()
    # -R, -P, -Y are rotations about the fixed x, y and z axis, in this order.
    turn = Quaternion(*from_rpy(options.R, options.P, options.Y))
    pose = Pose(Point(options.x, options.y, options.z), turn)
    if not spawn(options.model, xml, namespace, pose, options.reference_frame, gazebo):
        raise CannotSpawn(f"'{options.model}' was not spawned")


class _Bond:
    """Deletes the model when the node shuts down, even while the block that spawns it runs."""

    def __init__(self, gazebo: str, model: str) -> None:
        self._service, self._model = f"{gazebo}/delete_model", model
        self._spawned = False
        self._over = threading.Event()
        rospy.on_shutdown(self._release)

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._spawned = kind is None
        self._over.set()

    def _release(self) -> None:
        if not self._over.wait(FAREWELL) or not self._spawned:
            return
        try:
            ServiceClient(self._service, DeleteModel, timeout=FAREWELL)(self._model)
        except ServiceFailed as fault:
            print(f"spawn_model: '{self._model}' was not deleted: {fault}", file=sys.stderr)


def _wait_for_model(gazebo: str, name: str) -> None:
    """Waits for a model, also in a paused world, whose state topics are silent."""
    service = f"{gazebo}/get_world_properties"
    wait_for_service(service)
    rospy.loginfo("spawn_model: waiting for model '%s'", name)

    def is_there() -> bool:
        return name in _call(service, GetWorldProperties).model_names

    while not wait_until(is_there, REMIND, f"model '{name}'"):
        rospy.logwarn("spawn_model: still waiting for model '%s'", name)


def _call(service: str, kind: type) -> Any:
    try:
        return ServiceClient(service, kind, timeout=math.inf)()
    except ServiceFailed as fault:
        raise CannotSpawn(str(fault)) from fault


def _read(options: argparse.Namespace, piped: bytes) -> str:
    if options.database is not None:
        return INCLUDE.format(options.database)
    if options.param is not None:
        origin = f"parameter {rospy.resolve_name(options.param)}"
        try:
            text = str(rospy.get_param(options.param))
        except KeyError as fault:
            raise CannotSpawn(f"{origin} is not set") from fault
    else:
        origin = options.file or "standard input"
        try:
            text = decode(piped if options.stdin else read_file(Path(options.file)))
        except FileError as fault:
            raise CannotSpawn(f"{origin}: {fault}") from fault
    if not text.strip("\ufeff \t\r\n"):
        raise CannotSpawn(f"{origin} is empty")
    return text


def _prepared(text: str, package_to_model: bool) -> str:
    """Returns the XML without comments and declaration, as Gazebo's tool sends it."""
    try:
        root = parse_xml(text)
    except FileError as fault:
        raise CannotSpawn(f"the model can't be used: {fault}") from fault
    if package_to_model:
        for mesh in root.iter("mesh"):
            name = mesh.get("filename", "")
            if name.startswith("package://"):
                mesh.set("filename", "model://" + name.removeprefix("package://"))
    return ElementTree.tostring(root, encoding="unicode")
