# %% [markdown]
# # First result
#
# What does the March wind over Cape Kennedy do to AS-504, the Saturn V of Apollo 9? In a shell the same is
# `ascentwind run as504`.

# %% tags=["hide"]
import os
import tempfile

os.chdir(tempfile.mkdtemp())

# %%
import ascentwind as aw

study = aw.Study.load("as504")
study

# %% [markdown]
# One call gives mean and variance of every response at every end time, by source of the randomness. With a C compiler
# it takes a fraction of a second, once the code is compiled.

# %%
stats = study.response_statistics(times=range(40, 101))
stats

# %% [markdown]
# The peaks are of the larger side, |mean| + 3 sigma. The result is a labelled array: here the standard deviation of
# the bending moment at 75 s, from each source by itself and from all together.

# %%
stats.std.sel(response="bending_moment", time=75).to_series()

# %% [markdown]
# Sources are independent, so that their variances add up.

# %%
variances = stats.variance.sel(response="bending_moment", time=75)
print(f"{float(variances[:-1].sum() ** 0.5):.6e} N m")

# %%
stats.plot("bending_moment")

# %% [markdown]
# Where does the moment at 75 s come from? The weighting function says what a unit of each noise at an earlier time
# adds to it. The adjoint system gives it for all earlier times in one backward integration.

# %%
weights = study.weighting_function(time=75)
_ = weights["noise_weighting"].sel(response="bending_moment", noise="wind_1", t=slice(50, 75)).plot()

# %% [markdown]
# Files keep it all, with units, versions and hashes, and open again as the same object.

# %%
stats.save("results")
again = aw.ResponseStatistics.open("results/statistics.nc")
print(f"{again.peaks()[0].value:.4g} N m at {again.peaks()[0].time:g} s")

# %% [markdown]
# What these numbers mean, and what they do not, is [told on its own page](../../meaning/). The largest value of a
# whole flight, rather than of an instant, is [the load of a flight](../flight-load/).
