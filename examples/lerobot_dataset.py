#!/usr/bin/env python3
"""A folder of `workbench.py dataset` becomes a dataset of LeRobot's, format v3.

LeRobot pins another torch than this project, so it gets a virtual environment of its own, which needs nothing
of this project. Python 3.12 gets LeRobot 0.6.1, older ones 0.4.4:

    python3 -m venv lerobot
    lerobot/bin/pip install --extra-index-url https://download.pytorch.org/whl/cpu "lerobot[dataset]<0.7"
    lerobot/bin/python examples/lerobot_dataset.py datasets/pick datasets/pick_lerobot --task "lift the cube"

A frame has what was observed before an action, the action, and its reward; the last observation is left out.
"""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

NAMES = {"observations": "observation.state", "observations.observation": "observation.state",
         "actions": "action", "rewards": "next.reward"}  # fmt: skip
PICTURES = "observation.images."


def episodes(folder: Path, metadata: dict[str, Any]) -> Iterator[dict[str, np.ndarray]]:
    """Yields each episode's arrays by LeRobot's names [steps, ...], floats as float32, as LeRobot loads them.

    `next.success`, at the end of an episode, is left out if any episode doesn't say it.
    """
    is_judged = all(about["success"] is not None for about in metadata["episodes"])
    for about in metadata["episodes"]:
        with np.load(folder / about["file"]) as data:
            arrays = dict(data)
        ends = arrays.pop("terminations") | arrays.pop("truncations")
        found = {"next.done": ends, **({"next.success": ends & about["success"]} if is_judged else {})}
        for name, values in arrays.items():
            is_picture = values.dtype == np.uint8 and values.shape[3:] == (3,)
            key = NAMES.get(name, f"observation.{name.removeprefix('observations.')}")
            is_float = values.dtype.kind == "f"
            found[PICTURES + name if is_picture else key] = values.astype(np.float32) if is_float else values
        steps = len(ends)  # each row becomes an array, also that of a lone number
        yield {key: each[:steps].reshape(steps, *each.shape[1:] or (1,)) for key, each in found.items()}


def feature(key: str, values: np.ndarray, pictures: str) -> dict[str, Any]:
    """Returns what LeRobot is told of an array; `pictures` is "image" (lossless) or "video"."""
    is_picture = key.startswith(PICTURES)
    names = ["height", "width", "channels"] if is_picture else None
    return {"dtype": pictures if is_picture else str(values.dtype), "shape": values.shape[1:], "names": names}


def main() -> None:
    parser = argparse.ArgumentParser(description="writes a dataset of LeRobot's")
    parser.add_argument("dataset", type=Path, help="a folder that workbench.py dataset has written")
    parser.add_argument("out", type=Path, help="a new folder")
    parser.add_argument("--task", help="in words; default: the environment's id")
    parser.add_argument("--fps", type=int, help="steps a second; default: as the environment says")
    parser.add_argument("--video", action="store_true", help="pictures as MP4, with loss, not as PNG")
    options = parser.parse_args()
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    metadata = json.loads((options.dataset / "metadata.json").read_text(encoding="utf-8"))
    fps, task = options.fps or metadata["render_fps"], options.task or metadata["env_id"]
    pictures, dataset = "video" if options.video else "image", None  # type: str, Any
    for episode in episodes(options.dataset, metadata):
        features = {key: feature(key, values, pictures) for key, values in episode.items()}
        dataset = dataset or LeRobotDataset.create(options.out.name, fps, features, options.out)
        for row in range(len(episode["action"])):
            dataset.add_frame({key: values[row] for key, values in episode.items()} | {"task": task})
        dataset.save_episode()
    dataset.finalize()


if __name__ == "__main__":
    main()
