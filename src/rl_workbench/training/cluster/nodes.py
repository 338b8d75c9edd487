"""The nodes of a cluster: which of them can do our work, and how work is sent there."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rl_workbench.training.cluster.package import PACKAGE, own_packages, versions

PATIENCE = 90.0  # [s] until a node has started a worker that answers
NODE_LABEL = "ray.io/node-id"


@dataclass(frozen=True)
class Node:
    """A machine of the cluster."""

    id: str
    name: str  # its address, for the user
    cpus: int


class Cluster:
    """A cluster that this process belongs to.

    Args:
        ray: the module, initialised.
        say: is told of nodes that can't be used, each once.
    """

    def __init__(self, ray: Any, say: Callable[[str], None]) -> None:
        self.ray = ray
        self.nodes: dict[str, Node] = {}  # by their ids, those that can be used
        self._say, self._refused = say, set[str]()
        self._packages = own_packages()
        self._wanted = versions(self._packages)
        self._look = ray.remote(num_cpus=0, max_retries=0)(_looking())

    @property
    def cpus(self) -> int:
        """Of all nodes that can be used."""
        return sum(node.cpus for node in self.nodes.values())

    def update(self) -> None:
        """Looks for nodes that have come or gone; asks those that have come what they have."""
        alive = {each["NodeID"]: each for each in self.ray.nodes() if each["Alive"]}
        self.nodes = {id: node for id, node in self.nodes.items() if id in alive}
        new = [
            Node(id, each["NodeManagerAddress"], int(each["Resources"].get("CPU", 0)))
            for id, each in alive.items()
            if id not in self.nodes and id not in self._refused
        ]
        asked = [
            (node, self._look.options(label_selector=only(node.id)).remote(self._packages))
            for node in new
        ]
        for node, answer in asked:
            problem = self._problem(answer)
            if problem:
                self._refused.add(node.id)
                self._say(f"node {node.name} ({node.id[:8]}) is left out: {problem}")
            else:
                self.nodes[node.id] = node

    def _problem(self, answer: Any) -> str:
        """Why a node can't be used; empty if it can."""
        try:
            found: dict[str, str] = self.ray.get(answer, timeout=PATIENCE)
        except self.ray.exceptions.GetTimeoutError:
            self.ray.cancel(answer, force=True)
            return f"it didn't answer within {PATIENCE:.0f} s"
        except self.ray.exceptions.RayError as error:
            lines = [line for line in str(error).splitlines() if line.strip()]
            return f"it couldn't be asked: {lines[-1].strip() if lines else type(error).__name__}"
        if not found:
            return f"Python finds no package {PACKAGE} there; what is installed here has to be there, too"
        wanted = self._wanted.items()
        others = [(name, found.get(name, "none"), its) for name, its in wanted if found.get(name) != its]
        return ", ".join(f"its {name} is {has}, here it is {its}" for name, has, its in others)

    def placement(self) -> dict[str, Any]:
        """Options of a task or an actor: on any of the nodes that can be used."""
        return {"label_selector": {NODE_LABEL: f"in({','.join(self.nodes)})"}}


def only(node_id: str) -> dict[str, str]:
    """The selector of one node."""
    return {NODE_LABEL: node_id}


def _looking() -> Callable[[tuple[str, ...]], dict[str, str]]:
    """What asks a node. Being inside of this function, it travels as a whole: the node may lack our package."""

    def look(packages: tuple[str, ...]) -> dict[str, str]:
        try:
            from rl_workbench.training.cluster.package import versions
        except ImportError:
            return {}
        return versions(packages)

    return look
