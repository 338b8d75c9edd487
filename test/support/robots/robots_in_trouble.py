"""Robots of test/data in a lock-step world, their controllers, and what is reported of them."""

import logging
from pathlib import Path

import xacro
from support.robots.worlds import add_robot

from robot_sim.control.manager import STRICT
from robot_sim.physics.files.urdf import parse_urdf
from robot_sim.robot import ControlledRobot
from robot_sim.simulator import Simulator

ROBOTS = Path(__file__).resolve().parents[2] / "data" / "robots"


def urdf_of(name):
    return xacro.process_file(str(ROBOTS / f"{name}.urdf")).toxml()


class Rig:
    """One robot above the ground; `told` is its log, as pairs of level and text."""

    def __init__(self, world, text):
        self.sim = Simulator(world, lockstep=True)
        self.told = []
        name = parse_urdf(text).name
        robot = add_robot(self.sim, name, text, log=lambda *entry: self.told.append(entry))
        self.model, self.hardware, self.manager = robot.model, robot.hardware, robot.manager

    def use_default_log(self):
        """Goes on with a robot that logs as it does for who says nothing about it."""
        self.sim.remove_robot(self.sim.robots[0])
        self.sim.add_robot(ControlledRobot(self.model, self.hardware, self.manager))

    def load(self, kind, joint, gains):
        """Runs a controller of `joint`, which is called after it."""
        name = f"{joint}_controller"
        controller = self.manager.load(name, {"type": kind, "joint": joint, "pid": gains})
        self.manager.switch([name], [], STRICT)
        return controller

    def controller(self, joint):
        return self.manager.get(f"{joint}_controller")

    def run(self, seconds):
        """Returns the joints' states after each tick, as those who look at the robot see them."""
        states = []
        with self.sim.lock:
            for _ in range(round(seconds / self.sim.world.time_step)):
                self.sim.advance(1)
                states.append(self.model.joint_states())
        return states

    def warnings(self):
        return [text for level, text in self.told if level == logging.WARNING]


def beyond_stops(model, states):
    """How far [rad] a joint was beyond its stops at most."""
    joints = [model.description.joints[name] for name in model.joint_names]
    return max(
        max(joint.lower - position, position - joint.upper)
        for state in states
        for joint, (position, _) in zip(joints, state, strict=True)
    )
