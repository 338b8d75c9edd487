"""Springs of joints against closed forms."""

import math

import pytest
from support.robots.snippets import WORLD, joint, link, robot, sdf, sdf_joint, sdf_link
from support.robots.worlds import begin_anew, run

from robot_sim.physics.description import DescriptionError, Inertia
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.properties import JointProperties, set_joint_properties

MASS, MOMENT, STIFFNESS, REFERENCE = 2.0, 0.01, 200.0, 0.1  # [kg], [kg m²], [N/m], [m]
G = 9.8  # [m/s²]
VERSIONS = ["1.4", "1.5", "1.6", "1.7"]


FIX = sdf_joint("fix", "fixed", "world", "base")


def on_a_spring(
    kind="prismatic", stiffness=STIFFNESS, reference=REFERENCE, damping=0.0, version="1.6", base=FIX
):  # fmt: skip
    """A mass on a base, on a joint along the vertical with a spring."""
    limits = "" if kind == "continuous" else "<limit><lower>-3</lower><upper>3</upper></limit>"
    kind = "revolute" if kind == "continuous" else kind
    dynamics = f"""<dynamics><damping>{damping}</damping><spring_reference>{reference}</spring_reference>
      <spring_stiffness>{stiffness}</spring_stiffness></dynamics>"""
    links = [sdf_link(name, mass=MASS, moment=MOMENT) for name in ("base", "mass")]
    spring = sdf_joint("j", kind, "base", "mass", more=limits + dynamics)
    return sdf(*links, base, spring, version=version)


def spawned(world, **options):
    return world.spawn("m", parse_sdf(on_a_spring(**options)), Pose((0.0, 0.0, 5.0)))


def positions(world, model, ticks):
    seen = []
    for _ in range(ticks):
        world.step()
        seen.append(model.joint_state("j")[0])
    return seen


def period(positions, about, dt=0.001):
    """The time between upward crossings of a position."""
    ups = []
    for tick, (a, b) in enumerate(zip(positions, positions[1:], strict=False)):
        if a < about <= b:
            ups.append(tick + (about - a) / (b - a))
    return (ups[-1] - ups[0]) / (len(ups) - 1) * dt


def of_urdf(value):
    spring = value.format("Stiffness", STIFFNESS) + value.format("Reference", REFERENCE)
    links = [link(name, MASS, moment=MOMENT) for name in ("base", "mass", "lumped")]
    joints = [
        joint("fix", "fixed", "world", "base"),
        joint("weld", "fixed", "base", "lumped"),
        joint("j", "prismatic", "base", "mass", more='<dynamics damping="20"/>'),
    ]
    more = f"""<gazebo reference="j">{spring}<implicitSpringDamper>1</implicitSpringDamper></gazebo>
      <gazebo reference="weld">{spring}</gazebo>"""
    return parse_urdf(robot(WORLD, *links, *joints, more))


DESCRIPTIONS = {version: parse_sdf(on_a_spring(damping=20.0, version=version)) for version in VERSIONS}
DESCRIPTIONS["urdf"] = of_urdf("<spring{0}>{1}</spring{0}>")
DESCRIPTIONS["urdf by value"] = of_urdf('<spring{0} value="{1}"/>')


@pytest.mark.parametrize("name", DESCRIPTIONS)
def test_a_mass_rests_where_the_spring_carries_it(world, name):
    model = world.spawn("m", DESCRIPTIONS[name], Pose((0.0, 0.0, 5.0)))
    run(world, 4000)
    assert not model.description.warnings
    rest = REFERENCE - MASS * G / STIFFNESS
    assert model.joint_state("j")[0] == pytest.approx(rest, abs=1e-4 * MASS * G / STIFFNESS)


@pytest.mark.parametrize("kind", ["prismatic", "revolute", "continuous"])
def test_it_swings_with_its_period_and_gains_no_energy(world, kind):
    slides = kind == "prismatic"
    inertia, force = (MASS, MASS * G) if slides else (MOMENT, 0.0)
    stiffness = 200.0 if slides else 1.0
    model = spawned(world, kind=kind, stiffness=stiffness)
    rest = REFERENCE - force / stiffness

    def most_energy():
        seen = []
        for _ in range(1000):
            world.step()
            position, speed = model.joint_state("j")
            seen.append(0.5 * (stiffness * (position - rest) ** 2 + inertia * speed**2))
        return max(seen)

    seen = positions(world, model, 10_000)
    theory = 2.0 * math.pi * math.sqrt(inertia / stiffness)
    assert period(seen, rest) == pytest.approx(theory, rel=1e-3)
    first = most_energy()
    run(world, 20_000)  # 30 s in all
    assert most_energy() == pytest.approx(first, rel=3e-4)
    highest = max(positions(world, model, 1000))
    assert highest == pytest.approx(max(0.0, 2.0 * rest), abs=1e-2)


def test_a_damped_swing(world):
    damping = 4.0
    model = spawned(world, damping=damping)
    decay = damping / (2.0 * MASS)
    omega = math.sqrt(STIFFNESS / MASS - decay**2)
    rest = REFERENCE - MASS * G / STIFFNESS
    for tick, position in enumerate(positions(world, model, 2000), 1):
        t = tick * 0.001
        swing = math.cos(omega * t) + decay / omega * math.sin(omega * t)
        theory = rest * (1.0 - math.exp(-decay * t) * swing)
        assert position == pytest.approx(theory, abs=0.01 * abs(rest))


@pytest.mark.parametrize("kind", ["prismatic", "revolute"])
@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("stiffness", [1e5, 1e7, 1e12])
def test_stiff_springs_hold(world, kind, free, stiffness):
    options = {"base": ""} if free else {}
    model = spawned(world, kind=kind, stiffness=stiffness, reference=0.3, **options)
    seen = positions(world, model, 3000)
    assert max(map(abs, seen)) < 0.7
    told = ["springs too stiff for the step are softened: j"]
    most = 0.25 * (MASS if kind == "prismatic" else MOMENT) / 0.001**2
    cut = stiffness > most and not model.body.implicit_damping
    assert model.description.warnings == (told if cut else [])
    if stiffness > 1e6:
        assert seen[-1] == pytest.approx(0.3, abs=1e-4)


def test_a_chain_of_stiff_springs(world):
    """Flexible beams are modelled so. Where springs are cut, they bend and sway a little."""
    links = [sdf_link(f"l{i}", f"{0.1 * i} 0 0 0 0 0", "", 0.05, 1e-4) for i in range(9)]
    stiff = "<dynamics><spring_stiffness>1e12</spring_stiffness></dynamics>"
    ends = [(f"l{i}", f"l{i + 1}") for i in range(8)]
    joints = [sdf_joint(f"j{a}", "revolute", a, b, "0 1 0", more=stiff) for a, b in ends]
    text = sdf(*links, *joints, sdf_joint("fix", "fixed", "world", "l0"))
    model = world.spawn("beam", parse_sdf(text), Pose((0.0, 0.0, 5.0)))
    run(world, 3000)
    assert max(abs(position) for position, _ in model.joint_states()) < 0.05
    assert max(abs(speed) for _, speed in model.joint_states()) < 1.0


def test_efforts_add_up(world):
    model = spawned(world, damping=20.0)
    for _ in range(4000):
        model.body.apply_efforts([MASS * G])
        world.step()
    assert model.joint_state("j")[0] == pytest.approx(REFERENCE, abs=1e-6)


def test_it_stays_when_the_world_changes(make_world):
    """Other steps, masses and dampings, engines that begin anew to free memory, and resets."""
    world = make_world()
    model = spawned(world, damping=20.0)
    world.set_time_step(0.002)
    heavier = Inertia(2.0 * MASS, Pose((0.01, 0.0, 0.0)), ixx=MOMENT, iyy=MOMENT, izz=MOMENT)
    world.set_inertia(model, "mass", heavier)
    set_joint_properties(model, "j", JointProperties(damping=30.0), 0.002)
    begin_anew(world, parse_sdf(on_a_spring()))
    run(world, 3000)
    rest = REFERENCE - 2.0 * MASS * G / STIFFNESS
    assert model.joint_state("j")[0] == pytest.approx(rest, abs=1e-5)
    world.reset(joints=True)
    model.set_joint_positions({"j": 0.5})
    assert model.joint_state("j") == (0.5, 0.0)
    run(world, 3000)
    assert model.joint_state("j")[0] == pytest.approx(rest, abs=1e-5)


def test_snapshots(world):
    model = spawned(world)
    run(world, 100)
    snapshot = world.state_dict()
    first = positions(world, model, 100)
    world.load_state_dict(snapshot)
    assert positions(world, model, 100) == first


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        ({"stiffness": -1.0}, "a spring_stiffness of -1.0 is not between 0 and 1e"),
        ({"stiffness": 1e13}, "a spring_stiffness of 10000000000000.0 is not between"),
        ({"reference": 1e8}, "a spring_reference of 100000000.0 is beyond 1e"),
        ({"stiffness": "nan"}, "spring_stiffness"),
    ],
)
def test_faults(world, options, fault):
    with pytest.raises(DescriptionError, match=fault):
        spawned(world, **options)
