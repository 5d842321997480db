# %% [markdown]
# # Smaller loads by design
#
# Which gains give the smallest peak of the bending moment, under limits on the engine angle and on the damping of
# every mode? In a shell: `ascentwind design as504`.

# %%
import ascentwind as aw
from ascentwind.runners.design.problem import LoadReliefProblem

problem = LoadReliefProblem(
    aw.Study.load("as504"),
    {"control.T1.gain": (0.5, 2.0), "control.T2.gain": (0.5, 2.0)},  # what may change, and its bounds
    times=range(60, 91, 2),
    response="bending_moment",
    peak_limits={"engine_angle": 0.0327},  # rad, of |mean| + 3 sigma
    damping_limits={"rigid_body": 0.3, "bending_1": 0.01, "bending_2": 0.004, "slosh": 0.005},
    frozen_times=range(20, 141, 20),  # s, at which dampings are limited
)
result = aw.design(problem)
result

# %% [markdown]
# The verdict is the Karush-Kuhn-Tucker residual: at a stationary point no small change of the gains lowers the peak
# without passing a limit. A multiplier says what loosening a limit would gain.

# %%
print(f"residual {result.stationarity.residual:.1e}")
for what, multiplier in result.stationarity.multipliers:
    print(f"{what}: {multiplier:.3f}")

# %% [markdown]
# The peaks once more, by CVODES.

# %%
from ascentwind.runners.design.design import recompute_peaks

for peak in recompute_peaks(result):
    print(f"{peak.response} at {peak.time:g} s: {peak.designed:.8g} designed, {peak.cvodes:.8g} by CVODES")

# %% [markdown]
# The designed vehicle is a study like any other.

# %%
result.study.response_statistics(times=range(40, 101)).plot("bending_moment")
