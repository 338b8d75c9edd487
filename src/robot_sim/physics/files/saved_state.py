"""The `<state>` of a saved world: initial poses of models, links and lights.

Gazebo places the links and joins them afterwards. Here they are joined already, so joints take the positions
that the poses of their links give.
"""

import math
from collections.abc import Iterator
from xml.etree.ElementTree import Element

from robot_sim.constants import NANOSECONDS
from robot_sim.physics.description import DescriptionError, Joint, Light, ModelDescription, SavedMotion
from robot_sim.physics.dynamics import child_pose, link_poses, poses_at_zero
from robot_sim.physics.engine import FASTEST, Twist
from robot_sim.physics.engine_form import FURTHEST, rigid
from robot_sim.physics.files.elements import numbers, shown
from robot_sim.physics.files.sdf_parts import WORLD, read_pose
from robot_sim.physics.pose import ZERO, Pose, add, cross, rotate, rotation, subtract

SLACK = 0.01  # [m, rad]; so far solvers let links come apart
MOST_NAMES = 5  # that a warning lists
LONGEST = 2**31  # [s]; ROS's stamps end at 2^32
STILL: Twist = (ZERO, ZERO)

Saved = tuple[Pose, Twist]
"""Pose and velocity of a link in the world."""


def begin_as_saved(
    state: Element, models: dict[str, ModelDescription], lights: dict[str, Light]
) -> Iterator[str]:
    """Sets where models and lights begin; yields a warning for each thing that can't be as in the state."""
    missing = []
    for element in state:
        name = element.get("name", "")
        where = f"<state>, {element.tag} '{shown(name)}'"
        try:
            if element.tag == "light" and name in lights:
                lights[name].pose = _pose(element, where, lights[name].pose)
            elif element.tag == "model" and name in models:
                yield from _begin(models[name], element, where)
            elif element.tag in ("model", "light"):
                missing.append(f"{element.tag} '{shown(name)}'")
        except DescriptionError as error:
            yield f"{error}; it begins where the {element.tag} says"
    if missing:
        yield f"<state>: the world has no {', '.join(missing[:MOST_NAMES])}"


def saved_time(state: Element, warnings: list[str]) -> int:
    """Returns the simulated time [ns] of a state; 0, and a warning, if it is none."""
    text = state.findtext("sim_time", "0 0")
    try:
        seconds, rest = numbers(text, "<state>: <sim_time>", 2)
        if not (0.0 <= seconds <= LONGEST and 0.0 <= rest < NANOSECONDS):
            raise DescriptionError(f"<state>: <sim_time> is {shown(text)}")
    except DescriptionError as error:
        warnings.append(f"{error}; time begins at 0")
        return 0
    return int(seconds) * NANOSECONDS + int(rest)


def _pose(element: Element, where: str, default: Pose) -> Pose:
    if element.find("pose") is None:
        return default
    pose, _ = read_pose(element, where)
    for length in pose.position:
        if not abs(length) <= FURTHEST:
            raise DescriptionError(f"{where}: {length:g} m is beyond {FURTHEST:g} m")
    return pose


def _links(model: Element, scope: str, where: str, rest: dict[str, Pose]) -> Iterator[tuple[str, Saved]]:
    """Yields the links of a model's state and of those nested in it; in `rest` their names end in ::."""
    for element in model:
        name = scope + element.get("name", "")
        if element.tag == "model":
            frame = rest.get(f"{name}::", Pose())
            move = _pose(element, where, frame).compose(frame.inverse())
            inner = {n: move.compose(p) for n, p in rest.items() if n.startswith(f"{name}::")}
            yield from ((each, (pose, STILL)) for each, pose in (inner or {name: frame}).items())
            yield from _links(element, f"{name}::", where, inner)
        elif element.tag == "link":
            here = f"{where}, link '{shown(name)}'"
            text = element.findtext("velocity", "0 0 0 0 0 0")
            x, y, z, *rate = speeds = numbers(text, f"{here}: <velocity>", 6)
            if max(map(abs, speeds)) > FASTEST:
                raise DescriptionError(f"{here}: <velocity> is beyond {FASTEST:g} m/s")
            pose = _pose(element, here, rest.get(name, Pose()))
            yield name, (pose, ((x, y, z), (rate[0], rate[1], rate[2])))


def _begin(model: ModelDescription, element: Element, where: str) -> Iterator[str]:
    """Sets where a model begins; yields what can't be as in its state."""
    frame = _pose(element, where, model.initial_pose)
    base = frame.compose(model.root_pose)
    at_zero = poses_at_zero(rigid(model) if model.static else model)
    rest = {name: base.compose(pose) for name, pose in at_zero.items()}
    nested = {f"{name}::": frame.compose(pose) for name, pose in model.nested.items()}
    given = dict(_links(element, "", where, rest | nested))
    whole = {name: link.owner for name, link in model.links.items()}  # of links that close loops
    links = {name: given.get(whole[name], (pose, STILL)) for name, pose in rest.items()}
    unknown = [f"'{shown(name)}'" for name in given if name not in rest and name not in nested]
    if unknown:
        yield f"{where}: it has no link or model {', '.join(unknown[:MOST_NAMES])}"
    if model.static:
        root = links[model.root][0]
        for joint in model.joints.values():  # which moves nothing
            joint.pose = links[joint.child][0].relative_to(links[joint.parent][0])
            joint.anchor = Pose()
        model.islands = {name: links[name][0].relative_to(root) for name in model.islands}
        model.start = SavedMotion(root, STILL, {})
        return
    held = [each for each in model.joints.values() if each.parent == WORLD and each.child in given]
    if held:  # the model's frame has moved with its first link, the world hasn't
        links[WORLD] = model.initial_pose.compose(model.root_pose), STILL
    joints = {name: _joint_state(joint, links) for name, joint in model.joints.items()}
    root, twist = links[model.root]
    for joint in held[:1]:  # where somebody has put it meanwhile
        root = links[joint.child][0].compose(child_pose(joint, joints[joint.name][0]).inverse())
    model.start = SavedMotion(root, STILL if model.fixed_base else twist, joints)
    placed = link_poses(model, root, {name: position for name, (position, _) in joints.items()})
    apart = [
        f"'{shown(name)}'"
        for name, pose in placed.items()
        if whole[name] in given and _distance(pose, links[name][0]) > SLACK
    ]
    if apart:
        yield f"{where}: its joints don't let link {', '.join(apart[:MOST_NAMES])} be there"


def _joint_state(joint: Joint, links: dict[str, Saved]) -> tuple[float, float]:
    """Returns position and velocity of a joint that come nearest to those of its links."""
    (parent, (its_speed, its_rate)), (child, (speed, rate)) = (
        links[joint.parent], links[joint.child]
    )  # fmt: skip
    frame = parent.compose(joint.pose).compose(joint.anchor)
    moved = child.compose(joint.anchor)
    apart = moved.relative_to(frame)
    axis = rotate(frame.orientation, joint.axis)
    if joint.kind == "prismatic":
        speed = add(speed, cross(rate, subtract(moved.position, child.position)))
        its_speed = add(its_speed, cross(its_rate, subtract(moved.position, parent.position)))
        return _dot(apart.position, joint.axis), _dot(axis, subtract(speed, its_speed))
    x, y, z, w = apart.orientation
    turn = 2.0 * math.atan2(_dot((x, y, z), joint.axis), w)
    turn = math.remainder(turn, 2.0 * math.pi)
    if joint.bounded:  # a turn of another number of circles may be within the limits
        others = (turn, turn + 2.0 * math.pi, turn - 2.0 * math.pi)
        turn = next((each for each in others if joint.lower <= each <= joint.upper), turn)
    return turn, _dot(axis, subtract(rate, its_rate))


def _dot(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    return math.fsum(one * other for one, other in zip(a, b, strict=True))


def _distance(one: Pose, other: Pose) -> float:
    return max(math.dist(one.position, other.position), math.hypot(*rotation(one, other)))
