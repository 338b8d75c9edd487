"""A quick reader for OBJ files that have one object and no fault."""

import numpy as np

READ = ("v", "f", "o", "g")
WORDS = [[word] for word in READ]


def plain_obj(text: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Returns vertices and triangles, in half the time; None for a file of another form."""
    lines = [line for line in map(str.strip, text.splitlines()) if line.split(None, 1)[:1] in WORDS]
    corners = [line for line in lines if line[0] == "v"]
    faces = [line for line in lines if line[0] == "f"]
    known, used = " ".join(corners).split(), " ".join(faces).split()
    if "\\" in text or any(line[0] not in "vf" for line in lines[1:]):
        return None
    if len(known) != 4 * len(corners) or len(used) != 4 * len(faces) or not used:
        return None
    try:
        vertices = np.array([float(word) for word in known if word != "v"]).reshape(-1, 3)
        indices = [int(word.partition("/")[0]) for word in used if word != "f"]
    except ValueError:
        return None
    plain = np.array(indices).reshape(-1, 3)
    whole = np.isfinite(vertices).all() and plain.min() > 0 and plain.max() <= len(vertices)
    return (vertices, plain - 1) if whole else None
