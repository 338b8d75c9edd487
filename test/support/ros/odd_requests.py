"""Hypothesis strategies for requests with fields of the right type and odd values."""

import math

import genpy
from gazebo_msgs import srv
from geometry_msgs.msg import Point, Pose
from hypothesis import strategies as st

MODELS = ["ground_plane", "cartpole", "box"]
LINKS = ["cartpole::stand", "cartpole::cart", "cartpole::pole", "box::body"]
JOINTS = ["stand_cart", "cart_pole"]
BOX = """<robot name="box"><link name="body"><inertial><mass value="2"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link></robot>"""

OTHERS = ["body_collision", "grounding", "sun", "world", "map", "", "::", "a::b"]
NAMES = st.sampled_from([*MODELS, *LINKS, *JOINTS, *OTHERS])
ODD_TEXTS = ["x" * 100_000, "\0", "cartpole\0", "世界", "\u202ecartpole", "{", "<robot", "1e300"]
TEXTS = NAMES | st.text(max_size=8) | st.sampled_from(ODD_TEXTS)
SOUND = st.sampled_from([0.0, 1.0, 1e12, -1e12, 1e-9, 1e6]) | st.floats(-10.0, 10.0)
NUMBERS = (
    st.sampled_from([0.0, 1.0, -1.0, 0.001, math.nan, math.inf, -math.inf, 1e12, -1e12, 1e-12, 1e300,
                     1e308, 5e-324, 1e6])
    | st.floats(-10.0, 10.0) | st.floats()
)  # fmt: skip
UNSIGNED = st.sampled_from([0, 1, 50, 2**32 - 1]) | st.integers(0, 2**32 - 1)
FRAMES = st.sampled_from(["", "world", *LINKS, "cartpole", "box"])
FITTING = {  # by the field's name: what a sound request has in it
    "model_name": st.sampled_from(["cartpole", "box"]),
    "link_name": st.sampled_from(LINKS),
    "body_name": st.sampled_from(LINKS),
    "joint_name": st.sampled_from(JOINTS),
    "light_name": st.just("sun"),
    "reference_frame": FRAMES,
    "relative_entity_name": FRAMES,
}
SIMPLE = {
    "string": TEXTS,
    "float64": NUMBERS,
    "float32": NUMBERS.filter(lambda n: not 3.4e38 < abs(n) < math.inf),
    "bool": st.booleans(),
    "uint32": UNSIGNED,
    "int32": st.integers(-(2**31), 2**31 - 1),
    "uint8": st.integers(0, 255),
    "time": st.builds(genpy.Time, UNSIGNED, st.integers(0, 10**9 - 1)),
    "duration": st.builds(genpy.Duration, st.integers(-10, 1000), st.integers(-(10**9), 10**9)),
}


def values(kind, simple):
    """Draws values of that ROS type; `simple` has those of the types that are no message."""
    if kind.endswith("]"):
        return st.lists(values(kind.partition("[")[0], simple), max_size=4)
    if kind in simple:
        return simple[kind]
    return messages(genpy.message.get_message_class(kind), simple)


def messages(kind, simple):
    """Draws messages of that class, each field on its own; `simple` may have some by their names."""
    fields = zip(kind.__slots__, kind._slot_types, strict=True)
    drawn = {name: simple[name] if name in simple else values(of, simple) for name, of in fields}
    return st.builds(kind, **drawn)


def requests(kind):
    """Draws requests with a fault in them more likely than not, and requests that may be carried out."""
    sound = SIMPLE | {"string": NAMES, "float64": SOUND, "float32": SOUND}
    drawn = messages(kind, SIMPLE) | messages(kind, sound) | messages(kind, sound | FITTING)
    if kind is srv.SetLinkPropertiesRequest:
        # A tensor drawn at random is hardly ever one of a body.
        size = st.sampled_from([1.0, 1e-9, 1e12, 5.0])
        sizes = {"mass": size, "ixx": size, "iyy": size, "izz": size}
        near = st.floats(-1.0, 1.0)
        place = st.builds(Pose, position=st.builds(Point, near, near, near))
        drawn |= st.builds(
            kind, link_name=st.sampled_from(LINKS), com=place, gravity_mode=st.booleans(), **sizes
        )
    return drawn
