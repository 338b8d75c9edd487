"""Saved worlds: they begin as their `<state>` says, and a reset returns to what their models say."""

from math import cos, pi, sin

import pytest
from support.robots.snippets import sdf_joint, sdf_link, sdf_world
from support.robots.worlds import assert_near

from bullet_gazebo.services.spawn_services import fill_world
from robot_sim.physics.files.reading import Resources
from robot_sim.physics.files.world_file import parse_world
from robot_sim.physics.pose import Pose, from_rpy
from robot_sim.simulator import Simulator

BODY = "<collision name='c'><geometry><box><size>0.1 0.1 0.1</size></box></geometry></collision>"
CRATE = f'<model name="crate"><pose>0 0 0.5 0 0 0</pose><link name="link">{BODY}</link></model>'
WALL = f"""<model name="wall"><static>1</static><pose>0 5 0.5 0 0 0</pose>
    <link name="a">{BODY}</link><link name="b"><pose>1 0 0 0 0 0</pose>{BODY}</link></model>"""
SUN = '<light name="sun" type="directional"><pose>0 0 10 0 0 0</pose></light>'
ANGLE = 0.7  # [rad]


@pytest.fixture
def begun(make_world):
    """Starts a world with models and the children of a `<state>`."""

    def begin(models, *states):
        given = [f"<state world_name='w'>{state}</state>" for state in states]
        found = parse_world(sdf_world(models, *given), Resources())
        sim = Simulator(make_world(), lockstep=True)
        fill_world(sim, found, lambda: False)
        sim.warnings = found.warnings
        return sim

    return begin


def near(pose, position, rpy=(0.0, 0.0, 0.0)):
    assert_near(pose, Pose(position, from_rpy(*rpy)), 1e-5, turn=1e-3)


def place_of(sim, name):
    return sim.world.frame(name)[0]


def test_models_links_and_lights_begin_where_the_first_state_has_them(begun):
    sim = begun(
        CRATE + WALL + SUN,
        """<sim_time>12 0</sim_time>
        <model name="crate"><pose>3 2 0.5 0 0 0.8</pose><scale>1 1 1</scale>
          <link name="link"><pose>3 2 0.5 0 0 0.8</pose><velocity>1 0 0 0 0 2</velocity>
            <acceleration>9 9 9 0 0 0</acceleration><wrench>9 9 9 0 0 0</wrench></link></model>
        <model name="wall"><pose>-2 -2 0.5 0 0 1.570796</pose></model>
        <light name="sun"><pose>1 2 3 0 0 0</pose></light>""",
        '<model name="crate"><pose>9 9 9 0 0 0</pose></model>',
    )
    assert sim.warnings == []
    near(place_of(sim, "crate"), (3.0, 2.0, 0.5), (0.0, 0.0, 0.8))
    twist = sim.world.models["crate"].link_state("link")[1]
    assert twist[0] + twist[1] == pytest.approx((1.0, 0.0, 0.0, 0.0, 0.0, 2.0), abs=1e-6)
    near(place_of(sim, "wall"), (-2.0, -2.0, 0.5), (0.0, 0.0, pi / 2))
    near(place_of(sim, "wall::b"), (-2.0, -1.0, 0.5), (0.0, 0.0, pi / 2))
    assert sim.world.lights["sun"].pose.position == (1.0, 2.0, 3.0)
    sim.reset_world()
    near(place_of(sim, "crate"), (0.0, 0.0, 0.5))
    near(place_of(sim, "wall::b"), (1.0, 5.0, 0.5))
    assert sim.world.models["crate"].link_state("link")[1][0] == pytest.approx((0.0, 0.0, 0.0))


def test_a_static_models_links_lie_where_the_state_has_them(begun):
    state = """<model name="wall"><pose>0 5 0.5 0 0 0</pose><link name="a"><pose>1 1 1 0 0 0</pose></link>
        <link name="b"><pose>4 4 4 0 0 1</pose></link></model>"""
    sim = begun(WALL, state)
    near(place_of(sim, "wall::a"), (1.0, 1.0, 1.0))
    near(place_of(sim, "wall::b"), (4.0, 4.0, 4.0), (0.0, 0.0, 1.0))


def pendulum(anchor):
    """Two bars of 1 m, hanging from (0, 0, 2), which turn about x at their upper ends."""
    top = "<pose>0 0 0.5 0 0 0</pose>"
    ends = ("upper", "base" if anchor else "world", "one"), ("lower", "one", "two")
    joints = [sdf_joint(a, "revolute", b, c, "1 0 0", top) for a, b, c in ends]
    bars = [sdf_link(n, f"0 0 {z} 0 0 0", BODY) for n, z in (("one", -0.5), ("two", -1.5))]
    parts = "".join([anchor, *bars, *joints])
    return f'<model name="p"><pose>0 0 2 0 0 0</pose>{parts}</model>'


BASE = '<link name="base"/>' + sdf_joint("held", "fixed", "world", "base")
FREE = '<link name="base"><inertial><mass>1e6</mass></inertial></link>'


@pytest.mark.parametrize("anchor", [BASE, FREE, ""], ids=["fixed", "free", "world"])
def test_joints_stand_as_the_poses_of_their_links(begun, anchor):
    """Both bars hang turned: the joints' angles are those of geometry, not zero."""
    two = ANGLE - 0.3  # of the lower bar, from the vertical
    hinge = (0.0, sin(ANGLE), 2.0 - cos(ANGLE))
    ends = {
        "one": ((0.0, 0.5 * sin(ANGLE), 2.0 - 0.5 * cos(ANGLE)), ANGLE),
        "two": ((0.0, hinge[1] + 0.5 * sin(two), hinge[2] - 0.5 * cos(two)), two),
    }
    links = "".join(
        f'<link name="{name}"><pose>{x} {y} {z} {roll} 0 0</pose>'
        f"<velocity>0 {speed} 0 {rate} 0 0</velocity></link>"
        for (name, ((x, y, z), roll)), speed, rate in zip(ends.items(), (0.0, 0.0), (2.0, 3.0), strict=True)
    )
    # Gazebo's model goes where its first link goes.
    model = "0 0 2 0 0 0" if anchor else f"0 0 2 {ANGLE} 0 0"
    sim = begun(pendulum(anchor), f'<model name="p"><pose>{model}</pose>{links}</model>')
    assert sim.warnings == []
    for name, (position, roll) in ends.items():
        near(place_of(sim, f"p::{name}"), position, (roll, 0.0, 0.0))
    p = sim.world.models["p"]
    assert p.joint_state("upper") == pytest.approx((ANGLE, 2.0), abs=1e-6)
    assert p.joint_state("lower") == pytest.approx((-0.3, 1.0), abs=1e-6)
    sim.reset_simulation()
    near(place_of(sim, "p::two"), (0.0, 0.0, 0.5))
    assert p.joint_state("upper") == pytest.approx((0.0, 0.0), abs=1e-6)


def test_slides_and_turns_beyond_half_a_circle_are_within_their_limits(begun):
    limit = "<limit><lower>{}</lower><upper>{}</upper></limit>".format
    parts = [
        sdf_link("base", mass=1e6), sdf_link("slide"), sdf_link("arm"),
        sdf_joint("rail", "prismatic", "base", "slide", "0 1 0", more=limit(-1, 1)),
        sdf_joint("turn", "revolute", "slide", "arm", more=limit(0, 6)),
    ]  # fmt: skip
    state = """<model name="m"><pose>1 0 0 0 0 0</pose><link name="base"><pose>1 0 0 0 0 0</pose></link>
        <link name="slide"><pose>1 0.4 0 0 0 0</pose></link>
        <link name="arm"><pose>1 0.4 0 0 0 -1</pose></link></model>"""
    sim = begun(f'<model name="m">{"".join(parts)}</model>', state)
    assert sim.world.models["m"].joint_state("rail")[0] == pytest.approx(0.4)
    assert sim.world.models["m"].joint_state("turn")[0] == pytest.approx(2 * pi - 1)


NESTED = f"""<model name="m"><link name="l">{BODY}</link><model name="in"><pose>1 0 0 0 0 0</pose>
    <link name="l">{BODY}</link></model><joint name="j" type="revolute"><parent>l</parent>
    <child>in::l</child><axis><xyz>0 0 1</xyz></axis></joint></model>"""


def test_loops_are_closed_in_the_state(begun):
    """A parallelogram begins leaning; its last joint, which closes it, too."""
    bars = ("left", "0 0 0", "0 0 .5"), ("right", "1 0 0", "0 0 .5"), ("top", "0 0 1", ".5 0 0")
    parts = [sdf_link(n, f"{at} 0 0 0", moment=1.0, com=com) for n, at, com in bars]
    joints = [("a", "base", "left", 0), ("b", "base", "right", 0), ("c", "left", "top", 0),
              ("d", "top", "right", 1)]  # fmt: skip
    for name, parent, child, z in joints:
        pose = f"<pose>0 0 {z} 0 0 0</pose>"
        parts.append(sdf_joint(name, "revolute", parent, child, "0 1 0", pose))
    model = f'<model name="m">{BASE}{"".join(parts)}</model>'
    ends = {"left": f"0 0 0 0 {ANGLE} 0", "right": f"1 0 0 0 {ANGLE} 0",
            "top": f"{sin(ANGLE)} 0 {cos(ANGLE)} 0 0 0"}  # fmt: skip
    state = "".join(f'<link name="{n}"><pose>{pose}</pose></link>' for n, pose in ends.items())
    sim = begun(model, f'<model name="m">{state}</model>')
    m = sim.world.models["m"]
    wanted = {"a": ANGLE, "b": ANGLE, "c": -ANGLE, "d": ANGLE}
    assert {name: m.joint_state(name)[0] for name in wanted} == pytest.approx(wanted, abs=1e-6)
    sim.step(10)
    assert abs(m.joint_state("d")[1]) < 1.0  # nothing pulled it


def test_nested_models_have_their_own_states(begun):
    state = """<model name="m"><pose>0 0 1 0 0 0</pose><link name="l"><pose>0 0 1 0 0 0</pose></link>
        <model name="in"><pose>1 0 1 0 0 0.5</pose><link name="l"><pose>1 0 1 0 0 0.5</pose></link>
        </model></model>"""
    sim = begun(NESTED, state)
    near(place_of(sim, "m::in::l"), (1.0, 0.0, 1.0), (0.0, 0.0, 0.5))
    assert sim.world.models["m"].joint_state("j")[0] == pytest.approx(0.5)


def test_a_nested_model_takes_its_links_along(begun):
    """Also those of the models in it, and not those that the state names itself."""
    inner = f'<model name="far"><pose>0 0 1 0 0 0</pose><link name="l">{BODY}</link></model>'
    outer = f'<pose>1 0 0 0 0 0</pose><link name="l">{BODY}</link>{inner}'
    models = f"""<model name="m"><static>1</static><link name="l">{BODY}</link>
        <model name="in">{outer}</model><model name="listed">{outer}</model></model>"""
    turned = "<pose>2 0 1 0 0 1.5707963</pose>"
    state = f"""<model name="m"><pose>0 0 1 0 0 0</pose><model name="in">{turned}</model>
        <model name="listed">{turned}<link name="l"><pose>5 0 1 0 0 0</pose></link>
        <model name="far"><pose>7 0 0 0 0 0</pose></model></model></model>"""
    sim = begun(models, state)
    assert sim.warnings == []
    near(place_of(sim, "m::l"), (0.0, 0.0, 1.0))
    near(place_of(sim, "m::in::l"), (2.0, 0.0, 1.0), (0.0, 0.0, pi / 2.0))
    near(place_of(sim, "m::in::far::l"), (2.0, 0.0, 2.0), (0.0, 0.0, pi / 2.0))
    near(place_of(sim, "m::listed::l"), (5.0, 0.0, 1.0))
    near(place_of(sim, "m::listed::far::l"), (7.0, 0.0, 0.0))


def test_time_begins_as_saved_and_a_reset_sets_it_to_0(begun):
    sim = begun(CRATE, "<sim_time>12 345000000</sim_time>")
    assert (sim.now, sim.sim_time) == (12_345_000_000, 12.345)
    sim.step(1)
    assert sim.now == 12_346_000_000
    sim.reset_simulation()
    assert sim.now == 0


@pytest.mark.parametrize("text", ["-1 0", "1", "soon", "5000000000 0", "nan 0", "0 -5"])
def test_a_time_that_is_none_is_one_line(begun, text):
    sim = begun(CRATE, f"<sim_time>{text}</sim_time>")
    assert sim.now == 0
    assert [each.startswith("<state>: <sim_time>") for each in sim.warnings] == [True]


def test_what_a_state_inserts_and_deletes(begun):
    state = f"""<insertions>{CRATE.replace('"crate"', '"new"')}</insertions>
        <deletions><name>wall</name><name>sun</name></deletions>
        <model name="new"><pose>7 0 0 0 0 0</pose></model>"""
    sim = begun(CRATE + WALL + SUN, state)
    assert list(sim.world.models) == ["crate", "new"]
    assert not sim.world.lights
    near(place_of(sim, "new"), (7.0, 0.0, 0.0))


BEGINS = "it begins where the model says"


@pytest.mark.parametrize(
    ("state", "warning"),
    [
        ('<model name="ghost"><pose>1 2 3 0 0 0</pose></model><light name="moon"/>',
         "<state>: the world has no model 'ghost', light 'moon'"),
        ('<model name="wall"><link name="x"><pose>1 2 3 0 0 0</pose></link><link name="b"/></model>',
         "<state>, model 'wall': it has no link or model 'x'"),
        ('<model name="wall"><model name="in"><pose>1 2 3 0 0 0</pose></model></model>',
         "<state>, model 'wall': it has no link or model 'in'"),
        ('<model name="wall"><pose>1 2 3 0 0</pose></model>',
         "<state>, model 'wall': <pose> must hold 6 numbers, not '1 2 3 0 0'; " + BEGINS),
        ('<model name="wall"><pose>1 2 inf 0 0 0</pose></model>',
         "<state>, model 'wall': <pose>: 'inf' is not finite; " + BEGINS),
        ('<model name="wall"><link name="a"><pose>1e200 2 0 0 0 0</pose></link></model>',
         "<state>, model 'wall', link 'a': 1e+200 m is beyond 1e+07 m; " + BEGINS),
        ('<model name="wall"><link name="a"><velocity>0 0 0 0 1e10 0</velocity></link></model>',
         "<state>, model 'wall', link 'a': <velocity> is beyond 1e+09 m/s; " + BEGINS),
        ('<model name="p"><pose>0 0 2 0 0 0</pose><link name="two"><pose>0 3 0 0 0 0</pose></link></model>',
         "<state>, model 'p': its joints don't let link 'two' be there"),
    ],
)  # fmt: skip
def test_a_damaged_state_is_one_line_and_the_rest_stands(begun, state, warning):
    state += '<model name="crate"><pose>3 2 1 0 0 0</pose></model>'
    sim = begun(WALL + CRATE + pendulum(FREE), state)
    assert sim.warnings == [warning]
    near(place_of(sim, "crate"), (3.0, 2.0, 1.0))
    if "wall" in warning:
        near(place_of(sim, "wall"), (0.0, 5.0, 0.5))
