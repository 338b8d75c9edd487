"""Imperfect actuators: what a controller gets of a command comes late, within limits, and lags behind."""

import math
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, Final

from robot_envs.variation.numbers import at_least_zero, by_name, steps

MOST_DELAY: Final = 1000  # [control steps]
Commands = dict[str, Any]
"""By controller: a number, or for a group a tuple of them [m, rad, m/s, rad/s, N, N m]."""
Rule = Callable[[float, float, float], float]
"""What becomes of a number: of how much there is of it, what is wanted, and what was there before."""
Rules = dict[str, tuple[Rule, float]]


class Actuator:
    """Between a task's commands and the controllers: first the delay, then the limit, then the lag.

    Commands are numbers here, not angles: a set-point that jumps from pi to -pi passes 0.

    Args:
        holds: by controller, whether it takes positions; others take velocities or efforts.
        period: of control [s].
        delay: how many control steps pass before a command arrives. Until the first one does, controllers
            hold what they held at the episode's start.
        limit: one for all, or by controller. Efforts [N, N m] and velocities [m/s, rad/s] are cut at it,
            either way; positions follow no faster than that [m/s, rad/s].
        lag: time constant of a first-order lag [s]: one for all, or by controller; 0: none. For a control
            period a controller gets what the lag comes to at its end: 1 - exp(-t / lag) of a step.

    Raises:
        ValueError: for a number that makes no sense, or a controller that isn't there.
    """

    def __init__(
        self,
        holds: Mapping[str, bool],
        period: float,
        delay: int = 0,
        limit: float | Mapping[str, float] | None = None,
        lag: float | Mapping[str, float] = 0.0,
    ) -> None:
        names = list(holds)
        self._delay = steps("action_delay", delay, MOST_DELAY)
        given = {} if limit is None else by_name("actuator_limit", limit, names, "controller")
        most = {name: at_least_zero("actuator_limit", each) for name, each in given.items()}
        self._limits: Rules = {
            name: (_follow, each * period) if holds[name] else (_cut, each)
            for name, each in most.items()
        }
        given = by_name("actuator_lag", lag, names, "controller")
        lags = {name: at_least_zero("actuator_lag", each) for name, each in given.items()}
        self._lags: Rules = {
            name: (_lag, -math.expm1(-period / each)) for name, each in lags.items() if each > 0.0
        }
        self._sent: deque[Commands] = deque(maxlen=self._delay + 1)
        self._limited: Commands = {}
        self._reached: Commands = {}

    @property
    def is_ideal(self) -> bool:
        """Whether commands arrive as they are, at once."""
        return not (self._delay or self._limits or self._lags)

    def begin(self, held: Mapping[str, Any]) -> None:
        """Starts an episode.

        Args:
            held: what the controllers hold, all of them.
        """
        self._sent.clear()
        self._sent.extend([dict(held)] * self._delay)
        self._limited, self._reached = dict(held), dict(held)

    def __call__(self, commands: Mapping[str, Any]) -> Commands:
        """What arrives at the controllers in a control period.

        Args:
            commands: what is sent to all of them: the last one, where there is no new one.
        """
        self._sent.append(dict(commands))
        arriving = self._sent[0]
        self._limited = _ruled(self._limits, arriving, self._limited)
        self._reached = _ruled(self._lags, self._limited, self._reached)
        return self._reached


def _cut(most: float, wanted: float, _: float) -> float:
    return max(-most, min(most, wanted))


def _follow(way: float, wanted: float, before: float) -> float:
    return wanted if abs(wanted - before) <= way else before + math.copysign(way, wanted - before)


def _lag(share: float, wanted: float, before: float) -> float:
    return before + share * (wanted - before)


def _ruled(rules: Rules, wanted: Commands, before: Commands) -> Commands:
    """Commands by the controllers' rules, number by number."""
    found = dict(wanted)
    for name, (rule, size) in rules.items():
        to, at = wanted[name], before[name]
        if isinstance(to, tuple):
            found[name] = tuple(rule(size, *each) for each in zip(to, at, strict=True))
        else:
            found[name] = rule(size, to, at)
    return found
