"""Snapshots of controllers, their goals and sensors."""

import copy
import random
from dataclasses import replace

import pytest
from support.robots.branches import check_branches, future
from support.robots.cartpole import CONTROLLERS, cartpole_urdf
from support.robots.trajectory_rig import Listener
from support.robots.worlds import add_robot, start

from robot_sim.control.controllers.base import Output
from robot_sim.control.controllers.forward import Forward
from robot_sim.control.hardware import EFFORT
from robot_sim.control.trajectory_goals import GoalRequest, Trajectory, TrajectoryPoint
from robot_sim.physics.pose import Pose
from robot_sim.sensors.schedule import Schedule
from robot_sim.sensors.sensing import Sensing
from robot_sim.sensors.sensor_readers import SensorReaders, Taken
from robot_sim.snapshot import Snapshot, SnapshotError
from robot_sim.state import UnknownName
from robot_sim.state_dict import StateError

S = 1_000_000_000  # [ns]


def test_a_controlled_robot_goes_on_as_before(sim):
    robot = add_robot(sim, "cartpole", cartpole_urdf())
    start(robot, CONTROLLERS)
    robot.manager.get("cart").command(0.3)
    future(sim, 37)

    def between():
        robot.manager.get("cart").command(-0.2)
        sim.reset_simulation()
        future(sim, 11)

    first = check_branches(sim, between)
    assert first[-1][3] != first[0][3]


def test_robots_may_have_come_in_another_order_with_idle_controllers_and_other_gains(sim):
    def come(name, place):
        robot = add_robot(sim, name, cartpole_urdf(), Pose((0.0, place, 0.0)))
        start(robot, CONTROLLERS)
        return robot

    for name, place in (("first", 0.0), ("second", 1.0)):
        come(name, place).manager.get("cart").command(0.1 + place)
    future(sim, 37)

    def between():
        gone = next(each for each in sim.robots if each.model.name == "first")
        sim.remove_robot(gone)
        sim.delete_model(gone.model)
        robot = come("first", 0.0)
        robot.manager.load("idle", {**CONTROLLERS["cart"], "joint": "cart_pole"})
        (pid,) = robot.manager.get("cart").pids.values()
        pid.gains = replace(pid.gains, i=0.0, d=0.0)
        robot.review_gains()

    check_branches(sim, between)


@pytest.fixture
def arm(sim):
    robot = add_robot(sim, "cartpole", cartpole_urdf())
    joint = {"joints": ["stand_cart"], "gains": {"stand_cart": {"p": 500.0, "i": 10.0, "d": 20.0}}}
    start(robot, {"arm": {"type": "effort_controllers/JointTrajectoryController", **joint}})
    return robot.manager.get("arm")


def way(*places):
    points = [TrajectoryPoint((k + 1) * S // 5, [x]) for k, x in enumerate(places)]
    return Trajectory(["stand_cart"], points)


def test_a_trajectory_is_followed_from_where_it_was(sim, arm):
    arm.follow(way(0.1, -0.2, 0.2))
    future(sim, 150)
    first = check_branches(sim, lambda: arm.follow(way(-0.3)) or future(sim, 50), ticks=300)
    assert max(abs(states[0][0][0][0]) for _, states, *_ in first) > 0.1


def test_goals_are_their_clients_who_are_told_that_they_end(sim, arm):
    def pursue(key, place):
        told = Listener()
        arm.pursue(key, GoalRequest(way(place)), told)
        return told

    first = pursue("first", 0.1)
    future(sim, 50)
    snapshot = sim.save_state()
    after = future(sim, 400)
    assert [each.kind for each in first.outcomes] == ["succeeded"]
    second = pursue("second", -0.1)
    future(sim, 20)
    with pytest.raises(SnapshotError):
        sim.restore_state(Snapshot(snapshot.fits, {**snapshot.state, "now": None}, is_foreign=True))
    assert not second.outcomes
    sim.restore_state(snapshot)
    assert [each.kind for each in second.outcomes] == ["canceled"]
    assert future(sim, 400) == after
    assert len(first.outcomes) == len(second.outcomes) == 1


class Counting(Forward):
    """A user's controller, whose attributes are saved."""

    interface = EFFORT

    @classmethod
    def create(cls, name, params, hardware):
        return cls(name, [hardware.joints["stand_cart"]])

    def __init__(self, name, joints):
        super().__init__(name, joints)
        self.seen, self.random, self.report = [], random.Random(3), Output("count", "Float64")

    def update(self, now, dt):
        self.seen.append(now)
        self._joints[0].command = self.random.gauss(0.0, 0.1) * len(self.seen)


class Faulty(Counting):
    def state_dict(self):
        return len(self.seen)

    def load_state_dict(self, state):
        raise ValueError(f"not {state}")


def with_controller(sim, kind):
    robot = add_robot(sim, "cartpole", cartpole_urdf())
    robot.manager.types["own/Mine"] = kind
    start(robot, {"mine": {"type": "own/Mine"}})
    return robot.manager.get("mine")


def test_a_users_controller_is_saved_by_its_attributes(sim):
    mine = with_controller(sim, Counting)
    future(sim, 10)
    check_branches(sim, lambda: future(sim, 20))
    mine.callback = lambda: 0
    with sim.lock, pytest.raises(StateError, match=r"^Counting.callback: .*state_dict\(\) and load_"):
        sim.save_state()


def test_all_else_is_restored_where_a_users_controller_cannot(sim):
    with_controller(sim, Faulty)
    future(sim, 10)
    snapshot = sim.save_state()
    model = sim.world.models["cartpole"]
    before = sim.now, model.joint_states()
    future(sim, 20)
    with sim.lock, pytest.raises(StateError, match=r"load_state_dict\(\) of Faulty raised .*not 10"):
        sim.restore_state(snapshot)
    assert (sim.now, model.joint_states()) == before


IMU = (
    '<gazebo reference="cart"><sensor type="imu" name="feel"><always_on>1</always_on>'
    "<update_rate>100</update_rate><imu><linear_acceleration><x><noise type='gaussian'>"
    "<stddev>0.1</stddev></noise></x></linear_acceleration></imu></sensor></gazebo></robot>"
)


def test_sensors_measure_the_same_with_the_same_noise(sim):
    robot = add_robot(sim, "cartpole", cartpole_urdf().replace("</robot>", IMU))
    start(robot, CONTROLLERS)
    sensing = Sensing(sim, seed=3)
    readers = SensorReaders(sim, sensing, ["feel"])
    robot.manager.get("cart").command(0.2)
    future(sim, 25)
    snapshot = sim.save_state()

    def measured():
        seen = []
        for _ in range(30):
            future(sim, 5)
            (taken,) = readers.read()
            seen.append((taken.now, {k: v.tolist() for k, v in taken.values.items()}))
        return seen

    first = measured()
    assert len({str(values) for _, values in first}) > 10
    for seed in (5, 6):
        sim.reseed(seed)
        sim.reset_simulation()
        measured()
        sim.restore_state(snapshot)
        assert measured() == first


FORGED = {
    "clocks": lambda state: state["_clocks"][0].state.clear(),
    "a part of the file's": lambda state: state["_sensors"][0].state.update(deviation=-1.0),
    "no mount": lambda state: state["_sensors"][0].state.update(mount=5),
    "no part": lambda state: state["_sensors"][0].state.pop("_imu"),
    "names": lambda state: state.update(names=("felt",)),
    "a time": lambda state: state["_taken"].update(feel=Taken(1.5, {})),
    "of others": lambda state: state["_taken"].update(other=Taken(1, {})),
    "no text": lambda state: state.update(_sensors="x"),
    "more": lambda state: state.update(more=1),
}


@pytest.mark.parametrize("forge", FORGED.values(), ids=FORGED)
def test_forged_states_of_sensors_leave_the_world_as_it_was(sim, forge):
    add_robot(sim, "cartpole", cartpole_urdf().replace("</robot>", IMU))
    readers = SensorReaders(sim, Sensing(sim, seed=3), ["feel"])
    future(sim, 25)
    good = sim.save_state()
    first = future(sim, 30), readers.read()[0].now
    content = copy.deepcopy(good.state)
    forge(content["parts"]["readers"])
    with pytest.raises(SnapshotError):
        sim.restore_state(Snapshot(good.fits, content, is_foreign=True))
    assert readers.read()[0].now == first[1]
    sim.restore_state(good)
    assert (future(sim, 30), readers.read()[0].now) == first


@pytest.mark.parametrize("names", [["feel", "feel"], [f"feel@{size}x9" for size in range(9)]])
def test_readers_of_more_pictures_than_anybody_needs_are_refused(sim, names):
    add_robot(sim, "cartpole", cartpole_urdf().replace("</robot>", IMU))
    with pytest.raises(UnknownName, match="read twice, or more than 8 cameras"):
        SensorReaders(sim, Sensing(sim), names)


def test_a_file_fits_where_somebody_hears_a_sensor_since(sim):
    schedule, heard = Schedule(sim), False
    sim.parts["clock"] = schedule.begin(next(iter(sim.world.models.values())), 10.0, id, lambda: heard)
    snapshot = Snapshot.from_bytes(sim.save_state().to_bytes())
    heard = True
    schedule.review()
    future(sim, 300)
    sim.restore_state(snapshot)
    assert sim.now == 0


def test_a_sensor_that_is_heard_only_since_measures_at_its_times(sim):
    schedule, seen, heard = Schedule(sim), [], False
    model = next(iter(sim.world.models.values()))
    schedule.begin(model, 10.0, seen.append, lambda: heard, at_once=False)
    future(sim, 250)
    snapshot = sim.save_state()
    heard = True
    schedule.review()
    future(sim, 300)
    first = seen.copy()
    seen.clear()
    sim.restore_state(snapshot)
    heard = True
    schedule.review()
    future(sim, 300)
    assert seen == first == [3 * S // 10, 4 * S // 10, 5 * S // 10]
