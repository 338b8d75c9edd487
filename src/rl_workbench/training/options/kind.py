"""One value of `--algo`: what the command line and a record have to know of an algorithm."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from rl_workbench.extras import need


@dataclass(frozen=True)
class AlgorithmKind:
    """An algorithm by name; it is imported only when it is used.

    Args:
        name: of --algo, and in records.
        about: for --help: what trains.
        config: the file below config/ with tuned options.
        section: of that file; `{env_id}` stands for the environment's.
        implementation: the module with `make(options) -> Algorithm` and
            `load_policy(options, checkpoint, env) -> Policy`.
        hyperparameters: gives the dataclass of the algorithm's own options.
        defaults: of common options, where they are this algorithm's own.
        presets: whether the file has sections that no environment is called after.
        keeps_dict: whether it learns from a Dict of arrays as it is; others get all of its numbers in one
            vector.
        learns_in_several: whether it learns in several environments at the same time.
        package: the extra that it needs, as (module, name); None if none.
    """

    name: str
    about: str
    config: str
    implementation: str
    hyperparameters: Callable[[], type]
    section: str = "{env_id}"
    defaults: Mapping[str, Any] = field(default_factory=dict)
    presets: bool = False
    keeps_dict: bool = False
    learns_in_several: bool = False
    package: tuple[str, str] | None = None

    def check_installed(self) -> None:
        """Makes sure that what it needs is there.

        Raises:
            WorkbenchError: if it isn't; says how to get it.
        """
        if self.package:
            need(*self.package, f"the algorithm {self.name}")
