# SPDX-License-Identifier: Apache-2.0
"""Find where a photo was taken, by the gradient of its picture: pose.py MODEL"""
import sys
import gbtrace, numpy as np
model = gbtrace.Model(sys.argv[1])
camera = model.views()[0].camera
photo, m, v = model.render(camera), np.zeros(6), np.zeros(6)
guess = camera.moved([0.06, -0.05, 0.08, 0.015, 0.02, -0.03])  # right, down, forward; radians about the same axes
print("before: %.5f units, %.5f radians away" % guess.distance(camera))
for step in range(200):  # Adam
    pose = model.gradient(2 * (model.render(guess, keep=True) - photo) / photo.size)
    m, v = 0.9 * m + 0.1 * pose, 0.95 * v + 0.05 * pose**2
    guess = guess.moved(-0.02 * 0.01 ** (step / 200) * m / np.sqrt(v + 1e-30))
print("after:  %.5f units, %.5f radians away" % guess.distance(camera))
