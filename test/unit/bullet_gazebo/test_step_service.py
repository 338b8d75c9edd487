"""step_world as a function: random numbers, groups, joints of every interface, several robots, refusals."""

import random

import numpy as np
import pytest
from bullet_gazebo_msgs.srv import StepWorldRequest
from geometry_msgs.msg import Point, Quaternion, Twist, Vector3
from geometry_msgs.msg import Pose as PoseMsg

WORLD = StepWorldRequest.WORLD
FREE = {"effort_a": 2.0, "position_a": 0.01, "velocity_a": 0.3}  # joints, and commands to them
EFFORT, BOTH = "effort_joint", ["effort_b", "slides::effort_b"]
NOWHERE = PoseMsg(Point(0.0, float("nan"), 0.0), Quaternion())
FAST = Twist(Vector3(1e300, 0.0, 0.0), Vector3())
HIGH = PoseMsg(Point(1.0, 2.0, 3.0), Quaternion(0.0, 0.0, 0.0, 0.0))  # turned by nothing


def drawn():
    return random.random(), float(np.random.random())


def test_a_reset_with_a_seed_repeats_the_random_numbers_and_one_without_goes_on(world):
    numbers = []
    for seed in (7, 7, 0, 8):
        assert world.call(reset=WORLD, seed=seed).success
        numbers.append(drawn())
    assert numbers[0] == numbers[1]
    assert len(set(numbers)) == 3


def test_a_seed_without_a_reset_is_refused_and_draws_on(world):
    world.call(reset=WORLD, seed=7)
    drawn()
    answer = world.call(1, seed=7)
    assert "seed is 7, which goes with a reset only" in answer.status_message
    after = drawn()
    world.call(reset=WORLD, seed=7)
    assert after != drawn()
    assert after == drawn()


def test_groups_take_as_many_commands_as_they_have_joints(world):
    world.add("slides", "effort_group", "position_joint", "velocity_group")
    joints = world.step(
        10,
        controllers=["effort_group", "position_joint", "velocity_group"],
        commands=[1.0, -2.0, 0.001, 0.3, -0.4],  # b before a in both groups
    )
    assert (joints["effort_b"][2], joints["effort_a"][2]) == (1.0, -2.0)
    assert joints["position_a"][0] == pytest.approx(0.001, abs=1e-9)
    assert joints["velocity_a"][1] == pytest.approx(-0.4)


@pytest.mark.parametrize("commands", [[1.0], [1.0, 2.0, 3.0]])
def test_too_few_or_too_many_for_a_group_are_refused(world, commands):
    world.add("slides", "effort_group")
    answer = world.call(1, controllers=["effort_group"], commands=commands)
    assert f"1 controllers but {len(commands)} commands" in answer.status_message
    assert answer.sim_time == 0.0


def test_joints_of_every_interface_take_commands_without_a_controller(world):
    world.add("slides")
    joints = world.step(10, commanded_joints=list(FREE), joint_commands=list(FREE.values()))
    assert joints["effort_a"][2] == 2.0
    assert joints["effort_a"][1] == pytest.approx(2.0 * 0.01)
    assert joints["position_a"][0] == pytest.approx(0.01, abs=1e-9)
    assert joints["velocity_a"][1] == pytest.approx(0.3)


def test_a_commanded_position_is_approached_no_faster_than_the_joint_may(world):
    world.add("slides")
    place = {"commanded_joints": ["position_a"], "joint_commands": [1.0]}
    assert world.step(100, **place)["position_a"][0] == pytest.approx(0.4, abs=0.005)  # 4 m/s
    assert world.step(100)["position_a"][0] == pytest.approx(0.4, abs=0.005)  # nobody commands it
    assert world.step(200, **place)["position_a"][0] == pytest.approx(1.0, abs=1e-6)


def test_a_reset_lets_go_of_what_was_commanded(world):
    world.add("slides")
    fresh = world.step(20, reset=StepWorldRequest.SIMULATION)
    world.step(10, commanded_joints=list(FREE), joint_commands=list(FREE.values()))
    assert world.step(20, reset=StepWorldRequest.SIMULATION) == fresh


def test_of_several_robots_plain_names_are_refused_and_full_ones_taken(world):
    for name in ("left", "right"):
        world.add(name, "effort_joint")
    plain, full = (
        (
            {"controllers": [f"{robot}effort_joint"], "commands": [1.0]},
            {"commanded_joints": [f"{left}effort_b"], "joint_commands": [2.0]},
            {"joints": [f"{right}velocity_b"], "positions": [0.5]},
        )
        for robot, left, right in (("", "", ""), ("/right/", "left::", "right::"))
    )
    for fields, kind in zip(plain, ("controller", "joint", "joint"), strict=True):
        answer = world.call(1, **fields)
        assert not answer.success
        assert f" have a {kind} '" in answer.status_message
    joints = world.step(1, **full[0], **full[1], **full[2])
    assert len(joints) == 12
    assert [name for name, state in joints.items() if state[2]] == ["left::effort_b", "right::effort_a"]
    assert joints["right::velocity_b"][0] == pytest.approx(0.5)
    assert joints["left::velocity_b"][0] == 0.0


def test_all_models_and_all_contacts(objects):
    answer = objects.call(500, model_states=True, contacts=True)
    # Without a tick they are still those of the last one.
    assert objects.call(0, contacts=True).contacts == answer.contacts
    assert answer.model_names == ["slides", "ground_plane", "crate"]
    assert len(answer.contacts) == 1


def test_models_are_placed_with_a_reset_and_before_joints(objects):
    twist = Twist(Vector3(0.0, 0.0, 1.0), Vector3(0.0, 2.0, 0.0))
    answer = objects.call(
        0, reset=WORLD, models=["crate", "slides"], poses=[HIGH, PoseMsg()],
        twists=[twist, Twist()], joints=["effort_b"], positions=[0.1], velocities=[0.5],
        model_states_of=["crate"], contacts=True,
    )  # fmt: skip
    assert answer.success, answer.status_message
    place = answer.model_poses[0].position
    assert (place.x, place.y, place.z) == pytest.approx((1.0, 2.0, 3.0))
    assert answer.model_twists[0].linear.z == pytest.approx(1.0)
    assert answer.model_twists[0].angular.y == pytest.approx(2.0)
    assert answer.contacts == []  # it has left the ground
    joints = dict(zip(answer.joint_states.name, answer.joint_states.velocity, strict=True))
    assert joints["effort_b"] == 0.5
    assert objects.call(0, reset=WORLD, model_states_of=["crate"]).model_poses[0].position.y == 3.0


def test_a_placing_alone_needs_no_ticks(objects):
    answer = objects.call(0, models=["crate"], poses=[HIGH], model_states_of=["crate"])
    assert answer.model_poses[0].position.z == pytest.approx(3.0)
    assert answer.sim_time == 0.0


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"reset": 0, "ticks": 0}, "ticks is 0"),
        ({"ticks": -1}, "ticks is -1"),
        ({"ticks": 2_000_000}, "ticks is 2000000"),
        ({"reset": 7}, "reset is 7"),
        ({"controllers": [EFFORT]}, "1 controllers but 0 commands"),
        ({"controllers": [EFFORT], "commands": [float("nan")]}, "not finite"),
        ({"controllers": [EFFORT], "commands": [float("inf")]}, "not finite"),
        ({"controllers": [EFFORT], "commands": [1e300]}, "can't be beyond"),
        ({"controllers": ["states"], "commands": [0.1]}, "takes no numbers"),
        ({"controllers": ["effort_jiont"], "commands": [0.0]}, "did you mean 'effort_joint'?"),
        ({"controllers": [EFFORT, f"/slides/{EFFORT}"], "commands": [0, 1]}, "controllers names one twice"),
        ({"joints": ["effort_b"]}, "1 joints but 0 positions"),
        ({"joints": ["effort_b"], "positions": [float("nan")]}, "not finite"),
        ({"joints": ["effort_b", "effort_b"], "positions": [0, 1]}, "names one twice"),
        ({"joints": BOTH, "positions": [0, 1]}, "names 'slides::effort_b' twice"),
        ({"joints": ["efort_b"], "positions": [0.0]}, "did you mean 'effort_b'?"),
        ({"commanded_joints": BOTH, "joint_commands": [0, 1]}, "commanded_joints names one twice"),
        ({"commanded_joints": ["effort_a"], "joint_commands": [1]}, "belongs to controller 'effort_joint'"),
        ({"commanded_joints": ["slides::efort_b"], "joint_commands": [0.0]}, "mean 'slides::effort_b'?"),
        ({"models": ["crat"], "poses": [HIGH]}, "no model 'crat'; did you mean 'crate'?"),
        ({"models": ["crate"]}, "1 models but 0 poses"),
        ({"models": ["crate"], "poses": [HIGH], "twists": [Twist()] * 2}, "1 models but 2 twists"),
        ({"models": ["crate"] * 2, "poses": [HIGH] * 2}, "models names one twice"),
        ({"models": ["crate"], "poses": [NOWHERE]}, "poses[0].position.y is nan"),
        ({"models": ["crate"], "poses": [HIGH], "twists": [FAST]}, "twists[0].linear.x is 1e+300"),
        ({"model_states_of": ["crat"]}, "no model 'crat'; did you mean 'crate'?"),
        ({"link_states_of": ["crat"]}, "no link 'crat'; did you mean 'crate'?"),
        ({"link_states_of": ["crate"], "link_frames": ["grond"]}, "no link 'grond'"),
        ({"link_states_of": ["crate"], "link_frames": ["", ""]}, "1 link_states_of but 2 link_frames"),
        ({"link_frames": [""]}, "0 link_states_of but 1 link_frames"),
        ({"contacts_of": ["crate_colision"]}, "did you mean 'crate_collision'?"),
    ],
)  # fmt: skip
def test_what_is_refused_leaves_the_world_as_it_was(objects, fields, text):
    before = [model.state() for model in objects.sim.world.models.values()]
    answer = objects.call(**{"ticks": 1, "reset": WORLD, **fields})
    assert not answer.success
    assert text in answer.status_message
    assert answer.sim_time == 0.0
    assert [model.state() for model in objects.sim.world.models.values()] == before


def test_what_has_gone_during_a_long_request_is_told(objects, monkeypatch):
    sim = objects.sim
    monkeypatch.setattr(sim.lock, "yield_turn", lambda: sim.delete_model(sim.world.models["crate"]))
    answer = objects.call(600, link_states_of=["crate"])
    assert not answer.success
    assert "the ticks are done, but meanwhile there is no link 'crate'" in answer.status_message
    assert answer.sim_time == pytest.approx(0.6)


def test_who_comes_goes_stops_or_is_another_one_is_noticed_by_the_same_request(world):
    """What was found for the names of a request must not outlive those who had them."""
    world.add("left", "effort_joint")
    command = {"controllers": ["effort_joint"], "commands": [1.0]}
    joint = {"commanded_joints": ["effort_b"], "joint_commands": [2.0]}
    place = {"joints": ["velocity_b"], "positions": [0.5]}

    def refused(text, **fields):
        answer = world.call(1, **fields)
        assert not answer.success
        assert text in answer.status_message

    everything = {**command, **joint, **place}
    for _ in range(2):
        assert world.step(1, **everything)["effort_a"][2] == 1.0
    manager = world.sim.robots[0].manager
    manager.switch([], ["effort_joint"])
    refused("controller 'effort_joint' is stopped", **everything)
    manager.unload("effort_joint")
    refused("no controller named 'effort_joint'", **everything)
    fresh = manager.load("effort_joint", world._params["effort_joint"])
    refused("controller 'effort_joint' is initialized", **everything)
    manager.switch(["effort_joint"], [])
    assert world.step(1, **everything)["effort_a"][2] == 1.0
    assert fresh._commands == [1.0]
    world.add("right", "effort_joint")
    refused("several robots have a controller 'effort_joint'", **command)
    refused("several robots have a joint 'effort_b'", **joint)
    refused("several models have a joint 'velocity_b'", **place)
    assert world.call(1).joint_states.name[0] == "left::effort_a"

    gone = world.sim.robots[0]
    world.sim.remove_robot(gone)
    world.sim.delete_model(gone.model)
    joints = world.step(1, **everything)
    assert joints["effort_a"][2] == 1.0  # plain again
    assert joints["velocity_b"][0] == pytest.approx(0.5)
