"""Small networks in numpy: mean and spread of the logarithm of a label, with labels that are lower bounds."""

from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr

SMALL_N = 0.5  # labels are learnt as ln(label + SMALL_N)
HIDDEN, MEMBERS, EPOCHS, RATE, ROWS = 32, 3, 30, 4e-3, 128
DECAYS = ((0.03, 0.03), (0.3, 0.1), (3.0, 1.0))  # of the hidden layers and of the straight line: chosen by a held-out third of a training set


@dataclass
class Prediction:
    """Labels are log-normal about exp(mean), less SMALL_N."""

    mean: np.ndarray
    sd: np.ndarray

    def expected_n(self) -> np.ndarray:
        """Expected labels."""
        return np.clip(np.exp(self.mean + np.minimum(self.sd, 1.0) ** 2 / 2) - SMALL_N, 0, None)

    def within(self, label_n: np.ndarray, level: float, factor: float = 1.0) -> np.ndarray:
        """Which labels lie in the central interval of that level, when predictions are multiplied by a factor."""
        z = {0.5: 0.6745, 0.9: 1.6449}[level]
        low, high = (factor * np.clip(np.exp(self.mean + s * z * self.sd) - SMALL_N, 0, None) for s in (-1, 1))
        return (label_n >= low - 1e-9) & (label_n <= high)


class Network:
    """An ensemble; inputs are scaled by their own mean and deviation and cut at four deviations."""

    def __init__(self, inputs: np.ndarray, label_n: np.ndarray, censored: np.ndarray, seed: int,
                 decays: tuple[float, float] = DECAYS[-1], epochs: int = EPOCHS, members: int = MEMBERS) -> None:
        self.middle, self.scale = inputs.mean(0), inputs.std(0) + 1e-6
        x, y = self.scaled(inputs), np.log(label_n + SMALL_N)
        self.members = [self.fitted(x, y, censored, 100 * seed + k, decays, epochs) for k in range(members)]

    def scaled(self, inputs: np.ndarray) -> np.ndarray:
        """Inputs of the order of 1."""
        return np.clip((inputs - self.middle) / self.scale, -4, 4)

    @staticmethod
    def fitted(x: np.ndarray, y: np.ndarray, censored: np.ndarray, seed: int, decays: tuple[float, float],
               epochs: int) -> list[np.ndarray]:
        """Likelihood; Adam with a rate that falls to zero and weight decay."""
        rng = np.random.default_rng(seed)
        sizes = [x.shape[1], HIDDEN, HIDDEN, 2]
        p = [rng.normal(0, 1 / np.sqrt(a), (a, b)) for a, b in zip(sizes, sizes[1:])] + [np.zeros(b) for b in sizes[1:]]
        p.append(np.zeros((x.shape[1], 2)))
        p[2] *= 0.1
        p[5][:] = y.mean(), np.log(y.std())
        first, second = [np.zeros_like(w) for w in p], [np.zeros_like(w) for w in p]
        decay = [decays[0]] * 3 + [0.0] * 3 + [decays[1]]
        step, batches = 0, -(-len(x) // ROWS)
        for _ in range(epochs):
            for ids in np.array_split(rng.permutation(len(x)), batches):
                step += 1
                rate = RATE * 0.5 * (1 + np.cos(np.pi * step / (epochs * batches)))
                for i, g in enumerate(Network.gradient(p, x[ids], y[ids], censored[ids])):
                    first[i] = 0.9 * first[i] + 0.1 * g
                    second[i] = 0.999 * second[i] + 0.001 * g * g
                    change = first[i] / (1 - 0.9**step) / (np.sqrt(second[i] / (1 - 0.999**step)) + 1e-8)
                    p[i] = p[i] - rate * (change + decay[i] * p[i])
        return p

    @staticmethod
    def layers(p: list[np.ndarray], x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Hidden layers, mean and logarithm of the spread; a straight line passes them by."""
        a = np.tanh(x @ p[0] + p[3])
        b = np.tanh(a @ p[1] + p[4])
        out = b @ p[2] + p[5] + x @ p[6]
        return a, b, out[:, 0], out[:, 1]

    @staticmethod
    def gradient(p: list[np.ndarray], x: np.ndarray, y: np.ndarray, censored: np.ndarray) -> list[np.ndarray]:
        """Of the mean negative log likelihood."""
        a, b, mean, raw = Network.layers(p, x)
        log_sd = np.clip(raw, -4, 1)
        z = (y - mean) / np.exp(log_sd)
        # A lower bound has the likelihood that the label lies above it.
        hazard = np.exp(-0.5 * z * z - 0.9189385 - log_ndtr(-z))
        d_mean = np.where(censored, -hazard, -z) / np.exp(log_sd)
        d_log = np.where(censored, -hazard * z, 1 - z * z) * (raw == log_sd)
        d = np.stack([d_mean, d_log], 1) / len(x)
        db = d @ p[2].T * (1 - b * b)
        da = db @ p[1].T * (1 - a * a)
        return [x.T @ da, a.T @ db, b.T @ d, da.sum(0), db.sum(0), d.sum(0), x.T @ d]

    def __call__(self, inputs: np.ndarray) -> Prediction:
        """The mixture of the members, by its mean and spread."""
        found = [self.layers(p, self.scaled(inputs))[2:] for p in self.members]
        means, sds = np.stack([f[0] for f in found]), np.exp(np.clip(np.stack([f[1] for f in found]), -4, 1))
        return Prediction(means.mean(0), np.sqrt((sds**2).mean(0) + means.var(0)))


def chosen(inputs: np.ndarray, label_n: np.ndarray, censored: np.ndarray, held: np.ndarray, seed: int, epochs: int) -> tuple[float, float]:
    """The weight decay that predicts the held-out rows best, by likelihood."""
    def loss(decays: tuple[float, float]) -> float:
        p = Network(inputs[~held], label_n[~held], censored[~held], seed, decays, epochs, 1)(inputs[held & ~censored])
        z = (np.log(label_n[held & ~censored] + SMALL_N) - p.mean) / p.sd
        return float((0.5 * z * z + np.log(p.sd)).mean())

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
