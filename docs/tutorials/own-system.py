# %% [markdown]
# # A system of your own
#
# The method knows nothing of rockets. Any linear time-varying system driven by white noise gets the same statistics:
# here a first-order lag, dx/dt = -x / tau + n, with white noise n of unit intensity. Symbols are CasADi's.

# %%
import casadi as ca
import numpy as np

import ascentwind as aw

t, x, n, tau = (ca.SX.sym(s) for s in ("t", "x", "n", "tau"))
lag = aw.define_system(
    "lag",
    time=t,
    states={"x": (x, -x / tau + n)},
    noises={"gust": n},
    outputs={"x": x},
    parameters={"tau": (tau, 2.0)},
)
study = aw.Study.from_system(lag)
study

# %% [markdown]
# Its variance is known in closed form: tau/2 (1 - exp(-2 t / tau)). Below are the variances found, and how far they
# are from it, relatively.

# %%
times = np.array([0.5, 1.0, 2.0, 5.0])
found = study.response_statistics(times=times).variance.sel(response="x", source="combined")
print(found.values)
print(found.values / (1 - np.exp(-times)) - 1)

# %% [markdown]
# The derivative by tau is exact, by a pair of adjoint systems. By hand it is (1 - exp(-t)) / 2 - (t / 2) exp(-t) at
# tau = 2.

# %%
gradient = study.sensitivity("x", 2.0, quantity="variance")
print(float(gradient["derivative"].sel(parameter="tau")), (1 - np.exp(-2)) / 2 - np.exp(-2))

# %% [markdown]
# A comparison in an expression is a switch: every engine stops there, without being told. Here the lag opens at
# t = 1.

# %%
switched = aw.define_system(
    "switched lag",
    time=t,
    states={"x": (x, -x / ca.if_else(t < 1, tau, tau / 4) + n)},
    noises={"gust": n},
    outputs={"x": x},
    parameters={"tau": (tau, 2.0)},
)
aw.Study.from_system(switched).response_statistics(times=np.linspace(0.02, 3, 150)).plot("x")

# %% [markdown]
# Known inputs (`inputs=`) make a mean, tables a coefficient that is known as numbers only. Models that come as
# matrices on a grid of times are told in [systems from numbers](../../systems-from-numbers/).
