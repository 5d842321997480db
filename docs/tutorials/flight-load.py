# %% [markdown]
# # The load of a flight
#
# Mean + 3 sigma is of one instant. A flight has many: which bending moment does a *flight* pass with a given chance?
# In a shell: `ascentwind flight-load as504`.

# %%
import ascentwind as aw

study = aw.Study.load("as504")
load = study.flight_load("bending_moment", window=(40.0, 100.0), probabilities=[0.01, 0.00135])
load

# %% [markdown]
# The level passed by 0.135 % of flights lies well above the worst instant's |mean| + 3 sigma, 24.8 MN m, which single
# instants pass with that chance.

# %%
aw.plot(load)

# %% [markdown]
# The other way round: how many flights pass 30 MN m?

# %%
print(f"{load.probability(30e6).value:.2e}")

# %% [markdown]
# What each source adds to the level, and what the level would be without it.

# %%
load.shares.sel(probability=0.00135).to_dataframe()[["share", "level_without"]]

# %% [markdown]
# A limit, one number or a table over time, gives the chance of passing it, and the factor on the limit at which 0.135 %
# of flights pass.

# %%
limited = study.flight_load("bending_moment", window=(40.0, 100.0), limit=30e6)
limited.passage
