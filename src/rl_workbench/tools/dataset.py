"""`dataset`: replays demonstrations, and writes what was observed, with pictures and sensors."""

import argparse
import os
import re
import shlex
import shutil
import sys
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import closing, contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt
from rl_workbench.tools.flags import env_options, typed_values
from rl_workbench.training.progress import tell

if TYPE_CHECKING:
    import numpy as np

    from rl_workbench.training.checked import Env
    from rl_workbench.training.demonstrations import Played

RENDER = "render"  # among the sensors: the environment's own pictures
METADATA = "metadata.json"


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of the command."""
    add = parser.add_argument
    add("demos", type=Path, metavar="DEMOS", help="a folder that demonstrate has written")
    add("--out", type=Path, required=True, metavar="FOLDER", help="a new one; for minari NAME-v0")
    add("--format", choices=("npz", "minari"), default="npz", help="default npz")
    add("--sensors", default="", metavar="NAMES",
        help="of the robot, with commas, as front_camera@640x480,scan; render: its own pictures")  # fmt: skip
    add("--camera", nargs="+", default=[], metavar="KEY=VALUE",
        help="fields of the camera of render, e.g. distance=2.5 yaw=90")  # fmt: skip
    add("--env-kwargs", nargs="+", default=[], metavar="KEY=VALUE",
        help="other options of the environment; rewards must stay the same")  # fmt: skip


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Replays all episodes; the dataset appears once it is whole."""
    from rl_workbench.tools.recording import draw_without_display
    from rl_workbench.training import demonstrations
    from rl_workbench.training.folder import library_versions

    out, is_minari = arguments.out, arguments.format == "minari"
    if is_minari:
        if not (find_spec("minari") and find_spec("h5py")):
            command = shlex.join([sys.executable, "-m", "pip", "install", "minari[hdf5]"])
            raise WorkbenchError(f"--format minari needs Minari: {command} installs it")
        if not re.fullmatch(r"[\w-]+-v\d+", out.name, re.ASCII):
            raise WorkbenchError(f"--out: Minari's datasets are named as in pick-v0, not {out.name}")
    if out.exists():
        raise WorkbenchError(f"{out} exists; a dataset gets a new folder")
    found = demonstrations.load_all(arguments.demos)
    origin = next(iter(found.values())).origin
    changed, names = env_options(arguments), [each for each in arguments.sensors.split(",") if each]
    drawn = [each for each in names if each.partition("@")[0] == RENDER]
    own = [each for each in names if each not in drawn]
    options = dict(changed)
    if drawn:
        draw_without_display()
        options |= {"render_mode": "rgb_array", **_size(drawn[0])}
        if arguments.camera:
            options["camera"] = typed_values(arguments.camera, "--camera")
    if len({name.partition("@")[0] for name in names}) < len(names):
        raise WorkbenchError("--sensors names one twice")
    with closing(origin.make(options)) as env, _whole(out) as folder:
        sense = _sensors(env, own) if own else dict
        write = (_Minari if is_minari else _Npz)(folder, env)
        for path, episode in found.items():
            steps, sensed = [], []
            for played in demonstrations.replay(path, episode, env, exactly=not changed):
                if interrupt.requested():
                    raise WorkbenchError(f"interrupted: {out} isn't written")
                steps.append(played)
                sensed.append({**sense(), **({RENDER: env.render()} if drawn else {})})
            write.add(path, episode, steps, _stacked(sensed))
        compared = ["rewards", "ends", *([] if changed else ["observations"])]
        write.close({
            **origin._asdict(), "env_kwargs": {**origin.env_kwargs, **changed}, "sensors": names,
            "versions": library_versions(), "render_fps": env.metadata.get("render_fps"),
            "replay": {"episodes": len(found), "equal_to_the_bit": compared},
        })  # fmt: skip
    tell(f"{out}: {len(found)} episodes, replayed to the bit ({', '.join(compared)})")


def _size(name: str) -> dict[str, int]:
    _, is_sized, size = name.partition("@")
    sides = size.split("x")
    if is_sized and not (len(sides) == 2 and all(side.isdecimal() for side in sides)):
        raise WorkbenchError(f"--sensors {name}: the size is WIDTHxHEIGHT, as in {RENDER}@640x480")
    return dict(zip(("width", "height"), map(int, sides), strict=True)) if is_sized else {}


def _sensors(env: "Env", names: list[str]) -> Any:
    """Returns what reads these sensors of the robot."""
    from gymnasium import error

    if not env.has_wrapper_attr("sensor_reader"):
        raise WorkbenchError(f"--sensors: this environment has none but {RENDER}")
    try:
        return env.get_wrapper_attr("sensor_reader")(names)
    except (error.Error, ValueError) as wrong:
        raise WorkbenchError(f"--sensors: {wrong}") from wrong


def _stacked(sensed: list[dict[str, Any]]) -> "dict[str, np.ndarray]":
    """Returns what sensors measured, by name without sizes [steps + 1, ...]."""
    import numpy as np

    arrays = {}
    for name in sensed[0]:
        plain, _, field = name.partition(".")
        try:
            values = np.stack([np.asarray(each[name]) for each in sensed])
        except ValueError as error:
            raise WorkbenchError(f"--sensors: {name} isn't always of one size") from error
        if values.dtype.kind not in "biuf":
            raise WorkbenchError(f"--sensors: {name} isn't numbers")
        arrays[".".join(filter(None, (plain.partition("@")[0], field)))] = values
    return arrays


@contextmanager
def _whole(out: Path) -> Iterator[Path]:
    """Yields a folder that gets its name once all is written, and else is removed."""
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(prefix=f".{out.name}.", dir=out.parent))
    except OSError as error:
        raise WorkbenchError(f"can't write {out}: {error.strerror}") from error
    try:
        yield scratch / out.name
        os.rename(scratch / out.name, out)
    except OSError as error:
        raise WorkbenchError(f"can't write {out}: {error.strerror or error}") from error
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _columns(steps: "list[Played]") -> dict[str, Any]:
    """Returns what both formats hold of an episode."""
    import numpy as np

    seen, taken = [each.observation for each in steps], steps[1:]
    observations: Any = (
        {name: np.stack([each[name] for each in seen]) for name in seen[0]}
        if isinstance(seen[0], dict)
        else np.stack(seen)
    )
    terminations = np.array([each.terminated for each in taken])
    truncations = np.array([each.truncated for each in taken])
    truncations[-1] |= not terminations[-1]  # also where a driver has stopped
    return {
        "observations": observations, "actions": np.array([each.action for each in taken]),
        "rewards": np.array([each.reward for each in taken]),
        "terminations": terminations, "truncations": truncations,
    }  # fmt: skip


class _Npz:
    """A file of arrays for each episode, and metadata."""

    def __init__(self, folder: Path, env: "Env") -> None:
        folder.mkdir()
        self._folder, self._episodes = folder, []  # type: Path, list[dict[str, Any]]

    def add(self, path: Path, episode: Any, steps: Any, sensed: dict[str, Any]) -> None:
        import numpy as np

        columns = _columns(steps)
        if isinstance(seen := columns["observations"], dict):
            del columns["observations"]
            columns |= {f"observations.{name}": each for name, each in seen.items()}
        np.savez_compressed(self._folder / path.name, **columns, **sensed)
        about = {"file": path.name, "seed": episode.seed, "success": episode.success}
        self._episodes.append({**about, "steps": len(episode.actions)})

    def close(self, metadata: dict[str, Any]) -> None:
        from rl_workbench.storage import as_json, write_atomically

        content = {**metadata, "episodes": self._episodes}
        write_atomically(self._folder / METADATA, as_json(content))


class _Minari:
    """A dataset by Minari, its pictures without loss."""

    def __init__(self, folder: Path, env: "Env") -> None:
        self._folder, self._env, self._dataset = folder, env, None  # type: Path, Env, Any

    def add(self, path: Path, episode: Any, steps: Any, sensed: dict[str, Any]) -> None:
        import minari
        from gymnasium import spaces
        from minari.data_collector import EpisodeBuffer

        columns, space = _columns(steps), self._env.observation_space
        if sensed:
            boxes = {name: _box(each) for name, each in sensed.items()}
            space = spaces.Dict({"observation": space, **boxes})
            columns["observations"] = {"observation": columns["observations"], **sensed}
        rows = {name: columns[name] for name in ("rewards", "terminations", "truncations")}
        buffer = EpisodeBuffer(
            seed=episode.seed, observations=columns["observations"], actions=columns["actions"],
            **{name: each.tolist() for name, each in rows.items()},
        )  # fmt: skip
        if self._dataset is not None:
            self._dataset.update_dataset_from_buffer([buffer])
            return
        os.environ["MINARI_DATASETS_PATH"] = str(self._folder.parent.resolve())
        spec = self._env.unwrapped.spec
        with warnings.catch_warnings(action="ignore"):  # about an author, and so on
            self._dataset = minari.create_dataset_from_buffers(
                self._folder.name, [buffer], env=spec, eval_env=spec, observation_space=space,
                action_space=self._env.action_space, jpeg_encoding=False,
            )  # fmt: skip

    def close(self, metadata: dict[str, Any]) -> None:
        import json

        self._dataset.storage.update_metadata({"demonstrations": json.dumps(metadata)})


def _box(values: "np.ndarray") -> Any:
    import numpy as np
    from gymnasium import spaces

    is_picture = values.dtype == np.uint8
    low, high = (0, 255) if is_picture else (-np.inf, np.inf)
    return spaces.Box(low, high, values.shape[1:], values.dtype)
