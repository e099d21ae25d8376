"""Truth against answer: one record of yes and no per campaign, then rates with intervals."""

import math

import numpy as np

# Parameters of an answer that mean the same as the truth's size: name of the effect, then
# which parameter names count and how the size is expressed.
COMPARABLE = {
    "grip_force_loss": (["loss_n"], lambda act: act["size"]),
    "jaw_tilt": (["tilt_deg"], lambda act: act["size"]),
    "sensor_bias": (["bias_n"], lambda act: act["size"]),
    "sensor_gain": (["gain"], lambda act: 1 + act["size"]),
    "controller_gain": (["gain"], lambda act: 1 + act["size"]),
    "contamination": (["drop"], lambda act: act["size"]),
    "temperature": (["k_per_k"], lambda act: act["size"]),
    "deadband": (["width_n", "deadband_n", "band_n"], lambda act: act["size"]),
    "sensor_lowpass": (["tau_s"], lambda act: act["size"]),
}
SETTLED = 1.9  # multiples of the detectable size from which naming is asked for


def judge(truth, answer):
    """Record for one campaign; keys that do not apply are absent."""
    acts, group = truth["acts"], truth["group"]
    names = [e["name"] for e in answer["effects"]]
    record = {"group": group, "kind": truth["kind"], "verdict": answer["verdict"], "named": names,
              "unknown": answer["unknown"], "failed": answer["verdict"] == "failed",
              "seconds": answer["seconds"], "truth": [a["name"] for a in acts],
              "multiple": min([a["multiple"] for a in acts], default=0.0)}
    library = [a for a in acts if a["library"]]
    outside = [a for a in acts if not a["library"]]
    record["extra"] = _extra(library, outside, answer)
    settled = record["multiple"] >= SETTLED
    if group == "A":
        record["null"] = answer["verdict"] == "none" and not names and not answer["unknown"]
    elif group == "B":
        act = library[0]
        top = answer["effects"][0] if answer["effects"] else None
        exact = top is not None and top["name"] == act["name"]
        near = top is not None and _same_class(act, top)
        if settled:
            record["top1"], record["top1_class"] = exact, near
            record["top1_tied"] = exact or (top is not None and top["name"] in act["always_tied"])
            record["in_set"] = _in_set(act, answer)
        else:
            record["small_named"] = exact or near
            record["small_wrong"] = bool(names or answer["unknown"]) and not near
    elif group == "C" and settled:
        hits = [a["name"] in names for a in library]
        record["both"], record["either"] = all(hits), any(hits)
        record["both_class"] = _matched(library, answer["effects"]) == len(library)
    elif group == "D" and settled:
        right = [u for u in answer["unknown"] if _covariate(u) in [_covariate(x) for x in outside[0]["accepted"]]]
        record["unknown_said"] = answer["verdict"] == "unknown"
        record["unknown_right"] = answer["verdict"] == "unknown" and answer["unknown"][:1] == right[:1] != []
        record["unknown_listed"] = bool(right)
        record["misattributed"] = any((e["weight"] or 0) >= 0.5 for e in answer["effects"])
    elif group in "TE":
        record["covered"] = any(_in_set(a, answer) for a in library)
        record["covered_or_silent"] = record["covered"] or answer["verdict"] in ("none", "insufficient")
        record["set_size"] = len({n for e in answer["effects"] for n in [e["name"], *e["rivals"]]})
    _errors(record, truth, answer)
    return record


def _errors(record, truth, answer):
    after, floor = answer["rmse_after_n"], truth["floor_rmse_n"]
    if after is None:
        return
    record["ratio"] = after / floor
    record["rmse_after_n"], record["floor_n"] = after, floor
    before = answer["rmse_before_n"]
    if before is not None:
        record["ratio_before"] = before / floor
    stated = answer["stated"] or {}
    if stated.get("rmse_n"):
        record["stated_ratio"] = stated["rmse_n"] / after
        if stated.get("low90") is not None and stated.get("high90") is not None:
            record["stated_covers"] = stated["low90"] <= after <= stated["high90"]
    hits = []
    for act in truth["acts"]:
        for entry in answer["effects"]:
            if entry["name"] == act["name"] and act["name"] in COMPARABLE:
                names, convert = COMPARABLE[act["name"]]
                for name in names:
                    value = entry["parameters"].get(name)
                    if value and value.get("low90") is not None:
                        hits.append(value["low90"] <= convert(act) <= value["high90"])
                        break
    if hits:
        record["parameter_hits"], record["parameter_asked"] = sum(hits), len(hits)


def _covariate(text):
    return "*".join(sorted(part.strip() for part in str(text).split("*")))


def _same_class(act, entry):
    return act["name"] == entry["name"] or act["name"] in entry["class"] or entry["name"] in act["class"]


def _in_set(act, answer):
    return any(act["name"] in [e["name"], *e["rivals"]] for e in answer["effects"])


def _matched(acts, entries):
    """How many acts find an entry of their own, exact names first, then by class."""
    left, count, open_acts = list(entries), 0, []
    for act in acts:
        exact = next((e for e in left if e["name"] == act["name"]), None)
        if exact is None:
            open_acts.append(act)
        else:
            left.remove(exact)
            count += 1
    for act in open_acts:
        near = next((e for e in left if _same_class(act, e)), None)
        if near is not None:
            left.remove(near)
            count += 1
    return count


def _extra(library, outside, answer):
    """Names beyond the truth: effects with no act of their class, covariates not accepted."""
    accepted = {_covariate(x) for a in outside for x in a["accepted"]}
    wrong = [u for u in answer["unknown"] if _covariate(u) not in accepted]
    return len(answer["effects"]) - _matched(library, answer["effects"]) + len(wrong)


def binomial_interval(hits, total, level=0.95):
    """Clopper-Pearson by bisection on the binomial tail."""
    if total == 0:
        return 0.0, 1.0
    alpha = (1 - level) / 2

    def tail(p, k):  # P(X >= k)
        return sum(math.comb(total, j) * p**j * (1 - p) ** (total - j) for j in range(k, total + 1))

    def solve(function):
        low, high = 0.0, 1.0
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if function(middle) < 0 else (low, middle)
        return (low + high) / 2

    low = 0.0 if hits == 0 else solve(lambda p: tail(p, hits) - alpha)
    high = 1.0 if hits == total else solve(lambda p: alpha - (1 - tail(p, hits + 1)))
    return low, high


# key of the record, what it is, target, larger is better
RATES = [
    ("top1", "one effect, >= 2x: right name first", 0.90, True),
    ("top1_class", "one effect, >= 2x: right class first", 0.95, True),
    ("in_set", "one effect, >= 2x: truth in the reported set", None, True),
    ("small_named", "one effect, 1x: right class", None, True),
    ("small_wrong", "one effect, 1x: wrong name", 0.05, False),
    ("null", "none: nothing found", 0.95, True),
    ("unknown_right", "outside: unknown, right covariate first", 0.80, True),
    ("unknown_listed", "outside: right covariate listed", None, True),
    ("misattributed", "outside: a library name with weight >= 0.5", 0.10, False),
    ("both", "two effects: both named", 0.70, True),
    ("both_class", "two effects: both by class", None, True),
    ("either", "two effects: at least one named", 0.95, True),
    ("covered", "tied and few data: truth in the reported set", 0.95, True),
    ("covered_or_silent", "tied and few data: in the set, or no claim", None, True),
    ("failed", "crash, timeout or unreadable", 0.0, False),
]


def summary(records):
    """Rates with exact 95 % intervals, and the numbers that are no rates."""
    out = {"cases": len(records), "rates": {}, "numbers": {}}
    for key, text, target, upward in RATES:
        values = [bool(r[key]) for r in records if key in r]
        if values:
            low, high = binomial_interval(sum(values), len(values))
            out["rates"][key] = {"text": text, "hits": sum(values), "of": len(values), "rate": sum(values) / len(values),
                                 "low95": low, "high95": high, "target": target, "upward": upward}
    big = [r for r in records if r["group"] in "ABCD"]
    numbers = out["numbers"]
    numbers["extra names a campaign"] = (_mean([r["extra"] for r in records if not r["failed"]]), "<= 0.25")
    numbers["after / floor, median"] = (_quantile([r.get("ratio") for r in big], 0.5), "<= 1.10")
    numbers["after / floor, 90 %"] = (_quantile([r.get("ratio") for r in big], 0.9), "<= 1.5")
    numbers["before / floor, median"] = (_quantile([r.get("ratio_before") for r in big], 0.5), "")
    numbers["stated / measured error, median"] = (_quantile([r.get("stated_ratio") for r in big], 0.5), "0.85..1.15")
    inside = [0.85 <= r["stated_ratio"] <= 1.15 for r in big if "stated_ratio" in r]
    numbers["stated / measured within 0.85..1.15"] = (_mean(inside), "")
    covers = [r["stated_covers"] for r in big if "stated_covers" in r]
    numbers["stated 90 % interval holds the measured error"] = (_mean(covers), "0.85..0.95")
    asked = sum(r.get("parameter_asked", 0) for r in records)
    hits = sum(r.get("parameter_hits", 0) for r in records)
    numbers["90 % intervals of parameters cover"] = (hits / asked if asked else None, "0.85..0.95")
    numbers["seconds, median"] = (_quantile([r["seconds"] for r in records], 0.5), "")
    numbers["seconds, largest"] = (_quantile([r["seconds"] for r in records], 1.0), "<= 60")
    return out


def _mean(values):
    return float(np.mean(values)) if len(values) else None


def _quantile(values, q):
    values = [v for v in values if v is not None]
    return float(np.quantile(values, q)) if values else None
