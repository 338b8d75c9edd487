"""Rendering by OpenGL, on a GPU or in software, through MuJoCo; any engine may move the world.

A scene's visuals are mirrored into a model of MuJoCo once; then only poses are moved. Curved shapes are drawn
as facets. EGL is used, or what the environment variable MUJOCO_GL names.
"""

import importlib
import math
import os
from typing import Any

import numpy as np

from robot_sim.physics.engines import installing
from robot_sim.sensors.frames import frames
from robot_sim.sensors.intersection import reach
from robot_sim.sensors.pinhole import CameraView, Shot
from robot_sim.sensors.rendering import CameraRenderer, RendererError
from robot_sim.sensors.scene import SceneState, Target
from robot_sim.sensors.shading import AMBIENT, BACKGROUND, DIFFUSE

SLICES, STACKS = 64, 32  # of a ball
ROUND = 2.0 / (1.0 + math.cos(math.pi / SLICES))  # facets half within the shape and half without
LEAST_NEAR = 1e-3  # [m]; a near plane in the eye shows nothing
LEAST = 1e-9  # [m] of what MuJoCo would refuse as too small
THIN = 1e-6  # half the thickness of a plane, by how far the camera sees
OFF = ("SHADOW", "REFLECTION", "HAZE", "SKYBOX", "FOG")
SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader", "software")


class GlRenderer(CameraRenderer):
    """Draws pictures by MuJoCo's own renderer; raises RendererError where MuJoCo or GL is missing."""

    name = "gl"

    def __init__(self) -> None:
        super().__init__()
        self._context: Any = None
        self._state: SceneState | None = None
        self._size = 1, 1
        before = os.environ.get("MUJOCO_GL")
        platform = before or "egl"
        try:
            self._mj: Any = importlib.import_module("mujoco")
            os.environ["MUJOCO_GL"] = platform  # for MuJoCo's library
            self._gl: Any = importlib.import_module(f"mujoco.{platform}").GLContext(1, 1)
            self._gl.make_current()
            self._build([])
            gl = importlib.import_module("OpenGL.GL")
            self.device = gl.glGetString(gl.GL_RENDERER).decode()
        except Exception as error:  # PyOpenGL and drivers raise what they like
            if before is None:  # processes that this one starts would stumble over it
                os.environ.pop("MUJOCO_GL", None)
            fault = f"MUJOCO_GL={platform} gives no GL: {' '.join(str(error).split())[:200]}"
            fault += "; './ws extras' installs Mesa's, or take the renderer 'rays'"
            if isinstance(error, ModuleNotFoundError) and error.name in ("mujoco", "OpenGL"):
                fault = f"GL needs MuJoCo, an extra: '{installing('mujoco')}' installs it"
            raise RendererError(fault) from error

    @property
    def is_software(self) -> bool:
        """Whether no GPU draws."""
        return any(name in self.device.lower() for name in SOFTWARE)

    def close(self) -> None:
        super().close()
        if self._context is not None:
            self._gl.make_current()
            self._context.free()
            self._gl.free()
            self._context = None

    def _render(self, shot: Shot) -> CameraView:
        mj, camera, state = self._mj, shot.camera, shot.scene
        self._gl.make_current()
        size = camera.width, camera.height
        if self._state is None or self._state.version != state.version:
            self._size = size
            self._build(state.all_targets)
        elif any(np.greater(size, self._size)):
            self._size = max(size[0], self._size[0]), max(size[1], self._size[1])
            mj.mjr_resizeOffscreen(*self._size, self._context)
        self._state = state
        data = self._data
        turns, places = state.turns @ self._own_turns, state.places
        data.geom_xpos[:] = places + np.einsum("kij,kj->ki", state.turns, self._own_places)
        data.geom_xmat[:] = turns.reshape(-1, 9)
        eye = self._look(shot)
        colours, depths = self._draw(shot, from_behind=False)
        near = max(camera.near, LEAST_NEAR)
        corner = near * math.hypot(1.0, camera.across[0], camera.down[0, 0])
        if (np.linalg.norm(data.geom_xpos - eye, axis=1) < self._reaches + corner).any():
            # GL lights faces on their front alone; rays see the inside of a shape, and sheets from behind.
            others, there = self._draw(shot, from_behind=True)
            nearer = there > depths
            colours[nearer], depths[nearer] = others[nearer], there[nearer]
        nothing = depths == 0.0
        colours[nothing] = int(BACKGROUND)
        along = near * camera.far / (near + depths * (camera.far - near))
        return CameraView(colours, np.where(nothing, np.inf, along))

    def _draw(self, shot: Shot, from_behind: bool) -> tuple[np.ndarray, np.ndarray]:
        """Returns colours, and depths in GL's unit: of fronts, or `from_behind` of all faces lit there."""
        mj, camera, scene = self._mj, shot.camera, self._scene
        scene.flags[mj.mjtRndFlag.mjRND_CULL_FACE] = not from_behind
        beams = shot.scene.beams[: len(scene.lights)]
        _set(scene, nlight=len(beams))
        for number, (direction, strength) in enumerate(beams):
            length = np.linalg.norm(direction) or 1.0
            _set(
                scene.lights[number], type=mj.mjtLightType.mjLIGHT_DIRECTIONAL,
                dir=direction / (-length if from_behind else length),
                ambient=[AMBIENT if number == 0 else 0.0] * 3, diffuse=DIFFUSE * strength,
                specular=[0.0] * 3, castshadow=0, headlight=0,
            )  # fmt: skip
        rect = mj.MjrRect(0, 0, camera.width, camera.height)
        mj.mjr_render(rect, scene, self._context)
        colours = np.empty((camera.height, camera.width, 3), np.uint8)
        depths = np.empty((camera.height, camera.width), np.float32)
        mj.mjr_readPixels(colours, depths, rect, self._context)
        return colours[::-1], depths[::-1]  # the lowest row comes first

    def _look(self, shot: Shot) -> np.ndarray:
        """Puts the eye where the camera is, and below it what stands for endless planes; returns where."""
        camera, data, scene = shot.camera, self._data, self._scene
        turns, places = frames([shot.link.compose(camera.pose)])
        for plane in self._planes:
            normal = data.geom_xmat[plane].reshape(3, 3)[:, 2]
            height = (places[0] - data.geom_xpos[plane]) @ normal
            half = THIN * camera.far  # behind what is seen of the plane, from above or below
            data.geom_xpos[plane] = places[0] - (height + math.copysign(half, height)) * normal
            self._model.geom_size[plane] = 2.0 * camera.far, 2.0 * camera.far, half
        mj = self._mj
        mj.mjv_updateScene(
            self._model, data, self._option, None, mj.MjvCamera(), mj.mjtCatBit.mjCAT_ALL, scene
        )
        near = max(camera.near, LEAST_NEAR)
        across, up = (0.5 * near * side / camera.focal_length for side in (camera.width, camera.height))
        for eye in scene.camera:
            _set(
                eye, pos=places[0], forward=turns[0, :, 0], up=turns[0, :, 2], orthographic=0,
                frustum_near=near, frustum_far=camera.far, frustum_bottom=-up, frustum_top=up,
                frustum_center=0.0, frustum_width=across,
            )  # fmt: skip
        return np.asarray(places[0])

    def _build(self, targets: list[Target]) -> None:
        """Makes a MuJoCo model of the visible shapes."""
        mj = self._mj
        spec = mj.MjSpec()
        _set(
            spec.visual.quality, offsamples=0, shadowsize=0, numslices=SLICES, numstacks=STACKS,
            numquads=1,
        )  # fmt: skip
        _set(spec.visual.global_, offwidth=self._size[0], offheight=self._size[1])
        added = [self._add(spec, f"{number}", target) for number, target in enumerate(targets)]
        if self._context is not None:
            self._context.free()
        self._model = model = spec.compile()
        textures = [texture for texture in added if texture is not None]
        for begin, texture in zip(model.tex_adr, textures, strict=True):
            lowest_first = texture[::-1].ravel()
            model.tex_data[begin : begin + texture.size] = lowest_first
        self._data, self._option = mj.MjData(model), mj.MjvOption()
        self._scene = mj.MjvScene(model, maxgeom=len(targets) + 1)
        self._context = mj.MjrContext(model, mj.mjtFontScale.mjFONTSCALE_50)
        _set(self._context, readDepthMap=mj.mjtDepthMap.mjDEPTH_ZEROFAR)
        mj.mjr_setBuffer(mj.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        for flag in OFF:
            self._scene.flags[getattr(mj.mjtRndFlag, f"mjRND_{flag}")] = 0
        # From how near a shape may show the back of a face; a mesh always.
        self._reaches = np.array([
            -np.inf if (kind := target.shape.kind) == "plane"
            else np.inf if kind == "mesh" else reach(kind, target.shape.size)
            for target in targets
        ])  # fmt: skip
        self._planes = [n for n, target in enumerate(targets) if target.shape.kind == "plane"]
        count = len(targets)
        self._own_turns, self._own_places = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
        # MuJoCo moves meshes into frames of theirs.
        for number in np.flatnonzero(model.geom_dataid >= 0):
            mesh, turn = model.geom_dataid[number], self._own_turns[number].reshape(9)
            mj.mju_quat2Mat(turn, model.mesh_quat[mesh])
            self._own_places[number] = model.mesh_pos[mesh]

    def _add(self, spec: Any, name: str, target: Target) -> np.ndarray | None:
        """Adds a visual to a model, with room for its texture; returns that."""
        mj, shape, piece = self._mj, target.shape, target.piece
        paint = spec.add_material(name=name, rgba=[*target.rgba[:3], 1.0])
        _set(paint, specular=0.0, shininess=0.0, reflectance=0.0)
        geom = spec.worldbody.add_geom(material=name, contype=0, conaffinity=0)
        geom.type = getattr(mj.mjtGeom, f"mjGEOM_{shape.kind.upper()}")
        size = np.maximum(shape.size, LEAST)
        if shape.kind == "box":
            geom.size = size / 2.0
        elif shape.kind == "cylinder":
            geom.size = [ROUND * size[0], size[1] / 2.0, 0.0]
        elif shape.kind == "sphere":
            geom.size = [ROUND * size[0], 0.0, 0.0]
        elif shape.kind == "plane":  # MuJoCo shows its own ones from above alone
            geom.type = mj.mjtGeom.mjGEOM_BOX
            geom.size = [1.0, 1.0, THIN]
        elif piece is not None and (whole := piece.solid.normals.any(axis=1)).any():
            geom.meshname = name
            mesh = spec.add_mesh(name=name, inertia=mj.mjtMeshInertia.mjMESH_INERTIA_SHELL)
            count = max(int(np.count_nonzero(whole)), 6)  # a single triangle counts twice

            def flat(each: np.ndarray) -> np.ndarray:
                return np.resize(each[whole], (count, each.shape[1])).ravel()

            corners, normals = map(flat, piece.solid)
            _set(mesh, uservert=corners, usernormal=normals, userface=np.arange(count))
            if piece.texture is not None and piece.uvs is not None:
                _set(mesh, usertexcoord=flat(piece.uvs))
                height, width = piece.texture.shape[:2]
                spec.add_texture(
                    name=name, type=mj.mjtTexture.mjTEXTURE_2D, width=width, height=height,
                    builtin=mj.mjtBuiltin.mjBUILTIN_FLAT, nchannel=3,
                )  # fmt: skip
                paint.textures[mj.mjtTextureRole.mjTEXROLE_RGB] = name
                return piece.texture
        else:  # triangles without an area
            _set(geom, type=mj.mjtGeom.mjGEOM_SPHERE, size=[LEAST] * 3)
        return None


def _set(part: Any, **values: Any) -> None:
    """Sets attributes of one of MuJoCo's structures."""
    for name, value in values.items():
        setattr(part, name, value)
