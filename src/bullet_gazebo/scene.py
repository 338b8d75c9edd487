"""The scene for windows: looks, link poses, and contacts of the world.

An empty world offers exactly what Gazebo's does (docs/contract/gazebo.md 1.4), so the service and the topics
come when a window asks for them through the node's XML-RPC server (`world_services.WorldControl`).
"""

import secrets
import threading
import time
import traceback
from collections.abc import Callable, Iterable, Sequence
from copy import copy
from functools import partial

import numpy as np
import rospy
from bullet_gazebo_msgs.msg import (
    SceneContacts,
    SceneJoint,
    SceneLight,
    SceneLink,
    SceneModel,
    ScenePoses,
    SceneSensor,
    SceneShape,
)
from bullet_gazebo_msgs.srv import GetScene, GetSceneRequest, GetSceneResponse
from geometry_msgs.msg import Vector3
from std_msgs.msg import ColorRGBA

from bullet_gazebo.common.messages import from_pose_msg, to_pose_msg, to_time, to_vector
from bullet_gazebo.common.publishing import SubscriberCount
from robot_sim.physics.description import Color, Joint, Light, Link, Shape
from robot_sim.physics.model import Model
from robot_sim.physics.pose import Pose
from robot_sim.pictures.visuals import VisibleModel, visible_model
from robot_sim.simulator import Simulator

PERIOD = 1.0 / 30.0  # [s of wall time] between two messages of a topic
STOP_TIMEOUT = 1.0  # [s]
REPEAT = 1.0  # [s] between two logs of the same complaint
NO_STOP = (1.0, 0.0)  # limits of a joint without any: the lower one above the upper one


class SceneServer:
    """Models and lights that a window doesn't know yet (~get_scene), ~scene_poses and ~scene_contacts.

    While it has subscribers, the topics come up to thirty times a second of wall time: a thread of its own
    copies the world when the lock is free, in lock-step between two requests or slices of a long one, and
    publishes the copies.
    """

    def __init__(self, sim: Simulator, sensors: Sequence[SceneSensor]) -> None:
        """`sensors` changes under the simulator's lock, and the world's version with it."""
        self._sim, self._sensors = sim, sensors
        # A window may outlive its simulator: the next one counts from another number.
        self._first = secrets.randbits(31)
        self._news = threading.Event()  # a subscriber comes or goes, or the end
        self._ending = threading.Event()
        self._one_at_a_time = threading.Lock()
        self._is_offered = False

    def show(self) -> None:
        """Offers the scene, if it isn't offered yet."""
        with self._one_at_a_time:
            if not self._is_offered:
                self._is_offered = True
                self._offer()

    def _offer(self) -> None:
        self._poses = self._advertise("~scene_poses", ScenePoses)
        self._contacts = self._advertise("~scene_contacts", SceneContacts)
        self._service = rospy.Service("~get_scene", GetScene, self._get)
        self._thread = threading.Thread(target=self._run, name="scene", daemon=True)
        self._thread.start()
        rospy.on_shutdown(self._stop)

    def _get(self, request: GetSceneRequest) -> GetSceneResponse:
        world, known = self._sim.world, frozenset(request.known)
        with self._sim.lock.glance():  # converting a large model takes long, and is done without it
            version = self._number(world.version)
            models = list(world.models.values())
            lights = [copy(light) for light in world.lights.values()]
            sensors = list(self._sensors)
        described = []
        for model in models:
            number = self._number(model.number)
            if number in known:
                described.append(SceneModel(number=number, name=model.name, known=True))
            else:
                described.append(to_model(model, number, request.collisions))
        return GetSceneResponse(version, described, [to_light(light) for light in lights], sensors)

    def _advertise(self, name: str, kind: type) -> tuple[rospy.Publisher, SubscriberCount]:
        count = SubscriberCount(self._news.set)
        # A slow subscriber misses some: with a queue, a thread of rospy's sends.
        publisher = rospy.Publisher(name, kind, subscriber_listener=count, queue_size=1)
        return publisher, count

    def _number(self, number: int) -> int:
        """Returns the world's version or a model's number as clients see it."""
        return (self._first + number) % 2**32

    def _run(self) -> None:
        while not self._ending.is_set():
            self._news.wait()
            self._news.clear()
            self._publish_until_unwatched()

    def _publish_until_unwatched(self) -> None:
        due = time.monotonic()
        while self._poses[1].size or self._contacts[1].size:
            if self._ending.wait(max(0.0, due - time.monotonic())):
                return
            try:
                with self._sim.lock.glance():
                    copies = self._copy()
                for publish in copies:
                    publish()
            except Exception:  # noqa: BLE001 - the simulation continues, and the next message comes
                if not rospy.is_shutdown():
                    rospy.logerr_throttle(REPEAT, f"a scene is lost:\n{traceback.format_exc()}")
            due = max(due + PERIOD, time.monotonic())  # missed messages aren't made up for

    def _copy(self) -> list[Callable[[], None]]:
        """Copies the state to publish; the caller holds the lock."""
        copies: list[Callable[[], None]] = []
        if self._poses[1].size:
            copies.append(self._copy_poses())
        if self._contacts[1].size:
            contacts = self._sim.world.contacts()
            points = _singles(each.point for each in contacts)
            forces = _singles(each.force for each in contacts)
            copies.append(partial(self._contacts[0].publish, SceneContacts(points, forces)))
        return copies

    def _copy_poses(self) -> Callable[[], None]:
        models = self._sim.world.models.values()
        poses = [pose for model in models for pose in model.link_poses()]
        joints = [model.joint_states() for model in models if model.joint_names]
        now, paused = self._sim.now, self._sim.paused
        version = self._number(self._sim.world.version)

        def publish() -> None:
            message = ScenePoses(
                version=version, now=to_time(now), paused=paused, lockstep=self._sim.lockstep,
                poses=_singles((*pose.position, *pose.orientation) for pose in poses),
                positions=_singles([position for position, _ in states] for states in joints),
            )  # fmt: skip
            self._poses[0].publish(message)

        return publish

    def _stop(self) -> None:
        self._ending.set()
        self._news.set()
        self._thread.join(STOP_TIMEOUT)


def _singles(rows: Iterable[Sequence[float]]) -> np.ndarray:
    """Returns all numbers in a row as 32-bit floats; too large ones become infinite."""
    with np.errstate(over="ignore"):
        return np.array([number for row in rows for number in row]).astype(np.float32)


def to_model(model: Model, number: int, collisions: bool) -> SceneModel:
    """Converts the visible parts of a model, with its collision shapes if `collisions`."""
    description = model.description
    seen = visible_model(description, number, model.name, model.link_names, model.joint_names, collisions)
    return SceneModel(
        number=number,
        name=model.name,
        is_static=seen.static,
        links=[
            SceneLink(link.name, _to_shapes(link.visuals), _to_shapes(link.collisions)) for link in seen.links
        ],
        joints=[_to_joint(joint, seen.tips[joint.name]) for joint in seen.joints],
        root=seen.root,
        frame=to_pose_msg(seen.frame),
    )


def from_model(message: SceneModel) -> VisibleModel:
    return VisibleModel(
        message.number,
        message.name,
        [
            Link(link.name, collisions=_from_shapes(link.collisions), visuals=_from_shapes(link.visuals))
            for link in message.links
        ],
        [_from_joint(joint) for joint in message.joints],
        message.root,
        from_pose_msg(message.frame),
        message.is_static,
        {each.name: from_pose_msg(each.tip) for each in message.joints},
    )


def to_light(light: Light) -> SceneLight:
    return SceneLight(
        name=light.name, kind=light.kind, diffuse=ColorRGBA(*light.diffuse),
        pose=to_pose_msg(light.pose), direction=Vector3(*light.direction),
    )  # fmt: skip


def from_light(message: SceneLight) -> Light:
    return Light(
        message.name, diffuse=_from_color(message.diffuse), direction=to_vector(message.direction),
        pose=from_pose_msg(message.pose), kind=message.kind,
    )  # fmt: skip


def _to_joint(joint: Joint, tip: Pose) -> SceneJoint:
    lower, upper = (joint.lower, joint.upper) if joint.bounded else NO_STOP
    frame, axis = to_pose_msg(joint.anchor), Vector3(*joint.axis)
    place = joint.parent, to_pose_msg(joint.pose), to_pose_msg(tip)
    return SceneJoint(joint.name, joint.kind, joint.child, frame, axis, lower, upper, *place)


def _from_joint(message: SceneJoint) -> Joint:
    return Joint(
        message.name, message.kind, message.parent, message.child, from_pose_msg(message.pose),
        anchor=from_pose_msg(message.frame), axis=to_vector(message.axis), lower=message.lower,
        upper=message.upper,
    )  # fmt: skip


def _to_shapes(shapes: Iterable[Shape]) -> list[SceneShape]:
    return [
        SceneShape(
            name=shape.name,
            kind=shape.kind,
            size=shape.size,
            pose=to_pose_msg(shape.pose),
            mesh=shape.mesh,
            has_color=shape.rgba is not None,
            color=ColorRGBA(*(shape.rgba or (0.0, 0.0, 0.0, 0.0))),
        )  # fmt: skip
        for shape in shapes
    ]


def _from_shapes(messages: Iterable[SceneShape]) -> list[Shape]:
    return [
        Shape(
            message.kind,
            tuple(message.size),
            from_pose_msg(message.pose),
            message.mesh,
            _from_color(message.color) if message.has_color else None,
            message.name,
        )  # fmt: skip
        for message in messages
    ]


def _from_color(message: ColorRGBA) -> Color:
    return (message.r, message.g, message.b, message.a)
