"""The world as it stands on the page: a frame for each link, and its shapes below it."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import viser

from bullet_gazebo.physics.description import Light
from bullet_gazebo.physics.elements import shown
from bullet_gazebo.physics.pose import Pose
from bullet_gazebo.pictures.page.seen import SeenJoint, SeenModel
from bullet_gazebo.pictures.page.shapes import ShapeMaker, color_bytes, wxyz

NUMBERS = 7  # of a pose
STILL = 1e-6  # [m], and of a quaternion's parts: what moves by less isn't drawn anew
AXES = 0.15  # [m] of a joint's frame
CONTACT = 0.02  # [m]; how large a contact point is
RED = (220, 30, 30)


@dataclass
class DrawnModel:
    """A model on the page; `frames` are the nodes of its links."""

    seen: SeenModel
    frames: list[viser.FrameHandle]

    def pose(self, links: np.ndarray) -> Pose:
        """Returns where the model's frame is, from the poses (n, 7) of its links."""
        row = links[self.seen.root].tolist()
        root = Pose((row[0], row[1], row[2]), (row[3], row[4], row[5], row[6]))
        return root.compose(self.seen.frame)


class Picture:
    """Draws models. For one thread.

    Args:
        server: of the page.
        warn: is told what can't be shown, in one line.
        below: the node below which the models are.
    """

    def __init__(
        self, server: viser.ViserServer, warn: Callable[[str], None], below: str = ""
    ) -> None:
        self._server = server
        self._below = below
        self._shapes = ShapeMaker(server.scene, warn)
        self.models: dict[int, DrawnModel] = {}  # in the scene's order
        self._lights: list[viser.SceneNodeHandle] = []
        self._frames: list[viser.FrameHandle] = []
        self._last = np.zeros((0, NUMBERS))
        # Counts: a node of a name that was just taken away may go in the browser, too.
        self._drawings = 0
        self._contacts: viser.PointCloudHandle | None = None

    def draw(
        self, models: Sequence[SeenModel], lights: Iterable[Light], joint_frames: bool = False
    ) -> None:
        """Adds what is new, and takes away what is gone; of what is drawn already the number will do."""
        wanted = {model.number for model in models}
        with self._server.atomic():
            for number in [each for each in self.models if each not in wanted]:
                for frame in self.models.pop(number).frames:
                    frame.remove()
            drawn = self.models
            self.models = {
                model.number: drawn.get(model.number) or self._add(model, joint_frames)
                for model in models
            }
            self._light(lights)
        self._frames = [frame for model in self.models.values() for frame in model.frames]
        self._last = np.full((len(self._frames), NUMBERS), np.nan)

    def clear(self) -> None:
        """Takes all away, for a scene that is drawn otherwise."""
        with self._server.atomic():
            for model in self.models.values():
                for frame in model.frames:
                    frame.remove()
        self.models, self._frames = {}, []
        self._drawings += 1

    def _add(self, model: SeenModel, joint_frames: bool) -> DrawnModel:
        frames = []
        for index, link in enumerate(model.links):
            # Names may hold anything, so nodes are named by numbers.
            node = f"{self._below}/m{model.number}_{index}_{self._drawings}"
            frames.append(self._server.scene.add_frame(node, show_axes=False))
            where = f"model '{shown(model.name)}', link '{shown(link.name)}'"
            for count, shape in enumerate(link.visuals):
                self._shapes.add(f"{node}/v{count}", shape, f"{where}, visual", collision=False)
            for count, shape in enumerate(link.collisions):
                self._shapes.add(f"{node}/c{count}", shape, f"{where}, collision", collision=True)
        if joint_frames:
            nodes = {link.name: frame.name for link, frame in zip(model.links, frames, strict=True)}
            for count, joint in enumerate(model.joints):
                if joint.child in nodes:
                    self._add_joint(f"{nodes[joint.child]}/j{count}", joint)
        return DrawnModel(model, frames)

    def _add_joint(self, node: str, joint: SeenJoint) -> None:
        axis = np.array(joint.axis)
        self._server.scene.add_frame(
            node, axes_length=AXES, axes_radius=AXES / 25, position=joint.frame.position,
            wxyz=wxyz(joint.frame.orientation),
        )  # fmt: skip
        ends = np.stack([-AXES * axis, 2 * AXES * axis])[None].astype(np.float32)
        self._server.scene.add_line_segments(
            f"{node}/axis", ends, (250, 200, 0), thickness=AXES / 15
        )
        self._server.scene.add_label(
            f"{node}/name", shown(joint.name), position=tuple((2 * AXES * axis).tolist())
        )

    def _light(self, lights: Iterable[Light]) -> None:
        """Roughly: directional and point lights of their colour, and an even one so that nothing is dark."""
        for node in self._lights:
            node.remove()
        scene, self._lights = self._server.scene, []
        self._lights.append(scene.add_light_ambient("/lights/ambient", intensity=0.9))
        for count, light in enumerate(lights):
            color = color_bytes(light.diffuse)
            x, y, z = light.direction
            if light.kind == "directional":  # the page's shines from where it is to the origin
                self._lights.append(
                    scene.add_light_directional(
                        f"/lights/{count}", color=color, intensity=2.5, cast_shadow=True,
                        position=(-10.0 * x, -10.0 * y, -10.0 * z),
                    )
                )  # fmt: skip
            else:
                self._lights.append(
                    scene.add_light_point(
                        f"/lights/{count}", color=color, intensity=20.0,
                        position=light.pose.position,
                    )
                )  # fmt: skip

    def move(self, poses: np.ndarray) -> None:
        """Moves the links: position [m] and quaternion x y z w of each, in the models' order (n, 7)."""
        if len(poses) != len(self._frames):
            return
        still = (np.abs(poses - self._last) <= STILL).all(axis=1)
        moved = np.flatnonzero(~still & np.isfinite(poses).all(axis=1))
        with self._server.atomic():
            for index in moved:
                frame, pose = self._frames[index], poses[index]
                frame.position, frame.wxyz = pose[:3], wxyz(pose[3:])
        self._last[moved] = poses[moved]

    @property
    def links(self) -> dict[str, np.ndarray]:
        """Poses (n, 7) of the links, by model; of those that have been told."""
        found, first = {}, 0
        for model in self.models.values():
            rows = self._last[first : first + len(model.frames)]
            first += len(model.frames)
            if len(rows) and np.isfinite(rows[model.seen.root]).all():
                found[model.seen.name] = rows
        return found

    def joints(self, positions: Sequence[float]) -> dict[str, list[float]]:
        """Returns the positions [rad, m] of all joints by model."""
        found, first = {}, 0
        for model in self.models.values():
            count = len(model.seen.joints)
            found[model.seen.name] = list(positions[first : first + count])
            first += count
        return found

    def touch(self, points: np.ndarray) -> None:
        """Shows where bodies touch: points [m] (n, 3)."""
        points = points.astype(np.float32)
        if self._contacts is not None:
            if len(points) or self._contacts.visible:
                self._contacts.points = points
                self._contacts.visible = bool(len(points))
        elif len(points):
            self._contacts = self._server.scene.add_point_cloud(
                "/contacts",
                points,
                RED,
                point_size=CONTACT,
                point_shape="circle",
                precision="float32",
            )
