"""A cluster's head: where it is, and what it answers. Ray itself would ask for 20 s, whatever that is."""

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.cluster.address import AUTO, PATIENCE, no_head

METHOD = "/ray.rpc.NodeInfoGcsService/GetClusterId"
NOTHING = b""  # the request has no fields
ANOTHER_TOKEN = (
    "its token is another than this machine's: RAY_AUTH_MODE=token, and RAY_AUTH_TOKEN or "
    "~/.ray/auth_token (ray get-auth-token) have to be as on the head"
)


def head_of_this_machine() -> str:
    """HOST:PORT of the head of the cluster that this machine belongs to.

    Raises:
        WorkbenchError: if it belongs to none.
    """
    from ray._private.services import canonicalize_bootstrap_address_or_die

    try:
        return str(canonicalize_bootstrap_address_or_die(AUTO))
    except ConnectionError as error:
        raise WorkbenchError(
            f"--ray {AUTO}: this machine belongs to no Ray cluster, or to several; name one by its head's "
            "HOST:PORT, or have RAY_ADDRESS name it"
        ) from error


def check_head(address: str) -> None:
    """Refuses what answers as Ray's servers do, but isn't a head, or has another token.

    Args:
        address: HOST:PORT, where something answers.

    Raises:
        WorkbenchError: if it does.
    """
    import grpc
    from ray._private.grpc_utils import init_grpc_channel  # adds this machine's token

    with init_grpc_channel(address) as channel:
        try:
            channel.unary_unary(METHOD)(NOTHING, timeout=PATIENCE)
        except grpc.RpcError as error:
            code = error.code()
            if code == grpc.StatusCode.UNAUTHENTICATED:
                raise WorkbenchError(
                    f"can't join the Ray cluster at {address}: {ANOTHER_TOKEN}"
                ) from error
            if code == grpc.StatusCode.UNIMPLEMENTED:
                raise no_head(address) from error
            text = " ".join(error.details().split())
            raise WorkbenchError(f"no Ray cluster answers at {address}: {text}") from error
