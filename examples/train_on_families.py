"""Train on parts of some families and predict what grips of other families hold, beside oracles.

    pip install '.[train]'
    python examples/train_on_families.py --work runs/families

writes the benchmark (`gripgen init --benchmark`), sweeps it, trains small networks on a processor and leaves weights, a card and
figures in the work folder. No part of the three families for tests, nor one of their shape, is seen in training.

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
import torch
from torch import nn
from train_grip_metric import images_of

MU, MU_SPREAD = 0.15, 0.2  # of twin.toml
LEVEL = 0.9
# Gauss-Hermite quadrature over ln mu (probabilists' weights).
NODES, WEIGHTS = np.polynomial.hermite_e.hermegauss(5)
NODES_MU, WEIGHTS = MU * np.exp(MU_SPREAD * NODES), WEIGHTS / WEIGHTS.sum()


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
    at_nodes = [labels(f"oracle-{i}", re.sub(r"(?m)^mu = .*$", f"mu = {mu}", quiet)) for i, mu in enumerate(NODES_MU)]
    return with_mu, np.average(at_nodes, axis=0, weights=WEIGHTS)


class Arrays:
    """A run in memory, with what its own configuration says of the parts."""

    def __init__(self, dataset: gg.Dataset, oracles: tuple[np.ndarray, np.ndarray]) -> None:
        parts = tomllib.loads(dataset.info["config_toml"])["twin"]["parts"]
        part = dataset.column("part")
        self.images = images_of(dataset)
        self.label_n = np.asarray(dataset.labels, dtype=np.float64)
        self.force_n = np.asarray(dataset.column("grip_force_n"), dtype=np.float64)
        self.mu = np.array([parts[p]["mu"] for p in part])
        self.family = np.array([parts[p]["family"] for p in part])
        self.split = np.array([parts[p]["split"] for p in part])
        self.oracle_n, self.blind_oracle_n = (np.asarray(o)[dataset.rows] for o in oracles)


class Held(nn.Module):
    """Both images, ln F_G and ln mu to ln(F_max / (2 mu F_G)): what the pressure of the contact takes off Coulomb's law.

    Where in the image the contact lies does not matter, so features are means and maxima over the image; the same layers see either jaw.
    """

    def __init__(self, sees: bool) -> None:
        super().__init__()
        self.sees = sees

        def block(wide: int, out: int, stride: int) -> nn.Sequential:
            return nn.Sequential(nn.Conv2d(wide, out, 3, stride, 1), nn.BatchNorm2d(out), nn.ReLU())

        self.jaw = nn.Sequential(block(3, 16, 1), block(16, 32, 2), block(32, 48, 2), block(48, 48, 1))
        self.head = nn.Sequential(nn.Linear(98, 64), nn.ReLU(), nn.Linear(64, 1))
        self.register_buffer("rest", torch.zeros(1))

    def look(self, images: torch.Tensor) -> torch.Tensor:
        """Features of both images."""
        x = (images.float() - self.rest) / 32.0
        if not self.sees:
            return torch.zeros(len(x), 96)
        left, right = (self.jaw(x[:, i : i + 3]).flatten(2) for i in (0, 3))
        return torch.cat([(left.mean(2) + right.mean(2)) / 2, (left.amax(2) + right.amax(2)) / 2], 1)

    def forward(self, features: torch.Tensor, force_n: torch.Tensor, mu: torch.Tensor) -> torch.Tensor:
        """ln(F_max / (2 mu F_G))."""
        told = torch.stack([(force_n / 15.0).log(), (mu / MU).log() / MU_SPREAD], 1)
        return self.head(torch.cat([features, told], 1))[:, 0]


def train(data: Arrays, keep: np.ndarray, epochs: int, seed: int, sees: bool = True) -> Held:
    """Squared error of the logarithm, on the rows in `keep`."""
    torch.manual_seed(seed)
    model = Held(sees)
    at = torch.from_numpy(np.flatnonzero(keep))
    images = data.images[at]
    force_n, mu = (torch.from_numpy(x[keep]).float() for x in (data.force_n, data.mu))
    target = torch.from_numpy(np.log(data.label_n[keep].clip(0.05) / (2 * data.mu[keep] * data.force_n[keep]))).float()
    model.rest = images.float().mean(0, keepdim=True)
    steps = epochs * -(-len(at) // 64)
    optimiser = torch.optim.AdamW(model.parameters(), lr=3e-3, weight_decay=1e-2)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 3e-3, total_steps=steps, pct_start=0.2)
    model.train()
    for _ in range(epochs):
        for ids in torch.randperm(len(at)).split(64):
            found = model(model.look(images[ids]), force_n[ids], mu[ids])
            loss = ((found - target[ids]) ** 2).mean()
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()
    return model.eval()


@torch.no_grad()
def predict(model: Held, data: Arrays, keep: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Labels with mu told, and without it: averaged over how mu is spread."""
    at = torch.from_numpy(np.flatnonzero(keep))
    features = torch.cat([model.look(part) for part in data.images[at].split(256)])
    force_n = torch.from_numpy(data.force_n[keep]).float()

    def at_mu(mu: np.ndarray) -> np.ndarray:
        ln = model(features, force_n, torch.from_numpy(mu).float()).numpy()
        return 2 * mu * data.force_n[keep] * np.exp(ln)

    blind = [at_mu(np.full(len(at), mu)) for mu in NODES_MU]
    return at_mu(data.mu[keep]), np.average(blind, axis=0, weights=WEIGHTS)


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
    parser.add_argument("--epochs", type=int, default=20)
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
    told, blind = predict(network, data, test)
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
    torch.save({"weights": network.state_dict(), "half_width_ln": widths}, work / "held.pt")
    (work / "card.md").write_text(card(data, found, (work / "held.pt").stat().st_size))
    print(json.dumps(found, indent=2))
    print(f"{time.time() - started:.0f} s in all; weights, card and figures are in {work}")


def card(data: Arrays, found: dict[str, dict[str, float]], size: int) -> str:
    """What the weights are, what they were made from, and where they end."""
    split = {name: ", ".join(np.unique(data.family[data.split == name])) for name in ("train", "test")}
    f = found["test"]
    return f"""# held.pt, {size / 1e3:.0f} kB

Predicts the pull force at slip from two tactile images (40 x 30, averaged), the grip force of a jaw and, where it is known, mu of the part.

- Data: `gripgen init --benchmark`, swept with the reduced mechanics, gripgen {gg.__version__}; {int((data.split == "train").sum())} samples to learn
  from, {f["n"]} to test on. All labels are simulated.
- Split: {split["train"]} to learn from; {split["test"]} to test on. Shapes that are the same were left out before.
- Error on the test: {f["network_with_mu_n"]:.3f} N with mu ({f["ratio_with_mu"]:.2f} of the oracle), {f["network_without_mu_n"]:.3f} N without
  ({f["ratio_without_mu"]:.2f}). The 90 % interval holds {100 * f["within_90_with_mu"]:.0f} % and {100 * f["within_90_without_mu"]:.0f} %.
- Limits: the shipped sensor and gel, 5 to 30 N, friction of one law with mu about {MU}; no dust, wear or off-centre moment; families of the benchmark.
  Not for a real gripper without measured pulls.
"""


if __name__ == "__main__":
    main()
