"""A module that has a controller, and a fault at import."""

from robot_sim.control.controllers.base import Controller


class Any(Controller):
    type_name = "my_broken_controllers/Any"


raise RuntimeError("it has a fault at import")
