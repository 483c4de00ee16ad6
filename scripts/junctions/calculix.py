"""Natural frequencies of a layout by CalculiX, elements CPS8.

CalculiX makes solids of plane elements: only where they are thin is that plane stress. A fiftieth of the narrowest width is
thin enough (as thick as wide, bending is some 3.5 % too stiff); frequencies in the plane do not depend on the thickness.
"""

import pathlib
import re
import subprocess

import layouts


def frequencies(layout, folder, count=8, across=6):
    """The lowest frequencies [Hz], from the files in `folder` if they are there."""
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    nodes, elements, held = layout.mesh(across)
    thin = min(width for _, _, width in layout.beams) / 50
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{k + 1}, {x:.10e}, {y:.10e}, 0." for k, (x, y) in enumerate(nodes)]
    lines.append("*ELEMENT, TYPE=CPS8, ELSET=ALL")
    lines += [", ".join(str(v) for v in (k + 1, *(e + 1))) for k, e in enumerate(elements)]
    lines.append("*NSET, NSET=HELD")
    lines += [str(k + 1) for k in held]
    lines += [
        "*BOUNDARY",
        "HELD, 1, 2",
        "*MATERIAL, NAME=M",
        "*ELASTIC",
        f"{layouts.E:g}, {layouts.POISSON}",
        "*DENSITY",
        # lengths are in µm: CalculiX takes elements with tiny volumes for inverted ones
        f"{layouts.DENSITY * 1e-12:g}",
        "*SOLID SECTION, ELSET=ALL, MATERIAL=M",
        f"{thin:.6e}",
        "*STEP",
        "*FREQUENCY",
        f"{count}",
        "*END STEP",
    ]
    text = "\n".join(lines) + "\n"
    deck, found = folder / "layout.inp", folder / "layout.dat"
    if not (found.exists() and deck.exists() and deck.read_text() == text and table(found)):
        deck.write_text(text)
        with open(folder / "layout.log", "w") as log:
            subprocess.run(["ccx", "-i", "layout"], cwd=folder, stdout=log, check=True)
    return table(found)[:count], len(nodes)


def table(path):
    """Frequencies in cycles per second from a .dat file."""
    found = []
    for line in path.read_text().splitlines():
        numbers = line.split()
        if len(numbers) == 5 and re.fullmatch(r"\d+", numbers[0]):
            found.append(float(numbers[3]))
        elif found:
            break
    return found
