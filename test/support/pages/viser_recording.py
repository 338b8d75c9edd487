"""Reads what a viser recording holds."""

import msgspec
import numpy as np
import zstandard

ALIGNED = 8  # [bytes]; where an array begins


class Recording:
    """Messages with their times [s], and the nodes that they leave."""

    def __init__(self, content):
        whole = zstandard.ZstdDecompressor().decompress(content[8:])
        length = int.from_bytes(whole[:8], "little")
        found = msgspec.msgpack.decode(whole[8 : 8 + length])
        self.duration = found["durationSeconds"]  # [s]
        self._arrays, start = [], 8 + length
        for size in found["binaryBufferLengths"]:
            start += -start % ALIGNED
            self._arrays.append(whole[start : start + size])
            start += size
        self.messages = [(when, self._with_arrays(each)) for when, each in found["messages"]]

    def _with_arrays(self, value):
        if isinstance(value, dict) and "__binary_index" in value:
            return np.frombuffer(self._arrays[value["__binary_index"]], value["dtype"])
        if isinstance(value, dict):
            return {key: self._with_arrays(each) for key, each in value.items()}
        return value

    def of(self, kind):
        """The messages of a type, without their times."""
        return [message for _, message in self.messages if message["type"] == kind]

    def at(self, time=float("inf")):
        """Nodes by name as they are at a time [s]: their props, position and wxyz."""
        nodes = {}
        for when, message in self.messages:
            if when > time:
                break
            kind, name = message["type"], message.get("name")
            if "props" in message:
                nodes[name] = {"kind": kind, "position": [0.0] * 3, "wxyz": [1.0, 0.0, 0.0, 0.0]}
                nodes[name] |= message["props"]
            elif kind == "RemoveSceneNodeMessage":
                nodes = {
                    each: node
                    for each, node in nodes.items()
                    if each != name and not each.startswith(f"{name}/")
                }
            elif kind in ("SetPositionMessage", "SetOrientationMessage"):
                nodes.setdefault(name, {}).update(
                    {key: message[key] for key in ("position", "wxyz") if key in message}
                )
            elif kind == "SceneNodeUpdateMessage":
                nodes[name].update(message["updates"])
        return nodes

    def parts(self, time=float("inf")):
        """What the batches of shapes are made of at a time [s], each with position, wxyz and scale."""
        found = []
        for node in self.at(time).values():
            if node.get("kind") == "BatchedMeshesMessage":
                columns = [
                    np.reshape(node[f"batched_{key}s"], (-1, width)).tolist()
                    for key, width in (("position", 3), ("wxyz", 4), ("scale", 3))
                ]
                keys = ("position", "wxyz", "scale")
                found += [dict(zip(keys, row, strict=True)) for row in zip(*columns, strict=True)]
        return found
