"""Forces of walls by all contacts, the energy that they give, and the stand-off of tissue that is not known exactly."""

import pickle
import unittest

import numpy as np

import dibs
from subjects import ASIDE, HEART, OTHER, TREE

GAINS = {"stiffness": 1.0, "damping": 0.002, "max_force": 50.0, "margin": 8.0}
PROXY, REGION = dibs.Proxy(**GAINS), dibs.ForbiddenRegion(**GAINS)
PERIOD = 0.001
SPHERE = np.array([100.0, 0.0, 30.0, 2.5])
# Across a notch between two chambers.
SHAFT = np.array([16.0, -15, 88, 52, 72, 106, 2.5])


def near(tree, sphere, height):
    """A sphere at a height above the surface."""
    pair = tree.query(sphere)
    return np.append(pair["point_on_surface"] + pair["direction"] * (height + sphere[3]), sphere[3])


class Proxies(unittest.TestCase):
    def test_one_contact_is_a_forbidden_region(self):
        for tree, shift in ((TREE, np.zeros(3)), (OTHER, ASIDE)):
            sphere = near(tree, SPHERE + np.append(shift, 0), 3.0)
            found = dibs.Tracker(tree).closest(sphere, tree, margin=8.0)
            self.assertEqual(len(found.contacts.found), 1)
            origin, velocity = sphere[:3] + [0, 0, 40.0], np.array([-50.0, 20.0, 0.0])
            wrench, force = PROXY.force(found, origin, velocity), REGION.force(found, velocity)
            np.testing.assert_allclose(wrench.force, force.force, atol=1e-3)
            self.assertEqual((wrench.state, wrench.cause), (dibs.ForceState.ACTIVE, None))
            lever = found.contacts.found["point_on_tool"][0] - origin
            np.testing.assert_allclose(wrench.torque, np.cross(lever, wrench.force), atol=1e-2)
            self.assertGreater(np.linalg.norm(wrench.torque), 10)

    def test_two_contacts_hold_against_both(self):
        found = dibs.Tracker(TREE).closest(SHAFT, TREE, margin=12.0)
        proxy = dibs.Proxy(1.0, 0.0, max_force=50.0, margin=12.0)
        wrench, contacts = proxy.force(found, SHAFT[:3]), found.contacts.found
        self.assertGreater(len(contacts), 1)
        held = 0
        for contact in contacts:
            depth = 12.0 - contact["separation"]
            # A contact yields by a 16th; next to a wall's edge it has less weight.
            held += wrench.force @ contact["normal"] > 0.9 * depth
        self.assertGreater(held, 1)

    def test_a_guards_contacts_and_their_hold(self):
        guard = dibs.Guard(TREE, 300.0, 80, automatic=True, without_transit=True)
        tool = near(TREE, SPHERE, 2.0)
        answer, _ = guard.contacts(tool, 8.0, 1_000)
        hold = PROXY.force(answer, tool[:3], [10.0, 0, 0])
        self.assertEqual((hold.state, hold.force.tolist()), (dibs.ForceState.SAFE, [0, 0, 0]))
        self.assertIn("no surface", hold.cause)
        damped = dibs.Proxy(**GAINS, hold_damping=0.002)
        np.testing.assert_allclose(damped.force(answer, tool[:3], [10.0, 0, 0]).force, [-0.02, 0, 0], atol=1e-6)
        for now in range(1_000, 2_600):
            if now % 30 == 0:
                guard.frame(HEART.vertices, now)
                while guard.work() == "pending":
                    pass
            answer, contacts = guard.contacts(tool, 8.0, now)
        self.assertEqual((answer.state, len(contacts.found)), (dibs.State.NOMINAL, 1))
        wrench, force = PROXY.force(answer, tool[:3]), REGION.force(answer)
        np.testing.assert_allclose(wrench.force, force.force, atol=0.05)
        self.assertGreater(np.linalg.norm(force.force), 5)
        # The list reaches less far than this wall.
        self.assertEqual(dibs.Proxy(1, 0, 5, 9.0).force(answer, tool[:3]).state, dibs.ForceState.SAFE)

    def test_wrong_arguments_are_named(self):
        tracked = dibs.Tracker(TREE).closest(SPHERE, TREE)
        for name, error, call in [
            ("answer", TypeError, lambda: PROXY.force(None, [0, 0, 0])),
            ("answer", ValueError, lambda: PROXY.force(tracked, [0, 0, 0])),
            ("origin", ValueError, lambda: PROXY.force(tracked, [0, 0])),
            ("velocity", ValueError, lambda: PROXY.force(tracked, [0, 0, 0], [0, 0, np.nan])),
            ("angular", ValueError, lambda: PROXY.force(tracked, [0, 0, 0], [0, 0, 0], 1.0)),
            ("stiffness", ValueError, lambda: dibs.Proxy(0, 0, 5, 5)),
            ("margin", ValueError, lambda: dibs.Proxy(1, 0, 5, 0)),
            ("margin", TypeError, lambda: dibs.Proxy(1, 0, 5, "far")),
            ("tank", ValueError, lambda: dibs.EnergyAccount(0, 0.5, 1, 5, 300)),
            ("step", ValueError, lambda: dibs.EnergyAccount(1, np.nan, 1, 5, 300)),
            ("stiffness", ValueError, lambda: dibs.EnergyAccount(1, 0.5, -1, 5, 300)),
            ("max_force", ValueError, lambda: dibs.EnergyAccount(1, 0.5, 1, -5, 300)),
            ("speed", ValueError, lambda: dibs.EnergyAccount(1, 0.5, 1, 5, 0)),
            ("force", ValueError, lambda: dibs.EnergyAccount(1, 0.5, 1, 5, 300).limit([1, 2], [0, 0, 0], PERIOD)),
            ("velocity", TypeError, lambda: dibs.EnergyAccount(1, 0.5, 1, 5, 300).limit([0, 0, 0], None, PERIOD)),
            ("period", ValueError, lambda: dibs.EnergyAccount(1, 0.5, 1, 5, 300).limit([0, 0, 0], [0, 0, 0], 0)),
            ("tissue_speed", ValueError, lambda: dibs.Uncertainty(-1).stand_off(PERIOD)),
            ("error", ValueError, lambda: dibs.Uncertainty(1, np.nan).after(1)),
            ("ms", TypeError, lambda: dibs.Uncertainty(1).after(0.5)),
            ("period", ValueError, lambda: dibs.Uncertainty(1).stand_off(-1)),
        ]:
            with self.subTest(name), self.assertRaises(error) as raised:
                call()
            sentence = str(raised.exception)
            self.assertTrue(sentence.startswith(name), sentence)


class Accounts(unittest.TestCase):
    def test_a_jump_comes_in_steps_and_a_push_is_met_whole(self):
        account = dibs.EnergyAccount(tank=1.0, step=0.5, stiffness=1.0, max_force=5.0, speed=300.0)
        forces = [account.limit([5.0, 0, 0], [0, 0, 0], PERIOD)[0] for _ in range(12)]
        np.testing.assert_allclose(forces, np.minimum(0.5 * np.arange(1, 13), 5.0), atol=1e-4)
        pushed = dibs.EnergyAccount(1.0, 0.5, 1.0, 5.0, 300.0)
        for tick in range(100):
            wanted = [0.04 * tick, 0, 0]
            np.testing.assert_array_equal(pushed.limit(wanted, [-40.0, 0, 0], PERIOD), np.float32(wanted))
        self.assertGreater(pushed.balance, 1.0)
        copy = pickle.loads(pickle.dumps(pushed))
        self.assertEqual(copy.balance, 1.0)
        blind = account.limit([5.0, 0, 0], [np.nan] * 3, PERIOD)
        np.testing.assert_allclose(blind, [4.5, 0, 0], atol=1e-4)

    def test_a_wall_that_jumps_gives_no_more_than_the_tank(self):
        """A hand of 200 g with 20 N s/m, pushed against a wall that jumps every 33 ms."""

        def given(account, seed):
            random = np.random.default_rng(seed)
            at, speed, work, most, last, largest = 8.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for tick in range(3_000):
                if tick % 33 == 0:
                    wall, push = random.uniform(-2, 2), random.uniform(0, 9)
                force = float(np.clip(5.0 - (at - wall) - 0.002 * speed, 0, 5))
                if account is not None:
                    force = float(account.limit([force, 0, 0], [speed, 0, 0], PERIOD)[0])
                largest, last = max(largest, abs(force - last)), force
                speed += (force - push - 0.02 * speed) * PERIOD / 2e-4
                at += speed * PERIOD
                work += force * speed * PERIOD
                most = max(most, work)
            return most, largest

        exceeded = 0
        for seed in range(6):
            most, largest = given(dibs.EnergyAccount(1.0, 0.5, 1.0, 5.0, 300.0), seed)
            self.assertTrue(most <= 1.0 + 1e-3 and largest <= 0.5 + 1e-4, (most, largest))
            most, largest = given(None, seed)
            exceeded += most > 2 and largest > 2
        self.assertGreater(exceeded, 2)


class Uncertainties(unittest.TestCase):
    def test_the_stand_off_covers_speed_age_transit_and_registration(self):
        tissue = dibs.Uncertainty(100.0, 0.5).after(12).after(4)
        self.assertAlmostEqual(tissue.error, 2.1, places=5)
        self.assertAlmostEqual(tissue.stand_off(PERIOD), 2.2, places=5)
        self.assertGreaterEqual(tissue.stand_off(PERIOD), 0.5 + 0.1 * 16 + 0.1)
        # A filter keeps it in addition to its own.
        guard, tool = dibs.Filter(TREE, 1.0, 200.0), np.array([95.0, 3.0, 60.0, 95.0, 80.0, 90.0, 2.5])
        for _ in range(400):
            push = dibs.RigidMotion(tool[:3], [-0.1, 0, 0])
            tool = guard.admit(tool, push, PERIOD, TREE, **tissue._asdict()).motion.apply(tool)
        self.assertAlmostEqual(float(TREE.query(tool)["separation"]), 1.0 + tissue.stand_off(PERIOD), delta=0.1)


if __name__ == "__main__":
    unittest.main()
