# %% [markdown]
# # A vehicle of your own
#
# Start from a vehicle of the same kind, change what it is built of, build its tables, run. Cells that begin with
# `%%bash` are commands for a terminal; there `new-vehicle` asks for what it is not told.

# %% tags=["hide"]
import os
import tempfile

os.chdir(tempfile.mkdtemp())

# %% language="bash" magic_args="--out told --err hint"
# ascentwind new-vehicle my_rocket --from falcon1 --name my_rocket --title "My rocket"

# %%
print(told)

# %% [markdown]
# The raw inputs are `construction.toml` and the tables in `construction/`; every row says where it is from.

# %%
from pathlib import Path

import pandas as pd

table = Path("my_rocket/construction/masses.csv")
pd.read_csv(table, comment="#")[["item", "begin [m]", "end [m]", "mass [kg]", "status"]].tail(4)

# %% [markdown]
# This rocket shall carry 450 kg instead of 420.

# %%
text = table.read_text()
assert "Payload,19.507962,20.75688,420," in text
_ = table.write_text(text.replace("Payload,19.507962,20.75688,420,", "Payload,19.507962,20.75688,450,"))

# %% [markdown]
# `build-vehicle` flies the vehicle, computes masses, modes, slosh, aerodynamics and loads over time, tries the new
# tables and only then replaces the old ones.

# %% language="bash" magic_args="--out told --err hint"
# ascentwind build-vehicle my_rocket

# %%
print(told)

# %% [markdown]
# From here on it is a vehicle like those that ship with ascentwind. Do its roots decay where the load is largest?

# %%
import numpy as np

import ascentwind as aw

study = aw.Study.load("my_rocket")
roots = np.linalg.eigvals(study.matrices(70.0)[0])
print(f"{roots.real.max():.3g} 1/s")

# %%
stats = study.response_statistics(times=range(40, 111))
stats

# %%
stats.plot("bending_moment")

# %% [markdown]
# The wind is still that of falcon1: [a wind of your own](../own-wind/). Every step of the way, with what to look at,
# is told in [bring your own vehicle](../../bring-your-own-vehicle/).
