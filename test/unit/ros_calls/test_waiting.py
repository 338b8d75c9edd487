"""Waits end: with what is waited for, in time, or with the node; Ctrl-C goes through."""

import math
import signal
import threading
import time

import pytest
import rospy
from std_srvs.srv import SetBool
from support.ros.ros_fakes import FakeService

from ros_calls import master as ros_master
from ros_calls.service import ServiceMissing
from ros_calls.waiting import service_answers, service_comes_up, wait_and_call, wait_for_service, wait_until

NAME = "/fake/set"
LIMIT = 0.3  # [s] of a wait in vain
BOUND = 60.0  # [s] of one that has an end


@pytest.fixture
def master(other_master):
    with ros_master.using(other_master.uri):
        yield other_master


def test_the_time_is_the_walls_however_long_a_look_takes():
    looks = []
    assert not wait_until(lambda: looks.append(time.sleep(LIMIT / 2)), LIMIT, "it")
    assert len(looks) <= 3


def test_a_shutdown_ends_a_wait(monkeypatch):
    monkeypatch.setattr(rospy, "is_shutdown", lambda: True)
    with pytest.raises(rospy.ROSInterruptException, match="shut down while waiting for the tide"):
        wait_until(lambda: False, LIMIT, "the tide")
    assert wait_until(lambda: True, LIMIT, "the tide"), "what is there isn't waited for"


def test_ctrl_c_ends_a_wait():
    with pytest.raises(KeyboardInterrupt):
        wait_until(lambda: signal.raise_signal(signal.SIGINT), BOUND, "it")


def test_a_service_that_comes_up_is_called(master):
    service = FakeService()
    threading.Timer(LIMIT, master.services.update, ({NAME: service.address},)).start()
    assert wait_and_call(NAME, SetBool, True, timeout=BOUND).success
    service.close()


def test_a_registered_service_whose_node_has_ended_does_not_answer(master):
    service = FakeService()
    master.services[NAME] = service.address
    assert service_answers(NAME)
    service.close()
    assert not service_answers(NAME)


def test_names_are_resolved(master):
    service = FakeService()
    master.services[NAME] = service.address
    assert wait_for_service("fake//set") == NAME
    assert service_comes_up("fake/set", BOUND)
    service.close()


def test_one_that_does_not_come_up(master):
    assert not service_comes_up(NAME, LIMIT)
    with pytest.raises(ServiceMissing, match=r"service /fake/set didn't come up within 0.3 s"):
        wait_for_service(NAME, LIMIT)


def test_a_master_is_waited_for_only_by_who_says_so(nobody_listens):
    with ros_master.using(nobody_listens):
        with pytest.raises(ServiceMissing, match=r"no ROS master at .* \(Connection refused\)"):
            wait_for_service(NAME, math.inf)
        begin = time.monotonic()
        assert not service_comes_up(NAME, LIMIT)
        assert time.monotonic() - begin >= LIMIT
