"""A system's matrices and gradients at many times at once, and the collocation equations that use them."""
