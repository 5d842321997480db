# %% [markdown]
# # Out of Python: a C library
#
# A program that should not need Python gets a library in C99 with the vehicle's tables compiled in. Cells that begin
# with `%%bash` are commands for a terminal.

# %% tags=["hide"]
import os
import tempfile

os.chdir(tempfile.mkdtemp())

# %% language="bash" magic_args="--out told --err hint"
# ascentwind export as504 --format c --out lib

# %%
print(told)

# %% language="bash" magic_args="--out told --err hint"
# cd lib
# make > build.txt
# ./example_statistics > statistics.csv
# head -3 statistics.csv | cut -c 1-100

# %%
print(told)

# %% [markdown]
# The library computes the statistics of all responses in one pass. `make check` holds them against the table that
# ascentwind's own engine computed.

# %% language="bash" magic_args="--out told --err hint"
# make -C lib check

# %%
print(hint)

# %% [markdown]
# The header documents every function, with units.

# %% language="bash" magic_args="--out told --err hint"
# grep -A 14 "^/\* Mean and covariances" lib/as504.h

# %%
print(told)
