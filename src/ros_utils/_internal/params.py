"""Parameters of the current master (`ros_calls.master.using`), with a time limit.

rospy's own functions know one master per process.
"""

from typing import Any

import rosgraph
import rospy

from ros_calls import master as _master
from ros_calls.master import NoAnswer, Refused


def get(name: str) -> Any:
    """Returns a parameter; raises KeyError if it isn't set, MasterDown without a master."""
    _master.require()
    resolved = rospy.resolve_name(name)
    try:
        return _master.call("getParam", resolved)
    except Refused as fault:
        raise KeyError(resolved) from fault
    except NoAnswer as fault:
        raise _master.MasterDown(f"parameter {resolved}: {fault}") from fault


def put(name: str, value: Any) -> None:
    """Sets a parameter, or each entry of a mapping; raises MasterDown without a master, or if it refuses."""
    _master.require()
    resolved = rospy.resolve_name(name)
    values = value.items() if isinstance(value, dict) and value else [("", value)]
    for key, each in values:
        full = rosgraph.names.ns_join(resolved, str(key)) if key != "" else resolved
        try:
            _master.call("setParam", full, each)
        except (NoAnswer, Refused, OverflowError) as fault:
            raise _master.MasterDown(f"parameter {full}: {fault}") from fault
