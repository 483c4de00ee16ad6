"""Schematic symbols of the elements of circuits, for scripts/sketches: terminals with their names, signs, currents and the equation."""

import math

INK, NODE, SIGN, CURRENT, GUIDE = "#333333", "#b34700", "#245a9c", "#c00000", "#9db3cc"
WIDE = 416.0
"""Width of a schematic (pixels): at this width a picture of scripts/sketches has the scale 1."""
EQUATIONS = {
    "R": "v = R·i",
    "L": "v = L·di/dt",
    "C": "i = C·dv/dt",
    "Vsrc": "v = V",
    "Isrc": "i = I",
    "opamp": "v = 10⁶·(v(plus) − v(minus))",
    "vcvs": "v = A·(v(plus) − v(minus))",
    "short": "v = 0",
}
"""Equation of each symbol, by the first name of its block."""


def extent(model):
    """Corners of the schematic of an element (pixels, y upwards)."""
    high = {"opamp": 170.0, "vcvs": 150.0, "short": 140.0}.get(model, 90.0)
    return [(0.0, -high / 2), (WIDE, high / 2)]


def draw(picture, model, names, nodes):
    """Draws `model`, whose block has these element names and these names of nodes, in their order."""
    if model == "opamp":
        amplifier(picture, nodes)
    elif model == "vcvs":
        controlled_source(picture, nodes)
    elif model == "short":
        branch(picture, nodes, 45.0, [], names[0], "v = 0")
        wiper(picture, nodes, -35.0, names[1])
    else:
        branch(picture, nodes, 10.0, BODIES[model], "", EQUATIONS[model])


def line(picture, points, color=INK, width=1.6, dash=""):
    picture.path([picture.at(p) for p in points], color, width, dash=dash)


def label(picture, x, y, text, color=INK, anchor="middle", size=13):
    px, py = picture.at((x, y))
    picture.text(px, py + 5, text, color, anchor, size)


def arrow(picture, a, b, color, width=1.6):
    picture.arrow(picture.at(a), picture.at(b), color, width=width)


def circle(picture, x, y, radius, color=INK, width=1.6):
    px, py = picture.at((x, y))
    picture.shape(f'<circle cx="{px:.1f}" cy="{py:.1f}" r="{radius:.1f}" fill="#ffffff" stroke="{color}" stroke-width="{width}"/>')


def terminal(picture, x, y, name, anchor):
    """A node with its name beside it."""
    circle(picture, x, y, 4, NODE, 2)
    label(picture, x + (-10 if anchor == "end" else 10), y, name, NODE, anchor)


def voltage(picture, x, above, below, text):
    """The signs of a voltage between two heights, and its name between them."""
    label(picture, x, above, "+", SIGN, size=15)
    label(picture, x, below, "−", SIGN, size=15)
    label(picture, x, (above + below) / 2, text, SIGN)


def branch(picture, nodes, y, body, name, equation):
    """A branch from the first node to the second: its body, its current from left to right, its voltage below it."""
    left, right = 60.0, WIDE - 60.0
    half = 34.0 if body else 0.0
    for a, b in ((left, WIDE / 2 - half), (WIDE / 2 + half, right)):
        line(picture, [(a, y), (b, y)])
    for part in body:
        part(picture, WIDE / 2, y)
    arrow(picture, (92, y), (112, y), CURRENT, 2)
    label(picture, 102, y + 16, "i", CURRENT)
    label(picture, 132, y - 16, "+", SIGN, size=15)
    label(picture, WIDE - 132, y - 16, "−", SIGN, size=15)
    label(picture, WIDE / 2, y - 38, equation, SIGN)
    if name:
        label(picture, WIDE / 2, y + 18, name)
    terminal(picture, left, y, nodes[0], "end")
    terminal(picture, right, y, nodes[1], "start")


def resistor(picture, x, y):
    peaks = [(x - 34 + 68 * (k + 0.5) / 6, y + 10 * (-1) ** k) for k in range(6)]
    line(picture, [(x - 34, y)] + peaks + [(x + 34, y)])


def inductor(picture, x, y):
    turns = [(x - 34 + 17 * (k // 12) + 8.5 * (1 - math.cos(math.pi * (k % 12) / 12)), y + 12 * math.sin(math.pi * (k % 12) / 12)) for k in range(48)]
    line(picture, turns + [(x + 34, y)])


def plates(picture, x, y):
    for side in (-1, 1):
        line(picture, [(x + 34 * side, y), (x + 5 * side, y)])
        line(picture, [(x + 5 * side, y - 18), (x + 5 * side, y + 18)], width=2.6)


def source(picture, x, y):
    for side in (-1, 1):
        line(picture, [(x + 34 * side, y), (x + 22 * side, y)])
    circle(picture, x, y, 22)


def signs(picture, x, y):
    label(picture, x - 11, y, "+", size=15)
    label(picture, x + 11, y, "−", size=15)


def inner_arrow(picture, x, y):
    arrow(picture, (x - 14, y), (x + 14, y), CURRENT, 2)


BODIES = {"R": [resistor], "L": [inductor], "C": [plates], "Vsrc": [source, signs], "Isrc": [source, inner_arrow]}
"""What the branch of each element with two nodes is drawn of."""


def wiper(picture, nodes, y, name):
    """An open switch between the two nodes."""
    left, right = 60.0, WIDE - 60.0
    line(picture, [(left, y), (WIDE / 2 - 24, y), (WIDE / 2 + 18, y + 20)])
    line(picture, [(WIDE / 2 + 24, y), (right, y)])
    for x in (WIDE / 2 - 24, WIDE / 2 + 24):
        circle(picture, x, y, 3, INK, 1.4)
    label(picture, WIDE / 2, y - 18, f"{name}, always open")
    terminal(picture, left, y, nodes[0], "end")
    terminal(picture, right, y, nodes[1], "start")


def output(picture, right, above, below, out, reference, equation):
    terminal(picture, right, above, out, "start")
    terminal(picture, right, below, reference, "start")
    voltage(picture, right - 22, above - 16, below + 16, "v")
    label(picture, WIDE / 2, -92, equation, SIGN)


def amplifier(picture, nodes):
    minus, plus, out, reference = nodes
    line(picture, [(150, 62), (150, -46), (250, 8), (150, 62)])
    for y, sign, name in ((34, "−", minus), (-18, "+", plus)):
        line(picture, [(80, y), (150, y)])
        label(picture, 162, y, sign, size=15)
        terminal(picture, 80, y, name, "end")
    line(picture, [(250, 8), (310, 8)])
    line(picture, [(200, -19), (200, -66), (310, -66)])
    output(picture, 310, 8, -66, out, reference, EQUATIONS["opamp"])


def controlled_source(picture, nodes):
    plus, minus, out, reference = nodes
    for y, name in ((46, plus), (-46, minus)):
        line(picture, [(80, y), (140, y)])
        terminal(picture, 80, y, name, "end")
    label(picture, 130, 30, "+", SIGN, size=15)
    label(picture, 130, -30, "−", SIGN, size=15)
    line(picture, [(220, 46), (220, 26)])
    line(picture, [(220, -26), (220, -46)])
    line(picture, [(220, 26), (244, 0), (220, -26), (196, 0), (220, 26)])
    label(picture, 220, 11, "+", size=15)
    label(picture, 220, -11, "−", size=15)
    for y in (46, -46):
        line(picture, [(220, y), (310, y)])
    output(picture, 310, 46, -46, out, reference, EQUATIONS["vcvs"])
