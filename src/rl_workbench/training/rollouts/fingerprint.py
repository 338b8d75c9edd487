"""To which bits a machine computes: NumPy and torch choose their kernels by the processor's kind."""

import hashlib

import numpy as np
import torch

SIZES = (1, 4, 7, 32, 65)  # of layers; kernels have special ways for what doesn't fill a register


def fingerprint() -> str:
    """The same on two machines where policies act alike on both, as far as some layers of theirs tell.

    A different one means that some operation rounds another way: then the same episode needn't come out.
    """
    generator = np.random.default_rng(0)
    digest = hashlib.sha256()
    with torch.no_grad():
        for inputs in SIZES:
            for outputs in SIZES:
                weight = generator.standard_normal((outputs, inputs), np.float32)
                seen = generator.standard_normal(inputs, np.float32)
                found = np.tanh(weight @ seen)
                double = np.exp(found.astype(np.float64))
                batch = torch.from_numpy(weight) @ torch.from_numpy(seen)
                layer = torch.tanh(torch.from_numpy(seen)[None] @ torch.from_numpy(weight).T)
                parts = (found, double, double / double.sum(), np.cumsum(double))
                tensors = (batch, layer, torch.softmax(layer, 1), torch.log(torch.exp(layer)))
                for each in (*parts, *(tensor.numpy() for tensor in tensors)):
                    digest.update(each.tobytes())
    return digest.hexdigest()
