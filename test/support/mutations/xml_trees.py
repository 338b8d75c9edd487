"""Random changes of XML trees, made with knowledge of names, numbers and joints."""

import copy
from functools import partial
from xml.etree.ElementTree import Element, fromstring, register_namespace, tostring

from hypothesis import strategies as st

MOST_CHANGES = 5  # of one model; the faults of more hide each other

register_namespace("xacro", "http://www.ros.org/wiki/xacro")  # else it is written as ns0

ODD = [
    "", " ", "\t", "0", "-1", "1", "1e308", "-1e308", "1e400", "1e-320", "nan", "inf", "-inf",
    "9" * 500, "0x10", "1,5", "1_0", "1 2", "1 2 3", "1 2 3 4 5 6", "0 0 0", "nan nan nan",
    "1e200 1e200 1e200", "true", "TRUE", "none", "world", "__model__", "__root__", "base", "a", "b",
    "arm::hand", "::", "..", "~", "~nobody/x", "/", "/dev/zero", "x" * 3000, "a\nb", "ä\u202e",
    "\ufeff", "'\"<&>", "%00", "%s{}$(x)${y}", "package://none/x.stl", "package://", "model://crate",
    "model://gone", "model://%00", "file:///dev/zero", "gz://x", "1.6", "1.99", "2.0", "revolute",
    "prismatic", "fixed", "floating", "planar", "ball", "hardware_interface/VelocityJointInterface",
]  # fmt: skip
NAMING = ("name", "link", "joint", "reference", "relative_to", "attached_to", "expressed_in")
CHANGES = st.tuples(
    st.sampled_from(["drop", "copy", "move", "swap", "attribute", "text", "refer", "loop", "rename", "wrap"]),
    st.integers(0, 10**6), st.integers(0, 10**6), st.integers(0, 10**6),
)  # fmt: skip


def mutated_xml(base: str) -> st.SearchStrategy[str]:
    """Draws texts that are `base` with a few changes of its tree."""
    return st.lists(CHANGES, min_size=1, max_size=MOST_CHANGES).map(partial(_changed, base))


def _changed(base: str, changes: list[tuple[str, int, int, int]]) -> str:
    root = fromstring(base)
    for kind, first, second, third in changes:
        elements = list(root.iter())
        parents = {child: parent for parent in elements for child in parent}
        one, other = elements[first % len(elements)], elements[second % len(elements)]
        _change(kind, one, other, parents, third)
    return tostring(root, encoding="unicode")


def _change(kind: str, one: Element, other: Element, parents: dict[Element, Element], pick: int) -> None:
    parent = parents.get(one)
    odd = ODD[pick % len(ODD)]
    if kind == "attribute":
        keys = [*one.attrib, "value", "name", "xyz"]
        one.set(keys[pick // len(ODD) % len(keys)], odd)
    elif kind == "text":
        one.text = odd
    elif kind == "rename":
        one.tag = other.tag
    elif kind == "refer":  # a name becomes another one's
        for key in NAMING:
            if key in one.attrib and (name := next(iter(other.attrib.values()), other.text)):
                one.set(key, name.strip())
        if not len(one) and other.get("name"):
            one.text = other.get("name")
    elif kind == "swap":
        one.attrib, other.attrib = dict(other.attrib), dict(one.attrib)
        one.text, other.text = other.text, one.text
    elif kind == "loop":  # what stands at the joint's far end stands at its near end, too
        ends = [each for each in (one.find("parent"), one.find("child")) if each is not None]
        if len(ends) == 2:
            ends[pick % 2].attrib, ends[pick % 2].text = (
                dict(ends[1 - pick % 2].attrib),
                ends[1 - pick % 2].text,
            )
    elif kind == "wrap":
        inner = copy.deepcopy(one)
        for _ in range(pick % 150):
            outer = Element(one.tag, dict(one.attrib))
            outer.append(inner)
            inner = outer
        one.append(inner)
    elif parent is not None:
        if kind == "drop":
            parent.remove(one)
        elif kind == "copy":
            parent.extend(copy.deepcopy(one) for _ in range(1 + pick % 3))
        elif one not in other.iter() and other not in one.iter():  # move
            parent.remove(one)
            other.append(one)
