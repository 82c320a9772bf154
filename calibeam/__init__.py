"""The program: the only place where drivers, acquisition, calibrate and simulators are joined."""

import os

# The matrices of a session are small: on a busy machine the threads of a linear-algebra library wait for each other,
# and a fit takes ten times as long (decision 0003). Stands before numpy is loaded; a user's own setting goes first.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
