"""ServiceClient against services that hang, fail, end and come back, under another master."""

import itertools
import math
import signal
import threading
import time

import pytest
import rospy
from std_srvs.srv import Empty, SetBool, SetBoolRequest
from support.ros.ros_fakes import FakeService, failed, ok

from ros_calls import master as ros_master
from ros_calls import service as service_module
from ros_calls.service import LOOK, ServiceClient, ServiceFailed, ServiceGone, ServiceHangs
from ros_calls.waiting import wait_and_call

NAME = "/fake/set"
LIMIT = 0.3  # [s] of a call in vain
BOUND = 60.0  # [s] of one that has an answer


@pytest.fixture
def master(other_master, monkeypatch):
    # The process's own is another one, so that a call that goes there finds nothing.
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    with ros_master.using(other_master.uri):
        yield other_master


@pytest.fixture
def offer(master):
    services = []

    def offer(*args, **kwargs):
        service = FakeService(*args, **kwargs)
        services.append(service)
        master.services[NAME] = service.address
        return service

    yield offer
    for service in services:
        service.close()


@pytest.fixture
def client():
    clients = []

    def make(kind=SetBool, **kwargs):
        made = ServiceClient(NAME, kind, **{"timeout": BOUND} | kwargs)
        clients.append(made)
        return made

    yield make
    for made in clients:
        made.close()


def test_a_request_or_its_fields(offer, client):
    offer()
    call = client()
    assert call(True).success
    assert not call(SetBoolRequest(False)).success
    with pytest.raises(ServiceFailed, match=r"/fake/set: the request can't be sent"):
        call(True, "and more")


def test_a_kept_connection_serves_all_calls(offer, client, master):
    service = offer()
    call = client(persistent=True)
    for _ in range(3):
        call(True)
    assert len(service.connections) == len(master.questions) == 1
    single = client()
    for _ in range(2):
        single(True)
    assert len(service.connections) == 3


def test_nobody_offers_it(master, client):
    with pytest.raises(ServiceGone, match="/fake/set: no node offers this service"):
        client()(True)


def test_there_is_no_master(client):
    with (
        ros_master.using("http://127.0.0.1:1"),
        pytest.raises(ServiceGone, match=r"127.0.0.1:1 \(Conn.*start roscore"),
    ):
        client()(True)


def test_a_node_that_has_ended_is_still_registered(offer, client):
    offer().close()
    with pytest.raises(ServiceGone, match="the connection broke; its node has ended"):
        client()(True)


def test_a_service_that_fails_says_why(offer, client):
    offer(lambda request: [failed("out of order")])
    with pytest.raises(ServiceFailed, match="/fake/set: it failed: out of order"):
        client()(True)


def test_a_service_of_another_type(offer, client):
    offer(header={"error": "md5sums do not match"})
    with pytest.raises(ServiceFailed, match="md5sums do not match"):
        client(Empty)()


def test_a_connection_that_broke_is_renewed_by_the_next_call(offer, client):
    service = offer()
    call = client(persistent=True)
    call(True)
    service.break_off()
    with pytest.raises(ServiceGone):
        call(True)
    assert call(True).success


def test_what_may_be_done_twice_is_called_again_at_once(offer, client):
    service = offer()
    call = client(persistent=True)
    call(True)
    service.close()
    second = offer()
    assert call.call_idempotent(True).success
    second.close()
    with pytest.raises(ServiceGone):
        call.call_idempotent(True)


@pytest.mark.parametrize("header", [None, "silence"], ids=["call", "greeting"])
def test_a_service_that_hangs(offer, client, header):
    service = offer(lambda request: service.over.wait() and None, header)
    begin = time.monotonic()
    with pytest.raises(ServiceHangs, match=r"/fake/set: no answer within 0.3 s"):
        client(timeout=LIMIT)(True)
    assert time.monotonic() - begin >= LIMIT


def test_an_answer_in_pieces(offer, client):
    text = "x" * 200_000
    answer = ok(True, text)
    offer(lambda request: [answer[:3], answer[3:9], answer[9:100_000], answer[100_000:]])
    assert client()(True).message == text


def test_an_answer_that_trickles_in_has_the_same_limit(offer, client):
    def trickle(request):
        for byte in ok(True, "x" * 1000):
            time.sleep(LIMIT / 5)  # each in time, all of them not
            yield bytes([byte])

    offer(trickle)
    with pytest.raises(ServiceHangs):
        client(timeout=LIMIT)(True)


@pytest.fixture
def simulator(offer, master, monkeypatch):
    """Answers once it is told to; the limits of its clients are over soon."""
    monkeypatch.setattr(service_module, "WORKING", LIMIT / 5)
    master.nodes["/fake"] = master.uri
    ready = threading.Event()
    offer(lambda request: ready.wait(BOUND) and [ok(True)])
    return ready


def test_while_a_simulator_computes_no_limit_ends_a_call(simulator, client, master):
    looks = itertools.count()

    def work():
        for number in looks:
            if number == 6:
                simulator.set()
            yield number

    master.work = work()
    assert client(timeout=LIMIT / 5)(True).success
    assert next(looks) > 6


def test_what_a_signal_s_handler_raises_ends_a_call(simulator, client, master):
    def ring(*_):
        raise TimeoutError("the script's own")

    master.work = itertools.count()
    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, LIMIT)
    with pytest.raises(ServiceHangs) as hangs:
        client()(True)
    assert str(hangs.value.__cause__) == "the script's own"
    signal.signal(signal.SIGALRM, before)
    simulator.set()


def test_a_simulator_that_stands_still_hangs(simulator, client):
    with pytest.raises(ServiceHangs, match=r"/fake/set: no answer within 0.3 s"):
        client(timeout=LIMIT)(True)
    simulator.set()


def test_without_a_limit_it_waits_until_the_shutdown(offer, client, monkeypatch):
    service = offer(lambda request: service.over.wait() and None)
    down = threading.Event()
    monkeypatch.setattr(rospy, "is_shutdown", down.is_set)
    begin = time.monotonic()
    threading.Timer(3 * LIMIT, down.set).start()
    with pytest.raises(ServiceHangs, match="no answer before the shutdown"):
        client(timeout=math.inf)(True)
    assert time.monotonic() - begin > 2 * LIMIT


def test_without_a_limit_an_answer_may_come_late(offer, client, monkeypatch):
    looks, late = itertools.count(1), threading.Event()

    def is_shutdown():
        if next(looks) * LOOK > 2 * LIMIT:
            late.set()
        return False

    monkeypatch.setattr(rospy, "is_shutdown", is_shutdown)
    offer(lambda request: [ok(True)] if late.wait(BOUND) else None)
    assert client(timeout=math.inf)(True).success


def test_ctrl_c_ends_a_call_and_the_connection(offer, client):
    def interrupt(request):
        signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
        service.over.wait()

    service = offer(interrupt)
    call = client(persistent=True)
    with pytest.raises(KeyboardInterrupt):
        call(True)
    service.close()
    offer()
    assert call(True).success, "the answer to the first call isn't taken for the second one's"


def test_a_failure_because_of_a_shutdown_is_an_interrupt(offer, monkeypatch):
    down = threading.Event()
    offer(lambda request: down.set() or [failed("too late")])
    monkeypatch.setattr(rospy, "is_shutdown", down.is_set)
    with pytest.raises(rospy.ROSInterruptException, match="shut down while calling /fake/set"):
        wait_and_call(NAME, SetBool, True, timeout=BOUND)


def test_services_that_are_begun_work_at_the_same_time(master, client):
    both = threading.Barrier(2, timeout=BOUND)
    services = [FakeService(lambda request: both.wait() and None or [ok(True)]) for _ in range(2)]
    calls = []
    for index, service in enumerate(services):
        master.services[f"{NAME}{index}"] = service.address
        calls.append(ServiceClient(f"{NAME}{index}", SetBool, persistent=True, timeout=BOUND))
    for call in calls:
        call.begin(True)
    assert [call.end().success for call in calls] == [True, True]
    for each in calls + services:
        each.close()


def test_begin_and_end_come_in_turn(offer, client):
    offer()
    call = client(persistent=True)
    with pytest.raises(RuntimeError, match=r"/fake/set: end\(\) without begin\(\)"):
        call.end()
    call.begin(True)
    for again in (call.begin, call):
        with pytest.raises(RuntimeError, match=r"begin\(\) once more before end\(\)"):
            again(True)
    call.close()  # which gives up what was begun
    call.begin(False)
    assert not call.end().success


@pytest.mark.parametrize("persistent", [True, False])
def test_a_service_that_fails_after_the_begin(offer, client, persistent):
    asked = threading.Event()
    service = offer(lambda request: asked.set() or service.over.wait() and None)
    call = client(persistent=persistent)
    call.begin(True)
    assert asked.wait(BOUND)
    service.break_off()
    with pytest.raises(ServiceGone, match="the connection broke"):
        call.end()
    call.timeout = LIMIT
    call.begin(True)  # connects anew
    with pytest.raises(ServiceHangs, match=r"within 0.3 s"):
        call.end()
    service.close()
    offer()
    call.timeout = BOUND
    assert call(True).success
