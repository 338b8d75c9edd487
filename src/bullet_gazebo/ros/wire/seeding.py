"""Random numbers of whatever runs inside the simulator."""

import random

import numpy as np
import rospy


def seed_random_numbers(seed: int | None, tell: bool = True) -> None:
    """Has plugins and whatever else runs in the simulator draw the same numbers every time.

    The physics itself draws none.
    """
    if seed is None:
        return
    random.seed(seed)
    np.random.seed(seed % 2**32)
    if tell:
        rospy.loginfo("Random numbers start from seed %d", seed)
