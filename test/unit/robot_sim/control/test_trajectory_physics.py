"""Trajectories in the physics world: an arm under gravity follows a quintic within its tolerances."""

import pytest
from support.robots.trajectory_rig import Listener
from support.robots.worlds import add_robot, start

from robot_sim.control.trajectory_goals import (
    GoalOutcome,
    GoalRequest,
    Tolerance,
    Trajectory,
    TrajectoryPoint,
)
from robot_sim.simulator import Simulator

S = 1_000_000_000  # [ns]
JOINTS = ("shoulder", "elbow")
REST = (0.0, 0.0)
GAINS = {"p": 400.0, "i": 400.0, "d": 20.0, "i_clamp": 20.0}
KINDS = {
    "Effort": {"gains": dict.fromkeys(JOINTS, GAINS)},
    "Position": {},
    "Velocity": {
        "gains": dict.fromkeys(JOINTS, {"p": 50.0}),
        "velocity_ff": dict.fromkeys(JOINTS, 1.0),
    },
}


def arm(interface):
    """Two links of 0.5 m and 1 kg that swing in a vertical plane."""

    def link(name):
        return (
            f'<link name="{name}"><inertial><origin xyz="0 0 -0.25"/><mass value="1"/>'
            '<inertia ixx="0.021" ixy="0" ixz="0" iyy="0.021" iyz="0" izz="0.001"/></inertial></link>'
        )

    def joint(name, parent, child, z):
        return (
            f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="0 0 {z}"/><axis xyz="0 1 0"/>'
            '<limit lower="-3" upper="3" effort="100" velocity="10"/></joint>'
            f'<transmission name="t_{name}"><type>transmission_interface/SimpleTransmission</type>'
            f'<joint name="{name}"><hardwareInterface>hardware_interface/{interface}JointInterface'
            f'</hardwareInterface></joint><actuator name="m_{name}"/></transmission>'
        )

    return (
        f'<robot name="arm"><link name="world"/>{link("upper")}{link("lower")}'
        f"{joint('shoulder', 'world', 'upper', 2)}{joint('elbow', 'upper', 'lower', -0.5)}</robot>"
    )


@pytest.fixture
def sim(make_world):
    return Simulator(make_world(), lockstep=True)


def run_arm(sim, interface):
    robot = add_robot(sim, "arm", arm(interface))
    kind = f"{interface.lower()}_controllers/JointTrajectoryController"
    params = {"type": kind, "joints": list(JOINTS), "constraints": {"goal_time": 0.5}}
    start(robot, {"arm": params | KINDS[interface]})
    return robot, robot.manager.get("arm")


def pursue(controller, points, path):
    told = Listener()
    tolerance = dict.fromkeys(JOINTS, Tolerance(path))
    trajectory = Trajectory(JOINTS, points)
    controller.pursue("goal", GoalRequest(trajectory, tolerance, tolerance), told)
    return told


@pytest.mark.parametrize(
    ("interface", "path"), [("Effort", 0.02), ("Position", 0.01), ("Velocity", 0.01)]
)
def test_a_quintic_is_followed_within_its_tolerances(sim, interface, path):
    robot, controller = run_arm(sim, interface)
    points = [
        TrajectoryPoint(S, (0.5, 0.4), (0.4, -0.2), (0.0, 0.3)),
        TrajectoryPoint(2 * S, (0.8, -0.6), (0.0, 0.0), (0.0, 0.0)),
    ]
    with sim.lock:
        sim.advance(1)
        told = pursue(controller, points, path)
        sim.advance(2500)
    assert told.outcomes == [GoalOutcome("succeeded")]
    assert len(told.samples) == pytest.approx(40, abs=2)
    found = [robot.hardware.joints[name].position for name in JOINTS]
    assert found == pytest.approx([0.8, -0.6], abs=path)


def test_a_way_too_fast_for_the_motors_aborts_the_goal(sim):
    _, controller = run_arm(sim, "Effort")
    with sim.lock:
        sim.advance(1)
        told = pursue(controller, [TrajectoryPoint(S // 10, (1.5, 1.5), REST, REST)], 0.05)
        sim.advance(200)
    assert told.outcomes[0].kind == "aborted"
    assert "path error" in told.outcomes[0].text


@pytest.mark.parametrize("interface", ["Effort", "Position", "Velocity"])
def test_after_a_reset_the_arm_hangs_where_it_was_put(sim, interface):
    robot, controller = run_arm(sim, interface)
    with sim.lock:
        told = pursue(controller, [TrajectoryPoint(S, (1.0, -1.0))], 0.0)
        sim.advance(500)
        sim.set_joint_states(robot.model, {"shoulder": 0.0, "elbow": 0.0})
    assert [outcome.kind for outcome in told.outcomes] == ["canceled"]
    with sim.lock:
        sim.advance(500)
    places = [joint.position for joint in robot.hardware.joints.values()]
    assert places == pytest.approx([0.0, 0.0], abs=1e-6)
