# %% [markdown]
# # A wind of your own
#
# A month's wind is a mean, a standard deviation and correlations over altitude. A shaping filter turns white noise
# into a wind with just these.

# %%
import ascentwind as aw
from ascentwind.model.wind.range_reference import shipped_statistics

july = shipped_statistics("july", "zonal")
july

# %% [markdown]
# Fit a filter of third order directly in state space.

# %%
fit = aw.synthesise(july)
fit

# %%
aw.plot(fit)

# %% [markdown]
# Hold it against the statistics once more, by the adjoint of the filter.

# %%
from ascentwind.runners.wind.verification import verify

found = verify(fit.shaping_filter, july)
print(f"rms error {found.rms_error:.3f} m2/s2, {found.share_inside:.0%} inside the 90 % interval")

# %% [markdown]
# Mean and filter are one wind and go into the vehicle together. July's calm takes more than half of March's load.

# %%
from ascentwind.model.wind.statistics import WindModel

wind = WindModel(july.mean_table(), fit.shaping_filter, july.standard_deviation_table())
march = aw.Study.load("as504")
in_july = march.with_wind(wind)
times = range(60, 96)
for month, study in {"March": march, "July": in_july}.items():
    peak = study.response_statistics(times).peaks()[0]
    print(f"{month}: {peak.value / 1e6:.1f} MN m at {peak.time:g} s")

# %% [markdown]
# Soundings of your own site are read by `aw.read_soundings(file)`, in all common formats, and their
# `.statistics(name)` go the same way. For a vehicle folder one command does it all: `ascentwind wind apply`
# ([wind](../../wind/), [measured winds](../../measured-winds/)).
