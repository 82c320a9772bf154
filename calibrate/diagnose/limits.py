"""Thresholds of a diagnosis that several of its parts share, with unit, reason and source: what may be diagnosed,
outlying rows, settled fits, change with time, new poses.

A false alarm of a diagnosis is decided by
- `ALPHA_FIRST` and `ALPHA_FURTHER` of `search/limits.py`: terms;
- those under "False alarms" of `doubts/limits.py`: something unexplained, a room's temperature, repeats;
- `TIME_ALPHA` and `RUN_ALPHA` here: change with time, runs of gross errors;
- the levels at the top of `streams/limits.py`: recorded streams.

The rule of what is on these pages is that of `search/limits.py`.
"""

# False alarms: how often noise alone may leave a change with time, or a run of gross errors
TIME_ALPHA = 0.002  # probability, of all three tests together; of misfit that hangs together in time
TIME_DRAWS = 300  # draws of noise for it
TIME_FACTOR = 1.2  # factor on what noise gives; less decides nothing
RUN_ALPHA = 1e-3  # probability; of a run of gross errors at random: a session in a thousand

# What can be diagnosed
# samples; with fewer, no term can be separated from noise: such sessions end as `undecidable`. A cause
# of 6 to 12 times the noise was found in 4 of 14 drawn sessions of 11 to 15 rows, in 39 of 40 of 16 to 19
# (docs/proof.md, `few-rows`)
FEWEST_SAMPLES = 16
# samples; with fewer, no name is more likely than not, no unknown cause is sought and nothing is called consistent: a
# curve or two more leave next to no residual that would show the noise
FEWEST_FOR_NAMES = 20
FEWEST_LEFT = 12  # numbers that geometry leaves free, where samples are fewer than `FEWEST_FOR_NAMES`
# rows, 400 positions, of poses that a search works on: an effect of a quarter of the noise is plain to see in so many
MOST_SEARCH_ROWS = 1200
# share of the reach; where half of the readings are farther off the fitted arm, the rig file describes another arm: no
# physics moves an arm so far
FAR_OF_REACH = 0.02
FEWEST_TIMED = 40  # samples, for the tests of time
# share of the usual distance between postures; neighbours in the order of capture that are nearer move along a way
ORDERED_STEP = 0.25
SAME_POSTURE = 1e-3  # of a posture (cosines and sines); a pose nearer than this is a repeat
ALIKE_ALONG = 0.5  # correlation of neighbours along a way, from which on they err alike
FEWEST_TIMED_PAIRS = 20  # times between repeats, for the test of repeats
TIME_BLOCKS = 5  # blocks of equal length along the session, each predicted from the others
TIME_EDGE = 0.05  # share of the session at either end in which no change of level is sought: too few rows
# correlation of neighbours, at most, of noise: it has forgotten itself after some sixty rows (decision 0038)
WANDER_CORRELATION = 0.95
WANDER_SHARE = 0.5  # share of the variance, at most, of noise that wanders

# Outlying rows
GAP = 4.0  # factor on the next smaller misfit, from which on a row stands apart
OUTLYING_SHARE = 0.05  # share of the rows; more are no outliers, unless they are few by count:
OUTLYING_COUNT = 3  # rows
OUTLYING_RUN = 3  # rows in a row: something happened, and lasted
FEWEST_OF_INSTRUMENT = 12  # rows of an instrument; with fewer it is open which row is the odd one
FEWEST_IN_A_RUN = 3  # gross errors in a row that may be a run
OUTLYING_PASSES = 2  # passes: a row can hide behind a worse one
UNTRUSTED_WEIGHT = 0.1  # robust weight; a row below may have bent a plain fit
DISTRUSTED_WEIGHT = 0.3  # robust weight of a row that next to nothing of a model follows: five sigmas off
# robust weight of a reading of the second encoders, below which it counts less than fully: five sigmas off
GLITCH_WEIGHT = 0.3
OUTLYING_SIGMAS = 6.0  # sigmas; unseen rows beyond are left out of both models

# When a fit has settled
FIT_TURNS = 40  # turns of weights and least squares; most fits settle in 5 to 8
FEWEST_TURNS = 4  # turns, before a fit may end
REFRESHED_TURNS = 2  # turns after which drivers have settled: what a nanometre changes in them decides nothing
SOLVER_STEPS = 12  # steps of the solver in a turn: the next turn goes on from there
TURN_TOLERANCE = 0.02  # chi-square; in a turn, less than what settles the likelihood
LAST_TOLERANCE = 1e-3  # chi-square; in the turn that ends a fit, 3 % of a sigma
SETTLED = 0.1  # -2 log L; far below any difference that decides
CREEPING = SETTLED / FIT_TURNS  # -2 log L in a turn: as many as there are would not bring it beyond SETTLED
MOST_FITTED = 0.2  # share of the rows that are left over, at least, when noise is judged

# What the poses and earlier data determine
VISIBLE = 1e-5  # share of a column's square; below, the poses do not show the effect
# share of the largest lever of a joint: a millimetre or two, where other errors of the arm count as a turn
BLIND = 2e-3
# singular value; a direction that the data know no better than what is to be expected stays (docs/mathematics.md, 5)
UNSEEN = 1.0
UNSEEN_ASSUMED = 0.1  # sigmas that the data show of a whole unit; a direction with less gets a prior of one unit
GAUGE = 30.0  # plausible sizes; prior of a parameter for which none is stated
STRAIGHT = 1e-3  # m, rad or a factor; a known model is linear within it: its square, over a metre, is a micrometre
LOOSE = 1e3  # sigmas of an effect's value; it is never held beyond what the model states of it

# New poses
NEW_POSES = 20  # poses that are proposed
OFFERED_POSES = 400  # poses from which they are chosen
POSE_TRIES = 3  # times as many are drawn, since some never land
RECORDED_SHARE = 0.25  # share of the offered poses that were recorded
BETWEEN_POSES = (-0.5, 1.5)  # share of the way from one recorded pose to another
SPREAD_RAD = 0.1  # rad; about a pose between two recorded ones
ROOM_M = 0.05  # m beyond the box in which the flange has been
LOADED_KG = 1e-3  # kg; a payload of less is none
SEPARABLE = 6.0  # BIC; an alternative that all poses cannot drive farther off is no other cause but a richer one
