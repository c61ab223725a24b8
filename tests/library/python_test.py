"""The Python module: what C++ has, as dictionaries and arrays."""
import os
import unittest

import numpy
import soda

SCENES = os.environ["SODA_SCENARIOS"]


def library(name):
    return soda.Scene.load(os.path.join(SCENES, name + ".json"))


def ball(**more):
    return {
        "format": 1,
        "gravity_m_s2": [0, 0, -10],
        "time_step_s": 0.01,
        "steps": 100,
        "materials": [{"name": "wood", "friction": 0.5, "restitution": 0}],
        "statics": [{"name": "floor", "shape": {"type": "halfspace"}, "material": "wood"}],
        "bodies": [{"id": 7, "shape": {"type": "box", "size_m": [1, 1, 1]}, "mass_kg": 2,
                    "material": "wood", "position_m": [0, 0, 0.5]}],
        "territory": {"origin_m": [-4, -4, 0], "cell_size_m": 4, "cells": [2, 2, 1]},
        **more,
    }


class Python(unittest.TestCase):
    def test_it_says_what_it_is(self):
        self.assertRegex(soda.__version__, r"^\d+\.\d+\.\d+$")
        self.assertTrue(soda.__doc__)
        described = 0
        for kind in (soda.Scene, soda.Simulation, soda.RunResult):
            for name, member in vars(kind).items():
                if name.startswith("_"):
                    continue
                # Of a function, more than the signature that pybind11 writes.
                text = member.__doc__ or ""
                if not isinstance(member, property):
                    text = text.partition("\n\n")[2]
                self.assertTrue(text.strip(), f"{kind.__name__}.{name}")
                described += 1
        self.assertGreater(described, 30)

    def test_steps_have_the_bits_of_divided_runs(self):
        for name in ("border-stack", "user-input", "ragdolls"):
            scene = library(name)
            simulation = soda.Simulation(scene)
            simulation.step(20)
            divided = soda.run(scene, steps=20, threads=2)
            self.assertEqual(simulation.digest, divided.digest)
            numpy.testing.assert_array_equal(simulation.positions(), divided.positions())
            numpy.testing.assert_array_equal(simulation.orientations(), divided.orientations())

    def test_states_are_arrays_with_a_row_for_each_body(self):
        simulation = soda.Simulation(library("border-stack"))
        bodies = len(simulation.body_ids)
        self.assertEqual(simulation.body_ids.dtype, numpy.uint32)
        self.assertEqual(simulation.positions().shape, (bodies, 3))
        self.assertEqual(simulation.orientations().shape, (bodies, 4))
        self.assertEqual(simulation.velocities().shape, (bodies, 3))
        self.assertEqual(simulation.angular_velocities().shape, (bodies, 3))
        first = simulation.state(int(simulation.body_ids[0]))
        self.assertEqual(first["position_m"], tuple(simulation.positions()[0]))

    def test_contacts_bear_weight(self):
        simulation = soda.Simulation(soda.Scene.build(ball()))
        simulation.step(100)
        simulation.contacts()
        contacts = simulation.contacts()  # as often as one likes
        self.assertEqual(len(contacts), 4)
        self.assertTrue(contacts["other_is_static"].all())
        self.assertAlmostEqual(contacts["normal_newton"].sum(), 20.0, places=6)
        self.assertEqual(contacts["position_m"].shape, (4, 3))

    def test_counters_count(self):
        simulation = soda.Simulation(soda.Scene.build(ball()))
        simulation.step(3)
        self.assertEqual(simulation.counters()["steps"], 3)
        self.assertGreater(simulation.counters()["contact_points"], 0)
        self.assertEqual(simulation.report()["contact_points"], 4)

    def test_snapshots_go_on_bit_for_bit(self):
        scene = library("breaking-bridge")
        simulation, other = soda.Simulation(scene), soda.Simulation(scene)
        simulation.step(30)
        snapshot = simulation.snapshot()
        self.assertIsInstance(snapshot, bytes)
        simulation.step(30)
        other.restore(snapshot)
        self.assertEqual(other.steps, 30)
        other.step(30)
        self.assertEqual(other.digest, simulation.digest)
        with self.assertRaises(soda.UsageError):
            other.restore(snapshot[:-1])

    def test_inputs_act(self):
        simulation = soda.Simulation(soda.Scene.build(ball()))
        simulation.apply({"type": "push", "id": 1, "body": 7, "impulse_newton_s": [0, 0, 4]})
        simulation.step()
        self.assertGreater(simulation.velocities()[0, 2], 1.5)
        simulation.apply({"type": "remove", "id": 2, "body": 7})
        simulation.step()
        self.assertEqual(len(simulation.body_ids), 0)
        self.assertEqual(simulation.positions().shape, (0, 3))

    def test_states_are_written(self):
        simulation = soda.Simulation(soda.Scene.build(ball()))
        simulation.set_state(7, position_m=[1, 2, 3], velocity_m_s=(0, 0, 1))
        self.assertEqual(simulation.state(7)["position_m"], (1, 2, 3))
        self.assertEqual(simulation.state(7)["velocity_m_s"], (0, 0, 1))
        with self.assertRaises(soda.UsageError):
            simulation.set_state(7, place=[1, 2, 3])
        with self.assertRaises(soda.UsageError):
            simulation.set_state(7, position_m=[1, 2])

    def test_rays_hit(self):
        simulation = soda.Simulation(soda.Scene.build(ball()))
        hit = simulation.cast_ray([0, 0, 5], [0, 0, -1], 10)
        self.assertEqual((hit["id"], hit["is_static"], hit["distance_m"]), (7, False, 4.0))
        self.assertIsNone(simulation.cast_ray([0, 0, 5], [0, 0, 1], 10))

    def test_committed_steps_are_told(self):
        heights = []
        scene = soda.Scene.build(ball())
        soda.run(scene, steps=5, worlds=4, threads=2,
                 on_commit=lambda step, ids, positions: heights.append((step, positions[0, 2])))
        self.assertEqual([step for step, _ in heights], [1, 2, 3, 4, 5])

    def test_errors_are_exceptions(self):
        with self.assertRaisesRegex(soda.SceneError, "found no key .bodies.|mass_kg"):
            bad = ball()
            bad["bodies"][0]["mass_kg"] = -1
            soda.Scene.build(bad)
        with self.assertRaises(ValueError):
            soda.Scene.build("{")
        with self.assertRaises(OSError):
            soda.Scene.load("/nowhere.json")
        simulation = soda.Simulation(soda.Scene.build(ball()))
        with self.assertRaises(soda.UsageError):
            simulation.state(8)
        simulation.set_state(7, position_m=[1e308, 0, 0], velocity_m_s=[1e308, 0, 0])
        with self.assertRaises(soda.NumericalError):
            simulation.step(3)


if __name__ == "__main__":
    unittest.main()
