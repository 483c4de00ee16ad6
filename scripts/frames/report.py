"""Tables and picture of a comparison on random frames."""

import math
import re
from collections import Counter

import numpy as np


def deflection(model, scene):
    """The linear deflection in lengths of a beam."""
    u = model.linear_release().reshape(-1, 3)[: len(scene.places)]
    return float(np.max(np.hypot(u[:, 0], u[:, 1]))) / model.scale


def quantiles(values):
    return [float(q) for q in np.quantile(values, [0.1, 0.5, 0.9, 1.0])] if len(values) else [math.nan] * 4


def reason(message):
    """The kind of a refusal: its message without numbers and names."""
    text = re.sub(r'"[^"]*"|`[^`]*`', "…", message.removeprefix("error:").strip())
    text = re.sub(r"[-+]?\d[\d.]*(e[-+]?\d+)?", "#", text)
    return re.sub(r"^no static equilibrium: the last stable equilibrium that was found bears # of the load( \([^)]*\))?: ", "", text)[:200]


def share(part, whole):
    return f"{100 * part / whole:.1f} %" if whole else "–"


def tables(rows, frames):
    lines = [f"{frames} frames, seeds from {min(r['seed'] for r in rows)} to {max(r['seed'] for r in rows)}.", ""]
    lines += [
        "| analysis | tol | runs | refused | not confirmed | reference too coarse | error / tol: 10 %, median, 90 %, largest | error ≤ tol | silent beyond 2 tol | estimate / error: 10 %, median, 90 % | within a factor 3 |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    groups = sorted({(r["analysis"], -r["tol"]) for r in rows})
    for analysis, minus in groups:
        of = [r for r in rows if r["analysis"] == analysis and r["tol"] == -minus]
        refused = sum("refused" in r for r in of)
        strange = sum(r.get("outcome") == "not confirmed" for r in of)
        coarse = sum(r.get("outcome") == "reference too coarse" for r in of)
        good = [r for r in of if "error" in r and "outcome" not in r]
        ratio = [r["error"] / r["tol"] for r in good]
        # below a thousandth of the tolerance both are rounding
        known = [r for r in good if r.get("estimate") is not None and r["error"] > 1e-3 * r["tol"]]
        estimate = [r["estimate"] / r["error"] for r in known]
        near = sum(1 / 3 <= e <= 3 for e in estimate)
        silent = sum(r["error"] > 2 * r["tol"] and not r["warned"] for r in good)
        met = sum(x <= 1 for x in ratio)
        r, e = quantiles(ratio), quantiles(estimate)
        lines.append(
            f"| {analysis} | {-minus:.0e} | {len(of)} | {refused} | {strange} | {coarse} | {r[0]:.2g}, {r[1]:.2g}, {r[2]:.2g}, {r[3]:.2g} | "
            f"{share(met, len(ratio))} | {silent} | {e[0]:.2g}, {e[1]:.2g}, {e[2]:.2g} | {share(near, len(estimate))} |"
        )
    statics = [r for r in rows if r["analysis"] == "static"]
    if statics:
        lost = {r["seed"] for r in statics if r.get("loss") is not None}
        on_path = [r for r in statics if "branch" in r]
        unstable = sum(r.get("stable") is False for r in statics)
        lines += [
            "",
            f"Of these frames {len(lost)} lose stability before the full load. Where the reference reaches the full load without a loss, "
            f"{sum(r['branch'] for r in on_path)} of {len(on_path)} states are on its branch. "
            f"{unstable} runs are not confirmed because the equilibrium of the reference next to the printed nodes is unstable: a beam between them has buckled, "
            "and nodes do not show which way.",
        ]
    why = Counter(reason(r["refused"]) for r in rows if "refused" in r)
    if why:
        lines += ["", "| refusals by reason (numbers and names left out) | runs |", "|---|---|"]
        lines += [f"| {text} | {count} |" for text, count in why.most_common()]
    return "\n".join(lines)


def picture(rows, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    kinds = sorted({r["analysis"] for r in rows})
    fig, axes = plt.subplots(2, 1, figsize=(9, 7), constrained_layout=True)
    for axis, value, label in ((axes[0], lambda r: r["error"] / r["tol"], "error / tolerance"), (axes[1], lambda r: r["estimate"] / r["error"], "estimate / error")):
        for kind in kinds:
            good = [r for r in rows if r["analysis"] == kind and "error" in r and "outcome" not in r and r["error"] > 1e-6 * r["tol"]]
            if axis is axes[1]:
                good = [r for r in good if r.get("estimate") and r["error"] > 1e-3 * r["tol"]]
            values = np.sort([max(value(r), 1e-9) for r in good])
            if len(values):
                axis.step(values, np.linspace(0, 1, len(values)), where="post", label=f"{kind} ({len(values)})")
        axis.set_xscale("log")
        axis.set_xlabel(label)
        axis.set_ylabel("fraction of runs")
        axis.grid(alpha=0.3)
        axis.legend(loc="upper left")
    axes[0].axvline(1, color="black", lw=0.8)
    axes[0].set_xlim(1e-5, 1e2)
    axes[1].axvspan(1 / 3, 3, color="black", alpha=0.08)
    axes[1].set_xlim(1e-2, 1e3)
    axes[0].set_title("Random planar frames against an independent solver")
    fig.savefig(path, dpi=110)
