"""Train a network that predicts from two tactile images how much pull force a grip will hold.

    pip install '.[train]'
    python examples/train_grip_metric.py --work runs/grip-metric

makes its data with sweeps, trains small networks (images at an eighth of their resolution, so that a laptop's processor is enough)
and prints three tables: against trivial predictors on grips and parts that were held out; on a twin with an effect that
the training data lack, before and after the diagnosis; and synthetic against measured and hybrid training data. The
"measured" data come from a twin with that hidden effect. `docs/training.md`
has the figures of one run.
"""

import argparse
import copy
import json
import subprocess
import sys
import time
from pathlib import Path

import gripgen as gg
import numpy as np
import torch
from torch import nn

SHRINK = 8  # images are averaged over squares of so many pixels
PARTS = ["ball_bearing", "long_shaft", "gear", "roller_bearing"]
# What the rig does and the training twin does not know: an off-centre grip holds less.
HIDDEN = [{"name": "off_centre", "inverse_lever_per_mm": 0.2}]


def vary(seed: int) -> dict[str, object]:
    """Keys of a sweep: grips of all parts, anywhere on them, with forces from 20 to 80 N."""
    return {
        "design": "random",
        "seed": seed,
        "mechanics": "reduced",
        "trace": "none",
        "vary.part": PARTS,
        "vary.grip_pose": [0, 1],
        "vary.grip_force_n": {"uniform": [20, 80]},
        "vary.grip_angle_deg": {"uniform": [0, 180]},
        "vary.grip_offset_mm": {"uniform": [-6, 6]},
    }


def data(work: Path, name: str, twin: str, samples: int, seed: int, **more: object) -> gg.Dataset:
    """A sweep on a twin; one that is there is continued, or used as it is."""
    keys = vary(seed) | {"twin": twin, "samples": samples} | more
    gg.sweep("asset:configs/quickstart.toml", work / name, set=keys)
    return gg.load(work / name)


def images_of(dataset: gg.Dataset) -> torch.Tensor:
    """All images of a dataset, shrunk: uint8[N, 6, H / SHRINK, W / SHRINK]."""
    found = []
    for first in range(0, len(dataset), 64):
        pixels, _ = dataset.batch(range(first, min(first + 64, len(dataset))), threads=2)
        x = torch.from_numpy(pixels).permute(0, 1, 4, 2, 3).flatten(1, 2).float()
        found.append(nn.functional.avg_pool2d(x, SHRINK).round().to(torch.uint8))
    return torch.cat(found)


class Arrays:
    """A dataset in memory."""

    def __init__(self, dataset: gg.Dataset) -> None:
        self.images = images_of(dataset)
        self.labels = torch.from_numpy(dataset.labels)
        self.part = dataset.column("part")
        self.force_n = dataset.column("grip_force_n")
        # A pose is a grip of the part and its angle about the jaw axis, in sectors of 30 degrees.
        where = zip(self.part, dataset.column("grip_pose"), dataset.column("grip_angle_deg") // 30)
        self.pose = np.array([f"{part}/{grip:.0f}/{sector:.0f}" for part, grip, sector in where])

    def where(self, keep: np.ndarray) -> "Arrays":
        """The rows for which `keep` is true."""
        found = object.__new__(Arrays)
        at = torch.from_numpy(np.flatnonzero(keep))
        found.images, found.labels = self.images[at], self.labels[at]
        found.part, found.force_n, found.pose = self.part[keep], self.force_n[keep], self.pose[keep]
        return found


class GripMetric(nn.Module):
    """Both images to mean and log variance of ln F_max; the same layers see either jaw.

    With `told` the network is also given the grip force that the gripper was told, and learns ln(F_max / F_G): a force that is twice as
    large holds about twice as much, and that need not be learnt from images.
    """

    def __init__(self, told: bool = True) -> None:
        super().__init__()
        self.told = told

        def block(wide: int, out: int) -> nn.Sequential:
            return nn.Sequential(nn.Conv2d(wide, out, 3, 2, 1), nn.BatchNorm2d(out), nn.ReLU())

        # Where the imprint lies matters as much as what it looks like: two channels tell each pixel its place.
        self.jaw = nn.Sequential(block(5, 24), block(24, 48), block(48, 64), block(64, 64))
        self.head = nn.Sequential(nn.Linear(257, 128), nn.ReLU(), nn.Linear(128, 2))
        self.register_buffer("rest", torch.zeros(1))
        self.register_buffer("centre", torch.zeros(1))

    def one(self, x: torch.Tensor) -> torch.Tensor:
        """Features of one jaw: mean and maximum over the image."""
        n, _, h, w = x.shape
        rows = torch.linspace(-1, 1, h).view(1, 1, h, 1).expand(n, 1, h, w)
        columns = torch.linspace(-1, 1, w).view(1, 1, 1, w).expand(n, 1, h, w)
        y = self.jaw(torch.cat([x, rows, columns], 1)).flatten(2)
        return torch.cat([y.mean(2), y.amax(2)], 1)

    def forward(self, images: torch.Tensor, force_n: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """uint8[B, 6, h, w] and grip forces [B] to mean and log variance of ln F_max, each [B]."""
        x = (images.float() - self.rest) / 32.0
        ln_force = (force_n / 40.0).log() if self.told else torch.zeros(len(x))
        both = torch.cat([self.one(x[:, :3]), self.one(x[:, 3:]), ln_force[:, None]], 1)
        mean, log_variance = self.head(both).unbind(1)
        return self.centre + ln_force + mean, log_variance.clamp(-9.0, 3.0)


def train(
    arrays: Arrays,
    epochs: int,
    seed: int,
    start: GripMetric | None = None,
    rate: float = 2e-3,
    told: bool = True,
) -> GripMetric:
    """Gaussian negative log likelihood of ln F_max; `start` is a network to go on from."""
    torch.manual_seed(seed)
    model = GripMetric(told)
    force_n = torch.from_numpy(arrays.force_n).float()
    target = arrays.labels.clamp_min(0.05).log()
    if start is not None:
        model = copy.deepcopy(start)
    else:
        # What all images have in common: the rest frame and the light.
        model.rest = arrays.images.float().mean(0, keepdim=True)
        model.centre = (target - (force_n / 40.0).log() if told else target).mean().reshape(1)
    steps = epochs * -(-len(target) // 64)
    optimiser = torch.optim.AdamW(model.parameters(), lr=rate, weight_decay=1e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, rate, total_steps=steps, pct_start=0.2)
    model.train()
    for _ in range(epochs):
        for ids in torch.randperm(len(target)).split(64):
            mean, log_variance = model(arrays.images[ids], force_n[ids])
            loss = 0.5 * ((target[ids] - mean) ** 2 * (-log_variance).exp() + log_variance).mean()
            optimiser.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(model.parameters(), 1.0)
            optimiser.step()
            schedule.step()
    return model


@torch.no_grad()
def predict(model: GripMetric, arrays: Arrays) -> tuple[np.ndarray, np.ndarray]:
    """Force in N and its standard deviation."""
    model.eval()
    forces = torch.from_numpy(arrays.force_n).float().split(256)
    found = [model(images, force_n) for images, force_n in zip(arrays.images.split(256), forces)]
    mean, log_variance = (torch.cat(x) for x in zip(*found))
    force_n = mean.exp()
    return force_n.numpy(), (force_n * (0.5 * log_variance).exp()).numpy()


def errors(model: GripMetric, test: Arrays) -> dict[str, float]:
    """RMSE, mean absolute error in percent, and how many labels lie within 1.645 standard deviations."""
    force_n, sd_n = predict(model, test)
    truth = test.labels.numpy()
    return scores(force_n, truth) | {"within_90_pct": 100 * float(np.mean(np.abs(force_n - truth) < 1.645 * sd_n))}


def scores(force_n: np.ndarray, truth_n: np.ndarray) -> dict[str, float]:
    """RMSE in N and mean absolute error in percent."""
    error = force_n - truth_n
    return {
        "rmse_n": float(np.sqrt(np.mean(error**2))),
        "mape_pct": 100 * float(np.mean(np.abs(error) / truth_n)),
    }


def trivial(fit: Arrays, test: Arrays) -> dict[str, dict[str, float]]:
    """Predictors that see no image but are told part and grip force; of an unknown part they know what all others do."""
    truth, y = test.labels.numpy(), fit.labels.numpy()

    def by_part(of: object) -> np.ndarray:
        found = np.empty(len(truth))
        for part in set(test.part):
            own = fit.part == part
            own = own if own.any() else np.ones(len(y), bool)
            at = test.part == part
            found[at] = of(fit.force_n[own], y[own], test.force_n[at])  # type: ignore[operator]
        return found

    return {
        "mean": scores(np.full(len(truth), y.mean()), truth),
        "mean of the part": scores(by_part(lambda _, own, x: np.full(len(x), own.mean())), truth),
        "linear in F_G, by part": scores(by_part(lambda f, own, x: np.polyval(np.polyfit(f, own, 1), x)), truth),
    }


def make_campaign(work: Path) -> None:
    """240 pulls without images on the rig with the hidden effect, off centre too."""
    [effect] = HIDDEN
    inline = ", ".join(f"{key} = {json.dumps(value)}" for key, value in effect.items())
    command = [sys.executable, "-m", "gripgen", "campaign", "--pulls", "240", "--offsets-mm=-6,-3,0,3,6", "--quiet"]
    command += ["--set", f"effects=[{{ {inline} }}]", "--out", str(work / "campaign.toml"), "--force"]
    subprocess.run([*command, "--simulate", str(work / "campaign")], check=True)


def show(title: str, rows: dict[str, dict[str, float]]) -> None:
    """Print a table as Markdown."""
    print(f"\n{title}\n\n| | RMSE, N | mean error, % | labels in the 90 % interval, % |\n|---|---|---|---|")
    for name, row in rows.items():
        within = f"{row['within_90_pct']:.0f}" if "within_90_pct" in row else ""
        print(f"| {name} | {row['rmse_n']:.2f} | {row['mape_pct']:.1f} | {within} |", flush=True)


def main() -> None:
    """All three tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, default=Path("runs/grip-metric"))
    parser.add_argument("--samples", type=int, default=6000)
    parser.add_argument("--measured-samples", type=int, default=300, help="grips that a rig makes in an afternoon")
    parser.add_argument("--epochs", type=int, default=25)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    work, seed, epochs = options.work, options.seed, options.epochs
    work.mkdir(parents=True, exist_ok=True)
    started, tables = time.time(), {}

    baseline = "asset:configs/twin-baseline.toml"

    made = time.time()
    plain = Arrays(data(work, "plain", baseline, options.samples, 1))
    real = Arrays(data(work, "hidden", baseline, options.samples, 2, effects=HIDDEN))
    made = time.time() - made
    poses = np.unique(real.pose)
    held_out_poses = np.random.default_rng(seed).permutation(poses)[: len(poses) // 5]
    splits = [
        (f"{len(held_out_poses)} of {len(poses)} poses held out", np.isin(real.pose, held_out_poses)),
        ("part roller_bearing held out", real.part == "roller_bearing"),
    ]
    rows = {}
    for name, held_out in splits:
        fit, test = real.where(~held_out), real.where(held_out)
        rows |= {f"{name}: {k}": v for k, v in trivial(fit, test).items()}
        rows[f"{name}: network, images alone"] = errors(train(fit, epochs, seed, told=False), test)
        rows[f"{name}: network"] = errors(train(fit, epochs, seed), test)
    tables["trivial"] = rows
    show("Against trivial predictors, which are told part and grip force", rows)

    # The rig's grips: half to learn from, as many as it makes in an afternoon, half to test on.
    held_out = np.arange(len(real.part)) % 2 == 1
    test = real.where(held_out)
    measured = real.where(~held_out & (np.cumsum(~held_out) <= options.measured_samples))

    # Of the plain data a sixth is kept for the test.
    kept = np.arange(len(plain.part)) % 6 == 5
    network_plain = train(plain.where(~kept), epochs, seed)
    if not (work / "campaign").exists():
        make_campaign(work)
    found = gg.diagnose(work / "campaign", out=work / "diagnosed.toml", report=work / "diagnosis.html", force=True)
    print(f"\ndiagnosis of 240 pulls without images: {found.verdict}, {', '.join(found.names)}")
    diagnosed = Arrays(data(work, "diagnosed", str((work / "diagnosed.toml").resolve()), options.samples, 3))
    network_diagnosed = train(diagnosed, epochs, seed)
    rows = {
        "trained without the effect, tested without it": errors(network_plain, plain.where(kept)),
        "trained without the effect, tested with it": errors(network_plain, test),
        "trained on the diagnosed twin, tested with it": errors(network_diagnosed, test),
    }
    tables["across twins"] = rows
    show("Across twins: an effect that the training data lack", rows)

    few = max(epochs, epochs * 1500 // len(measured.part))
    rows = {
        "synthetic only (twin without the effect)": errors(network_plain, test),
        f"measured only ({len(measured.part)} grips)": errors(train(measured, few, seed), test),
        "hybrid: synthetic, then measured": errors(train(measured, few // 2, seed, network_plain, 5e-4), test),
        "hybrid: diagnosed twin, then measured": errors(train(measured, few // 2, seed, network_diagnosed, 5e-4), test),
    }
    tables["outlook"] = rows
    show("Synthetic, measured and hybrid training data", rows)
    print(f"\n{time.time() - started:.0f} s, {made:.0f} of them for the first {2 * options.samples} samples")
    (work / "figures.json").write_text(json.dumps(tables, indent=2))


if __name__ == "__main__":
    main()
