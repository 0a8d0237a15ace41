"""Texts of small recipes, each a second's work: what tests of several parts read, change and
damage."""

SCENE = """
seed = 3
count = 1
batch = 1
[scene]
columns = 6
start-noise = 1e-3
[material]
name = "camel-ponte-roma"
area-weight-factor = { low = 0.9, high = 1.1 }
[wind]
speed = { low = 1.0, high = 4.0 }
toward = 0.1
[time]
settle = 0.04
frames = 2
[effects.lift]
coefficient = 0.5
"""
"""A flag of 6 columns, two frames."""
SIMULATION = """
batch = 2
[scene]
columns = 6
[material]
name = "camel-ponte-roma"
area-weight = { low = 0.10, high = 0.17 }
bending-factors = { low = 0.1, high = 10.0 }
[wind]
speed = { low = 0.0, high = 10.0 }
[time]
settle = 0.2
frames = 30
"""
"""The scene that `DATA_SET` names "scene.toml"."""
DATA_SET = """
title = "A tiny data set"
licence = "CC0-1.0"
seed = 1
[simulation]
scene = "scene.toml"
[render]
prior = "flags"
width = 32
height = 32
raster-samples = 2
[sides.train]
sequences = 3
renders = 7
[sides.test]
sequences = 2
renders = 3
[camera]
jpeg-quality = { low = 70, high = 90 }
read-noise = 1.0
shot-noise = 2.0
frame-slot = 2048
[anemometer]
noise = 0.1
[anemometer.effects.anemometer-lag]
distance = { low = 1.0, high = 3.0 }
[anemometer.effects.anemometer-gain]
gain = { low = 0.95, high = 1.05 }
"""
"""Five sequences of a coarse flag, ten films of 32 × 32 pixels."""
GROUPS = """
[groups]
height = { low = 0.2, high = 0.4 }
rates = [20.0, 40.0]
attachments = ["corners", "hoist"]
"""
"""For a data set, before its sides: batches of one height, rate and attachment each."""
TRAINING = """
title = "small"
seed = 1
[data]
dataset = "made"
[input]
maps = "wave-maps"
size = 24
frames = 12
scales = [1.0, 0.9]
variants = 2
[network]
name = "wave"
dimension = 4
widths = [6, 6, 6]
[loss]
name = "posterior"
targets = ["wind_speed"]
components = 2
[optimiser]
rate = 1e-2
decay = 1e-4
batch = 4
epochs = 3
schedule = "cosine"
patience = 9
"""
"""A network that learns wind speeds from the data set "made"."""
EXPERIMENT = """
title = "Flags"
[cloth]
width = 1.5
height = 1.0
vertices = 200
[attachment]
at = "hoist-corners"
[air]
density = 1.2
gravity = 9.81
[material]
name = "camel-ponte-roma"
[test]
level = 0.03
nulls = 20
[[recording]]
source = "one"
rate = 25.0
wind = { speed = 4.0 }
"""
"""Markers of one recording, to be judged."""
