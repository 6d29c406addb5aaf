# SPDX-License-Identifier: Apache-2.0
"""Which anchors does the middle of a view look at? query.py RUN"""
import sys
import gbtrace, numpy as np
model, balls = gbtrace.Model(sys.argv[1]), gbtrace.Balls(sys.argv[1])
camera = model.views()[0].camera
crossed = balls.crossed([camera.center], [camera.rotation[2]])  # the third row looks forward
first = crossed[0][np.argmin(crossed.value)]
print(f"{len(balls)} anchors, {len(crossed[0])} along the ray; the first is {first} at {balls.position[first].round(3)}")
index, distance = balls.nearest(balls.position, k=3, skip_same=True)
print(f"its nearest others: {index[first]}; median spacing of all: {np.median(distance[:, 0]):.4f}")
