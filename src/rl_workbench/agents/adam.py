"""Adam without torch's compiler, whose import takes longer than a short training, and 70 MB."""

from inspect import unwrap

from torch import no_grad, optim


class Adam(optim.Adam):
    """torch's, to the bit; its methods import the compiler only to tell it that it shall leave them alone."""

    step = no_grad()(unwrap(optim.Adam.step))
    state_dict, load_state_dict = unwrap(optim.Adam.state_dict), unwrap(optim.Adam.load_state_dict)
    add_param_group, zero_grad = unwrap(optim.Adam.add_param_group), unwrap(optim.Adam.zero_grad)
