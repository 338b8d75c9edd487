"""Controllers of a user's own package, named in YAML as `my_controllers/Spring` (docs/controllers.md)."""

from geometry_msgs.msg import Vector3

from robot_sim.control.controllers.base import Controller, Input, Output, joint_param, number_param


class Spring(Controller):
    """Pulls a joint to the set-point of the topic `command` (Float64) with `stiffness` [N/m]."""

    type_name = "my_controllers/Spring"
    interface = "EffortJointInterface"

    def __init__(self, name, joint, stiffness):
        super().__init__(name)
        self.joint = joint
        self.stiffness = stiffness
        self.set_point = 0.0
        self.claimed = (joint.name,)
        self.stretch = Output("stretch", Vector3)  # a ROS message type: published as it is
        self.inputs = [Input("command", "Float64", self.command)]
        self.outputs = [self.stretch]

    @classmethod
    def create(cls, name, params, hardware):
        joint = joint_param(params, name, cls.interface, hardware)
        return cls(name, joint, number_param(params, "stiffness", name))

    def command(self, value):
        self.set_point = value

    def starting(self, now):
        self.set_point = self.joint.position

    def update(self, now, dt):
        stretch = self.set_point - self.joint.position
        self.joint.command = self.stiffness * stretch
        if self.stretch.wanted:  # the topic has subscribers
            self.stretch.send(Vector3(x=stretch))


class Rude(Controller):
    """A controller that misbehaves at the place that the parameter `where` names."""

    type_name = "my_controllers/Rude"
    interface = "EffortJointInterface"

    def __init__(self, name, joint, where):
        super().__init__(name)
        self.joint = joint
        self.where = where
        self.heard = 0
        self.claimed = joint.name if where == "claimed" else (joint.name,)
        self.report = Output("report", Vector3)
        self.outputs = [self.report]
        if where == "topic":
            self.outputs = [self.report, Output("other", "NoSuchKind")]
        self.inputs = [Input("command", "Float64", self.command)]

    @classmethod
    def create(cls, name, params, hardware):
        where = params["where"]
        if where == "create":
            raise SystemExit(1)
        made = cls(name, joint_param(params, name, cls.interface, hardware), where)
        return None if where == "nothing" else made

    def command(self, value):
        self.heard += 1
        if self.where == "command" and value < 0.0:
            raise SystemExit("a message that it dislikes")
        self.joint.command = value

    def update(self, now, dt):
        if self.where == "update":
            raise SystemExit("it has had enough")
        if self.where == "report":
            self.report.sink("no message")
        if self.where == "content":
            self.report.sink(Vector3(x="no number"))
