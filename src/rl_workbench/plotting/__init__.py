"""Learning curves as pictures, which need no display; a training at its end and the tools share them."""
