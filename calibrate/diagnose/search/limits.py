"""Every threshold of the search for effects, with unit, reason and source: when noise alone gives a term, and when a
term is accepted or dropped.

Modules write `limits.ALPHA_FIRST`: a reader sees at once that the number is on this page, and a test changes it in one
place. Numerical constants of an algorithm (steps of difference quotients, guards against rounding, grids, chunks of an
array) stay where they are used. `diagnose`, `diagnose/assess` and `diagnose/streams` have a page of the same name each.

BIC is in units of 2 ln L; 2 is no more than a bare mention, 6 strong and 10 very strong evidence (Kass, Raftery, Bayes
factors, J. Am. Stat. Assoc. 90(430), 1995, section 3.2).
"""

# False alarms: how often noise alone may give a term
# probability; over the whole catalogue, of the first term. A whole diagnosis is allowed 5 %; the rest is for effects
# without a name. docs/figures.md (`false_alarms`, and the concealed proof) has the measured shares beside what is asked
# for: at most 6 % of sessions with white or heavy-tailed noise, 8 % with wandering noise
ALPHA_FIRST = 0.03
# probability; of a first term that follows time, against noise that wanders, for it to enter. The final check asks it
# for ALPHA_FIRST, too
ALPHA_DRIFT = 0.05
ALPHA_FURTHER = 0.01  # probability; of every further term, and of an effect without a name (doubts/unknown.py)
# probability; of a term that no machine is without (friction), by the null of the whole catalogue
ALPHA_USUAL = 0.1
USUAL_WORTH = 10.0  # BIC, besides: very strong evidence (Kass, Raftery 1995, section 3.2)
# count; ALPHA_FIRST and ALPHA_FURTHER are shared by fast and slow terms (Bonferroni), but for slow ones where noise
# wanders: the law overstates the wander
FAMILIES = 2
NULL_DRAWS = 600  # draws of noise for the check of the final terms: half of ALPHA_FURTHER, for one family, is three
FEW_NULL_DRAWS = 200  # draws of noise for a check during the search; the final check has NULL_DRAWS
TAIL_SHARE = 0.15  # share of the draws to which the tail is fitted
# draws beyond a value from which on their share is the probability; with fewer it is extrapolated from the tail
TAIL_ENOUGH = 10
LEAST_P = 1e-9  # probability; an extrapolated tail is not trusted below

# When a term is accepted
SURE = 60.0  # BIC; from here on a term is accepted during the search without draws. The final check draws for all
SURE_SLOW = 150.0  # BIC; the same of a slow term, which noise that wanders resembles
BETTER = 0.5  # BIC; an exchange that gains less is not worth it: linear scores are not more exact
MOST_TERMS = 30  # terms; beyond, the form of the model is wrong, not incomplete
# additions in a row that vanished again, before the search ends: where many effects are mixed up, a third addition has
# never helped
VANISHED_IN_A_ROW = 2
AT_ONCE = 4  # terms better than SURE that are accepted before the next refit
PEERS = 8  # physics of one port that are tried in turn for a plausible size: ten thermometers are one growth
LOOKED_AT = 32  # best entries of the catalogue that are tried for one addition
REFUSED = 6  # refits in a row that confirm no entry, before no further one is tried
SWAPS = 12  # exchanges in a row
PAIRED = 8  # terms; up to so many, every pair is also tried as one term
REFINED = 6  # terms with inner values that are ranked by their best inner values, not by those of the grid
# share of the best gain; a term that shows less on the grid is not brought up to it by any inner value
WORTH_REFINING = 0.3
EQUAL_DECIMALS = 3  # decimals of BIC; terms that the readings do not separate keep the order of the catalogue
# order; harmonics of a turn up to it can be a smooth curve over a part of the turn, and are not accepted beside it
HELD_HARMONICS = 2

# When an accepted term is dropped
COLLINEAR = 0.05  # share of a term that the others leave; with less it is not a term of its own
COLLINEAR_COST = 6.0  # BIC that dropping such a term may cost. 6: strong evidence (Kass, Raftery 1995, section 3.2)
# square of the sum of a port's terms over the sum of their squares; below, they balance each other, which no machine
# does
CANCELS = 0.1
# sigmas that a slow term would show between visits of one pose; with less, the visits decide nothing
REVISIT_SIGMAS = 5.0
REVISIT_SHARE = 0.5  # share of a slow term that the visits have to show (mismatch catalogue, false alarms)
REVISIT_CONFIDENCE = 3.0  # sigmas by which the share has to be below REVISIT_SHARE

# Noise that wanders
# -2 log L that wandering has to gain. 5 % of sessions with white noise pass (chi-square, two parameters), which costs
# power only
WANDERS = 6.0
# -2 log L; the strongest wander within it of the best is taken: wander is overstated rather than understated
WANDER_CONSERVATIVE = 1.0
FEWEST_FOR_WANDER = 40  # observations of an instrument, for a wander to be found
FEWEST_FOR_LENGTHS = 10  # observations of an instrument, for a law of their lengths
MOST_LEVERAGE = 0.9  # leverage; rows that the model follows closer show nothing about the noise

# Sizes
DETERMINED = 1e-10  # share of the largest eigenvalue of unit columns; combinations below are not determined
PART_OF_UNDETERMINED = 1e-3  # share of a value in such a combination, from which on the value is not reported
