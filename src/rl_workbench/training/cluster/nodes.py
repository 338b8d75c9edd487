"""The nodes of a cluster: which of them can do our work, and how work is sent there."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.cluster.package import PACKAGE, own_packages, versions

NODE_LABEL = "ray.io/node-id"


@dataclass(frozen=True)
class Node:
    """A machine of the cluster."""

    id: str
    name: str  # for the user: its address, and the beginning of its id
    cpus: int


class Cluster:
    """A cluster that this process belongs to.

    Args:
        ray: the module, initialised.
        say: is told of nodes that can't be used, each once.
        own: the id of this process's node, if that is to be looked after: nothing begins without it any more.
    """

    def __init__(self, ray: Any, say: Callable[[str], None], own: str = "") -> None:
        self.ray = ray
        self._own = own
        self.nodes: dict[str, Node] = {}  # by their ids, those that can be used
        self._say = say
        self._known = set[str]()  # ids of nodes that were asked, whatever they answered
        self._asked: dict[Any, Node] = {}  # by Ray's references to their answers
        self._packages = own_packages()
        self._wanted = versions(self._packages)
        self._look = ray.remote(num_cpus=0, max_retries=0)(_looking())

    @property
    def cpus(self) -> int:
        """Of all nodes that can be used."""
        return sum(node.cpus for node in self.nodes.values())

    def update(self, patience: float = 0.0) -> None:
        """Looks for nodes that have come or gone; asks those that have come what they have.

        Args:
            patience: for their answers [s]; those that come later are found by a later call.

        Raises:
            WorkbenchError: if this process's own node has ended.
        """
        alive = {each["NodeID"]: each for each in self.ray.nodes() if each["Alive"]}
        if self._own and self._own not in alive:
            raise WorkbenchError(
                "the node of this machine has left the cluster; what was saved is not lost, and can be gone "
                "on with"
            )
        self.nodes = {id: node for id, node in self.nodes.items() if id in alive}
        for id, each in alive.items():
            if id not in self._known:
                self._known.add(id)
                cpus = int(each["Resources"].get("CPU", 0))
                answer = self._look.options(label_selector=only(id)).remote(self._packages)
                name = f"{each['NodeManagerAddress']} ({id[:4]})"
                self._asked[answer] = Node(id, name, cpus)
        if self._asked:
            asked = list(self._asked)
            answered, _ = self.ray.wait(asked, num_returns=len(asked), timeout=patience)
            for answer in answered:
                self._take(self._asked.pop(answer), answer)

    def _take(self, node: Node, answer: Any) -> None:
        problem = self._problem(answer)
        if problem:
            self._say(f"node {node.name} is left out: {problem}")
        else:
            self.nodes[node.id] = node

    def _problem(self, answer: Any) -> str:
        """Why a node can't be used; empty if it can."""
        try:
            found: dict[str, str] = self.ray.get(answer)
        except self.ray.exceptions.RayError as error:
            lines = [line for line in str(error).splitlines() if line.strip()]
            return f"it couldn't be asked: {lines[-1].strip() if lines else type(error).__name__}"
        if not found:
            return f"Python finds no package {PACKAGE} there; what is installed here has to be there, too"
        wanted = self._wanted.items()
        others = [
            (name, found.get(name, "none"), its) for name, its in wanted if found.get(name) != its
        ]
        return ", ".join(f"its {name} is {has}, here it is {its}" for name, has, its in others)

    def placement(self) -> dict[str, Any]:
        """Options of a task or an actor: on any of the nodes that can be used."""
        return {"label_selector": {NODE_LABEL: f"in({','.join(self.nodes)})"}}


def check_processors(workers: int, processors: int) -> None:
    """Holds a training's workers against a cluster.

    Raises:
        WorkbenchError: if it has fewer processors than there are workers.
    """
    if processors < workers:
        raise WorkbenchError(
            f"num_envs {workers} takes as many processors, and the cluster has {processors}: "
            f"--num-envs {max(processors, 1)}, or more machines"
        )


def only(node_id: str) -> dict[str, str]:
    """The selector of one node."""
    return {NODE_LABEL: node_id}


def _looking() -> Callable[[tuple[str, ...]], dict[str, str]]:
    """What asks a node. Inside of a function it travels as a whole: the node may lack our package."""

    def look(packages: tuple[str, ...]) -> dict[str, str]:
        try:
            from rl_workbench.training.cluster.package import versions
        except ImportError:
            return {}
        return versions(packages)

    return look
