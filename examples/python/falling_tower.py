"""A tower of boxes, built from a dictionary, watched by numpy: how it settles, and what it bears.

python3 falling_tower.py
"""
import numpy
import soda

scene = soda.Scene.build({
    "format": 1,
    "gravity_m_s2": [0, 0, -9.81],
    "time_step_s": 1 / 120,
    "steps": 240,
    "materials": [{"name": "wood", "friction": 0.5, "restitution": 0}],
    "statics": [{"name": "floor", "shape": {"type": "halfspace"}, "material": "wood"}],
    "bodies": [
        {"id": i, "shape": {"type": "box", "size_m": [1, 1, 0.5]}, "mass_kg": 2.0,
         "material": "wood", "position_m": [0.05 * (i % 2), 0, 0.25 + 0.5 * i]}
        for i in range(6)
    ],
    "territory": {"origin_m": [-4, -4, 0], "cell_size_m": 4, "cells": [2, 2, 1]},
})

simulation = soda.Simulation(scene)
heights = []
for step in range(240):
    simulation.step()
    heights.append(simulation.positions()[:, 2])
heights = numpy.array(heights)
print(f"top box: {heights[0, -1]:.4f} m at first, {heights[-1, -1]:.4f} m in the end")

contacts = simulation.contacts()
on_floor = contacts[contacts["other_is_static"]]
weight = 6 * 2.0 * 9.81
print(f"the floor bears {on_floor['normal_newton'].sum():.2f} N of {weight:.2f} N "
      f"in {len(on_floor)} points")
print("fastest body:", f"{numpy.linalg.norm(simulation.velocities(), axis=1).max():.1e} m/s")
assert abs(on_floor["normal_newton"].sum() - weight) < 0.01 * weight

# The same by the Time Warp kernel, divided into four worlds.
divided = soda.run(scene, worlds=4, threads=2)
assert divided.digest == simulation.digest
print(f"digest {divided.digest:016x}, divided or not")
