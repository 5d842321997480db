# %% [markdown]
# # What drives a load
#
# One pair of adjoint systems gives the derivative of a load by every number of the vehicle, exactly. In a shell:
# `ascentwind sensitivity as504`.

# %%
import ascentwind as aw

study = aw.Study.load("as504")
gradient = study.sensitivity("bending_moment", "peak", quantity="abs_mean_plus_3sigma")
print(f"{gradient.attrs['mean'] + 3 * gradient.attrs['variance'] ** 0.5:.4g} N m")

# %% [markdown]
# The elasticity is the change of the load in percent for one percent of a number: the ten numbers that matter most.

# %%
rows = gradient[["parameter_value", "derivative", "elasticity"]].to_dataframe()[["elasticity", "description"]]
rows.loc[rows["elasticity"].abs().sort_values(ascending=False).index[:10]]

# %% [markdown]
# Whole tables over time have a derivative at every second. Which of them matter?

# %%
gradient["table_elasticity"].to_series().sort_values(key=abs, ascending=False)[:8]

# %%
from ascentwind.runners.sensitivity.derivative_figures import tornado_figure

tornado_figure(gradient)

# %% [markdown]
# A derivative is only as good as it is checked: here by differences of another engine's runs.

# %%
check = study.check_sensitivity("bending_moment", 75, parameters=["control.T1.gain"])
check[["derivative", "difference", "apart"]].to_dataframe()
