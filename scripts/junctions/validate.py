"""Compares Bimorph with plane stress on six layouts, and writes netlists, reference numbers and the documented table.

Run it by `scripts/junctions/validate`.
"""

import json
import pathlib
import subprocess
import sys

import calculix
import layouts

ROOT = pathlib.Path(__file__).parents[2]
NETLISTS = ROOT / "tests/netlists/junctions"
NUMBERS = ROOT / "tests/physics/junctions/plane_stress.rs"
DOCUMENT = ROOT / "docs/explanation/junctions.md"
# options of each column; what a bound is asked of is the default, and rotary inertia where the command says that it is missing
KINDS = {
    "centreline": ["--junctions", "centreline"],
    "offset": ["--junctions", "offset"],
    "calibrated": [],
    "with rotary inertia": ["--rotary-inertia"],
}
WIDE = ["paddle"]
MODES = 7
BEGIN, END = "<!-- figures: begin -->\n", "<!-- figures: end -->\n"
FIRST, ALL = 2.0, 4.0


def bimorph(netlist, kind):
    """Frequencies of the model [Hz], finely divided."""
    words = ["modes", netlist, "--count", str(MODES), "--band", "5M", "--tol", "1e-4", "--undamped", *KINDS[kind]]
    found = subprocess.run([ROOT / "target/release/bimorph", *words, "--json"], capture_output=True, check=True, text=True)
    return json.loads(found.stdout)["frequencies_hz"]


def main():
    across = int(sys.argv[1]) if len(sys.argv) > 1 else 6
    NETLISTS.mkdir(parents=True, exist_ok=True)
    NUMBERS.parent.mkdir(parents=True, exist_ok=True)
    rows, constants, good = [], [], True
    for name, draw in layouts.ALL.items():
        layout = draw()
        netlist = NETLISTS / f"{name}.net"
        netlist.write_text(layout.netlist())
        folder = ROOT / "target/junctions" / f"{name}_{across}"
        reference, nodes = calculix.frequencies(layout, folder, across=across)
        reference = reference[:MODES]
        constants.append(f'    ("{name}", [{", ".join(f"{f:.1f}" for f in reference)}]),\n')
        cells = []
        for kind in KINDS:
            errors = [100 * (f / r - 1) for f, r in zip(bimorph(netlist, kind), reference)]
            worst = max(errors, key=abs)
            cells.append(f"{errors[0]:+.2f} / {worst:+.2f}")
            print(f"{name:15} {kind:19} " + " ".join(f"{e:+6.2f}" for e in errors))
            if kind == ("with rotary inertia" if name in WIDE else "calibrated") and (abs(errors[0]) > FIRST or abs(worst) > ALL):
                good = False
        rows.append(f"| [{name}](../tests/netlists/junctions/{name}.net) | {nodes} | {reference[0]/1e3:.2f} | {' | '.join(cells)} |\n")
    NUMBERS.write_text(
        "//! Frequencies of the six layouts in plane stress. Written by `scripts/junctions/validate`: do not edit.\n\n"
        f"/// Netlist and frequencies 1–7 [Hz]: CalculiX 2.20, CPS8, thin, {across} elements across the narrowest beam.\n"
        f"#[rustfmt::skip]\npub(super) const LAYOUTS: [(&str, [f64; {MODES}]); {len(constants)}] = [\n{''.join(constants)}];\n"
    )
    table = (
        "| layout | nodes | mode 1 [kHz] | centreline | offset | calibrated | and `--rotary-inertia` |\n|---|---|---|---|---|---|---|\n" + "".join(rows)
    )
    if DOCUMENT.exists():
        before, rest = DOCUMENT.read_text().split(BEGIN)
        DOCUMENT.write_text(before + BEGIN + table + END + rest.split(END)[1])
    print(table)
    if not good:
        sys.exit(f"mode 1 must be within {FIRST} %, modes 1 to {MODES} within {ALL} %")


if __name__ == "__main__":
    main()
