"""Steps on the wire: requests and answers have genpy's bytes and numbers, whatever came before."""

import io
import struct

import genpy
import pytest
from bullet_gazebo_msgs.srv import StepWorldRequest, StepWorldResponse
from gazebo_msgs.msg import ContactState
from geometry_msgs.msg import Pose, Twist

from robot_envs.backends.ros.wire.messages import ask_for
from robot_envs.backends.ros.wire.step_answer import StepKind
from robot_envs.backends.ros.wire.step_request import MOST_FRAMES, StepRequest
from robot_envs.world_state import LinkQuery, StateQuery


def written(message):
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def test_a_requests_bytes_are_genpys():
    ours = StepRequest(8)
    for names, numbers in (
        (("/a/cart", "/b/arm"), [0.5, -0.0, 1e-300]),
        (("/a/cart",), [2.0]),
        (("/a/cart", "/b/arm"), [float("nan"), 1.0, 3.0]),
        ((), []),
        (("/ä",), list(map(float, range(300)))),
    ):
        for asked in (
            StateQuery(),
            StateQuery(links=(LinkQuery("arm::hand", "arm::base"),), all_models=True),
        ):
            ours.ask_for(asked)
            genpys = StepWorldRequest(ticks=8)
            ask_for(genpys, asked)
            for factor in (1.0, 2.0):
                genpys.controllers, genpys.commands = (
                    list(names),
                    [factor * each for each in numbers],
                )
                ours.command(names, genpys.commands)
                assert written(ours) == written(genpys)


def test_a_task_that_commands_others_all_the_time_takes_no_more_memory():
    ours = StepRequest(8)
    for number in range(5 * MOST_FRAMES):
        ours.command((f"/{number}",), [1.0])
        assert f"/{number}".encode() in written(ours)
    assert len(ours._frames) <= MOST_FRAMES


def test_what_is_no_number_is_refused():
    ours = StepRequest(8)
    ours.command(("/a",), ["much"])
    with pytest.raises(struct.error):
        written(ours)


def answer(step, names, efforts=True, **others):
    made = StepWorldResponse(success=True, sim_time=0.001 * step, **others)
    joints = made.joint_states
    joints.header.seq, joints.header.stamp.secs, joints.header.stamp.nsecs = step, 7, 1000 * step
    joints.name = names
    joints.position = [0.1 * step + index for index in range(len(names))]
    joints.velocity = [-0.0] * len(names)
    joints.effort = [float("inf")] * len(names) if efforts else []
    return made


def told(message):
    """All that it tells; -0.0 isn't 0.0."""
    joints = message.joint_states
    lists = [joints.name, joints.position, joints.velocity, joints.effort]
    lists += [message.model_names, message.link_poses, message.contacts, message.model_poses]
    stamp = joints.header.stamp
    return (
        (message.success, message.status_message, message.sim_time, joints.header.seq)
        + (stamp.secs, stamp.nsecs, joints.header.frame_id)
        + tuple(repr(list(each)) for each in lists)
    )


def test_an_answers_numbers_are_genpys_and_most_are_read_without_it():
    kind, forms = StepKind(), []
    pole, renamed, many = ["cart", "pole"], ["cart", "pola"], ["ä", "b", "c"]
    sent = [answer(step, pole) for step in range(3)]
    sent += [answer(3, renamed), answer(4, pole, efforts=False), answer(5, many), answer(6, many)]
    sent += [answer(7, pole, contacts=[ContactState(collision1_name="a")]), answer(8, pole)]
    sent += [answer(9, pole, link_poses=[Pose()], link_twists=[Twist()]), answer(10, [])]
    sent += [
        StepWorldResponse(success=False, status_message="no"),
        answer(11, pole),
        answer(12, pole),
    ]
    for each in sent:
        data = written(each)
        theirs = StepWorldResponse().deserialize(data)
        ours = kind._response_class().deserialize(data)
        assert told(ours) == told(theirs)
        forms.append(kind.form)
    assert forms[0] is forms[1] is forms[2]
    assert forms[5] is forms[6] is not None
    assert forms[12] is forms[13] is not None
    assert forms[7] is None, "with contacts it is genpy's"


def test_an_answer_that_is_cut_off_is_no_answer():
    kind = StepKind()
    data = written(answer(1, ["cart"]))
    for _ in range(2):
        kind._response_class().deserialize(data)
        for wrong in (data[:-1], data[:20], b""):
            with pytest.raises(genpy.DeserializationError):
                kind._response_class().deserialize(wrong)
