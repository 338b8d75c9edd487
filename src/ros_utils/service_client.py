"""A client for one service, and its errors, which `StepClient` raises, too. See `ros_calls.service`."""

from ros_calls.service import TIMEOUT, ServiceClient, ServiceFailed, ServiceGone, ServiceHangs, ServiceMissing

__all__ = [
    "TIMEOUT", "ServiceClient", "ServiceFailed", "ServiceGone", "ServiceHangs", "ServiceMissing",
]  # fmt: skip
