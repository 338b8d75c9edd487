"""Controllers that report IMUs and force-torque sensors, with both engines: rates, resets, refusals."""

import pytest
from support.robots.snippets import link
from support.robots.worlds import add_robot, start

from robot_sim.control.controllers import built_in
from robot_sim.control.errors import ControlError
from robot_sim.physics.pose import Pose
from robot_sim.sensors.sensing import Sensing
from robot_sim.sensors.sensor_readers import offer_sensors
from robot_sim.simulator import Simulator

G = 9.8
MS = 1_000_000
IMU = {"type": "imu_sensor_controller/ImuSensorController"}
FORCES = {"type": "force_torque_sensor_controller/ForceTorqueSensorController"}
SOLID = '<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision>'
URDF = f"""<robot name="r">{link("base", 3, more=SOLID)}{link("hand", 2, more=SOLID)}
<joint name="wrist" type="fixed"><parent link="base"/><child link="hand"/><origin xyz="0 0 0.3"/></joint>
<gazebo reference="base"><sensor name="imu/data" type="imu"><update_rate>{{rate}}</update_rate>
<imu><angular_velocity><x>
<noise type="gaussian"><stddev>{{noise}}</stddev></noise></x></angular_velocity></imu></sensor></gazebo>
<gazebo reference="wrist"><disableFixedJointLumping>1</disableFixedJointLumping>
<sensor name="wrist_ft" type="force_torque"><update_rate>100</update_rate></sensor></gazebo></robot>"""


class Bot:
    """A robot on the ground, and what its controllers send."""

    def __init__(self, world, rate=0, noise=0, **options):
        self.sim = Simulator(world, lockstep=True, **options)
        text = URDF.format(rate=rate, noise=noise)
        self.robot = add_robot(self.sim, "r", text, Pose((0.0, 0.0, 0.1)))
        offer_sensors(self.robot.hardware, self.sim, self.robot.model, Sensing(self.sim))
        self.sent = {}

    def start(self, **controllers):
        rate = {"publish_rate": 100}
        start(self.robot, {name: rate | each for name, each in controllers.items()})
        for each in self.robot.manager.loaded:
            for output in each.outputs:
                output.sink = self.sent.setdefault(output.topic, []).append

    def stamps(self, topic):
        return [sample.stamp // MS for sample in self.sent[topic]]


@pytest.fixture
def bot(world):
    return Bot(world)


def test_both_report_at_their_rate_what_the_sensors_feel(bot):
    bot.start(imu=IMU, forces=FORCES)
    bot.sim.advance(1000)
    imu, wrench = bot.sent["imu/data"], bot.sent["wrist_ft"]
    assert bot.stamps("imu/data")[:3] == bot.stamps("wrist_ft")[:3] == [11, 21, 31]
    assert all(output.shared for each in bot.robot.manager.loaded for output in each.outputs)
    assert imu[-1].value.linear_acceleration == pytest.approx((0.0, 0.0, G), abs=0.1)
    assert wrench[-1].value[0] == pytest.approx((0.0, 0.0, -2.0 * G), abs=0.5)
    assert (imu[-1].frame, wrench[-1].frame) == ("base", "hand")


def test_a_sensor_with_a_rate_keeps_its_last_measurement_between(world):
    bot = Bot(world, rate=50)
    bot.start(imu=IMU)
    bot.sim.advance(200)
    values = [sample.value for sample in bot.sent["imu/data"]]
    assert len(values) == 19
    assert len(set(values[-10:])) <= 6


@pytest.mark.parametrize("relatch", [True, False])
def test_nothing_is_stale_or_silent_after_resets(world, relatch):
    bot = Bot(world, relatch=relatch)
    bot.start(imu=IMU, forces=FORCES)
    for reset in (bot.sim.reset_simulation, bot.sim.reset_world, bot.sim.reset_time):
        bot.sim.advance(150)
        bot.robot.model.place(Pose((0.0, 0.0, 5.0)), ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
        bot.sent["imu/data"].clear()
        reset()
        now = bot.sim.now
        assert [sample.stamp for sample in bot.sent["imu/data"]] == [now]  # at once
        bot.sim.advance(11)
        for sent in bot.sent.values():
            assert now < sent[-1].stamp <= now + 11 * MS


def test_a_stopped_controller_measures_nothing_and_goes_on_when_it_starts(bot):
    bot.start(imu=IMU)
    bot.sim.advance(100)
    bot.robot.manager.switch([], ["imu"])
    assert not bot.sim.listeners
    bot.sent["imu/data"].clear()
    bot.sim.advance(100)
    assert not bot.sent["imu/data"]
    bot.robot.manager.switch(["imu"], [])
    bot.sim.advance(100)
    assert bot.stamps("imu/data")[-1] == 291


def test_a_rate_of_0_and_one_without_topics_publish_nothing(bot):
    bot.start(imu=IMU | {"publish_rate": 0})
    bot.sim.advance(20)
    assert bot.sent == {"imu/data": []}
    bot.robot.manager.switch([], ["imu"])
    for makers in bot.robot.hardware.sensors.values():
        makers.clear()
    offer_sensors(bot.robot.hardware, bot.sim, bot.robot.model, sensing=None)
    bot.start(again=IMU, forces=FORCES)
    bot.sim.advance(50)
    assert not bot.sim.listeners
    assert bot.sent == {"imu/data": [], "wrist_ft": []}


def test_what_is_missing_or_faulty_is_named(world, make_world):
    create = built_in()[IMU["type"]].create
    with pytest.raises(ControlError, match="imu/publish_rate is missing"):
        create("imu", IMU, Bot(world).robot.hardware)
    faulty = Bot(make_world(), noise=-1)
    with pytest.raises(ControlError, match="'imu/data' can't be simulated.*stddev"):
        create("imu", {"publish_rate": 10}, faulty.robot.hardware)
    faulty.robot.hardware.sensors[built_in()[IMU["type"]].interface].clear()
    with pytest.raises(ControlError, match='no <sensor type="imu">.*ImuSensorInterface'):
        create("imu", {"publish_rate": 10}, faulty.robot.hardware)
