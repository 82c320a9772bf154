"""Every threshold of the examination of streams, with unit, reason and source: clocks, gaps, settling, ringing, slips.

Modules write `limits.SLIP_ALPHA`; the rule of what is here is that of `diagnose/search/limits.py`.
"""

# False alarms: how often noise alone may give a finding
# probability; of a joint that is behind its set-point. docs/figures.md, the concealed proof: no alarm is wanted in
# healthy streams
FOLLOWING_ALPHA = 1e-3
SETTLING_ALPHA = 1e-3  # probability, over all samples; of a sample taken before the arm has settled
RINGING_ALPHA = 1e-3  # probability, over all stops; of a swing after a stop
SLIP_ALPHA = 1e-3  # probability, over all joints and places; of an encoder that slipped
FROZEN_CHANCE = 1e-6  # probability; of a run of equal readings by quantisation alone
LATE_SIGMAS = 5.0  # sigmas of a lag or a drift of a clock; below, none is reported
# s; what two lines may delay differently: a USB frame 1 ms, a SYNC and the answers of six encoders at 1 Mbit/s 0.8 ms
LATE_S = 1.2e-3
BEHIND_S = 2e-5  # s; a fiftieth of the finest sampling, a joint is not reported as behind below
MISSED_SIGMAS = 1.0  # sigmas of one reading; what a sample misses below has no effect

# Late channels and clocks
CLOCK_DRIFT = 1e-4  # s/s; of a quartz, a drift below is usual
OTHER_PACE = 1e-2  # s/s; no clock drifts so much: an emulation runs faster than its host
BLOCK_S = 0.5  # s; a motion of an arm from pose to pose. What is slower than this is level
BLOCKS_TOGETHER = 2  # blocks; errors of a reading that depend on the angle last as long as a motion does
BLOCK_MOVES = 20.0  # factor on the noise that a block has to move to show something about time
FEWEST_BLOCKS = 5  # blocks together, for a lag
USELESS_S = 1e-3  # s; a lag of greater sigma is no answer: ten times what is asked for, and what unlike motions leave
LAGGING_TOGETHER = 3  # joints whose common lag is that of their clock
GRID_S = 0.01  # s; 100 Hz is finer than any motion of an arm, and the fine fit converges from some 50 ms
GRID_SMOOTH = 5  # points of the grid over which speeds are smoothed
COARSE_WINDOW_S = 8.0  # s; windows in which two streams are compared
COARSE_REACH_S = 1.0  # s; of a window about the guess for all
WORST_RATE = 1e-3  # s/s; between two clocks, or beside the rate that is known: ten times a poor quartz
WINDOW_CORRELATION = 0.6  # correlation; a window below does not count
SLOWEST_RAD_S = 0.02  # rad/s, rms; a joint that is slower has not moved
SPEED_OVER_S = 0.008  # s; a speed is formed over one sample of the slowest controller
PROMPT_AMONG = 50  # samples on either side of a step, of which the promptest stamp counts
PROMPT_WINDOWS = 30  # windows of host time, in each of which the promptest stamp counts
SHARED_CLOCK_S = 0.5  # s between a stamp of the bus and the reader's; no epoch of a foreign clock is so near by chance
DENIED_SHARE = 0.5  # share of a step of a clock that the host's stamps have to deny

# Gaps, frozen readings, light
# sampling periods between two samples that the device counted as neighbours; beyond, its clock was set
CLOCK_STEP_PERIODS = 2.5
FEWEST_EQUAL = 5  # equal readings in a row that are looked at
# steps of its own resolution, or sigmas of another device's noise, by which that one moved meanwhile
MOVED_MEANWHILE = 10.0
GOES_ON_STEPS = 1.5  # largest step near a run of equal readings; a joint that stuck leaves it by no more
ANSWERS_SHARE = 0.5  # share of the rows of the encoder that answers most often; one with fewer is left out, and stated
GAP_PERIODS = 5.0  # sampling periods; a longer pause is not bridged by a curve, since an arm can do anything meanwhile
DARK = 0.2  # share of the usual light; a beam half off a face falls from full to nothing within its own width
PRINTED_ROWS = 8  # rows that are printed one by one

# Stands, settling, ringing
SHORTEST_STAND_S = 0.1  # s; shorter stands are not used
MOVING_RAD_S = 1e-3  # rad/s; 60 µrad in 60 ms: slower than any motion of a program, faster than noise of a reading
SERVO_S = 0.05  # s after the set-point stands, before what still swings is called ringing: a usual servo's own settling
SETTLED_AFTER_S = 0.05  # s of the stand, at least, from which the settled reading is taken
SETTLING_BLOCK = 5  # samples that are averaged before the noise of a mean is judged, since neighbours may be correlated
RINGING_WINDOW_S = 2.0  # s; a machine of 3 Hz and 2 % damping has faded to a third by then
RINGING_SAMPLES = 40  # samples of a stop that are needed
RINGING_STOPS = 0.2  # share of the stops; what swings after fewer is a knock or the servo, not a soft machine
RINGING_JOINT = 0.9  # share of the swing that one joint has to explain
RINGING_JOINTS_TIED = 0.05  # share of the swing; joints within it are not separated
FEWEST_CYCLES = 1.5  # cycles in the window; fewer are a bend, not an oscillation
MOST_DAMPING = 0.5  # damping ratio; beyond, it hardly swings, and is settling
FINEST_SWING = 2.5  # samples of one swing, at least

# What a measured torque does between two encoders
DEFLECTION_ALPHA = 1e-2  # probability, over all joints; of one that turns under its torque, as unseen blocks do, too
USUAL_DISC_RAD = 3e-4  # rad; eccentricity of a disc, one sigma: 6 µm on a radius of 20 mm

# Slips of an encoder
SLIP_SPARE_STANDS = 5  # stands beyond the numbers that are fitted
SLIP_PHYSICS_STANDS = 12  # further stands, from which on physics may explain the same
MOST_SLIPS = 5  # slips of one joint; with more it is not slipping but loose
SLIP_EDGE_S = 0.1  # s after the set-point stands, before readings count

# What stays between two readings of one angle
OFFSET_SIGMAS = 5.0  # sigmas of an offset that is reported
# factors on what nothing explains and on what goes with the motion, rms: a servo with 30 mrad of following error (wrist
# of a KR 300) leaves 10 mrad of levels and steps, too, and an offset that is no larger is one of them
OFFSET_BEYOND_LEFT = 5.0
OFFSET_BEYOND_MOTION = 2.0
OFFSET_LEAVES = 0.5  # share of what is left without it, rms, that may be left with a step or a droop
FINEST_RAD = 1e-6  # rad; a fifth of an arc second: no encoder of a joint shows less
UNLIKE = 0.05  # share of the motion; what differs by more does not follow the same shaft one to one
OFFSET_TURN_RAD = 1.0  # rad; over a shorter way a sine of the angle is not separated from a level
STANDS_RAD = 1e-3  # rad; a joint that turns through less has not moved
