# %% [markdown]
# # The day of launch
#
# A balloon was let go three hours before launch. May we fly?

# %% tags=["hide"]
import os
import tempfile

os.chdir(tempfile.mkdtemp())

# %% [markdown]
# The balloon's wind would come from a file in any common format. Here it is written down: a strong west wind, with its
# largest value at 11 km.

# %%
from pathlib import Path

import numpy as np

import ascentwind as aw

altitude = np.arange(200.0, 18001.0, 200.0)
u = 5 + 42 * np.exp(-(((altitude - 11000) / 4500) ** 2))
rows = [f"1,{h:.0f},{wind:.2f},0" for h, wind in zip(altitude, u, strict=True)]
_ = Path("balloon.csv").write_text("\n".join(["profile,altitude [m],u [m/s],v [m/s]", *rows]))
_ = Path("limits.csv").write_text("time [s],bending_moment [N m]\n40,25e6\n100,25e6\n")

# %%
study = aw.Study.load("as504")
launch = study.day_of_launch("balloon.csv", hours_before=3, limits="limits.csv", window=(40.0, 100.0))
launch

# %%
aw.plot(launch)

# %% [markdown]
# An hour before launch a second balloon shows that the wind has risen by a quarter. Nothing is integrated again.

# %%
rows = [f"1,{h:.0f},{1.25 * wind:.2f},0" for h, wind in zip(altitude, u, strict=True)]
_ = Path("later.csv").write_text("\n".join(["profile,altitude [m],u [m/s],v [m/s]", *rows]))
later = launch.update("later.csv", hours_before=1)
for asked in (launch, later):
    print("go" if asked.go else "no go", f"{asked.probability:.2%} of flights pass the limit")
