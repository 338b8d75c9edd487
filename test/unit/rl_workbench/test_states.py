"""An optimizer's moments of another size: torch would write beyond them, and the process might crash."""

from typing import Any

import pytest
import torch

from rl_workbench.states import check_optimizer


@pytest.mark.parametrize("optimizer", [torch.optim.Adam, torch.optim.RMSprop, torch.optim.SGD])
def test_moments_of_another_size_are_refused(optimizer: Any) -> None:
    def made(size: int) -> Any:
        weights = torch.nn.Parameter(torch.ones(size))
        result = optimizer([weights], lr=0.1)
        weights.grad = torch.ones(size)
        result.step()
        return result

    new = optimizer([torch.nn.Parameter(torch.ones(4))], lr=0.3)
    check_optimizer(new, new.state_dict())
    check_optimizer(new, made(4).state_dict())
    if optimizer is not torch.optim.SGD:  # which has no moments
        with pytest.raises(ValueError, match=r"of shape \(4,\) is expected, not \(3,\)"):
            check_optimizer(new, made(3).state_dict())
