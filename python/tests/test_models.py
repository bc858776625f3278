"""Models in process, against the command line, theory and NumPy."""

import json
import pickle
import subprocess
import tempfile
import threading
import unittest
from pathlib import Path

import numpy as np

import asobench as ab
from asobench._program import program


def record(n=300, delay=1, scale=1.0, seed=7):
    """A record of a plant of second order with a little coloured noise."""
    rng = np.random.default_rng(seed)
    u = rng.choice([-1.0, 1.0], n)
    plant = ab.Model(A=[1, -1.2, 0.5], B=[1.0, 0.3], nk=delay)
    e = 0.2 * rng.standard_normal(n)
    return scale * u, scale * (plant.simulate(u) + e + 0.4 * np.append(0, e[:-1]))


def by_program(u, y, *flags):
    """The first estimate of `asobench estimate`, or the line of its error."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "record.csv")
        path.write_text("u,y\n" + "".join(f"{a!r},{b!r}\n" for a, b in zip(u.tolist(), y.tolist())))
        call = [program(), "estimate", path, *flags, "--format", "json"]
        done = subprocess.run(list(map(str, call)), capture_output=True, text=True)
    return json.loads(done.stdout)["estimates"][0] if done.stdout else done.stderr


def bits(values):
    """Numbers as bits; null is NaN."""
    array = np.array([np.nan if value is None else value for value in np.atleast_1d(values)], dtype=float)
    return array.tobytes()


class SameBits(unittest.TestCase):
    def compare(self, u, y, estimator, options, flags):
        printed = by_program(u, y, "--estimator", estimator, *flags)
        if isinstance(printed, str):
            with self.assertRaises(ValueError, msg=printed):
                ab.estimate(u, y, estimator, **options)
            return
        try:
            model = ab.estimate(u, y, estimator, **options)
        except ab.EstimateFailed as error:
            self.assertIsNone(printed["model"]["A"][1:] and printed["a"])
            self.assertEqual(error.kind, printed["failure"]["kind"])
            return
        roots = {name: [root["re"] + 1j * root["im"] for root in printed[name]] for name in ("poles", "zeros")}
        told = printed["residuals"]
        tests = model.residual_tests()
        numbers = {name: (getattr(model, name), printed["model"][name]) for name in "ABCDF"}
        numbers |= {name: (getattr(model, name), printed[name]) for name in ("noise_variance", "loss", "condition")}
        numbers["gain"] = (model.gain, printed["static_gain"])
        numbers["gain_se"] = (model.gain_se, printed["static_gain_se"])
        numbers["fit"] = (
            list(model.fit()),
            [printed["fit_percent"]["window"][key] for key in ("simulated", "one_step")],
        )
        numbers["state"] = (model.state_space()[1], printed["b"])
        if model.x0 is not None:
            numbers["x0"] = (model.x0, printed["x0"])
        if model.cov is not None:
            numbers["se"] = (model.se, printed["se"])
        self.assertEqual(tests is None, told is None)
        if tests is not None:
            for name, key in (("white", "white"), ("past_input", "free_of_past_input")):
                numbers[name] = (getattr(tests, name), (told[key] or {}).get("p_value"))
        if printed["observer"]:
            numbers["observer"] = (ab.observer(model).run(u, y)[-1], printed["observer"]["x_at_window"])
        for name in ("poles", "zeros"):
            found = getattr(model, f"{name}_se")
            for part in ("re", "im", "modulus"):
                own = getattr(found, {"re": "se_real", "im": "se_imag"}.get(part, f"se_{part}"))
                numbers[f"{name} {part}"] = (own, [(root["se"] or {}).get(part) for root in printed[name]])
        for name, (own, other) in numbers.items():
            self.assertEqual(bits(own), bits(other), f"{estimator} {name}: {own} {other}")
        self.assertEqual(model.continuous is None, printed["continuous"] is None)
        if model.continuous:
            for name in ("numerator", "denominator", "se"):
                self.assertEqual(bits(getattr(model.continuous, name)), bits(printed["continuous"][name]))
            self.assertEqual(pickle.loads(pickle.dumps(model)).continuous.hold, printed["continuous"]["hold"])
        for name in roots:
            self.assertEqual(getattr(model, name).tolist(), roots[name], f"{estimator} {name}")
        self.assertEqual(model.iterations, printed["iterations"])
        self.assertEqual(model.status, printed["status"] if not printed["failure"] else printed["failure"]["kind"])

    def test_offset_and_start_as_the_command_line(self):
        u, y = (signal[40:] for signal in record())
        y = y + 50.0
        options = {"order": 2, "initial": "estimate", "offset": "estimate"}
        for estimator in ("oe", "armax", "bj", "pem", "wnsf", "bjsm"):
            with self.subTest(estimator):
                model = ab.estimate(u, y, estimator, **options)
                flags = [word for key, value in options.items() for word in (f"--{key}", value)]
                printed = by_program(u, y, "--estimator", estimator, *flags)["offset"]
                self.assertEqual(bits(model.offset), bits([printed["value"], printed["se"]]))
                self.assertLess(abs(model.offset.value - 50.0), 4.0 * model.offset.se)
                restored = pickle.loads(pickle.dumps(model))
                self.assertEqual(restored.offset, model.offset)
                self.assertLess(np.abs(restored.predict(u, y) - y)[5:].std(), 0.4)
                self.assertLess(np.abs(model.simulate(u, model.x0) - y).mean(), 1.0)
        self.assertIsNone(ab.estimate(u, y, "oe", order=2).offset)

    def test_every_estimator_as_the_command_line(self):
        records = {"plain": record(), "delayed": record(delay=3), "tiny": record(scale=2.0**-180)}
        for name, (u, y) in records.items():
            delay = 3 if name == "delayed" else 1
            for estimator in ab.estimators:
                with self.subTest(f"{estimator} {name}"):
                    own = {"ts": 0.5} if "ts" in ab._estimators.registry()[estimator]["options"] else {}
                    flags = ["--order", 2, "--delay", delay, *(f"--{key}={value}" for key, value in own.items())]
                    self.compare(u, y, estimator, {"order": 2, "nk": delay, **own}, flags)

    def test_orders_and_options_as_the_command_line(self):
        u, y = record()
        for estimator, orders, options in [
            ("arx", "na=2,nb=3,nk=0", {"rows": "prewindow", "covariance": "robust"}),
            ("oe", "nb=2,nf=2,nk=1", {"starts": 3, "initial": "estimate"}),
            ("bj", "nb=2,nf=2,nc=1,nd=1,nk=1", {"starts": 2}),
            ("iv", "na=2,nb=2,nk=1", {}),
            ("armax", "na=9,nb=9,nc=9,nk=1", {"starts": 1}),
        ]:
            with self.subTest(estimator):
                flags = ["--orders", orders, *(f"--{key}={value}" for key, value in options.items())]
                counts = {key: int(value) for key, value in (part.split("=") for part in orders.split(","))}
                self.compare(u, y, estimator, {**counts, **options}, flags)
                self.compare(u, y, estimator, {"orders": orders, **options}, flags)

    def test_a_singular_record_fails_as_there(self):
        u, y = np.ones(50), np.arange(50.0)
        with self.assertRaises(ab.EstimateFailed) as caught:
            ab.estimate(u, y, "arx", na=2, nb=2)
        self.assertEqual(caught.exception.kind, "rank-deficient")
        self.assertEqual(pickle.loads(pickle.dumps(caught.exception)).kind, "rank-deficient")


class Models(unittest.TestCase):
    def setUp(self):
        self.u, self.y = record()

    def test_arx_is_least_squares(self):
        model = ab.estimate(self.u, self.y, "arx", na=2, nb=2, nk=1)
        k = np.arange(2, len(self.y))[:, None]
        phi = np.hstack([-self.y[k - [1, 2]], self.u[k - [1, 2]]])
        theta, rss, *_ = np.linalg.lstsq(phi, self.y[2:], rcond=None)
        np.testing.assert_allclose(model.params, theta, rtol=1e-11)
        cov = rss[0] / (len(phi) - 4) * np.linalg.inv(phi.T @ phi)
        np.testing.assert_allclose(model.cov, cov, rtol=1e-9)
        np.testing.assert_allclose(model.se, np.sqrt(np.diag(cov)), rtol=1e-9)

    def test_predictions_of_several_steps_iterate_the_equation(self):
        model = ab.Model(A=[1, -1.2, 0.5], B=[1.0, 0.3], nk=1)
        for steps in (1, 2, 5):
            predicted = model.predict(self.u, self.y, steps)
            for t in (20, 150, 299):
                y = self.y[: t - steps + 1].tolist()
                for k in range(t - steps + 1, t + 1):
                    y.append(1.2 * y[k - 1] - 0.5 * y[k - 2] + self.u[k - 1] + 0.3 * self.u[k - 2])
                self.assertAlmostEqual(predicted[t], y[t], places=11)
            self.assertTrue(np.isnan(predicted[: 1 + steps]).all())
            later = slice(1 + steps, None)
            errors = self.y[later] - predicted[later]
            expected = 100 * (1 - np.linalg.norm(errors) / np.linalg.norm(self.y[later] - self.y.mean()))
            self.assertAlmostEqual(model.fit_ahead(steps, self.u, self.y), expected, places=9)
        noise = ab.Model(B=[1.0, 0.3], F=[1, -1.2, 0.5], nk=1)
        np.testing.assert_allclose(noise.predict(self.u, self.y, 9), noise.predict(self.u, self.y, 1), rtol=1e-9)

    def test_several_records_are_one_problem(self):
        rng = np.random.default_rng(3)
        u = [rng.choice([-1.0, 1.0], n) for n in (60, 80)]
        y = [ab.Model(A=[1, -1.5, 0.7], B=[1.0, 0.5], nk=1).simulate(part) for part in u]
        y = [part + 0.1 * rng.standard_normal(len(part)) for part in y]
        model = ab.estimate(u, y, "arx", na=2, nb=2, nk=1)
        rows = [(np.column_stack([-o[1:-1], -o[:-2], i[1:-1], i[:-2]]), o[2:]) for i, o in zip(u, y, strict=True)]
        expected = np.linalg.lstsq(np.vstack([r[0] for r in rows]), np.concatenate([r[1] for r in rows]), rcond=None)[0]
        np.testing.assert_allclose(model.params, expected, rtol=1e-10)
        with self.assertRaisesRegex(ValueError, "one record"):
            ab.estimate(u, y, "n4sid", order=2)
        with self.assertRaisesRegex(ValueError, "two lists"):
            ab.estimate(u, y[0], "arx", order=2)

    def test_responses_are_those_of_the_polynomials(self):
        model = ab.estimate(self.u, self.y, "bj", nb=2, nf=2, nc=1, nd=1, starts=1)
        w = np.array([0.0, 0.3, 1.0, 3.0])
        z = np.exp(-1j * w)
        of = [np.polyval(part[::-1], z) for part in (model.B, model.A, model.F)]
        found = model.frequency_response(w)
        np.testing.assert_allclose(found.response, of[0] / of[1] / of[2], rtol=1e-12)
        self.assertTrue((found.magnitude_low < found.magnitude).all())
        np.testing.assert_allclose(model.step_response(9).y, model.simulate(np.ones(9)), rtol=1e-13)
        self.assertAlmostEqual(model.gain, found.response[0].real)

    def test_a_state_reproduces_the_output(self):
        model = ab.Model(A=[1, -1.2, 0.5], B=[0.7, 1.0, 0.3], nk=0)
        a, b, c, d = model.state_space()
        x, y = np.array([0.3, -0.2]), []
        for k in range(20):
            y.append(c @ x + d * self.u[k])
            x = a @ x + b * self.u[k]
        np.testing.assert_allclose(model.simulate(self.u[:20], [0.3, -0.2]), y, rtol=1e-12)
        rest = model.simulate(self.u[:20])
        np.testing.assert_allclose(model.simulate(self.u[:20], [0.0, 0.0]), rest, rtol=1e-12, atol=1e-14)

    def test_other_packages(self):
        model = ab.Model(A=[1, -1.2, 0.5], B=[1.0, 0.3], nk=2)
        expected = model.simulate(np.ones(10))
        try:
            import scipy.signal
        except ImportError:
            self.skipTest("no scipy")
        (found,) = scipy.signal.dstep(model.to_scipy(), n=10)[1]
        np.testing.assert_allclose(found[:, 0], expected, atol=1e-13)
        try:
            import control
        except ImportError:
            self.skipTest("no control")
        np.testing.assert_allclose(control.step_response(model.to_control(), 9).outputs, expected, atol=1e-12)

    def test_inputs_of_every_kind(self):
        model = ab.estimate(self.u, self.y, "arx", na=2, nb=2)
        columns = np.column_stack([self.u, self.y])
        for u, y in [
            (self.u.tolist(), tuple(self.y)),
            (columns[:, 0], columns[:, 1]),
            (self.u.astype(np.int8), self.y.astype(np.longdouble)),
            (self.u.astype(">f8"), self.y.astype(">f8")),
            (self.u > 0, self.y),
        ]:
            other = ab.estimate(np.asarray(u) * 2.0 - 1 if np.asarray(u).dtype == bool else u, y, "arx", na=2, nb=2)
            self.assertEqual(bits(model.params), bits(other.params))
        single = ab.estimate(self.u.astype(np.float32), self.y.astype(np.float32), "arx", na=2, nb=2)
        np.testing.assert_allclose(single.params, model.params, rtol=1e-5)

    def test_the_record_of_a_model_is_its_own(self):
        u, y = self.u.copy(), self.y.copy()
        model = ab.estimate(u, y, "arx", na=2, nb=2)
        before = model.fit()
        y[:] = 0
        self.assertEqual(model.fit(), before)
        with self.assertRaises(ValueError):
            model.A[0] = 2

    def test_pickles(self):
        for estimator in ("iv", "oe", "moesp"):
            nk = 2 if estimator == "iv" else 1
            model = ab.estimate(*record(delay=nk), estimator, order=2, nk=nk)
            other = pickle.loads(pickle.dumps(model))
            for name in ("params", "se", "x0", "loss", "condition", "singular_values", "noise_variance"):
                self.assertEqual(bits(getattr(model, name)), bits(getattr(other, name)), name)
            self.assertEqual(
                (model.fit(), model.status, model.options, model.summary()),
                (other.fit(), other.status, other.options, other.summary()),
            )

    def test_threads_and_their_results(self):
        expected = ab.estimate(self.u, self.y, "oe", nb=2, nf=2, starts=2).params.tobytes()
        found = []

        def some():
            for _ in range(5):
                found.append(ab.estimate(self.u, self.y, "oe", nb=2, nf=2, starts=2).params.tobytes())

        threads = [threading.Thread(target=some) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(found, [expected] * 40)

    def test_the_interpreter_is_free_meanwhile(self):
        u, y = record(200_000)
        ticks, done = [], threading.Event()

        def count():
            while not done.is_set():
                ticks.append(1)
                done.wait(0.001)

        counter = threading.Thread(target=count)
        counter.start()
        before = len(ticks)
        ab.estimate(u, y, "oe", nb=2, nf=2, starts=4)
        during = len(ticks) - before
        done.set()
        counter.join()
        self.assertGreater(during, 3)

    def test_a_fork_estimates_too(self):
        import multiprocessing

        with multiprocessing.get_context("fork").Pool(2) as pool:
            forked = pool.starmap(params, [(self.u, self.y)] * 4)
        self.assertEqual({values.tobytes() for values in forked}, {params(self.u, self.y).tobytes()})

    def test_no_growth_of_memory(self):
        import resource

        def fits(count):
            for _ in range(count):
                ab.estimate(self.u, self.y, "arx", na=2, nb=2).summary()
            return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

        before = fits(500)
        self.assertLess(fits(3000) - before, 2048)  # KiB; the records alone are 14 MB

    def test_functions_from_the_registry(self):
        import inspect

        for name in ab.estimators:
            function = ab.estimators[name]
            described = inspect.signature(function).parameters
            for key, option in ab._estimators.registry()[name]["options"].items():
                self.assertIn(key, described)
                self.assertIn(option["about"], function.__doc__)
        model = ab.estimators.iv_delayed(self.u, self.y, na=2, nb=2)
        self.assertEqual(model.estimator, "iv-delayed")

    def test_orders(self):
        table = ab.orders(self.u, self.y, range(1, 5), nk=[1, 2])
        self.assertEqual([(row["na"], row["nk"]) for row in table.rows[:5]], [(1, 1), (2, 1), (3, 1), (4, 1), (1, 2)])
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "record.csv")
            path.write_text("u,y\n" + "".join(f"{a!r},{b!r}\n" for a, b in zip(self.u.tolist(), self.y.tolist())))
            call = [program(), "estimate", path, "--order", "1:4", "--delay", "1:2", "--format", "json"]
            printed = json.loads(subprocess.run(call, capture_output=True, text=True, check=True).stdout)
        for row, other in zip(table.rows, printed["table"], strict=True):
            self.assertEqual([row[key] for key in ("V", "aic", "bic")], [other[key] for key in ("V", "aic", "bic")])
            self.assertEqual(row["fit"], other["fit_percent"]["window"])
        self.assertEqual(table.best["bic"]["na"], printed["best"]["bic"]["na"])

    def test_states(self):
        """Kalman filters by NumPy's own recursions, to their limit; the other observers without covariances."""
        model = ab.estimate(self.u, self.y, "arx", na=2, nb=2)
        a, b, c, _ = model.state_space()
        q, r, x, p = np.array([[0.3, 0.1], [0.1, 0.2]]), 0.4, model.x0, np.diag([2.0, 3.0])
        states, sds = [x], [np.sqrt(np.diag(p))]
        for u, y in zip(self.u, self.y):
            gain = a @ p @ c / (c @ p @ c + r)
            x = a @ x + b * u + gain * (y - c @ x)
            p = a @ p @ a.T + q - np.outer(gain, gain) * (c @ p @ c + r)
            states, sds = [*states, x], [*sds, np.sqrt(np.diag(p))]
        varying = model.observer("kalman-varying", Q=q, r=r, P0=[2.0, 3.0])
        observed = varying.run(self.u, self.y)
        np.testing.assert_allclose(observed.x, states, rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(observed.sd, sds, rtol=1e-10)
        np.testing.assert_allclose(observed.y + observed.innovations, self.y, rtol=1e-12, atol=1e-12)
        steady = model.observer("kalman", Q=q, r=r)
        np.testing.assert_allclose(steady.gain, gain, rtol=1e-10)
        np.testing.assert_allclose(steady.P, p, rtol=1e-10)
        np.testing.assert_allclose(np.poly(steady.poles), np.poly(a - np.outer(steady.gain, c)), atol=1e-10)
        self.assertIsNone(model.observer("scaled:0.5").run(self.u, self.y).sd)
        identified = model.observer("kalman")
        np.testing.assert_allclose(identified.Q, identified.Q[0, 0] * np.eye(2))
        self.assertEqual(identified.run(self.u, self.y).sd.shape, (301, 2))
        self.assertEqual(repr(identified), "ModelObserver('kalman')")

    def test_words_and_picture(self):
        model = ab.estimate(self.u, self.y, "oe", nb=2, nf=2, starts=1)
        for part in ("b_1", "f_2", "white p =", "status          ok"):
            self.assertIn(part, model.summary())
        self.assertIn("<svg", model._repr_html_())
        self.assertEqual(repr(model), "Model(nb=2,nf=2,nk=1, by oe)")


def params(u, y):
    return ab.estimate(u, y, "arx", na=2, nb=2).params


if __name__ == "__main__":
    unittest.main()
