"""How must a ball be thrown to hit a target? Trials from one snapshot, the best of them for good.

python3 shooting.py
"""
import time

import numpy
import soda

scene = soda.Scene.build({
    "format": 1,
    "gravity_m_s2": [0, 0, -9.81],
    "time_step_s": 1 / 240,
    "steps": 480,
    "materials": [{"name": "rubber", "friction": 0.6, "restitution": 0.7}],
    "statics": [{"name": "floor", "shape": {"type": "halfspace"}, "material": "rubber"}],
    "bodies": [{"id": 1, "shape": {"type": "sphere", "radius_m": 0.1}, "mass_kg": 0.5,
                "material": "rubber", "position_m": [0, 0, 1]}],
    "territory": {"origin_m": [-1, -1, 0], "cell_size_m": 10, "cells": [1, 1, 1]},
})
TARGET = numpy.array([4.0, 0.5, 0.1])
simulation = soda.Simulation(scene)
start = simulation.snapshot()
trials = 0


def throw(velocity):
    """How near the ball comes to the target after its first bounce."""
    global trials
    trials += 1
    simulation.restore(start)
    simulation.apply({"type": "set-velocity", "id": 1, "step": simulation.steps, "body": 1,
                      "velocity_m_s": [float(v) for v in velocity]})
    nearest = numpy.inf
    for _ in range(120):
        simulation.step(4)
        if simulation.time_s > 0.5:
            nearest = min(nearest, numpy.linalg.norm(simulation.positions()[0] - TARGET))
    return nearest


begin = time.perf_counter()
best = numpy.array([2.0, 0.0, 2.0])
miss, spread = throw(best), 1.0
random = numpy.random.default_rng(1)
while trials < 200:
    velocity = best + spread * random.normal(size=3)
    this = throw(velocity)
    if this < miss:
        best, miss = velocity, this
    else:
        spread = max(0.97 * spread, 0.01)
took = time.perf_counter() - begin
print(f"{trials} throws in {took:.2f} s ({1e6 * took / trials / 480:.1f} us a step); "
      f"the best, {best.round(3)} m/s, comes within {miss * 1000:.1f} mm")
assert miss < 0.1
assert throw(best) == miss  # the same throw is the same throw
