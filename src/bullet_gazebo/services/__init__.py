"""Gazebo's services, and those of a world in lock-step."""

from collections.abc import Callable
from typing import Any, TypeVar

import genpy
import rospy

from bullet_gazebo.common.messages import LARGEST_NUMBER, bad_number

NO_MODEL = "model does not exist"
SCOPE = "did you forget to scope the link by model name?"
NO_LINK = f"link not found, {SCOPE}"
Found = TypeVar("Found")


class ServiceRefused(Exception):
    """A request can't be carried out, and nothing has changed; the text says why."""


def existing(found: Found | None, fault: str) -> Found:
    """Returns what a name was looked up as; raises ServiceRefused with that text if there is none."""
    if found is None:
        raise ServiceRefused(fault)
    return found


def offer(name: str, kind: Any, act: Callable[[Any], str | genpy.Message]) -> rospy.Service:
    """Offers a service whose answer has `success` and `status_message`.

    `act` carries out a request and returns the answer, or the text of one that has only that; or raises
    ServiceRefused, whose text follows the name of the service's type.
    """

    def handle(request: genpy.Message) -> genpy.Message:
        try:
            done = act(request)
        except ServiceRefused as refusal:
            text = f"{kind.__name__}: {refusal}"
            return kind._response_class(success=False, status_message=text)
        if isinstance(done, str):
            return kind._response_class(success=True, status_message=done)
        return done

    return rospy.Service(name, kind, handle)


def check_message(message: genpy.Message, largest: float = LARGEST_NUMBER) -> None:
    """Raises ServiceRefused for a message with a number that the world can't take."""
    fault = bad_number(message, largest)
    if fault:
        raise ServiceRefused(fault)
