"""Every threshold that decides how sure a diagnosis is, with unit, reason and source: unexplained structure, names,
alternative explanations, unseen rows, noise.

Modules write `limits.SCATTER_ALPHA`; the rule of what is here is that of `diagnose/search/limits.py`.
"""

# False alarms: how often noise alone may leave something unexplained
# probability; over all ports, of scatter by a column that was not recorded. Low, since joints of a sound arm repeat
# unequally well, too, and are not drawn exactly
SCATTER_ALPHA = 0.005
SCATTER_DRAWS = 200  # permutations for it: one of them is the level
REPEATS_ALPHA = 0.01  # probability; of misfit that comes back when a pose is repeated
FEWEST_GROUPS = 4  # repeated poses that are needed for this test
NEIGHBOURS_ALPHA = 0.005  # probability; of neighbours in posture that err alike as much
NEIGHBOURS_DRAWS = 400  # permutations for it: two of them are the level
ROOM_ALPHA = 1e-4  # probability; of a joint that seems to follow the room's temperature, which no part of a joint does
UNKNOWN_DRAWS = 120  # draws of noise against an effect without a name; the level is search.limits.ALPHA_FURTHER
FAR_REPEATS_ALPHA = 0.01  # probability; of repeats that disagree more when they are far apart in time
FAR_REPEATS_EXCHANGES = 300  # permutations for it

# When a name is final, and when an effect is unknown
# BIC by which a curve without a name has to beat the best name. 10: very strong evidence (Kass, Raftery 1995, section
# 3.2; decision 0016). docs/proof.md, "Where it fails", states how often a cause outside the catalogue is named with
# confidence all the same
UNKNOWN_BEATS_NAME = 10.0
UNKNOWN_ROUNDS = 6  # rounds of replacing names and adding curves, each followed by a search
CURVES_IN_A_ROW = 4  # curves added without a name between them, before the search goes on
LEAST_CONFIDENCE = 0.05  # confidence; a name below it becomes an unknown cause (docs/mathematics.md)
# sigmas of its size that a name needs. docs/proof.md, "Where it fails", states how many sizes lie within 1.96 sigma of
# the truth
SIZE_SIGMAS = 3.0
# share of the greatest cause by weight; less may come from an unknown load, or from a link's own weight. Where all
# weights are stated they are wrong by a fifth at most: its square at the same port (decision 0017)
LOAD_SHARE = 0.2
CURVE_LEFTOVER = 0.1  # share of an unknown cause; a curve may leave so much of a law that it only resembles
SAME_EFFECT = 1e-6  # sine of the angle between what two names can do to the readings; below, they are one effect
FAULTS_AT_ONE_PLACE = 3  # faults at one place that are suspicious; two may share a joint
FAULTS_BY_CHANCE = 0.01  # probability that so many independent faults meet at one place
UNSEEN_FAULTS = 0.5  # faults at the other places that are too small to be found (Jeffreys' prior of a Poisson rate)
LAGGING_JOINTS = 3  # joints that lag by the way they came; from so many on one late clock is simpler than play in each
CONFUSABLE = 0.97  # cosine between two effects at these poses, from which on they are reported as confusable

# Alternative explanations
# BIC; no more than a bare mention (Kass, Raftery, Bayes factors, J. Am. Stat. Assoc. 90(430), 1995, section 3.2): of
# names within it the simplest is taken
NAMES_TIED = 2.0
NAMING_ROUNDS = 6  # exchanges of names in a row
# BIC; beyond, there is strong evidence against an alternative, and it is not reported (Kass, Raftery 1995; mismatch
# catalogue, alternatives)
ALTERNATIVE_WITHIN = 6.0
ALTERNATIVE_NEAR = 20.0  # BIC by the linear score; alternatives within it are refitted to be sure
ALTERNATIVE_REFITS = 4  # alternatives of one term that are refitted, the nearest ones
REFITTED_TERMS = 4  # terms; in larger models no alternative is refitted, since a refit costs seconds
REFITTED_SAMPLES = 800  # samples; the same of larger sessions
# prior odds of other names for one pattern that turns with weight, against a soft joint. A harmonic drive yields 10 to
# 70 µrad/Nm (mismatch catalogue); a bolted foot, a cast link and a flanged tool are several times as stiff
ODDS_WITH_COMPLIANCE = {"base-compliance": 1.0 / 2.0, "link-bending": 1.0 / 4.0, "tool-sag": 1.0 / 8.0}

# Unseen rows and the noise floor
UNSEEN_SHARE = 0.2  # share of the samples that are left out
PLACES_LEFT_OUT = 3  # places that are left out in turn, the largest ones: each costs two refits
FOLDS = 5  # folds of blocks in time
BLOCKS_OF_A_FOLD = 10  # blocks in time of each fold
SAMPLES_OF_A_BLOCK = 3  # samples of a block, in a small session: single samples would be half seen by their neighbours
HALVINGS = 3  # times that the workspace is halved
REGIONS = 2**HALVINGS  # regions of the workspace that are left out in turn
FEWEST_LEFT_OUT = 10  # samples of a place, and of anything that is left out
BOOTSTRAP_ROUNDS = 500  # draws for the interval of what the terms remove (Efron, Tibshirani 1993, ch. 8)
NOISE_FLOOR_DOF = 20  # degrees of freedom of repeats, for a noise floor
WORKSPACE_POSES = 300  # poses at which the tool error over the workspace changes
# measured poses, copies counted, for each new one: what is chosen by the poses stays as it was to 1 %
POSES_FOR_ONE_NEW = 100.0

# The noise that the rig file states
MORE_THAN_STATED = 1.5  # factor; a statement is not more exact than that
MORE_THAN_STATED_SIGMAS = 3.0  # sigmas of the mean square, by which it has to be beyond the statement
# factor; statements are wrong by up to 8 (mismatch study, second set, lesson 14), beyond it is physics
STATEMENT_WRONG_BY = 10.0
ROWS_CLOSE_IN_TIME = 3  # rows from one repeat to the next, at most, that are close in time
CLOSE_PAIRS = 8  # repeats close in time that are needed
BEYOND_REPEATS = 1.3  # factor on the scatter of repeats close in time; a misfit beyond it is more than noise
THROUGH_JOINTS = 12.0  # 2 ln L by which scatter follows the levers of the joints (up to as many sizes as joints)
STRUCTURE_SHARE = 0.2  # share of the variance; less may be what small effects leave beside noise
NOISE_OBSERVATIONS = 30  # observations that are needed to judge a statement
NEIGHBOURS = 3  # neighbours in posture that are compared

# Scatter through a port
RESTLESS = 12.0  # 2 ln L by which some samples have to scatter through all joints, others not (two numbers)
SCATTER_OBSERVATIONS = 30  # observations that are needed
# 2 ln L within which ports are not separated: the simplest is reported, or one whose column is known to be missing
PORTS_TIED = 6.0
UNEQUAL_JOINTS = 3.0  # factor between the joint of a sound arm that repeats worst and the best one
UNEQUAL_STEPS = 4  # steps from the best joint to the worst
