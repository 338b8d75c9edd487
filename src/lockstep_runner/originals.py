"""Python's own versions of the functions that are replaced for the script, for use in this package."""

import threading
import time

sleep = time.sleep
monotonic = time.monotonic
Event = threading.Event
Condition = threading.Condition
event_wait = threading.Event.wait
condition_wait = threading.Condition.wait
join = threading.Thread.join
start = threading.Thread.start
