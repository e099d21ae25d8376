"""Small networks in numpy: mean and spread of the logarithm of a label, with labels that are lower bounds."""

from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr

SMALL_N = 0.5  # labels are learnt as ln(label + SMALL_N)
HIDDEN, MEMBERS, EPOCHS, RATE, ROWS = 32, 3, 30, 4e-3, 128
DECAYS = ((0.03, 0.03), (0.3, 0.1), (3.0, 1.0))  # of the hidden layers and of the straight line: chosen by a held-out third of a training set


@dataclass
class Member:
    """What one network says of the pulls of a rig that it has not met: ln(label + SMALL_N) = mean + basis w + noise, w ~ N(0, spread^2)."""

    mean: np.ndarray
    sd: np.ndarray
    basis: np.ndarray  # [N, 2]
    spread: np.ndarray  # [2]

    def given(self, few: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and variance of all pulls, with the labels `y` of a few."""
        phi, weight = self.basis[few], 1 / self.sd[few] ** 2
        covariance = np.linalg.inv(np.diag(self.spread**-2) + (phi * weight[:, None]).T @ phi)
        w = covariance @ (phi.T @ (weight * (y - self.mean[few])))
        return self.mean + self.basis @ w, self.sd**2 + np.einsum("ni,ij,nj->n", self.basis, covariance, self.basis)


@dataclass
class Prediction:
    """Labels are log-normal about exp(mean), less SMALL_N, times a factor."""

    mean: np.ndarray
    sd: np.ndarray
    factor: float = 1.0
    members: tuple[Member, ...] = ()

    @staticmethod
    def of(members: tuple[Member, ...], few: np.ndarray, y: np.ndarray) -> "Prediction":
        """The mixture of the members, by its mean and spread."""
        means, variances = (np.stack(v) for v in zip(*(m.given(few, y) for m in members)))
        return Prediction(means.mean(0), np.sqrt(variances.mean(0) + means.var(0)), 1.0, members)

    def given(self, few: np.ndarray, label_n: np.ndarray) -> "Prediction":
        """With the labels of a few pulls: of a network that knows rigs the posterior of this rig, else one factor by least squares."""
        if not len(few):
            return self
        if self.members:
            return self.of(self.members, few, np.log(label_n + SMALL_N))
        expected_n = self.expected_n()[few]
        return Prediction(self.mean, self.sd, float((expected_n * label_n).sum() / max((expected_n**2).sum(), 1e-9)))

    def expected_n(self) -> np.ndarray:
        """Expected labels."""
        return self.factor * np.clip(np.exp(self.mean + np.minimum(self.sd, 1.0) ** 2 / 2) - SMALL_N, 0, None)

    def within(self, label_n: np.ndarray, level: float) -> np.ndarray:
        """Which labels lie in the central interval of that level."""
        z = {0.5: 0.6745, 0.9: 1.6449}[level]
        low, high = (self.factor * np.clip(np.exp(self.mean + s * z * self.sd) - SMALL_N, 0, None) for s in (-1, 1))
        return (label_n >= low - 1e-9) & (label_n <= high)


@dataclass
class Rows:
    """Rows to learn from. A row that is seen under several lights counts once."""

    x: np.ndarray
    label_n: np.ndarray
    censored: np.ndarray
    rig: np.ndarray  # numbers from 0; all alike where a set knows no rigs
    copies: int = 1

    def where(self, keep: np.ndarray) -> "Rows":
        """Some of them."""
        return Rows(self.x[keep], self.label_n[keep], self.censored[keep], self.rig[keep], self.copies)


class Network:
    """An ensemble; inputs are scaled by their own mean and deviation and cut at four deviations.

    Two numbers of a rig are learnt with the weights: w in mean + w_1 + w_2 q x, q a straight line in the inputs. Their spread over rigs is what a
    few pulls of a new rig are weighed against (a linear model on learnt features, as in Harrison, Sharma and Pavone 2018)."""

    def __init__(self, rows: Rows, seed: int, decays: tuple[float, float] = DECAYS[-1], epochs: int = EPOCHS, members: int = MEMBERS) -> None:
        self.middle, self.scale = rows.x.mean(0), rows.x.std(0) + 1e-6
        self.knows_rigs = len(np.unique(rows.rig)) > 1
        scaled = Rows(self.scaled(rows.x), np.log(rows.label_n + SMALL_N), rows.censored, rows.rig, rows.copies)
        self.members = [self.fitted(scaled, 100 * seed + k, decays, epochs, self.knows_rigs) for k in range(members)]

    def scaled(self, inputs: np.ndarray) -> np.ndarray:
        """Inputs of the order of 1."""
        return np.clip((inputs - self.middle) / self.scale, -4, 4)

    @staticmethod
    def fitted(rows: Rows, seed: int, decays: tuple[float, float], epochs: int, knows_rigs: bool) -> tuple[list[np.ndarray], np.ndarray]:
        """Likelihood; Adam with a rate that falls to zero and weight decay. Rigs by their posterior after each pass."""
        rng = np.random.default_rng(seed)
        x, y = rows.x, rows.label_n
        sizes = [x.shape[1], HIDDEN, HIDDEN, 2]
        p = [rng.normal(0, 1 / np.sqrt(a), (a, b)) for a, b in zip(sizes, sizes[1:])] + [np.zeros(b) for b in sizes[1:]]
        p.append(np.zeros((x.shape[1], 2)))
        p[2] *= 0.1
        p[5][:] = y.mean(), np.log(y.std())
        p.append(rng.normal(0, 1 / np.sqrt(x.shape[1]), x.shape[1]))
        first, second = [np.zeros_like(w) for w in p], [np.zeros_like(w) for w in p]
        decay = [decays[0]] * 3 + [0.0] * 3 + [decays[1]] * 2
        step, batches = 0, -(-len(x) // ROWS)
        spread, rigs = np.array([y.std() / 2, y.std() / 8]), np.zeros((rows.rig.max() + 1, 2))
        for _ in range(epochs):
            for ids in np.array_split(rng.permutation(len(x)), batches):
                step += 1
                rate = RATE * 0.5 * (1 + np.cos(np.pi * step / (epochs * batches)))
                for i, g in enumerate(Network.gradient(p, x[ids], y[ids], rows.censored[ids], rigs[rows.rig[ids]])):
                    first[i] = 0.9 * first[i] + 0.1 * g
                    second[i] = 0.999 * second[i] + 0.001 * g * g
                    change = first[i] / (1 - 0.9**step) / (np.sqrt(second[i] / (1 - 0.999**step)) + 1e-8)
                    p[i] = p[i] - rate * (change + decay[i] * p[i])
            if knows_rigs:
                rigs, spread = Network.of_rigs(p, rows, spread, len(rigs))
        return p, spread if knows_rigs else np.zeros(2)

    @staticmethod
    def of_rigs(p: list[np.ndarray], rows: Rows, spread: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Posterior means of the rigs from uncensored labels, and their spread (expectation maximisation)."""
        _, _, mean, raw = Network.layers(p, rows.x)
        weight = np.where(rows.censored, 0, np.exp(-2 * np.clip(raw, -4, 1))) / rows.copies
        phi = np.stack([np.ones(len(mean)), rows.x @ p[7]], 1)
        precision, pull = np.tile(np.diag(spread**-2), (count, 1, 1)), np.zeros((count, 2))
        np.add.at(precision, rows.rig, weight[:, None, None] * phi[:, :, None] * phi[:, None, :])
        np.add.at(pull, rows.rig, (weight * (rows.label_n - mean))[:, None] * phi)
        covariance = np.linalg.inv(precision)
        found = np.einsum("rij,rj->ri", covariance, pull)
        met = np.unique(rows.rig)
        # What all rigs have in common is none of theirs.
        common = found[met].mean(0)
        found -= common
        p[5][0] += common[0]
        p[6][:, 0] += common[1] * p[7]
        squares = found[met] ** 2 + np.diagonal(covariance[met], axis1=1, axis2=2)
        return found, np.maximum(np.sqrt(squares.mean(0)), 1e-3)

    @staticmethod
    def layers(p: list[np.ndarray], x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Hidden layers, mean and logarithm of the spread; a straight line passes them by."""
        a = np.tanh(x @ p[0] + p[3])
        b = np.tanh(a @ p[1] + p[4])
        out = b @ p[2] + p[5] + x @ p[6]
        return a, b, out[:, 0], out[:, 1]

    @staticmethod
    def gradient(p: list[np.ndarray], x: np.ndarray, y: np.ndarray, censored: np.ndarray, rig: np.ndarray) -> list[np.ndarray]:
        """Of the mean negative log likelihood."""
        a, b, mean, raw = Network.layers(p, x)
        log_sd = np.clip(raw, -4, 1)
        z = (y - mean - rig[:, 0] - rig[:, 1] * (x @ p[7])) / np.exp(log_sd)
        # A lower bound has the likelihood that the label lies above it.
        hazard = np.exp(-0.5 * z * z - 0.9189385 - log_ndtr(-z))
        d_mean = np.where(censored, -hazard, -z) / np.exp(log_sd)
        d_log = np.where(censored, -hazard * z, 1 - z * z) * (raw == log_sd)
        d = np.stack([d_mean, d_log], 1) / len(x)
        db = d @ p[2].T * (1 - b * b)
        da = db @ p[1].T * (1 - a * a)
        return [x.T @ da, a.T @ db, b.T @ d, da.sum(0), db.sum(0), d.sum(0), x.T @ d, x.T @ (d[:, 0] * rig[:, 1])]

    def __call__(self, inputs: np.ndarray) -> Prediction:
        """Of pulls of one rig that it has not met."""
        x, members = self.scaled(inputs), []
        for p, spread in self.members:
            _, _, mean, raw = self.layers(p, x)
            members.append(Member(mean, np.exp(np.clip(raw, -4, 1)), np.stack([np.ones(len(x)), x @ p[7]], 1), np.maximum(spread, 1e-9)))
        found = Prediction.of(tuple(members), np.zeros(0, int), np.zeros(0))
        return found if self.knows_rigs else Prediction(found.mean, found.sd)


def chosen(rows: Rows, held: np.ndarray, seed: int, epochs: int) -> tuple[float, float]:
    """The weight decay that predicts held-out rows best, by likelihood: of each rig one half, with the labels of the other."""
    tests = rows.where(held & ~rows.censored)

    def loss(decays: tuple[float, float]) -> float:
        network, found = Network(rows.where(~held), seed, decays, epochs, 1), []
        for rig in np.unique(tests.rig):
            own = tests.where(tests.rig == rig)
            half = np.arange(len(own.label_n) // 2)
            p, rest = network(own.x).given(half, own.label_n[half]), slice(len(half), None)
            z = (np.log(own.label_n[rest] / p.factor + SMALL_N) - p.mean[rest]) / p.sd[rest]
            found.append(0.5 * z * z + np.log(p.sd[rest]))
        return float(np.concatenate(found).mean())

    return min(DECAYS, key=loss)


class Ridge:
    """A straight line for small sets: ln(label + SMALL_N), each input of the order of 1."""

    def __init__(self, inputs: np.ndarray, label_n: np.ndarray, strength: float = 1.0) -> None:
        self.middle, self.scale = inputs.mean(0), inputs.std(0) + 1e-6
        x, y = (inputs - self.middle) / self.scale, np.log(label_n + SMALL_N)
        self.constant = y.mean()
        self.weights = np.linalg.solve(x.T @ x + strength * np.eye(x.shape[1]), x.T @ (y - self.constant))
        self.sd = (y - self.constant - x @ self.weights).std()

    def __call__(self, inputs: np.ndarray) -> Prediction:
        """As of a network."""
        mean = self.constant + np.clip((inputs - self.middle) / self.scale, -4, 4) @ self.weights
        return Prediction(mean, np.full(len(mean), self.sd))
