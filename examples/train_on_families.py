"""Train on parts of some families and predict what grips of other families hold, compared with oracles.

    pip install .
    python examples/train_on_families.py --work runs/families

writes the benchmark (`gripgen init --benchmark`), sweeps it, trains small networks (numpy alone, on a processor) and leaves weights, a
card and figures in the work folder. Images become heights by photometry, heights become areas, areas and forces become what is held. No part of
the three families for tests, nor one of their shape, is seen in training, and no constant of the twin reaches the networks.

Two oracles are simulated: they know geometry, pose, force and the law of friction. One also knows mu of the part, the other how mu
is spread. What is left to them is the scatter from grip to grip and the noise of the sensor. Intervals are conformal: their width is that
of errors on training families that were left out in turn. `docs/training.md` has the figures of one run.
"""

import argparse
import json
import re
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import gripgen as gg
import numpy as np

ORACLE_MU, ORACLE_MU_SPREAD = 0.15, 0.2  # as twin.toml draws it; the networks are not told
SHRINK = 4  # images are averaged over squares of so many pixels
PIXEL_MM = 0.0877 * SHRINK  # of the shipped sensor
LEVEL = 0.9
# Gauss-Hermite quadrature over ln mu (probabilists' weights).
NODES, WEIGHTS = np.polynomial.hermite_e.hermegauss(5)
WEIGHTS = WEIGHTS / WEIGHTS.sum()


def make_benchmark(work: Path, per_family: int | None) -> Path:
    """The benchmark's sweep, made once."""
    folder = work / "benchmark"
    if not (folder / "sweep.toml").exists():
        few = ["--per-family", str(per_family)] if per_family else []
        command = [sys.executable, "-m", "gripgen", "init", "--benchmark", "-o", str(folder), *few]
        subprocess.run(command, check=True)
    return folder / "sweep.toml"


def known_to_oracles(work: Path, sweep: Path, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Expected labels of all samples: with mu of the part, and averaged over how mu is spread."""
    text = (sweep.parent / "twin.toml").read_text()
    quiet = re.sub(r"(?m)^scatter = .*$", "scatter = 0.0", text) + "\n[wrist]\nnoise_n = 0.0\n"

    def labels(name: str, twin: str) -> np.ndarray:
        path = sweep.parent / f"twin-{name}.toml"
        path.write_text(twin)
        keys = {"twin": str(path.resolve()), "samples": samples, "images": "none"}
        gg.sweep(sweep, work / name, set=keys)
        # Every sample, so that rows are those of the sweep with images.
        return gg.load(work / name, status=("slipped", "no_contact", "censored", "failed")).labels

    with_mu = labels("oracle", quiet)
    nodes_mu = ORACLE_MU * np.exp(ORACLE_MU_SPREAD * NODES)
    at_nodes = [labels(f"oracle-{i}", re.sub(r"(?m)^mu = .*$", f"mu = {mu}", quiet)) for i, mu in enumerate(nodes_mu)]
    return with_mu, np.average(at_nodes, axis=0, weights=WEIGHTS)


class Arrays:
    """A run in memory, with what its own configuration says of the parts."""

    def __init__(self, dataset: gg.Dataset, oracles: tuple[np.ndarray, np.ndarray]) -> None:
        parts = tomllib.loads(dataset.info["config_toml"])["twin"]["parts"]
        part = dataset.column("part")
        self.dataset = dataset
        self.images = images_of(dataset)
        self.label_n = np.asarray(dataset.labels, dtype=np.float64)
        self.force_n = np.asarray(dataset.column("grip_force_n"), dtype=np.float64)
        self.mu = np.array([parts[p]["mu"] for p in part])
        self.family = np.array([parts[p]["family"] for p in part])
        self.split = np.array([parts[p]["split"] for p in part])
        self.oracle_n, self.blind_oracle_n = (np.asarray(o)[dataset.rows] for o in oracles)

    def heights_mm(self, rows: np.ndarray) -> np.ndarray:
        """How deep the part is pressed into both gels, simulated again: [2 N, h, w]."""
        found = self.dataset.batch(rows, images=False, heights=True, threads=2).heights_mm
        return shrunk(found[..., None])[..., 0].reshape(-1, *self.images.shape[2:4])


def shrunk(x: np.ndarray) -> np.ndarray:
    """Averages over squares of [N, 2, H, W, C]."""
    n, jaws, h, w, c = x.shape
    return x.reshape(n, jaws, h // SHRINK, SHRINK, w // SHRINK, SHRINK, c).mean((3, 5))


def images_of(dataset: gg.Dataset) -> np.ndarray:
    """All images of a dataset, shrunk: float32[N, 2, h, w, 3]."""
    found = []
    for first in range(0, len(dataset), 64):
        pixels, _ = dataset.batch(range(first, min(first + 64, len(dataset))), threads=2)
        found.append(shrunk(pixels.astype(np.float32)))
    return np.concatenate(found)


class Photometry:
    """Images to heights: a quadric from the change of colour to the slope, fitted on heights of the training families, then integrated."""

    def __init__(self, colours: np.ndarray, heights_mm: np.ndarray) -> None:
        """Changes of colour [N, h, w, 3] and heights [N, h, w]."""
        slopes = np.stack(np.gradient(heights_mm, PIXEL_MM, axis=(1, 2)), -1)
        x, y = self.quadric(colours).reshape(-1, 9), slopes.reshape(-1, 2)
        self.map = np.linalg.solve(x.T @ x + 1e-3 * len(x) * np.eye(9), x.T @ y)

    @staticmethod
    def quadric(colours: np.ndarray) -> np.ndarray:
        """Three channels, their squares and products."""
        c = colours / 32.0
        pairs = [c[..., i] * c[..., j] for i in range(3) for j in range(i, 3)]
        return np.concatenate([c, np.stack(pairs, -1)], -1)

    def heights_mm(self, colours: np.ndarray) -> np.ndarray:
        """Heights whose slopes come nearest, with the lowest twentieth at 0: a cosine series."""
        slopes = self.quadric(colours) @ self.map
        down, right = slopes[..., 0], slopes[..., 1]
        # Mirrored, so that the series has no step at the border.
        down = np.concatenate([down, -down[:, ::-1]], 1)
        down = np.concatenate([down, down[:, :, ::-1]], 2)
        right = np.concatenate([right, right[:, ::-1]], 1)
        right = np.concatenate([right, -right[:, :, ::-1]], 2)
        n, m = down.shape[1:]
        v, u = np.fft.fftfreq(n)[:, None], np.fft.rfftfreq(m)[None]
        dv, du = 2j * np.pi * v / PIXEL_MM, 2j * np.pi * u / PIXEL_MM
        length = np.abs(dv) ** 2 + np.abs(du) ** 2
        length[0, 0] = 1.0
        series = (np.conj(dv) * np.fft.rfft2(down) + np.conj(du) * np.fft.rfft2(right)) / length
        series[:, 0, 0] = 0.0
        found = np.fft.irfft2(series, s=(n, m))[:, : n // 2, : m // 2]
        return found - np.quantile(found, 0.05, axis=(1, 2), keepdims=True)


LEVELS_MM = [0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.3, 1.7, 2.2, 3.0]


def seen(colours: np.ndarray, heights_mm: np.ndarray, force_n: np.ndarray, imprint_mm3_per_n: float) -> np.ndarray:
    """What matters of an image, wherever the contact lies: areas above levels, size of slopes, and the contact that V = c F would have."""
    cell = PIXEL_MM**2
    areas = np.stack([np.log1p((heights_mm > t).sum((1, 2)) * cell) for t in LEVELS_MM], 1)
    change = np.abs(colours).mean(-1)
    edges = np.stack([np.log1p((change > t).sum((1, 2)) * cell) for t in (4, 10, 25)], 1)
    size = np.stack([change.mean((1, 2)), heights_mm.max((1, 2)), np.log1p(heights_mm.sum((1, 2)) * cell)], 1)
    # The level above which lies the volume that the force presses in.
    wanted, low, high = imprint_mm3_per_n * force_n, np.full(len(force_n), -5.0), heights_mm.max((1, 2))
    for _ in range(30):
        middle = (low + high) / 2
        volume = (heights_mm - middle[:, None, None]).clip(0).sum((1, 2)) * cell
        low, high = np.where(volume > wanted, middle, low), np.where(volume > wanted, high, middle)
    area = (heights_mm > low[:, None, None]).sum((1, 2)) * cell
    return np.concatenate([areas, edges, size, np.stack([np.log1p(area), low, np.log(wanted / area.clip(cell))], 1)], 1)


class Network:
    """Three small networks; each jaw holds its share: F_max = mu F_G (share of the left + share of the right)."""

    def __init__(self, x: np.ndarray, told: np.ndarray, target: np.ndarray, epochs: int, seed: int, sees: bool) -> None:
        """Features [N, 2, K], what is told [N, 2], and ln(F_max / (2 mu F_G))."""
        self.sees = sees
        inputs = self.join(x, told)
        self.mean, self.sd = inputs.mean((0, 1)), inputs.std((0, 1)) + 1e-6
        self.members = [self.fitted((inputs - self.mean) / self.sd, target, epochs, seed + k) for k in range(3)]

    def join(self, x: np.ndarray, told: np.ndarray) -> np.ndarray:
        """Features of each jaw beside what is told of both."""
        told = np.repeat(told[:, None], 2, 1)
        return np.concatenate([x, told], 2) if self.sees else told

    @staticmethod
    def fitted(x: np.ndarray, target: np.ndarray, epochs: int, seed: int) -> list[np.ndarray]:
        """Squared error of the logarithm; Adam with a falling rate and weight decay."""
        rng = np.random.default_rng(seed)
        sizes = [x.shape[2], 40, 40, 1]
        p = [rng.normal(0, 1 / np.sqrt(a), (a, b)) for a, b in zip(sizes, sizes[1:])]
        p += [np.zeros(b) for b in sizes[1:]]
        m, v, step = [np.zeros_like(w) for w in p], [np.zeros_like(w) for w in p], 0
        steps = epochs * -(-len(x) // 64)
        for _ in range(epochs):
            for ids in np.array_split(rng.permutation(len(x)), -(-len(x) // 64)):
                step += 1
                gradient = Network.gradient(p, x[ids], target[ids])
                rate = 4e-3 * 0.5 * (1 + np.cos(np.pi * step / steps))
                for i, g in enumerate(gradient):
                    m[i] = 0.9 * m[i] + 0.1 * g
                    v[i] = 0.999 * v[i] + 0.001 * g * g
                    change = m[i] / (1 - 0.9**step) / (np.sqrt(v[i] / (1 - 0.999**step)) + 1e-8)
                    p[i] = p[i] - rate * (change + (2e-2 * p[i] if i < 3 else 0.0))
        return p

    @staticmethod
    def layers(p: list[np.ndarray], x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Both hidden layers and the logarithm of each jaw's share."""
        a = np.tanh(x @ p[0] + p[3])
        b = np.tanh(a @ p[1] + p[4])
        return a, b, (b @ p[2] + p[5])[..., 0]

    @staticmethod
    def gradient(p: list[np.ndarray], x: np.ndarray, target: np.ndarray) -> list[np.ndarray]:
        """Of half the mean squared error."""
        a, b, ln = Network.layers(p, x)
        shares = np.exp(ln)
        error = np.log(shares.mean(1)) - target
        d = (error[:, None] * shares / shares.sum(1, keepdims=True) / len(x))[..., None]
        db = d @ p[2].T * (1 - b * b)
        da = db @ p[1].T * (1 - a * a)
        def flat(y: np.ndarray) -> np.ndarray:
            return y.reshape(-1, y.shape[-1])

        weights = [flat(u).T @ flat(w) for u, w in ((x, da), (a, db), (b, d))]
        return weights + [flat(w).sum(0) for w in (da, db, d)]

    def __call__(self, x: np.ndarray, told: np.ndarray) -> np.ndarray:
        """ln(F_max / (2 mu F_G)), the mean of the networks."""
        inputs = (self.join(x, told) - self.mean) / self.sd
        return np.mean([np.log(np.exp(self.layers(p, inputs)[2]).mean(1)) for p in self.members], 0)


class Held:
    """Images and grip force to the force that is held: photometry, features, networks; all from the rows in `keep`."""

    def __init__(self, data: Arrays, keep: np.ndarray, epochs: int, seed: int, sees: bool = True) -> None:
        few = np.flatnonzero(keep)
        few = np.random.default_rng(seed).permutation(few)[:300]
        self.rest = data.images[keep].mean(0)
        colours, heights_mm = (data.images[few] - self.rest).reshape(-1, *data.images.shape[2:]), data.heights_mm(few)
        self.photometry = Photometry(colours, heights_mm)
        # Of the training parts: mean and spread of ln mu, and the volume that a newton presses in.
        ln_mu = np.log(np.unique(data.mu[keep]))
        volume_mm3 = heights_mm.clip(0).sum() * PIXEL_MM**2
        self.known = np.array([ln_mu.mean(), ln_mu.std(ddof=1), volume_mm3 / (2 * data.force_n[few].sum())])
        target = np.log(data.label_n[keep].clip(0.05) / (2 * data.mu[keep] * data.force_n[keep]))
        told = self.told(data.force_n[keep], data.mu[keep])
        self.network = Network(self.features(data, keep), told, target, epochs, seed, sees)

    def told(self, force_n: np.ndarray, mu: np.ndarray) -> np.ndarray:
        """What the network is told in addition to images."""
        return np.stack([np.log(force_n / 15.0), (np.log(mu) - self.known[0]) / self.known[1]], 1)

    def features(self, data: Arrays, keep: np.ndarray) -> np.ndarray:
        """Of both jaws, [N, 2, K]."""
        at, found = np.flatnonzero(keep), []
        for ids in np.array_split(at, -(-len(at) // 128)):
            colours = (data.images[ids] - self.rest).astype(np.float64)
            jaws = (colours[:, 0], colours[:, 1])
            both = [seen(c, self.photometry.heights_mm(c), data.force_n[ids], self.known[2]) for c in jaws]
            found.append(np.stack(both, 1))
        return np.concatenate(found)

    def predict(self, data: Arrays, keep: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Labels with mu told, and without it: averaged over how mu is spread."""
        x, force_n = self.features(data, keep), data.force_n[keep]

        def at_mu(mu: np.ndarray) -> np.ndarray:
            return 2 * mu * force_n * np.exp(self.network(x, self.told(force_n, mu)))

        nodes_mu = np.exp(self.known[0] + self.known[1] * NODES)
        blind = [at_mu(np.full(len(force_n), mu)) for mu in nodes_mu]
        return at_mu(data.mu[keep]), np.average(blind, axis=0, weights=WEIGHTS)

    def save(self, path: Path, widths: list[float]) -> None:
        """Weights as plain arrays."""
        arrays = {f"network{k}_{i}": w.astype(np.float32) for k, p in enumerate(self.network.members) for i, w in enumerate(p)}
        arrays |= {"rest": self.rest.astype(np.float32), "colour_to_slope": self.photometry.map, "known": self.known}
        np.savez_compressed(path, mean=self.network.mean, sd=self.network.sd, half_width_ln=widths, **arrays)

    @classmethod
    def load(cls, path: Path) -> tuple["Held", np.ndarray]:
        """What `save` wrote, and the half widths of ln F with and without mu."""
        arrays = np.load(path)
        held, network, photometry = cls.__new__(cls), Network.__new__(Network), Photometry.__new__(Photometry)
        network.sees, network.mean, network.sd = True, arrays["mean"], arrays["sd"]
        network.members = [[arrays[f"network{k}_{i}"].astype(float) for i in range(6)] for k in range(3)]
        photometry.map = arrays["colour_to_slope"]
        held.rest, held.network, held.photometry, held.known = arrays["rest"], network, photometry, arrays["known"]
        return held, arrays["half_width_ln"]


def train(data: Arrays, keep: np.ndarray, epochs: int, seed: int, sees: bool = True) -> Held:
    """From the rows in `keep` alone."""
    return Held(data, keep, epochs, seed, sees)


def predict(model: Held, data: Arrays, keep: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Labels with mu told, and without it."""
    return model.predict(data, keep)


def rmse(error: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(error**2)))


def width(label_n: np.ndarray, predicted_n: np.ndarray) -> float:
    """Conformal half width of ln F: the smallest that holds as many left-out labels as it should."""
    errors = np.sort(np.abs(np.log(label_n.clip(0.05) / predicted_n)))
    return float(errors[min(len(errors) - 1, int(np.ceil((len(errors) + 1) * LEVEL)) - 1)])


def within(label_n: np.ndarray, predicted_n: np.ndarray, half_width: float) -> float:
    """Share of labels inside the interval."""
    return float(np.mean(np.abs(np.log(label_n.clip(0.05) / predicted_n)) <= half_width))


def straight(data: Arrays, fit: np.ndarray, test: np.ndarray, told_mu: bool) -> np.ndarray:
    """Linear in F_G, or in mu F_G."""
    x = data.force_n * (data.mu if told_mu else 1.0)
    return np.polyval(np.polyfit(x[fit], data.label_n[fit], 1), x[test])


def left_out(data: Arrays, among: np.ndarray, groups: int, epochs: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Predictions of all rows in `among` by networks that never saw their family; and the group of each row."""
    names = np.random.default_rng(seed).permutation(np.unique(data.family[among]))
    group = np.full(len(data.label_n), -1)
    told, blind = np.full(len(group), np.nan), np.full(len(group), np.nan)
    for k in range(groups):
        out = among & np.isin(data.family, names[k::groups])
        group[out] = k
        told[out], blind[out] = predict(train(data, among & ~out, epochs, seed), data, out)
    return told, blind, group


def figures(data: Arrays, keep: np.ndarray, told: np.ndarray, blind: np.ndarray) -> dict[str, float]:
    """Errors of a network on some rows, in N and beside the oracles."""
    label_n = data.label_n[keep]
    oracle, blind_oracle = rmse(data.oracle_n[keep] - label_n), rmse(data.blind_oracle_n[keep] - label_n)
    with_mu, without = rmse(told - label_n), rmse(blind - label_n)
    return {
        "n": int(keep.sum()),
        "oracle_with_mu_n": oracle,
        "network_with_mu_n": with_mu,
        "ratio_with_mu": with_mu / oracle,
        "oracle_without_mu_n": blind_oracle,
        "network_without_mu_n": without,
        "ratio_without_mu": without / blind_oracle,
    }


def main() -> None:
    """Data, oracles, networks, tables, weights and card."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, default=Path("runs/families"))
    parser.add_argument("--samples", type=int, default=4000)
    parser.add_argument("--per-family", type=int, help="the first so many parts of each family only")
    parser.add_argument("--epochs", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rotate", action="store_true", help="also leave out every family in turn, three at a time")
    options = parser.parse_args()
    work, epochs, seed = options.work, options.epochs, options.seed
    work.mkdir(parents=True, exist_ok=True)
    started = time.time()

    sweep = make_benchmark(work, options.per_family)
    gg.sweep(sweep, work / "run", set={"samples": options.samples})
    oracles = known_to_oracles(work, sweep, options.samples)
    data = Arrays(gg.load(work / "run"), oracles)
    fit, test = data.split == "train", data.split == "test"
    print(f"{len(data.label_n)} samples of {len(np.unique(data.family))} families, {time.time() - started:.0f} s")

    # The width of intervals, from families that are left out of training in turn; then one network for the test.
    told_out, blind_out, _ = left_out(data, fit, 3, epochs, seed)
    widths = [width(data.label_n[fit], p[fit]) for p in (told_out, blind_out)]
    network = train(data, fit, epochs, seed)
    told, blind = told_test, blind_test = predict(network, data, test)
    found = {"test": figures(data, test, told, blind)}
    label_n = data.label_n[test]
    found["test"]["within_90_with_mu"] = within(label_n, told, widths[0])
    found["test"]["within_90_without_mu"] = within(label_n, blind, widths[1])
    no_images = predict(train(data, fit, epochs, seed, sees=False), data, test)
    for k, name in enumerate(["with_mu", "without_mu"]):
        found["test"][f"no_images_{name}_n"] = rmse(no_images[k] - label_n)
        found["test"][f"linear_{name}_n"] = rmse(straight(data, fit, test, k == 0) - label_n)
    for family in np.unique(data.family[test]):
        own = data.family == family
        found[family] = figures(data, own, told[own[test]], blind[own[test]])
        found[family]["within_90_with_mu"] = within(data.label_n[own], told[own[test]], widths[0])
        found[family]["within_90_without_mu"] = within(data.label_n[own], blind[own[test]], widths[1])
    if options.rotate:
        every = np.ones(len(data.label_n), bool)
        told, blind, group = left_out(data, every, 4, epochs, seed)
        found["rotated"] = figures(data, every, told, blind)
        for name, p in (("with_mu", told), ("without_mu", blind)):
            inside = []
            for k in range(4):
                rest, own = group != k, group == k
                inside.append(within(data.label_n[own], p[own], width(data.label_n[rest], p[rest])))
            found["rotated"][f"within_90_{name}_by_group"] = inside
    (work / "figures.json").write_text(json.dumps(found, indent=2))
    network.save(work / "held.npz", widths)
    again = predict(Held.load(work / "held.npz")[0], data, test)
    if not all(np.allclose(a, b, rtol=1e-3) for a, b in zip(again, (told_test, blind_test))):
        raise SystemExit("what was saved predicts otherwise than what was trained")
    (work / "card.md").write_text(card(data, found, (work / "held.npz").stat().st_size))
    print(json.dumps(found, indent=2))
    print(f"{time.time() - started:.0f} s in all; weights, card and figures are in {work}")


def card(data: Arrays, found: dict[str, dict[str, float]], size: int) -> str:
    """What the weights are, what they were made from, and where they end."""
    split = {name: ", ".join(np.unique(data.family[data.split == name])) for name in ("train", "test")}
    f = found["test"]
    return f"""# held.npz, {size / 1e3:.0f} kB

Predicts the pull force at slip from two tactile images (80 x 60, averaged), the grip force of a jaw and, where it is known, mu of the part.

- Data: `gripgen init --benchmark`, swept with the reduced mechanics, gripgen {gg.__version__}; {int((data.split == "train").sum())} samples to learn
  from, {f["n"]} to test on. All labels are simulated.
- Split: {split["train"]} to learn from; {split["test"]} to test on. Shapes that are the same were left out before.
- Error on the test: {f["network_with_mu_n"]:.3f} N with mu ({f["ratio_with_mu"]:.2f} of the oracle), {f["network_without_mu_n"]:.3f} N without
  ({f["ratio_without_mu"]:.2f}). The 90 % interval holds {100 * f["within_90_with_mu"]:.0f} % and {100 * f["within_90_without_mu"]:.0f} %.
- Limits: the shipped sensor and gel, 5 to 30 N, friction of one law with mu about {np.exp(np.log(data.mu).mean()):.2f}; no dust, wear or off-centre moment; families of the benchmark.
  Not for a real gripper without measured pulls.
"""


if __name__ == "__main__":
    main()
