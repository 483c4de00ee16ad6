//! Outlines of wires and flashes.
//!
//! A circle of diameter d becomes a regular polygon of [`SIDES`] sides and the same area, so that mass is kept; its corners lie
//! 0.04 % of d outside the circle. Round ends and corners of wires are arcs of it. Wires of GDSII have sharp (mitred) corners up to a
//! turn of 120°, cut off beyond; where a wire is bent more sharply than its width allows, it comes as one piece a stretch.

use std::f64::consts::PI;

/// Sides of a circle.
pub(crate) const SIDES: usize = 64;

/// How a wire ends and turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Style {
    /// Square ends, drawn out by these lengths before the first and behind the last point; mitred corners.
    Square([f64; 2]),
    /// Round ends with mitred corners (GDSII path type 1).
    RoundEnds,
    /// Round ends and round corners (CIF).
    Round,
}

/// A circle: same area, first corner on the x axis' positive side.
pub(crate) fn circle(centre: [f64; 2], diameter: f64) -> Vec<[f64; 2]> {
    let r = diameter / 2.0 * swelling();
    let corner = |k: usize| {
        let angle = PI * (2 * k + 1) as f64 / SIDES as f64;
        [centre[0] + r * angle.cos(), centre[1] + r * angle.sin()]
    };
    (0..SIDES).map(corner).collect()
}

/// Radius of the corners of a regular polygon with the area of the unit circle.
fn swelling() -> f64 {
    let n = SIDES as f64;
    (2.0 * PI / (n * (2.0 * PI / n).sin())).sqrt()
}

/// Contours that together are a wire of this width along these points, each counter-clockwise.
/// Points that repeat are passed over; a single one gives a square or a circle.
pub(crate) fn wire(points: &[[f64; 2]], width: f64, style: Style) -> Vec<Vec<[f64; 2]>> {
    let mut path: Vec<[f64; 2]> = Vec::with_capacity(points.len());
    for p in points {
        if path.last() != Some(p) {
            path.push(*p);
        }
    }
    let h = width / 2.0;
    if path.len() < 2 {
        let Some(&[x, y]) = path.first() else { return Vec::new() };
        return match style {
            Style::Square([before, behind]) => {
                let [left, right] = [x - before, x + behind];
                if right > left {
                    vec![vec![[left, y - h], [right, y - h], [right, y + h], [left, y + h]]]
                } else {
                    Vec::new()
                }
            }
            Style::RoundEnds | Style::Round => vec![circle([x, y], width)],
        };
    }
    if let Style::Square([before, behind]) = style {
        let last = path.len() - 1;
        let (d0, d1) = (direction(path[0], path[1]), direction(path[last - 1], path[last]));
        path[0] = [path[0][0] - before * d0[0], path[0][1] - before * d0[1]];
        path[last] = [path[last][0] + behind * d1[0], path[last][1] + behind * d1[1]];
    }
    if unfolded(&path, h) { vec![in_one(&path, h, style)] } else { pieces(&path, h, style) }
}

fn direction(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let l = dx.hypot(dy);
    // Exact along the axes, so that what lies on the grid stays on it.
    if dx == 0.0 {
        [0.0, dy.signum()]
    } else if dy == 0.0 {
        [dx.signum(), 0.0]
    } else {
        [dx / l, dy / l]
    }
}

/// Cosine and sine of the turn at the corner between two directions.
fn turn(d: [f64; 2], e: [f64; 2]) -> [f64; 2] {
    [d[0] * e[0] + d[1] * e[1], d[0] * e[1] - d[1] * e[0]]
}

/// How far a mitre reaches along a stretch, in half widths: the tangent of half the turn.
fn reach([c, s]: [f64; 2]) -> f64 {
    s.abs() / (1.0 + c)
}

/// Cosine of the sharpest turn with a mitre: 120°, the mitre is then twice the half width.
const MITRE_COSINE: f64 = -0.5;

/// True when inner corners lie inside their stretches and no turn is sharper than [`SHARPEST`].
fn unfolded(path: &[[f64; 2]], h: f64) -> bool {
    let mut before = 0.0;
    (1..path.len()).all(|k| {
        let d = direction(path[k - 1], path[k]);
        let length = (path[k][0] - path[k - 1][0]).hypot(path[k][1] - path[k - 1][1]);
        let next = path.get(k + 1).map(|after| turn(d, direction(path[k], *after)));
        let here = next.map_or(0.0, reach);
        let fits = h * (before + here) <= length && next.is_none_or(|[c, _]| c >= MITRE_COSINE - 1e-12);
        before = here;
        fits
    })
}

/// The outline in one contour: along the right side, around the end, back along the left side.
fn in_one(path: &[[f64; 2]], h: f64, style: Style) -> Vec<[f64; 2]> {
    let last = path.len() - 1;
    let mut outline = Vec::with_capacity(2 * path.len() + SIDES);
    side(path, h, style, &mut outline);
    cap(path[last], direction(path[last - 1], path[last]), h, style, &mut outline);
    let back: Vec<[f64; 2]> = path.iter().rev().copied().collect();
    side(&back, h, style, &mut outline);
    cap(path[0], direction(path[1], path[0]), h, style, &mut outline);
    outline
}

/// The right side of a path, from its first to its last point.
fn side(path: &[[f64; 2]], h: f64, style: Style, outline: &mut Vec<[f64; 2]>) {
    let right = |p: [f64; 2], d: [f64; 2]| [p[0] + h * d[1], p[1] - h * d[0]];
    let last = path.len() - 1;
    outline.push(right(path[0], direction(path[0], path[1])));
    for k in 1..last {
        let (d, e) = (direction(path[k - 1], path[k]), direction(path[k], path[k + 1]));
        let [c, s] = turn(d, e);
        if s == 0.0 && c > 0.0 {
            continue;
        }
        if s > 0.0 && style == Style::Round {
            outline.push(right(path[k], d));
            arc(path[k], d, s.atan2(c), h, outline);
            outline.push(right(path[k], e));
        } else {
            let t = h * s / (1.0 + c);
            let corner = right(path[k], d);
            outline.push([corner[0] + t * d[0], corner[1] + t * d[1]]);
        }
    }
    outline.push(right(path[last], direction(path[last - 1], path[last])));
}

/// The end of a wire that runs towards `d`: between its right and its left corner.
fn cap(p: [f64; 2], d: [f64; 2], h: f64, style: Style, outline: &mut Vec<[f64; 2]>) {
    if !matches!(style, Style::Square(_)) {
        arc(p, d, PI, h, outline);
    }
}

/// Corners on a circle around p, from the right of direction `d` counter-clockwise through `angle` (rad), without the ends.
fn arc(p: [f64; 2], d: [f64; 2], angle: f64, h: f64, outline: &mut Vec<[f64; 2]>) {
    let sides = ((angle / (2.0 * PI) * SIDES as f64).ceil() as usize).max(1);
    // The radius with which the corners and the two ends, at distance h, enclose the area of the sector.
    let n = sides as f64;
    let step = angle / n;
    let (a, b, c) = ((n - 1.0) / 2.0 * step.sin(), (step / 2.0).sin(), n * step / 2.0);
    let r = h * 2.0 * c / (b + (b * b + 4.0 * a * c).sqrt());
    let start = d[1].atan2(d[0]) - PI / 2.0;
    for k in 0..sides {
        let at = start + angle * (k as f64 + 0.5) / sides as f64;
        outline.push([p[0] + r * at.cos(), p[1] + r * at.sin()]);
    }
}

/// One rectangle a stretch, and what fills the corners between them.
fn pieces(path: &[[f64; 2]], h: f64, style: Style) -> Vec<Vec<[f64; 2]>> {
    let mut all = Vec::with_capacity(2 * path.len());
    for k in 1..path.len() {
        let stretch = &path[k - 1..=k];
        let mut outline = in_one(stretch, h, Style::Square([0.0; 2]));
        outline.dedup();
        all.push(outline);
    }
    for k in 1..path.len() - 1 {
        let (d, e) = (direction(path[k - 1], path[k]), direction(path[k], path[k + 1]));
        let [c, s] = turn(d, e);
        if style == Style::Round {
            all.push(circle(path[k], 2.0 * h));
        } else if s != 0.0 {
            // On the outer side: the two corners of the stretches, and the tip of the mitre unless it is too long.
            let outer = if s > 0.0 { h } else { -h };
            let corner = |d: [f64; 2]| [path[k][0] + outer * d[1], path[k][1] - outer * d[0]];
            let (first, second) = (corner(d), corner(e));
            let mut wedge = vec![path[k], first];
            if c >= MITRE_COSINE - 1e-12 {
                let t = h * s.abs() / (1.0 + c);
                wedge.push([first[0] + t * d[0], first[1] + t * d[1]]);
            }
            wedge.push(second);
            if s < 0.0 {
                wedge.reverse();
            }
            all.push(wedge);
        }
    }
    if !matches!(style, Style::Square(_)) {
        all.extend([circle(path[0], 2.0 * h), circle(path[path.len() - 1], 2.0 * h)]);
    }
    all
}

#[cfg(test)]
mod tests {
    //! Wires and circles have the areas of their closed forms, and run counter-clockwise.
    use super::*;

    fn area(contour: &[[f64; 2]]) -> f64 {
        let next = contour.iter().cycle().skip(1);
        contour.iter().zip(next).map(|(p, q)| p[0] * q[1] - q[0] * p[1]).sum::<f64>() / 2.0
    }

    #[test]
    fn a_circle_has_the_area_of_a_circle() {
        assert!((area(&circle([3.0, -1.0], 4.0)) / (4.0 * PI) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn an_elbow_is_mitred_or_rounded() {
        let elbow = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]];
        let mitred = wire(&elbow, 2.0, Style::Square([0.0; 2]));
        assert_eq!((mitred.len(), area(&mitred[0])), (1, 40.0));
        assert_eq!(area(&wire(&elbow, 2.0, Style::Square([1.0, 3.0]))[0]), 48.0);
        let round_ends = wire(&elbow, 2.0, Style::RoundEnds);
        assert!((area(&round_ends[0]) - 40.0 - PI).abs() < 1e-12);
        // Round corners take 1 - pi/4 off the outer corner.
        let round = wire(&elbow, 2.0, Style::Round);
        assert!((area(&round[0]) - 39.0 - PI - PI / 4.0).abs() < 1e-12, "{}", area(&round[0]));
    }

    #[test]
    fn what_folds_comes_in_pieces_all_counter_clockwise() {
        let hairpin = [[0.0, 0.0], [10.0, 0.0], [0.0, 1.0]];
        for style in [Style::Square([0.0; 2]), Style::Round] {
            let all = wire(&hairpin, 2.0, style);
            assert!(all.len() >= 3 && all.iter().all(|piece| area(piece) > 0.0), "{all:?}");
        }
        assert!(wire(&[], 2.0, Style::Round).is_empty());
        assert_eq!(area(&wire(&[[5.0, 5.0], [5.0, 5.0]], 2.0, Style::Square([1.0; 2]))[0]), 4.0);
    }
}
