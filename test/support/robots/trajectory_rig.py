"""A JointTrajectoryController on obedient joints, stepped tick by tick."""

from robot_sim.control.controllers import built_in
from robot_sim.control.hardware import RobotHardware
from robot_sim.control.trajectory_goals import GoalRequest, Trajectory, TrajectoryPoint
from robot_sim.control.transmissions import read_description

MS, S = 1_000_000, 1_000_000_000  # [ns]
DT = 0.001  # [s]
KINDS = {"shoulder": "revolute", "wrist": "continuous", "rail": "prismatic"}
GAINS = {joint: {"p": 10.0, "d": 2.0} for joint in KINDS}


def urdf(interface):
    joints = "".join(
        f'<joint name="{name}" type="{kind}"><limit lower="-3" upper="3" effort="9" velocity="9"/></joint>'
        f'<transmission name="t_{name}"><type>transmission_interface/SimpleTransmission</type>'
        f'<joint name="{name}"><hardwareInterface>hardware_interface/{interface}JointInterface'
        f'</hardwareInterface></joint><actuator name="m_{name}"/></transmission>'
        for name, kind in KINDS.items()
    )
    return f'<robot name="arm">{joints}</robot>'


class Listener:
    def __init__(self):
        self.samples, self.outcomes = [], []

    def feedback(self, sample):
        self.samples.append(sample)

    def finished(self, outcome):
        self.outcomes.append(outcome)


class Rig:
    """A running controller; with a position interface its joints are where they were told to be."""

    def __init__(self, interface="Position", joints=("shoulder",), **params):
        self.hardware = RobotHardware(read_description(urdf(interface)))
        self.joints = self.hardware.joints
        self.now = 100 * S
        kind = built_in()[f"{interface.lower()}_controllers/JointTrajectoryController"]
        params = {"joints": joints and list(joints), "gains": GAINS} | params
        self.controller = kind.create("arm", params, self.hardware)
        self.obedient = interface == "Position"

    def start(self):
        self.controller.starting(self.now)
        self.controller.state = "running"
        return self

    def run(self, ticks=1):
        for _ in range(ticks):
            self.now += MS
            self.controller.update(self.now, DT)
            if self.obedient:
                for name in self.controller.joint_names:
                    joint = self.joints[name]
                    joint.velocity = (joint.command - joint.position) / DT
                    joint.position = joint.command

    def pursue(self, trajectory, key="goal", **tolerances):
        listener = Listener()
        self.controller.pursue(key, GoalRequest(trajectory, **tolerances), listener)
        return listener

    def collect(self):
        samples = []
        self.controller.outputs[0].sink = samples.append
        return samples


def move(*points, names=("shoulder",), stamp=0):
    """Points are (time [s], positions) at rest."""
    rest = (0.0,) * len(names)
    return Trajectory(names, [TrajectoryPoint(round(t * S), p, rest, rest) for t, p in points], stamp)
