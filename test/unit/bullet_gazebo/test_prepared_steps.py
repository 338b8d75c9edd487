"""Prepared steps: handles, their numbers, and what makes one stale."""

from functools import partial

import pytest
from bullet_gazebo_msgs.srv import PreparedStepRequest, PrepareStepRequest, StepWorldRequest

from bullet_gazebo.services import step_service
from robot_sim.physics.files.sdf import parse_sdf
from robot_sim.physics.pose import Pose
from robot_sim.physics.world import ground_plane

QUESTION = {
    "model_states_of": ["crate"], "link_states_of": ["crate", "crate"], "contacts_of": ["crate"],
    "link_frames": ["", "ground_plane::link"],
}  # fmt: skip
EYE = """<sdf version="1.6"><model name="eye"><static>true</static><link name="link">
<sensor name="sonar" type="ray"><update_rate>30</update_rate><ray><scan><horizontal><samples>1</samples>
</horizontal></scan><range><min>0.1</min><max>9</max></range></ray></sensor></link></model></sdf>"""


def test_a_prepared_step_has_the_numbers_of_step_world(objects):
    objects.add("other", "effort_group")
    names = {
        "controllers": ["/slides/effort_joint", "effort_group"],
        "commanded_joints": ["slides::position_a"],
        **QUESTION,
    }
    prepared = objects.prepare(**names)
    assert prepared.models == ["crate"]

    def by_name():
        return objects.call(
            8, commands=[1.0, 2.0, -1.0], joint_commands=[0.3], **names, reset=StepWorldRequest.SIMULATION
        )  # fmt: skip

    expected, again = by_name(), by_name()
    assert again == expected
    for _ in range(100):
        expected = objects.call(8, commands=[1.0, 2.0, -1.0], joint_commands=[0.3], **names)
    by_name()
    for _ in range(100):
        answer = objects.prepared(prepared, 8, 1.0, 2.0, -1.0, 0.3)
    assert answer.success, answer.status_message
    joints = expected.joint_states
    numbers = [*joints.position, *joints.velocity, *joints.effort]
    poses = [*expected.model_poses, *expected.link_poses]
    for pose, twist in zip(poses, [*expected.model_twists, *expected.link_twists], strict=True):
        for part in (pose.position, pose.orientation, twist.linear, twist.angular):
            numbers += [getattr(part, name) for name in part.__slots__]
    assert answer.numbers == numbers
    assert prepared.joints == joints.name
    assert answer.contacts == expected.contacts
    assert answer.now == joints.header.stamp.to_nsec()
    assert objects.prepared(prepared, 0, 1.0, 2.0, -1.0, 0.3).numbers == numbers


@pytest.mark.parametrize("what", ["link_states_of", "model_states_of", "contacts_of", "sensors"])
def test_names_without_end_are_refused(objects, what):
    request = PrepareStepRequest(**{what: ["crate"] * 100_000})
    assert objects.service._prepare(request).status_message == (
        f"PrepareStep: {what} has 100000 names; up to 10000 are answered"
    )


def test_a_handle_is_stale_once_its_names_may_mean_something_else(world):
    world.add("left", "effort_joint")
    names = {"controllers": ["/left/effort_joint"], "commanded_joints": ["left::position_a"]}
    manager = world.sim.robots[0].manager
    for change in (
        lambda: world.add("right"),
        lambda: world.sim.remove_robot(world.sim.robots[1]),
        lambda: manager.load("effort_group", world._params["effort_group"]),
        lambda: manager.unload("effort_group"),
        lambda: world.sim.world.spawn("ground_plane", ground_plane(), Pose()),
    ):
        prepared = world.prepare(**names)
        assert world.prepared(prepared, 1, 1.0, 0.0).success
        change()
        answer = world.prepared(prepared, 1, 1.0, 0.0)
        assert (answer.success, answer.stale) == (False, True)
        assert not world.service._prepared, "it would keep models that are deleted"
    # A controller that starts or stops: the names are refused until it has its old state again.
    prepared = world.prepare(**names)
    manager.switch([], ["effort_joint"])
    assert world.prepared(prepared, 1, 1.0, 0.0).stale
    answer = world.service._prepare(PrepareStepRequest(**names))
    assert "effort_joint' is stopped, not running" in answer.status_message
    manager.switch(["effort_joint"], [])
    assert world.prepared(prepared, 1, 1.0, 0.0).success


def test_an_unknown_handle_is_stale_and_handles_are_bounded(world):
    assert world.service._step_prepared(PreparedStepRequest(1, 1, [])).stale
    first = world.prepare()
    for _ in range(step_service.MOST_HANDLES):
        last = world.prepare()
    assert world.prepared(first, 1).stale
    assert world.prepared(last, 1).success
    assert len(world.service._prepared) == step_service.MOST_HANDLES


@pytest.mark.parametrize(
    ("ticks", "commands", "text"),
    [
        (1, [1.0], "1 commands where 'effort_joint' takes 1, joint 'position_a' takes 1"),
        (1, [1.0, float("nan")], "commands has nan"),
        (1, [1e300, 0.0], "commands has 1e+300"),
        (-1, [1.0, 0.0], "ticks is -1"),
        (10**7, [1.0, 0.0], "ticks is 10000000"),
    ],
)
def test_numbers_that_do_not_fit_are_refused_and_nothing_done(world, ticks, commands, text):
    world.add("slides", "effort_joint")
    prepared = world.prepare(controllers=["effort_joint"], commanded_joints=["position_a"])
    answer = world.prepared(prepared, ticks, *commands)
    assert not answer.success
    assert text in answer.status_message
    assert (answer.stale, answer.now) == (False, 0)


def test_a_prepared_step_says_what_has_gone_during_a_long_request(objects, monkeypatch):
    sim = objects.sim
    every = objects.prepare(model_states=True)
    spawn = partial(sim.world.spawn, "new", ground_plane(), Pose())
    monkeypatch.setattr(sim.lock, "yield_turn", spawn)
    answer = objects.prepared(every, 600)
    assert "the ticks are done, but meanwhile robots or models" in answer.status_message
    linked = objects.prepare(link_states_of=["crate::crate"])
    monkeypatch.setattr(sim.lock, "yield_turn", lambda: sim.delete_model(sim.world.models["crate"]))
    answer = objects.prepared(linked, 600)
    assert "the ticks are done, but meanwhile there is no link" in answer.status_message


@pytest.fixture
def eye(world):
    world.sim.world.spawn("eye", parse_sdf(EYE), Pose())
    return world


def test_sensors_measure_until_somebody_else_lets_time_pass(eye):
    sim = eye.sim
    silent = list(sim.listeners)
    looking, blind = eye.prepare(sensors=["sonar"]), eye.prepare()
    for advance in (
        lambda: eye.call(1),
        lambda: eye.prepared(blind, 1),
        lambda: sim.advance(1),  # as advance_world does
    ):
        assert eye.prepared(looking, 1).sensors
        eye.call(0)  # without ticks
        eye.prepared(blind, 0)
        assert sim.listeners != silent
        advance()
        assert sim.listeners == silent


def test_sensors_keep_their_clocks_whatever_else_comes_or_goes(eye):
    sim = eye.sim

    def times(change):
        sim.reset(everything=True)
        found = []
        for step in range(12):
            if step == 4:
                change()
            prepared = eye.prepare(sensors=["sonar"])
            found.append(eye.prepared(prepared, 8).sensors[0].now)
        eye.call(1)
        return found

    expected = times(lambda: None)
    assert len(set(expected)) > 2
    assert times(lambda: sim.world.spawn("ground_plane", ground_plane(), Pose())) == expected

    def replace():
        sim.delete_model(sim.world.models["eye"])
        sim.world.spawn("eye", parse_sdf(EYE), Pose())

    assert times(replace) != expected, "a new model's sensor has a clock of its own"
