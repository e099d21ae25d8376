"""Tables and the figure of loop.py, from errors in newtons by world and predictor."""

from html import escape

import numpy as np

from research.transfer.scores import interval

BEFORE, AFTER = "no correction", "loop"
FOUR = (BEFORE, "wide", "no correction, tuned", "a F_G")
WORDS = {
    "no correction": "no correction",
    "wide": "wide randomisation",
    "no correction, tuned": "fine-tuning",
    "a F_G": "a F_G",
    "loop": "the loop",
    "corrected": "corrected twin",
    "corrected, best": "corrected twin, fine-tuned",
    "wide, tuned": "wide randomisation, fine-tuned",
    "line on the pulls": "line on the 30 pulls",
    "a F_G per part, of all its other pulls": "a F_G per part (oracle)",
}
COLOURS = {"no correction": "#777777", "wide": "#c8a000", "no correction, tuned": "#2060c0", "a F_G": "#a040a0", "loop": "#d03020"}
WIDTH, HEIGHT, LEFT, TOP, BOTTOM = 860, 400, 60, 52, 300
Errors = list[dict[str, float]]


def by_world(errors: Errors, names: list[str], answers: list[str]) -> str:
    """RMSE of each predictor in each world."""
    lines = ["| world, what acts | diagnosis | mean label, N | " + " | ".join(WORDS.values()) + " |", "|---" * (len(WORDS) + 3) + "|"]
    for number, (found, name, answer) in enumerate(zip(errors, names, answers)):
        cells = [f"{found[k]:.2f}" for k in WORDS]
        lines.append(f"| {number}, {name} | {answer} | {found['mean label']:.2f} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def ratios(errors: Errors) -> str:
    """Each predictor over no correction, and the corrected twin over each."""
    def of(name: str) -> np.ndarray:
        """Errors of a predictor in all worlds."""
        return np.array([e[name] for e in errors])

    lines = ["| predictor | over no correction | worst world | the loop over it | the loop is better in |", "|---|---|---|---|---|"]
    for name, words in WORDS.items():
        mine, against = of(name) / of(BEFORE), of(AFTER) / of(name)
        first, second = (f"{m:.2f} ({a:.2f} to {b:.2f})" for m, a, b in (interval(mine), interval(against)))
        lines.append(f"| {words} | {first} | {mine.max():.2f} | {second} | {int((against < 1).sum())} of {len(errors)} |")
    return "\n".join(lines)


def wrong(firsts: Errors) -> str:
    """What a wrong diagnosis does, on the first half of the parts."""
    shown = {"no correction": "no correction", "no correction, tuned": "fine-tuning", "loop": "the loop", "wrong": "wrong twin",
             "wrong, best": "wrong twin, fine-tuned", "loop, wrong": "the loop with it"}
    lines = ["| world | " + " | ".join(f"{w}, N" for w in shown.values()) + " |", "|---" * (len(shown) + 1) + "|"]
    for number, found in enumerate(firsts):
        lines.append(f"| {number} | " + " | ".join(f"{found[k]:.2f}" for k in shown) + " |")
    means = [interval(np.array([f[k] / f[BEFORE] for f in firsts])) for k in shown]
    lines.append("| over no correction | " + " | ".join(f"{m:.2f} ({a:.2f} to {b:.2f})" for m, a, b in means) + " |")
    return "\n".join(lines)


def verdict(errors: Errors) -> str:
    """The target: better than each of the four in six worlds of eight, never above 1.05 of no correction."""
    wins = {name: sum(e[AFTER] < e[name] for e in errors) for name in FOUR}
    all_four = sum(all(e[AFTER] < e[name] for name in FOUR) for e in errors)
    worst = max(e[AFTER] / e[BEFORE] for e in errors)
    won = ", ".join(f"{WORDS[k]} {v}" for k, v in wins.items())
    return f"Better than all four at once in {all_four} of {len(errors)} worlds (alone: {won}). Worst world: {worst:.2f} of no correction."


def figure(errors: Errors, names: list[str]) -> str:
    """RMSE over that without correction, by world."""
    def x_of(world: float) -> float:
        """Middle of a world."""
        return LEFT + (world + 0.5) * (WIDTH - LEFT - 20) / len(errors)

    top = max(1.2, 1.05 * max(e[k] / e[BEFORE] for e in errors for k in COLOURS))

    def y_of(ratio: float) -> float:
        """Height of a ratio."""
        return BOTTOM - ratio / top * (BOTTOM - TOP)

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="12">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>']
    for tick in np.arange(0, top, 0.2 if top < 2.5 else 0.5):
        out.append(f'<line x1="{LEFT}" x2="{WIDTH - 20}" y1="{y_of(tick):.1f}" y2="{y_of(tick):.1f}" stroke="{"#555" if tick == 1 else "#ddd"}"/>')
        out.append(f'<text x="{LEFT - 8}" y="{y_of(tick) + 4:.1f}" text-anchor="end">{tick:.1f}</text>')
    middle = (TOP + BOTTOM) / 2
    out.append(f'<text x="16" y="{middle}" transform="rotate(-90 16 {middle})" text-anchor="middle">RMSE over no correction (N/N)</text>')
    for k, (name, colour) in enumerate(COLOURS.items()):
        left = LEFT + k * 158
        out.append(f'<circle cx="{left}" cy="24" r="5" fill="{colour}"/><text x="{left + 9}" y="28">{WORDS[name]}</text>')
        for world, found in enumerate(errors):
            at = f'cx="{x_of(world) + 9 * (k - 2):.1f}" cy="{y_of(found[name] / found[BEFORE]):.1f}"'
            out.append(f'<circle {at} r="5" fill="{colour}"><title>{WORDS[name]}: {found[name]:.2f} N</title></circle>')
    for world, (name, found) in enumerate(zip(names, errors)):
        lines = [f"world {world}", *words_of(name), f"{found[BEFORE]:.2f} N"]
        for row, line in enumerate(lines):
            out.append(f'<text x="{x_of(world):.1f}" y="{BOTTOM + 20 + 15 * row}" text-anchor="middle" font-size="11">{escape(line)}</text>')
    out.append(f'<text x="{LEFT}" y="{HEIGHT - 6}" font-size="11" fill="#555">'
               "under each world: what acts, and the RMSE without correction, on parts that were not pulled</text>")
    return "\n".join([*out, "</svg>"]) + "\n"


def words_of(name: str) -> list[str]:
    """A name in lines of two words."""
    words = name.split()
    return [" ".join(words[i:i + 2]) for i in range(0, len(words), 2)]
