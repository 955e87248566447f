"""A commented experiment file and a small CSV to start from."""

NAME = "my-wire"
TOML = """\
# An experiment: one test of one wire. Replace the values, and the rows of my-wire.csv, by yours.
# Lengths are in mm, times in s, tensions in N. Then: wirebayes check my-wire.toml

[[experiment]]
# Results are stored under this name: letters, digits, '.', '_' and '-'.
name = "my-wire"

# Samples of one material may be fitted together (wirebayes fit … --together "Dyneema 1 mm").
material = "Dyneema 1 mm"

# Zero-tension length of the sample before the test.
length_mm = 1200.0

# The step to which tensions were rounded: the last digit of the display. Leave the line out where it is not known.
resolution_N = 0.01

# One row a reading: number of the hold, displacement of the moving end, time since the hold began, tension.
# A column temperature_C is optional. Hold numbers rise and may skip; displacements may fall.
readings = "my-wire.csv"

# Positions that were held without being read: each goes before the recorded hold of that number.
# unrecorded_holds = [{ before_hold = 3, displacement_mm = 2.5, duration_s = 60.0 }]

# What is known of the wire before the test (optional; every parameter has a range in the scales of the test):
# [experiment.prior.k1]
# distribution = "log-normal"
# median = 1500.0
# sd_log = 0.5

# Another test of another sample is another [[experiment]], here or in a file of its own.
"""

CSV = """\
hold,displacement_mm,time_s,tension_N
1,0.5,0,1.08
1,0.5,15,1.01
1,0.5,30,0.94
1,0.5,60,0.87
1,0.5,120,0.78
2,1.0,0,1.44
2,1.0,15,1.39
2,1.0,30,1.35
2,1.0,60,1.32
2,1.0,120,1.25
3,1.5,0,1.88
3,1.5,15,1.83
3,1.5,30,1.82
3,1.5,60,1.76
3,1.5,120,1.73
4,2.0,0,2.38
4,2.0,15,2.32
4,2.0,30,2.31
4,2.0,60,2.27
4,2.0,120,2.24
5,2.5,0,2.84
5,2.5,15,2.78
5,2.5,30,2.76
5,2.5,60,2.73
5,2.5,120,2.70
6,3.0,0,3.33
6,3.0,15,3.27
6,3.0,30,3.25
6,3.0,60,3.22
6,3.0,120,3.18
7,2.0,0,1.90
7,2.0,15,1.97
7,2.0,30,2.02
7,2.0,60,2.06
7,2.0,120,2.12
8,1.0,0,0.95
8,1.0,15,1.03
8,1.0,30,1.08
8,1.0,60,1.15
8,1.0,120,1.23
"""
